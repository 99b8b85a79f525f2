"""python -m benchmarks runs, agrees with itself on the bits, and calls nothing a result that scatters."""

import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from benchmarks.cases import flag
from benchmarks.cloth import sample_springs, sheet
from benchmarks.measure import Sample, moves_per_frame
from warpsim import Scene, Simulation

ROOT = Path(__file__).resolve().parents[2]


def test_quick_benchmarks(tmp_path):
    out = tmp_path / "figures.jsonl"
    done = subprocess.run(
        [sys.executable, "-m", "benchmarks", "--quick", "--json", out], cwd=ROOT, capture_output=True, text=True, timeout=300
    )
    assert done.returncode == 0, done.stdout + done.stderr
    rows = [json.loads(line) for line in out.read_text().splitlines()]
    ways = [row for row in rows if "ns" in row]
    assert len(ways) >= 2 and len({row["hash"] for row in ways}) == 1 and all(row["ns"] > 0 for row in ways)
    assert all(sum(row["shares"].values()) == pytest.approx(1.0) for row in rows if "shares" in row)
    sheets = {row["way"] for row in rows if row["case"] == "cloth" and "way" in row}
    assert {"warpsim, 1 thread", "Warp's sample, 1 thread"} <= sheets
    for row in rows:
        if "ratio" in row and not row["settled"]:
            assert f"{row['ratio']}: no result" in done.stdout


def test_a_noisy_ratio_is_no_result():
    steady, noisy = Sample([1.0, 1.01, 0.99, 1.0, 1.02]), Sample([1.0, 2.0, 1.0, 3.0, 1.5])
    assert steady.settled and not noisy.settled
    assert Sample([2.0, 4.0]).over(Sample([1.0, 2.0])).values == [2.0, 2.0]


@pytest.mark.parametrize("count", [2, 3, 9])
def test_the_sample_has_the_springs_of_our_sheet(count):
    ours = Simulation(sheet(count), device="cpu", threads=1).frame()["sheet"].springs
    its = sample_springs(count)
    assert len(its) == len(ours) and {tuple(sorted(pair)) for pair in its.tolist()} == {tuple(sorted(pair)) for pair in ours.tolist()}


def test_moves_count_the_substeps_that_are_taken():
    """A network takes as many as its springs need, a particle as many as it chooses, whatever the scene's time says."""
    springs = {"type": "springs", "points": [[0, 0, 0], [1, 0, 0]], "springs": [[0, 1]], "stiffness": 1e5}
    emitter = {"shape": {"type": "point"}, "burst": {"count": 5}, "lifetime": 9}
    dust = {"type": "particles", "capacity": 5, "emitters": [emitter], "solver": "abm_pece_2"}
    systems = {"net": springs | {"substeps": "auto"}, "few": springs | {"substeps": 3}, "dust": dust}
    run = Simulation(Scene.model_validate({"name": "s", "time": {"substeps": "auto"}, "systems": systems}), device="cpu", threads=1)
    run.step_frame()
    told = run.statistics()["dust"]
    assert moves_per_frame(run) == 2 * run.advice["net"].chosen + 2 * 3 + 5 * told["substeps"] and run.advice["net"].chosen > 1


def test_the_flag_stands_its_substeps():
    run = Simulation(flag().scene, device="cpu", threads=1)
    assert run.advice["flag"].least <= run.advice["flag"].chosen
    run.run(0.5)
    assert np.isfinite(run.frame()["flag"].position).all()
