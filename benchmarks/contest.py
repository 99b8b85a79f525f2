"""A contest: one scene, run by warpsim on one core and on all, by its plain kernels, and by peers that do the same, in turns.

What a module of this folder adds to the table is a list of rows, from its function `rows(quick)`: contests, or anything with `name`, `work`
and `measure(report, effort)`.
"""

import importlib.util
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from statistics import median
from typing import Protocol

from benchmarks.measure import Sample, Stepped, Timing, Way, take_turns
from benchmarks.report import OTHERS, Report
from warpsim import Scene, Simulation
from warpsim.frame import Frame
from warpsim.launch import available_cores

TURN = 5e-3  # [s]: of the fastest, so that starting a frame is a small part of it, as in a run
MOST_FRAMES = 200  # in a turn


@dataclass(frozen=True)
class Effort:
    """How long a row may take: as many rounds as fit, but some at least. quick: small sizes, which show that it runs, not how fast."""

    seconds: float = 15.0
    most_rounds: int = 30
    least_rounds: int = 7
    quick: bool = False

    @property
    def patience(self) -> float:
        """How long disturbed turns are taken again [s]."""
        return 0.0 if self.quick else self.seconds

    def rounds(self, seconds_per_round: float) -> int:
        """Return how many rounds there is time for."""
        return max(self.least_rounds, min(self.most_rounds, int(self.seconds / max(seconds_per_round, 1e-9))))


class Row(Protocol):
    """A line of the table, or some that are measured together."""

    name: str
    work: str

    def measure(self, report: Report, effort: Effort) -> None: ...


@dataclass(frozen=True)
class Entrant:
    """A peer with so many threads; `make` gets ours, warmed up, to begin where it is; `needs`: the package without which there is none."""

    label: str
    threads: int
    make: Callable[[Simulation], Stepped]
    needs: str | None = None

    @property
    def title(self) -> str:
        return f"{self.label}, {self.threads} thread{'s' * (self.threads > 1)}"

    @property
    def installed(self) -> bool:
        return self.needs is None or importlib.util.find_spec(self.needs) is not None


@dataclass(frozen=True)
class Claim:
    """The fastest entrant of these labels takes `reach` times as long as warpsim on all cores."""

    labels: Sequence[str]
    reach: float | None  # None: it is told, and held to nothing


@dataclass(frozen=True)
class Contest:
    """What is run, by whom, what is compared, and what is to reach; a None is not asked for. See `measure` for the order of things.

    items: what the time of a frame is divided by, default the live particles. compare: (our frame, a peer) -> how far apart they are, at
    most `most`, because of `why`. plain: how many times as long the plain kernels take on all cores (0: told, nothing to reach). cores: one
    core over all. steps_per_second, times_real: on all cores.
    """

    name: str
    work: str
    scene: Scene
    items: int | None = None
    item: str = "particle"
    warmup: int = 2
    compared: int = 5
    entrants: Sequence[Entrant] = ()
    compare: Callable[[Frame, Stepped], float] | None = None
    unit: str = "m"
    most: float = math.inf
    why: str = ""
    claims: Sequence[Claim] = ()
    plain: float | None = None
    cores: float | None = 1.5
    steps_per_second: float | None = None
    times_real: float | None = None
    phases: bool = True

    def measure(self, report: Report, effort: Effort) -> None:
        """Warm up, let the peers begin where we are, compare, take turns, and tell."""
        bout = Bout(self, report)
        bout.step(self.compared)
        if not bout.agrees():
            report.unmeasured(self.name, "every time", None, "states differ")
            return
        bout.take_turns(effort)
        bout.tell_times()
        bout.tell_claims()
        if self.phases:
            bout.tell_phases(3 if effort.quick else 7)


def own_ways() -> list[Way]:
    """One core, and all."""
    cores = available_cores()
    return [Way("warpsim, 1 core", 1), *([Way(f"warpsim, {cores} cores", cores)] if cores > 1 else [])]


@dataclass
class Bout:
    """A contest under way."""

    contest: Contest
    report: Report
    ours: dict[Way, Simulation] = field(init=False)
    peers: dict[Way, Stepped] = field(init=False)
    titles: dict[str, list[Way]] = field(init=False)  # of the peers that take part, by label
    times: dict[Way, Timing] = field(init=False)

    def __post_init__(self):
        contest = self.contest
        ways = own_ways()
        self.alone, self.most = ways[0], ways[-1]
        if contest.plain is not None:
            ways.append(Way(f"plain kernels, {self.most.threads} core{'s' * (self.most.threads > 1)}", self.most.threads, native=False))
        self.ours = {way: way.build(contest.scene, "cpu") for way in ways}
        for run in self.ours.values():
            for _ in range(contest.warmup):
                run.step_frame()
        self.peers, self.titles = {}, {}
        for entrant in contest.entrants:
            if not entrant.installed:
                self.report.missing(contest.name, entrant.title, entrant.needs)
                continue
            way = Way(entrant.title, entrant.threads, native=False)
            self.peers[way] = entrant.make(self.ours[self.alone])
            self.titles.setdefault(entrant.label, []).append(way)

    @property
    def runs(self) -> dict[Way, Stepped]:
        """All who take part."""
        return self.ours | self.peers

    @property
    def items(self) -> int:
        """What the time of a frame is divided by."""
        systems = self.ours[self.alone].systems.values()
        return self.contest.items or max(1, sum(system.population.counter("live") for system in systems))

    def step(self, frames: int) -> None:
        """Advance all alike."""
        for run in self.runs.values():
            for _ in range(frames):
                run.step_frame()

    def agrees(self) -> bool:
        """Tell whether our hashes are equal and how far away the peers are; without that no time means anything."""
        contest, frame = self.contest, self.ours[self.alone].frame()
        hashes = {way.label: run.state_hash() for way, run in self.ours.items()}
        apart = {way.label: contest.compare(frame, peer) for way, peer in self.peers.items()} if contest.compare else {}
        self.report.states(contest.name, self.ours[self.alone].index, hashes, apart, contest.most, contest.unit, contest.why)
        return len(set(hashes.values())) == 1 and all(distance <= contest.most for distance in apart.values())

    def take_turns(self, effort: Effort) -> None:
        """Take one round to see how long it takes, then as many as there is time for."""
        first = take_turns(self.runs, 1, lambda: None, patience=0.0)
        fastest = min(timing.seconds.median for timing in first.values())
        frames = 2 if effort.quick else max(1, min(MOST_FRAMES, math.ceil(TURN / fastest)))
        lead = 1 if frames > 1 else 0
        together = sum(timing.seconds.median for timing in first.values()) * (frames + lead)
        self.times = take_turns(self.runs, effort.rounds(together), lambda: None, frames, lead, effort.patience)
        farthest = max(run.index for run in self.ours.values())
        for run in self.ours.values():
            run.seek(farthest)  # some have taken turns again
        self.report.end_states(self.contest.name, {way.label: run.state_hash() for way, run in self.ours.items()}, farthest)

    def tell_times(self) -> None:
        """Tell what a frame and an item cost in each way."""
        for way, timing in self.times.items():
            role = "peer" if way in self.peers else "plain" if not way.native else "one" if way == self.alone else "all"
            self.report.time(self.contest.name, way, timing, self.items, self.contest.item, role)

    def tell_claims(self) -> None:
        """Hold what was measured against what is to reach."""
        contest, mine = self.contest, self.times[self.most]
        for claim in contest.claims:
            self._tell_peers(claim)
        for way in self.ours:
            if not way.native:
                self._tell_ratio(way, self.most, contest.plain or None)
        if contest.cores is not None and self.most != self.alone:
            self._tell_ratio(self.alone, self.most, contest.cores)
        if contest.steps_per_second is not None:
            rate = Sample([1.0 / value for value in mine.seconds.values])
            self.report.claim(contest.name, "steps/s", rate, contest.steps_per_second, self.disturbance(self.most))
        if contest.times_real is not None:
            real = Sample([1.0 / (contest.scene.time.fps * value) for value in mine.seconds.values])
            self.report.claim(contest.name, "times real time", real, contest.times_real, self.disturbance(self.most))

    def _tell_peers(self, claim: Claim) -> None:
        """Tell how much longer each peer takes than we do on all cores, the fastest first, and core for core."""
        ways = [max(self.titles[label], key=lambda way: way.threads) for label in claim.labels if label in self.titles]
        if not ways:
            needs = sorted({entrant.needs for entrant in self.contest.entrants if entrant.label in claim.labels and entrant.needs})
            reason = f"not installed: {', '.join(needs)}" if needs else "there is none"
            self.report.unmeasured(self.contest.name, " or ".join(claim.labels), claim.reach, reason)
            return
        ways.sort(key=lambda way: self.times[way].seconds.median)
        for place, way in enumerate(ways):
            self._tell_ratio(way, self.most, claim.reach if place == 0 else None)
        for label in claim.labels:
            for way in self.titles.get(label, []):
                if way.threads == 1 and self.most != self.alone:
                    self._tell_ratio(way, self.alone, None)

    def _tell_ratio(self, slow: Way, fast: Way, reach: float | None) -> None:
        ratio = self.times[slow].seconds.over(self.times[fast].seconds)
        disturbed = self.disturbance(slow) or self.disturbance(fast)
        self.report.times_as_long(self.contest.name, slow, fast, ratio, reach, disturbed)

    def disturbance(self, way: Way) -> str:
        """Return what stood in the way of a way, if anything."""
        return OTHERS if self.times[way].disturbed else ""

    def tell_phases(self, frames: int) -> None:
        """Tell how long each stage of a frame takes on one core, run one by one."""
        taken = [self.ours[self.alone].time_stages() for _ in range(frames)]
        phases = {stage: median(times[stage] for times in taken) for stage in taken[0]}
        self.report.phases(self.contest.name, self.alone.label, phases)
