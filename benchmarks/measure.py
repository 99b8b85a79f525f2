"""Timing that can be believed: ways of running take turns, a ratio is made pair by pair, and its spread stands beside it."""

import time
from collections.abc import Callable
from dataclasses import dataclass
from statistics import median, quantiles

from warpsim import Scene, Simulation

MOST_SPREAD = 0.20  # interquartile range over median; what scatters more is not called a result


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
    def spread(self) -> float:
        """Interquartile range over median."""
        low, _, high = quantiles(self.values, n=4)
        return (high - low) / self.median

    @property
    def settled(self) -> bool:
        return self.spread <= MOST_SPREAD

    def over(self, other: "Sample") -> "Sample":
        """Ratio of two samples that were taken in turns, pair by pair."""
        return Sample([mine / its for mine, its in zip(self.values, other.values, strict=True)])


def seconds(work: Callable[[], None], wait: Callable[[], None]) -> float:
    """Time of one call and of the device's work that it started."""
    wait()
    begin = time.perf_counter()
    work()
    wait()
    return time.perf_counter() - begin


def take_turns(runs: dict[str, Simulation], rounds: int, wait: Callable[[], None], frames: int = 1) -> dict[str, Sample]:
    """Time of a frame of every run [s], one run after the other in each round, in the opposite order every other round."""
    times: dict[str, list[float]] = {label: [] for label in runs}
    for turn in range(rounds):
        for label in list(runs)[:: -1 if turn % 2 else 1]:
            times[label].append(seconds(lambda run=runs[label]: [run.step_frame() for _ in range(frames)], wait) / frames)
    return {label: Sample(values) for label, values in times.items()}


def stage_shares(run: Simulation, frames: int) -> dict[str, float]:
    """Share of every stage in a frame: medians of stages run one by one, over their sum."""
    taken = [run.time_stages() for _ in range(frames)]
    medians = {stage: median(times[stage] for times in taken) for stage in taken[0]}
    return {stage: value / sum(medians.values()) for stage, value in medians.items()}
