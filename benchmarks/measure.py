"""Timing that can be believed: ways of running take turns, a ratio is made pair by pair, and its spread stands beside it."""

import time
from collections.abc import Callable
from dataclasses import dataclass
from statistics import median, quantiles

from warpsim import Scene, Simulation

MOST_SPREAD = 0.20  # interquartile range over median; what scatters more is not called a result
LEAST_SHARE = 0.85  # of the cores that a way asks for; with less, other work on the machine was measured too
MOST_TRIES = 20  # at a turn with less


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


@dataclass(frozen=True)
class Timing:
    """What the turns of one way took: seconds per frame, and how many cores the process got meanwhile."""

    seconds: Sample
    cores: Sample

    def starved(self, threads: int) -> bool:
        """Whether other work on the machine took cores away, which a small spread does not show."""
        return self.cores.median < LEAST_SHARE * threads


def take_turns(runs: dict[Way, Simulation], rounds: int, wait: Callable[[], None], frames: int = 1) -> dict[Way, Timing]:
    """Time every run, one after the other in each round, in the opposite order every other round; `wait` waits for the device.

    A turn that did not get its cores is taken again, for a while: on a machine that others use, too, that is a turn between theirs.
    """
    seconds: dict[Way, list[float]] = {way: [] for way in runs}
    cores: dict[Way, list[float]] = {way: [] for way in runs}
    for turn in range(rounds):
        for way in list(runs)[:: -1 if turn % 2 else 1]:
            least = LEAST_SHARE * (way.threads if way.native else 1)
            for _ in range(MOST_TRIES):
                taken, got = take_turn(runs[way], wait, frames)
                if got >= least:
                    break
            seconds[way].append(taken)
            cores[way].append(got)
    return {way: Timing(Sample(seconds[way]), Sample(cores[way])) for way in runs}


def take_turn(run: Simulation, wait: Callable[[], None], frames: int) -> tuple[float, float]:
    """Return how long a frame takes [s], the mean of some, and how many cores the process got meanwhile."""
    wait()
    begin, worked = time.perf_counter(), time.process_time()
    for _ in range(frames):
        run.step_frame()
    wait()
    taken = time.perf_counter() - begin
    return taken / frames, (time.process_time() - worked) / taken


def moves_per_frame(run: Simulation) -> float:
    """Return how many substeps its particles take in a frame, all together; where they choose them, as many as they have chosen."""
    told = run.statistics()
    return sum(told[name]["live"] * told[name].get("substeps", system.pace.substep_count) for name, system in run.systems.items())


def stage_shares(run: Simulation, frames: int) -> dict[str, float]:
    """Share of every stage in a frame: medians of stages run one by one, over their sum."""
    taken = [run.time_stages() for _ in range(frames)]
    medians = {stage: median(times[stage] for times in taken) for stage in taken[0]}
    return {stage: value / sum(medians.values()) for stage, value in medians.items()}
