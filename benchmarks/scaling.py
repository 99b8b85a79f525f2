"""What one particle, boid or vertex costs among a thousand and among ten million: the curves of the picture, and how far the cost grows."""

from collections.abc import Callable
from dataclasses import dataclass, replace

from rich.console import Console

from benchmarks import cloth, flocks
from benchmarks.bandwidth import COPIED, COPIED_QUICKLY, Copy
from benchmarks.contest import Bout, Contest, Effort, own_ways
from benchmarks.measure import Sample, take_turns
from benchmarks.particles import particles
from benchmarks.report import OTHERS, Report
from warpsim import Simulation
from warpsim.launch import available_cores

MOST_COMPARED = 5  # frames of each point
FEW_ROUNDS = Effort(seconds=2.0, most_rounds=11, least_rounds=4)  # a point of a curve
GROWTH = 1.5  # at most, of the cost of one
ON_THE_BOUND = 0.7  # of the copy bandwidth: memory is the limit then, not the program


@dataclass(frozen=True)
class Curve:
    """Contests that differ in their number alone, and the two numbers between which the cost may grow by so much."""

    name: str
    work: str
    make: Callable[[int], Contest]
    counts: tuple[int, ...]
    peers: tuple[str, ...] = ()
    most_with_peers: int = 1_000_000  # theirs take seconds a frame beyond
    grows: tuple[int, int] | None = None

    def measure(self, report: Report, effort: Effort) -> None:
        """Run a contest of each size, then the two sizes in turns."""
        few = Effort(0.2, 3, 3, quick=True) if effort.quick else FEW_ROUNDS
        for count in self.counts:
            self._point(count, report, few)
        if self.grows:
            self._growth(*self.grows, report, effort)

    def _point(self, count: int, report: Report, effort: Effort) -> None:
        contest = self.make(count)
        threads = {label: max((e.threads for e in contest.entrants if e.label == label), default=0) for label in self.peers}
        usual = [entrant for entrant in contest.entrants if entrant.threads == threads.get(entrant.label)]
        usual = usual if count <= self.most_with_peers else []
        contest = replace(contest, entrants=usual, plain=None, items=None, compared=min(contest.compared, MOST_COMPARED))
        bout = Bout(contest, Report(Console(quiet=True)))
        bout.step(contest.compared)
        if not bout.agrees():
            report.unmeasured(self.name, f"{count:,}", None, "states differ")
            return
        bout.take_turns(effort)
        for way, timing in bout.times.items():
            settled = timing.seconds.settled and not bout.disturbance(way)
            report.point(self.name, way.label, bout.items, timing.seconds, settled)

    def _growth(self, few: int, many: int, report: Report, effort: Effort) -> None:
        """Tell how much more one costs among many than among few, and how near that is to copying its state."""
        way = own_ways()[-1]
        runs: dict = {count: way.build(self.make(count).scene, "cpu") for count in (few, many)}
        for count, run in runs.items():
            for _ in range(self.make(count).warmup):
                run.step_frame()
        copy = Copy(COPIED_QUICKLY if effort.quick else COPIED, available_cores())
        rounds = max(3, effort.least_rounds)
        times = take_turns(runs | {"copy": copy}, rounds, lambda: None, patience=effort.patience)
        live = {count: sum(system.population.counter("live") for system in run.systems.values()) for count, run in runs.items()}
        each = {count: Sample([seconds / live[count] for seconds in times[count].seconds.values]) for count in runs}
        disturbed = OTHERS if any(timing.disturbed for timing in times.values()) else ""
        share = Sample(
            [
                bytes_of(runs[many]) / copy.bytes * c / s
                for c, s in zip(times["copy"].seconds.values, times[many].seconds.values, strict=True)
            ]
        )
        bound = each[many].over(each[few]).median >= GROWTH and share.median >= ON_THE_BOUND
        report.claim(
            self.name, f"cost of one among {many:,} / {few:,}", each[many].over(each[few]), None if bound else GROWTH, disturbed, below=True
        )
        label = f"its state read and written once, of the copy bandwidth, {many:,}"
        report.claim(self.name, label, share, ON_THE_BOUND if bound else None, disturbed)
        rate = 1e-9 * copy.bytes / times["copy"].seconds.median
        report.note(
            self.name,
            f"{bytes_of(runs[many]) / live[many]:.0f} bytes of state each, read and written; copies go at {rate:.1f} GB/s",
            bytes_each=bytes_of(runs[many]) / live[many],
            copy_gb_per_s=rate,
        )


def bytes_of(run: Simulation) -> int:
    """Return how many bytes the live rows of a simulation's populations have, once read and once written."""
    return sum(2 * 4 * system.population.slab.shape[0] * system.population.counter("live") for system in run.systems.values())


def dust(count: int) -> Contest:
    """The particles of particles-1m."""
    return particles("particles", count, plain=None)


def boids(count: int) -> Contest:
    """Boids at constant density."""
    return flocks.boids("boids", count, peers=1.0)


def vertices(count: int) -> Contest:
    """The sheet of Warp's sample, as many vertices as make a square."""
    return replace(cloth.contest("cloth", round(count**0.5), to_reach=False), item="vertex")


def rows(quick: bool) -> list[Curve]:
    """Three curves."""
    decades = (1_000, 3_000, 10_000, 30_000, 100_000, 300_000, 1_000_000, 3_000_000, 10_000_000)
    counts, ends = ((500, 2_000), (500, 2_000)) if quick else (decades, (100_000, 10_000_000))
    sides = (12, 16) if quick else (32, 64, 128, 256, 512)
    usual = ("Numba prange", "Taichi")
    return [
        Curve("scaling-particles", "the particles of particles-1m, from a thousand to ten million", dust, counts, usual, grows=ends),
        Curve(
            "scaling-flocks", "the boids of flocks-100k, from a thousand to ten million, equally dense", boids, counts, usual, grows=ends
        ),
        Curve(
            "scaling-cloth",
            "the sheet of cloth-128, from 32 x 32 to 512 x 512",
            vertices,
            tuple(side * side for side in sides),
            ("Warp's sample", "Taichi's sample"),
            256 * 256,
        ),
    ]
