"""python -m benchmarks runs, agrees with itself on the bits, and calls nothing a result that scatters."""

import json
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
from rich.console import Console

from benchmarks import gpu
from benchmarks.__main__ import BEGIN, END, QUICK, all_rows, make_page
from benchmarks.cases import flag, sparks
from benchmarks.cloth import sample_springs, sheet
from benchmarks.contest import Claim, Contest, Entrant
from benchmarks.measure import Sample, moves_per_frame
from benchmarks.report import Report, read_rows, verdict_of
from benchmarks.table import markdown
from warpsim import Scene, Simulation
from warpsim.launch import available_cores

ROOT = Path(__file__).resolve().parents[2]


VERDICTS = {"", "reached", "missed", "no result", "not measured"}


def test_every_row_runs_small(tmp_path):
    """In one test, for the run takes half a minute: rows say something, ways end in equal states, a page is made of what was written."""
    out = tmp_path / "figures.jsonl"
    command = [sys.executable, "-m", "benchmarks", "--quick", "--json", out]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, timeout=600)
    assert done.returncode == 0, done.stdout + done.stderr
    rows = [json.loads(line) for line in out.read_text().splitlines()]
    rows_say_something(rows, done.stdout)
    states_are_equal(rows)
    page_is_made_of_them(out, tmp_path)
    assert out.with_suffix(".png").exists()


def rows_say_something(rows: list[dict], shown: str) -> None:
    told = {name: {row["kind"] for row in rows if row["row"] == name} for name in all_rows(quick=True)}
    assert all(kinds & {"claim", "point"} for kinds in told.values()), told
    assert rows[0]["kind"] == "machine" and rows[0]["date"] and rows[0]["warp-lang"]
    for row in rows:
        if row["kind"] == "claim":
            assert row["verdict"] in VERDICTS and row["claim"].split(" / ")[0] in shown
            assert row["verdict"] not in ("no result", "not measured") or row["why"]


def states_are_equal(rows: list[dict]) -> None:
    states = [row for row in rows if row["kind"] in ("states", "end")]
    assert {"sparks", "flag"} <= {row["row"] for row in states}
    assert all(row["equal"] and len(row["hashes"]) >= min(2, available_cores()) for row in states), states
    assert all(distance <= row["most"] for row in states for distance in row.get("apart", {}).values())


def page_is_made_of_them(out: Path, folder: Path) -> None:
    """Between its markers, and nothing else of it changes; a second file's figures replace the first's, row by row."""
    page, again = folder / "page.md", folder / "again.jsonl"
    page.write_text(f"before\n{BEGIN}\nold\n{END}\nafter\n")
    nothing = {"spread": 0.0, "reach": None, "below": False, "verdict": "", "why": ""}
    row = {"row": "startup", "kind": "claim", "claim": "afresh", "value": 1, "quartiles": [1, 1]}
    again.write_text(json.dumps(row | nothing) + "\n")
    make_page([out, again], page)
    text = page.read_text()
    assert text.startswith(f"before\n{BEGIN}\n") and text.endswith(f"{END}\nafter\n") and "\nold\n" not in text
    assert "| sparks |" in text and "afresh" in text and "--help" not in text
    assert read_rows([folder / "page.jsonl"]) == read_rows([out, again])
    assert (folder / "images" / "scaling.png").exists() and "images/scaling.png" in text


def test_rows_of_a_gpu_run_on_what_there_is():
    """Without a GPU they say so; their code runs on the processor here, whose figures mean nothing."""
    report = Report(Console(quiet=True))
    for row in gpu.rows(quick=True):
        row.on("cpu", report, QUICK)
    claims = [row for row in report.rows if row["kind"] == "claim"]
    assert len(claims) == 3 and claims[0]["value"] > 0.0 and claims[1]["value"] > 0.0


def test_a_figure_is_reached_missed_or_no_result():
    """Bars hold to the last digit; what scatters, or was taken on borrowed cores, is judged neither way."""
    steady, noisy = Sample([4.0, 4.0, 4.0]), Sample([3.0, 5.0, 9.0])
    assert verdict_of(steady, 4.0, False, "", "row")[0] == "reached" == verdict_of(steady, 4.0, True, "", "row")[0]
    assert verdict_of(steady, 4.1, False, "", "row")[0] == "missed" == verdict_of(steady, 3.9, True, "", "row")[0]
    for sample, disturbed in ((noisy, ""), (steady, "others")):
        verdict, why = verdict_of(sample, 1.0, False, disturbed, "row")
        assert verdict == "no result" and "--only row" in why
    assert verdict_of(steady, None, False, "", "row") == ("", "")


class Late:
    """A peer that ends elsewhere."""

    position = np.full((2_000, 3), 1e3)

    def step_frame(self) -> None:
        pass


def test_peers_that_do_something_else_are_not_timed():
    report = Report(Console(quiet=True))
    case = sparks(50)
    peer = Entrant("Late", 1, lambda run: Late())
    away = Entrant("Absent", 1, lambda run: Late(), needs="no_such_package")
    distance = lambda frame, stepped: float(np.abs(stepped.position).max())  # noqa: E731
    Contest("odd", "", case.scene, entrants=[peer, away], compare=distance, most=1.0, claims=[Claim(("Late",), 2.0)]).measure(report, QUICK)
    kinds = [row["kind"] for row in report.rows]
    assert kinds == ["missing", "states", "claim"] and report.rows[-1]["verdict"] == "not measured" and "differ" in report.rows[-1]["why"]


def test_the_fastest_peer_is_the_one_to_beat():
    """Of two that do nothing and nearly nothing, the claim holds against the first; one that is not installed leaves no result."""
    report = Report(Console(quiet=True))
    lazy = Entrant("Lazy", 1, lambda run: Waits(0.0))
    slow = Entrant("Slow", 1, lambda run: Waits(2e-3))
    away = Entrant("Absent", 1, lambda run: Waits(0.0), needs="no_such_package")
    claims = [Claim(("Slow", "Lazy"), 0.5), Claim(("Absent",), 4.0)]
    Contest("odd", "", sparks(50).scene, entrants=[slow, lazy, away], claims=claims, cores=None, phases=False).measure(report, QUICK)
    told = {row["claim"].split(",")[0]: row for row in report.rows if row["kind"] == "claim" and row["reach"] is not None}
    assert set(told) == {"Lazy", "Absent"} and told["Lazy"]["reach"] == 0.5
    assert told["Absent"]["verdict"] == "not measured" and "no_such_package" in told["Absent"]["why"]


class Waits:
    """A peer that takes so long."""

    def __init__(self, seconds: float):
        self.seconds = seconds

    def step_frame(self) -> None:
        """Wait."""
        time.sleep(self.seconds)


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


def test_the_page_shows_what_was_measured():
    """Nobody retypes a figure: the tables of docs/performance.md are those of the lines beside it."""
    page, figures = ROOT / "docs" / "performance.md", ROOT / "docs" / "performance.jsonl"
    assert markdown(read_rows([figures]), "images/scaling.png") in page.read_text(), (
        "python -m benchmarks --page docs/performance.jsonl --into docs/performance.md"
    )
