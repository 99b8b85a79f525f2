"""python -m benchmarks runs, agrees with itself on the bits, and calls nothing a result that scatters."""

import json
import subprocess
import sys
from pathlib import Path

import pytest

from benchmarks.measure import Sample

ROOT = Path(__file__).resolve().parents[2]


def test_quick_benchmarks(tmp_path):
    out = tmp_path / "figures.jsonl"
    done = subprocess.run(
        [sys.executable, "-m", "benchmarks", "--quick", "--json", out], cwd=ROOT, capture_output=True, text=True, timeout=120
    )
    assert done.returncode == 0, done.stdout + done.stderr
    rows = [json.loads(line) for line in out.read_text().splitlines()]
    ways = [row for row in rows if "ns" in row]
    assert len(ways) >= 2 and len({row["hash"] for row in ways}) == 1 and all(row["ns"] > 0 for row in ways)
    assert all(sum(row["shares"].values()) == pytest.approx(1.0) for row in rows if "shares" in row)
    for row in rows:
        if "ratio" in row and not row["settled"]:
            assert f"{row['ratio']}: no result" in done.stdout


def test_a_noisy_ratio_is_no_result():
    steady, noisy = Sample([1.0, 1.01, 0.99, 1.0, 1.02]), Sample([1.0, 2.0, 1.0, 3.0, 1.5])
    assert steady.settled and not noisy.settled
    assert Sample([2.0, 4.0]).over(Sample([1.0, 2.0])).values == [2.0, 2.0]
