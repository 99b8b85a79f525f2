"""Graphs: a frame is a list of stages, captured once and replayed, by one core or by all of them (crew.py), or on a stream of a GPU."""

import math
import os
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from itertools import chain

import warp as wp

from warpsim.compiling import load_modules
from warpsim.cores import Crowding, available_cores
from warpsim.crew import MOST_CORES, STANDS_ASIDE, calls, can_share, crew, replay, worth_keeping_lock
from warpsim.kernels import crew as meeting
from warpsim.sharing import WORTH, Measured, Plan, best_plan, joint, single

__all__ = ["MOST_CORES", "PARALLEL_FROM", "FrameGraph", "Stage", "available_cores"]
PARALLEL_FROM = 25e-6  # s of one core's work; what takes less is not worth a thought; 0: all cores share everything, always
UNKNOWN, UNKNOWN_EACH = 1e-2, 1e-7  # s that a frame is taken to last, and each element in it, before one was timed
THOUGHTS = 8  # frames between thoughts about who does what
UNSEEN = 50  # times the square of the number of cores: frames after which one core is timed again, with all it costs half a percent
MOST_PLANS = 6  # kept as graphs
TURNS = 30  # of a body that is repeated until something holds, as a rule


@dataclass(frozen=True)
class Stage:
    """One kernel over `count` elements; `loop` is its native loop for the CPU. count = 1: one thread, then all wait for it.

    With `launch` instead of a kernel it is a serial call that only enqueues device work. With `body` instead it is stages that are
    repeated while the first number of `condition` is not 0, `most` times at most; a stage of the body that is not its first sets it.
    `own`: its loop writes points of the core's own share (share() in kernels/loops.py) and reads none of another's that the stages beside
    it write, so that between two such stages nobody waits. `turns`: its parts wait for each other, and its loop takes the addresses of
    kernels/crew.py and the words of the barrier after its inputs. `of`: the company of systems that it is about; stages of different
    companies touch nothing in common but what stages without one, which come before all others, have written.
    """

    name: str
    kernel: wp.Kernel | None = None
    count: int = 1
    inputs: Sequence = ()
    loop: wp.Kernel | None = None
    launch: Callable[[], None] | None = None
    body: Sequence["Stage"] = ()
    condition: wp.array | None = None
    most: int = 0
    own: bool = False
    turns: bool = False
    of: str = ""

    def __post_init__(self):
        """Refuse what a conditional node of a CUDA graph could not hold: calls that take memory, another loop."""
        if any(inner.launch or inner.body for inner in self.body):
            raise ValueError(f"{self.name}: a body is made of kernels alone")


def check_pool(device: wp.Device, stages: Sequence[Stage]) -> None:
    """Raise ValueError if a GPU cannot capture what stages launch themselves: scans take memory for a moment, within the graph."""
    if device.is_cuda and not wp.is_mempool_enabled(device) and any(stage.launch for stage in stages):
        raise ValueError(f"{device.alias} has no memory pool, which a frame needs there (Warp: is_mempool_supported): take --device cpu")


class FrameGraph:
    """A captured frame. CUDA: one graph. CPU: one graph per core, with native barriers between the stages that cores share.

    How long each company of systems takes one core is measured; from that, again and again, a plan is made of who does what (sharing.py).
    A frame once begun is finished, whatever KeyboardInterrupt does: it is replayed by native code, which sees none. `native=False` runs the
    plain kernels on the CPU. The bits are the same either way, for any number of cores, and whatever else the machine is busy with.
    """

    def __init__(self, stages: Sequence[Stage], device: str, core_count: int, native: bool):
        self.device = wp.get_device(device)
        self.core_count = core_count if self.device.is_cpu and can_share() else 1
        self.native = native and self.device.is_cpu
        self.stages = list(stages)
        self.crowding = Crowding()
        self.cores = 1  # that the last frame was shared among
        self._barrier = wp.zeros(meeting.BARRIER, dtype=int, device="cpu")
        self._singles: dict[int, FrameGraph] = {}
        kernels = [*map(self._kernel, chain.from_iterable((stage, *stage.body) for stage in self.stages))]
        kernels += [meeting.resolve_barrier] if self.core_count > 1 else []
        load_modules(filter(None, kernels), self.device, available_cores())
        check_pool(self.device, self.stages)
        self._companies = list(dict.fromkeys(stage.of for stage in self.stages if stage.of))
        self._notes = wp.zeros((len(self._companies), 2), dtype=wp.int64, device="cpu")  # ns of its thread: when each began, and ended
        self._meetings = {name: self._meetings_of(self._stages_of(name)) for name in self._companies}
        self._measured = Measured(self._companies)
        self._since = self._unseen = 0  # frames since the last thought about who does what, and since one core was timed
        self._looked = False  # whether the last frame was one core's in order to be timed
        self._work = math.inf  # s of one core, as far as is known
        self._used: Plan | None = None
        self._loads: Mapping[str, int] = {}
        self._alone, self._joint = single(self._companies), joint(self._companies, self.core_count)
        self._plan = self._alone
        self._last: dict[Plan, float] = {}  # s that the last frame by each plan took
        self._graphs: dict[Plan, list[wp.Graph]] = {}
        self._graphs_of(self._alone)
        self._apart = self._places_apart()

    def _graphs_of(self, plan: Plan) -> list[wp.Graph]:
        """Return one graph for each core; they are captured when they are first needed."""
        if plan not in self._graphs:
            for old in [old for old in self._graphs if old != self._alone][: max(0, len(self._graphs) - MOST_PLANS)]:
                del self._graphs[old]
            self._graphs[plan] = [self._capture(core, plan) for core in range(plan.core_count)]
        return self._graphs[plan]

    def _capture(self, core: int, plan: Plan) -> wp.Graph:
        """Capture what one core does: what comes first, the companies that are its own, and its part of those that all share."""
        n = plan.core_count
        # On the CPU this records and does not run. All modules are loaded: an older driver would have Warp load every other one, too.
        with wp.ScopedCapture(self.device, force_module_load=False) as capture:
            self._launch_all(self._stages_of(""), core, n)
            for name in plan.own[core]:
                self._note(name, 0)
                self._launch_all(self._stages_of(name), 0, 1)
                self._note(name, 1)
            for name in plan.shared:
                self._launch_all(self._stages_of(name), core, n)
        return capture.graph

    def _stages_of(self, company: str) -> list[Stage]:
        return [stage for stage in self.stages if stage.of == company]

    def _note(self, name: str, place: int) -> None:
        """Launch a look at the thread's clock, where there is something to plan."""
        if self.core_count > 1:
            inputs = [0, self._companies.index(name), place, calls(), self._notes]
            wp.launch(meeting.note_time, 1, inputs, device=self.device)

    def _meetings_of(self, stages: Sequence[Stage]) -> int:
        """Return how often cores meet that share such stages."""
        count = 0
        for stage, following in zip(stages, [*stages[1:], None], strict=False):
            if stage.body:
                count += TURNS * self._meetings_of(stage.body)
            else:
                count += not (self._keeps_to_itself(stage) and self._keeps_to_itself(following))
        return count

    def _launch_all(self, stages: Sequence[Stage], core: int, core_count: int) -> None:
        """Launch one core's part of stages, one after the other; all cores meet after each, but between two that keep to their own."""
        for stage, following in zip(stages, [*stages[1:], None], strict=False):
            if stage.body:
                self._repeat(stage, partial(self._launch_all, stage.body, core, core_count))
                continue
            self._launch(stage, core, core_count)
            if core_count > 1 and not (self._keeps_to_itself(stage) and self._keeps_to_itself(following)):
                wp.launch(meeting.resolve_barrier, 1, [core_count, calls(), self._barrier], device=self.device)

    def _repeat(self, stage: Stage, body: Callable[[], None]) -> None:
        """Launch the body of a stage while its condition holds: each core looks at it after all have met, before any can change it."""
        if self.device.is_cpu or wp.is_conditional_graph_supported():
            wp.capture_while(stage.condition, body)
            return
        for _ in range(stage.most):  # an older driver: turns beyond the last that counts must change nothing
            body()

    def _keeps_to_itself(self, stage: Stage | None) -> bool:
        """Return whether each core's part of a stage is about points of its own share alone."""
        return stage is not None and stage.own and stage.count > 1 and self.native

    def _kernel(self, stage: Stage) -> wp.Kernel | None:
        """Return what a stage launches here."""
        return stage.loop if self.native and stage.loop is not None and stage.count > 1 else stage.kernel

    def _launch(self, stage: Stage, core: int, core_count: int) -> None:
        """Launch one core's part of a stage."""
        if stage.launch is not None or stage.count == 1:
            if core == 0:
                stage.launch() if stage.launch else wp.launch(stage.kernel, 1, [0, *stage.inputs], device=self.device)
        elif self.native and stage.loop is not None:
            meeting_place = [calls(), self._barrier] if stage.turns else []
            wp.launch(stage.loop, 1, [core, core_count, *stage.inputs, *meeting_place], device=self.device)
        else:
            first, end = stage.count * core // core_count, stage.count * (core + 1) // core_count
            if end > first:
                wp.launch(stage.kernel, end - first, [first, *stage.inputs], device=self.device)

    def run(self, loads: Mapping[str, int]) -> None:
        """Advance one frame; `loads`: how many elements each company has, with which its work grows. Raises BrokenFrame."""
        if self.device.is_cuda:
            wp.capture_launch(self._graphs[self._alone][0])
            return
        plan, always = self._plan_for(loads), PARALLEL_FROM <= 0
        if plan.core_count == 1 or always:
            self._carry_out(plan)
        else:
            chosen = self._alone if self.crowding.one else plan
            began = time.perf_counter()
            share = self._carry_out(chosen)
            if self.cores == chosen.core_count:
                self.crowding.told(time.perf_counter() - began, share, self._work)

    def _plan_for(self, loads: Mapping[str, int]) -> Plan:
        """Return who does what, by what is known: thought over from time to time, and now and then one core does all, to be timed."""
        before, self._loads = self._loads, loads
        if self.core_count == 1 or not self._companies:
            return self._alone
        if PARALLEL_FROM <= 0:
            return self._joint
        self._since += 1
        self._unseen = self._unseen + 1 if self._plan.shared else 0
        thinks = self._since >= THOUGHTS or self._looked or not self._measured.known and not self._plan.shared
        if thinks and self._used is not None:
            self._since = 0
            self._think(before)
        looks = self._unseen >= UNSEEN * self.core_count**2 or thinks and not self._measured.known
        self._unseen = 0 if looks else self._unseen
        self._looked = looks  # what was timed is gone a frame later
        return self._alone if looks else self._plan

    def _think(self, before: Mapping[str, int]) -> None:
        """Take to heart how long the companies took that were one core's in the last frame, and change the plan if that is worth it."""
        loads = self._loads  # as that frame left them: what was born in it counts
        times = self._notes.numpy()
        for names in self._used.own:
            for name in names:
                began, ended = times[self._companies.index(name)]
                self._measured.told(name, (ended - began) * 1e-9, max(loads.get(name, 0), before.get(name, 0)))
        work = self._measured.work(loads)
        if work is None:
            return
        self._work = sum(work.values())
        best = best_plan(work, self._meetings, self.core_count) if self._work >= PARALLEL_FROM else self._alone
        if best.cost(work, self._meetings) < WORTH * self._plan.cost(work, self._meetings):
            self._plan = best

    def _carry_out(self, plan: Plan) -> float:
        """Carry a frame out and return for which share of the time its threads had cores, as far as that is known."""
        last = self._last.get(plan, UNKNOWN + UNKNOWN_EACH * sum(self._loads.values()))
        aside = last > STANDS_ASIDE
        alone = plan.core_count == 1 and not aside or not crew().taken_by(self)  # another thread's frame may have the crew
        self._used = plan = self._alone if alone else plan
        self.cores = plan.core_count
        if alone:
            began = time.thread_time()  # waiting for the interpreter lock is left out
            replay(self._graphs_of(plan)[0], worth_keeping_lock(last))
            self._last[plan] = time.thread_time() - began
            return 1.0
        crew().order(self._graphs_of(plan), self._barrier, self._apart if plan.core_count > 1 else None, aside)
        crew().carry_out(worth_keeping_lock(last))
        self._last[plan] = crew().taken
        return crew().share

    def _places_apart(self) -> tuple[frozenset[int], ...] | None:
        """Return a core for each graph where a frame has all there are; None: wherever the system likes.

        Threads that wait for each other all the time and are put on one core, which a busy machine does, take turns of milliseconds.
        """
        cores = sorted(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else []
        return tuple(frozenset((core,)) for core in cores) if self.core_count == len(cores) > 1 else None

    def settle(self) -> None:
        """Wait for a frame that KeyboardInterrupt left running."""
        if self.device.is_cpu and crew().held_by(self):
            crew().finish()
        wp.synchronize_device(self.device)

    def time_stages(self, loads: Mapping[str, int]) -> dict[str, float]:
        """Advance one frame stage by stage and return the time each took [s]; for benchmarks, slower than run()."""
        times: dict[str, float] = {}
        for stage in self.stages:
            begin = time.perf_counter()
            self._single(stage).run(loads)
            wp.synchronize_device(self.device)
            times[stage.name] = times.get(stage.name, 0.0) + time.perf_counter() - begin
        return times

    def _single(self, stage: Stage) -> "FrameGraph":
        """Return a graph of one stage, made once."""
        place = next(k for k, other in enumerate(self.stages) if other is stage)
        if place not in self._singles:
            self._singles[place] = FrameGraph([stage], self.device.alias, self.core_count, self.native)
        return self._singles[place]
