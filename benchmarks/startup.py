"""What a user waits for before anything moves: whole processes, from the command to its end."""

import subprocess
import sys
import time
from pathlib import Path

from benchmarks.measure import Sample
from benchmarks.report import Report

ROOT = Path(__file__).resolve().parents[1]
BARS = {  # arguments -> bar [s]
    "--help": 0.3,
    "list": 0.3,
    "validate campfire": 0.4,
    "schema": 0.4,
    "run campfire --viewer none --frames 1": 2.0,  # kernels from the cache
}


def measure_startup(report: Report, rounds: int) -> None:
    """Time every verb in turn, once unmeasured, and hold its median to its bar."""
    taken: dict[str, list[float]] = {arguments: [] for arguments in BARS}
    for turn in range(rounds + 1):
        for arguments, times in taken.items():
            begin = time.perf_counter()
            subprocess.run([sys.executable, "-m", "warpsim", *arguments.split()], cwd=ROOT, capture_output=True, check=True)
            if turn:
                times.append(time.perf_counter() - begin)
    lines = []
    for arguments, times in taken.items():
        sample = Sample(times)
        verdict = "reached" if sample.median < BARS[arguments] else "missed"
        cells = [
            arguments,
            f"{1e3 * sample.median:.0f}",
            f"{1e3 * min(times):.0f}",
            f"{sample.spread:.0%}",
            f"{1e3 * BARS[arguments]:.0f}",
            verdict,
        ]
        row = {"arguments": arguments, "seconds": sample.median, "spread": sample.spread, "bar": BARS[arguments]}
        lines.append((cells, row))
    header = ["warpsim …", "median ms", "fastest ms", "spread", "bar ms", ""]
    report.figures("startup", "whole process, from the command to its end", header, lines)
    report.console.print()
