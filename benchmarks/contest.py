"""A contest: one scene, run by warpsim on one core and on all, by its plain kernels, and by peers that do the same, in turns.

What a module of this folder adds to the table is a list of these, from its function `rows(quick)`.
"""

import importlib.util
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from statistics import median

from benchmarks.measure import MOST_TRIES, Sample, Stepped, Timing, Way, take_turns
from benchmarks.report import Report
from warpsim import Scene, Simulation
from warpsim.frame import Frame
from warpsim.launch import PARALLEL_FROM, available_cores

TURN = 5e-3  # [s]: of the fastest, so that starting a frame is a small part of it, as in a run
MOST_FRAMES = 200  # in a turn


@dataclass(frozen=True)
class Effort:
    """How long a contest may take: as many rounds as fit, but some at least."""

    seconds: float = 20.0
    most_rounds: int = 30
    least_rounds: int = 7
    quick: bool = False

    def rounds(self, seconds_per_round: float) -> int:
        return max(self.least_rounds, min(self.most_rounds, int(self.seconds / max(seconds_per_round, 1e-9))))


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
    reach: float


@dataclass(frozen=True)
class Contest:
    """What is run, by whom, what is compared, and what is to reach; a None is not asked for. See `measure` for the order of things.

    items: what the time of a frame is divided by. compare: (our frame, a peer) -> how far apart they are, at most `most`, because of `why`.
    plain: how many times as long the plain kernels take on all cores. cores: one core over all. steps_per_second, times_real: of all cores.
    """

    name: str
    work: str
    scene: Scene
    items: int
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
        if bout.agrees():
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
    runs: dict[Way, Stepped] = field(init=False)
    times: dict[Way, Timing] = field(init=False)
    titles: dict[str, list[Way]] = field(init=False)  # of the peers that take part, by label

    def __post_init__(self):
        contest = self.contest
        self.ours = {way: way.build(contest.scene, "cpu") for way in own_ways()}
        self.alone, self.most = list(self.ours)[0], list(self.ours)[-1]
        if contest.plain is not None:
            self.ours |= {
                way: way.build(contest.scene, "cpu") for way in [Way(f"plain kernels, {self.most.threads} cores", self.most.threads, False)]
            }
        for run in self.ours.values():
            for _ in range(contest.warmup):
                run.step_frame()
        self.peers, self.titles = {}, {}
        for entrant in contest.entrants:
            if not entrant.installed:
                self.report.missing(contest.name, entrant.label, entrant.needs)
                continue
            way = Way(entrant.title, entrant.threads, native=False)
            self.peers[way] = entrant.make(self.ours[self.alone])
            self.titles.setdefault(entrant.label, []).append(way)
        self.runs = self.ours | self.peers

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
        self.report.states(contest.name, hashes, apart, contest.most, contest.unit, contest.why)
        return len(set(hashes.values())) == 1 and all(distance <= contest.most for distance in apart.values())

    def take_turns(self, effort: Effort) -> None:
        """Take one round to see how long it takes, then as many as there is time for."""
        first = take_turns(self.runs, 1, lambda: None, tries=1)
        fastest = min(timing.seconds.median for timing in first.values())
        frames = max(1, min(MOST_FRAMES, math.ceil(TURN / fastest)))
        lead = 1 if frames > 1 else 0
        together = sum(timing.seconds.median for timing in first.values()) * (frames + lead)
        self.times = take_turns(self.runs, effort.rounds(together), lambda: None, frames, lead, 1 if effort.quick else MOST_TRIES)
        farthest = max(run.index for run in self.ours.values())
        for run in self.ours.values():
            run.seek(farthest)  # some have taken turns again
        self.report.end_states(self.contest.name, {way.label: run.state_hash() for way, run in self.ours.items()}, farthest)

    def tell_times(self) -> None:
        """Tell what a frame and an item cost in each way."""
        contest = self.contest
        for way, timing in self.times.items():
            ours = way in self.ours and way.native
            self.report.time(contest.name, way, timing, contest.items, contest.item, ours)

    def tell_claims(self) -> None:
        """Hold what was measured against what is to reach."""
        contest, name = self.contest, self.contest.name
        mine = self.times[self.most]
        for claim in contest.claims:
            ways = [max(self.titles[label], key=lambda way: way.threads) for label in claim.labels if label in self.titles]
            if not ways:
                self.report.unmeasured(name, " or ".join(claim.labels), claim.reach, "none of them is installed")
                continue
            way = min(ways, key=lambda way: self.times[way].seconds.median)
            self._tell_ratio(way, self.most, claim.reach)
        for way in self.peers:  # core for core
            if way.threads == 1 and self.most.threads > 1:
                self._tell_ratio(way, self.alone, None)
        for way in self.ours:
            if not way.native:
                self._tell_ratio(way, self.most, contest.plain or None)
        shared = sum(system.load for system in self.ours[self.most].systems.values()) >= PARALLEL_FROM
        if contest.cores is not None and self.most is not self.alone and shared:
            self._tell_ratio(self.alone, self.most, contest.cores)
        if contest.steps_per_second is not None:
            rate = Sample([1.0 / value for value in mine.seconds.values])
            self.report.claim(name, f"steps/s, {self.most.label}", rate, contest.steps_per_second, mine.disturbed)
        if contest.times_real is not None:
            real = Sample([1.0 / (contest.scene.time.fps * value) for value in mine.seconds.values])
            self.report.claim(name, f"times real time, {self.most.label}", real, contest.times_real, mine.disturbed)

    def _tell_ratio(self, slow: Way, fast: Way, reach: float | None) -> None:
        slower, faster = self.times[slow], self.times[fast]
        ratio = slower.seconds.over(faster.seconds)
        self.report.claim(self.contest.name, f"{slow.label} / {fast.label}", ratio, reach, slower.disturbed or faster.disturbed)

    def tell_phases(self, frames: int) -> None:
        """Tell how long each stage of a frame takes on one core, run one by one."""
        taken = [self.ours[self.alone].time_stages() for _ in range(frames)]
        phases = {stage: median(times[stage] for times in taken) for stage in taken[0]}
        self.report.phases(self.contest.name, self.alone.label, phases)
