"""What a user waits for before anything moves: whole processes, from the command to its end, and first frames with an empty cache."""

import os
import subprocess
import sys
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path
from statistics import median

from benchmarks.contest import Effort
from benchmarks.measure import Sample, other_work
from benchmarks.report import OTHERS, Report

ROOT = Path(__file__).resolve().parents[1]
VERBS = {"--help": 0.3, "list": 0.3, "validate campfire": 0.4}  # to stay below [s]
SCENES = ("campfire", "cloth", "school")  # particles; sheets in gusts of noise; flocks that see each other
MOST_OTHERS = 0.2  # cores that other programs may have had in the middle turn
WARM, COLD = 2.0, 10.0  # first frame, to stay below [s]


def seconds_of(arguments: str, cache: str | None = None) -> tuple[float, float]:
    """Return how long a command takes [s], and how many cores other programs had meanwhile. Raises CalledProcessError if it fails.

    cache: a folder of kernels of its own.
    """
    environment = {**os.environ, **({"WARP_CACHE_PATH": cache} if cache else {})}
    begin, others = time.perf_counter(), other_work(own_work())
    subprocess.run([sys.executable, "-m", "warpsim", *arguments.split()], cwd=ROOT, capture_output=True, check=True, env=environment)
    taken = time.perf_counter() - begin
    return taken, (other_work(own_work()) - others) / taken


def own_work() -> float:
    """Return the processor time of this program and of those it has run [s]."""
    spent = os.times()
    return spent.user + spent.system + spent.children_user + spent.children_system


def tell(name: str, label: str, taken: list[tuple[float, float]], below: float, report: Report) -> None:
    """Hold the median of what a command took against its limit."""
    disturbed = OTHERS if median(others for _, others in taken) > MOST_OTHERS else ""
    report.claim(name, label, Sample([seconds for seconds, _ in taken]), below, disturbed, below=True)


def first_frame(scene: str) -> str:
    """Return the arguments that show a scene's first frame and end."""
    return f"run {scene} --viewer none --frames 1"


@dataclass(frozen=True)
class Verbs:
    """Verbs that only read and print."""

    name: str = "startup"
    work: str = "whole process, from the command to its end, s"

    def measure(self, report: Report, effort: Effort) -> None:
        """Time every verb in turn, after one turn that brings its files into memory."""
        taken: dict[str, list[tuple[float, float]]] = {arguments: [] for arguments in VERBS}
        for arguments in VERBS:
            seconds_of(arguments)
        for _ in range(2 if effort.quick else 11):
            for arguments, times in taken.items():
                times.append(seconds_of(arguments))
        for arguments, times in taken.items():
            tell(self.name, f"warpsim {arguments}", times, VERBS[arguments], report)


@dataclass(frozen=True)
class FirstFrame:
    """From the command to the first frame of a shipped scene, with its kernels in the cache and without."""

    name: str = "first-frame"
    work: str = "from the command to the first frame of a shipped scene, kernels compiled before (warm) or not (cold), s"

    def measure(self, report: Report, effort: Effort) -> None:
        """Begin with an empty cache, then run from what that has left there."""
        if effort.quick:
            tell(self.name, f"{SCENES[0]}, warm", [seconds_of(first_frame(SCENES[0]))], WARM, report)
            report.unmeasured(self.name, f"{SCENES[0]}, cold", COLD, "takes too long for --quick", below=True)
            return
        for scene in SCENES:
            cold, warm = [], []
            for _ in range(3):
                with tempfile.TemporaryDirectory() as cache:
                    cold.append(seconds_of(first_frame(scene), cache))
                    warm += [seconds_of(first_frame(scene), cache) for _ in range(2)]
            tell(self.name, f"{scene}, warm", warm, WARM, report)
            tell(self.name, f"{scene}, cold", cold, COLD, report)


def rows(quick: bool) -> list[Verbs | FirstFrame]:
    """Two rows."""
    return [Verbs(), FirstFrame()]
