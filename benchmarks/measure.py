"""Timing that can be believed: ways of running take turns, a ratio is made pair by pair, and its spread stands beside it."""

import math
import os
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from statistics import median, quantiles
from typing import Protocol

from warpsim import Scene, Simulation

MOST_SPREAD = 0.20  # interquartile range over median; what scatters more is not called a result
MOST_WAITED = 0.10  # of a turn, by threads that could have run; with more, other work on the machine was measured too
REST = 5e-3  # s before a turn: the threads of the one before spin on for a while, waiting for more to do
BREAK = 0.2  # s until a disturbed turn is taken again
PATIENCE = 10.0  # s that turns with more are taken again, all of a measurement together


class Stepped(Protocol):
    """What takes turns: a simulation, or a peer. A frame is finished when `step_frame` returns."""

    def step_frame(self) -> None: ...


@dataclass(frozen=True)
class Way:
    """One way of running a scene: which device, how many cores, native loops or the plain kernels."""

    label: str
    threads: int
    native: bool = True

    def build(self, scene: Scene, device: str) -> Simulation:
        return Simulation(scene, device=device, threads=self.threads, native=self.native)


@dataclass(frozen=True)
class Sample:
    """Repeated measurements of one quantity."""

    values: list[float]

    @property
    def median(self) -> float:
        return median(self.values)

    @property
    def quartiles(self) -> tuple[float, float]:
        """Where the middle half begins and ends."""
        low, _, high = quantiles(self.values, n=4) if len(self.values) > 1 else self.values * 3
        return low, high

    @property
    def spread(self) -> float:
        """Interquartile range over median."""
        low, high = self.quartiles
        return (high - low) / self.median if self.median else math.inf if high > low else 0.0

    @property
    def settled(self) -> bool:
        return self.spread <= MOST_SPREAD

    def over(self, other: "Sample") -> "Sample":
        """Ratio of two samples that were taken in turns, pair by pair."""
        return Sample([mine / its for mine, its in zip(self.values, other.values, strict=True)])


@dataclass(frozen=True)
class Timing:
    """What the turns of one way took: seconds per frame, how many cores the process got, and the share of a turn it waited for one."""

    seconds: Sample
    cores: Sample
    waited: Sample

    @property
    def disturbed(self) -> bool:
        """Whether other work on the machine took cores away, which a small spread does not show."""
        return self.waited.median > MOST_WAITED


def time_waited() -> float:
    """Return how long the threads of this process have waited for a core so far, all together [s]; 0 where the system does not tell."""
    waited = 0
    for task in Path("/proc/self/task").glob("*/schedstat"):
        try:
            waited += int(task.read_text().split()[1])
        except (OSError, IndexError):  # a thread that has just ended
            continue
    return 1e-9 * waited


def other_work(own: float) -> float:
    """Return how much processor time the machine has spent so far on anything but `own` seconds of it [s]; 0 where it does not tell."""
    ticks = Path("/proc/stat")
    if not ticks.exists():
        return 0.0
    user, nice, system, _, _, interrupts, soft, stolen, *_ = map(int, ticks.read_text().split("\n", 1)[0].split()[1:])
    return (user + nice + system + interrupts + soft + stolen) / os.sysconf("SC_CLK_TCK") - own


def take_turns(runs: dict, rounds: int, wait: Callable[[], None], frames: int = 1, lead: int = 0, patience: float = PATIENCE) -> dict:
    """Time every run, one after the other in each round, in the opposite order every other round; `wait` waits for the device.

    Each turn begins with `lead` frames that are not timed. A turn in which other programs took the cores is taken again, as long as
    the `patience` [s] lasts: on a machine that others use, too, that is a turn between theirs. Returns a Timing for each key of `runs`.
    """
    turns: dict = {way: [] for way in runs}
    for turn in range(rounds):
        for way in list(runs)[:: -1 if turn % 2 else 1]:
            taken = take_turn(runs[way], wait, frames, lead)
            while taken[2] > MOST_WAITED and patience > 0.0:
                patience -= BREAK + taken[0] * (frames + lead)
                time.sleep(BREAK)
                taken = take_turn(runs[way], wait, frames, lead)
            turns[way].append(taken)
    return {way: Timing(*(Sample(list(column)) for column in zip(*taken, strict=True))) for way, taken in turns.items()}


def take_turn(run: Stepped, wait: Callable[[], None], frames: int, lead: int = 0) -> tuple[float, float, float]:
    """Return how long a frame takes [s], the mean of some, how many cores the process got meanwhile, and the share of it that it waited.

    A simulation that saw others on its cores, and kept to one, has waited for the others, too.
    """
    time.sleep(REST)
    for _ in range(lead):
        run.step_frame()
    wait()
    waited, crowded = time_waited(), getattr(run, "crowded_frames", 0)
    begin, worked = time.perf_counter(), time.process_time()
    for _ in range(frames):
        run.step_frame()
    wait()
    taken, worked = time.perf_counter() - begin, time.process_time() - worked
    waited, crowded = (time_waited() - waited) / taken, (getattr(run, "crowded_frames", 0) - crowded) / frames
    return taken / frames, worked / taken, max(waited, crowded)


def moves_per_frame(run: Simulation) -> float:
    """Return how many substeps its particles take in a frame, all together; where they choose them, as many as they have chosen."""
    told = run.statistics()
    return sum(told[name]["live"] * told[name].get("substeps", system.pace.substep_count) for name, system in run.systems.items())


def stage_shares(run: Simulation, frames: int) -> dict[str, float]:
    """Share of every stage in a frame: medians of stages run one by one, over their sum."""
    taken = [run.time_stages() for _ in range(frames)]
    medians = {stage: median(times[stage] for times in taken) for stage in taken[0]}
    return {stage: value / sum(medians.values()) for stage, value in medians.items()}


def machine_load() -> float:
    """Return how many programs wanted a core in the last minute, on the mean; 0 where the system does not tell."""
    return os.getloadavg()[0] if hasattr(os, "getloadavg") else 0.0
