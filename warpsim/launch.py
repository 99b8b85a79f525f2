"""Graphs: a frame is a list of stages, captured once and replayed, by one core or by all of them (crew.py), or on a stream of a GPU."""

import os
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from itertools import chain

import warp as wp

from warpsim.compiling import load_modules
from warpsim.cores import Crowding, available_cores
from warpsim.crew import MOST_CORES, STANDS_ASIDE, calls, can_share, crew, replay, worth_keeping_lock
from warpsim.kernels import crew as meeting

__all__ = ["MOST_CORES", "PARALLEL_FROM", "FrameGraph", "Stage", "available_cores"]
PARALLEL_FROM = 15_000  # particles; with fewer the barriers cost more than a second core brings; 0: all cores, always
UNKNOWN = 1.0  # s that a frame is taken to last before one was timed


@dataclass(frozen=True)
class Stage:
    """One kernel over `count` elements; `loop` is its native loop for the CPU. count = 1: one thread, then all wait for it.

    With `launch` instead of a kernel it is a serial call that only enqueues device work. With `body` instead it is stages that are
    repeated while the first number of `condition` is not 0, `most` times at most; a stage of the body that is not its first sets it.
    `own`: its loop writes points of the core's own share (share() in kernels/loops.py) and reads none of another's that the stages beside
    it write, so that between two such stages nobody waits.
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


class FrameGraph:
    """A captured frame. CUDA: one graph. CPU: one graph per core with native barriers between the stages, and one for a single core.

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
        self._last = {1: UNKNOWN, self.core_count: UNKNOWN}  # s that the last frame on so many cores took
        self._barrier = wp.zeros(meeting.BARRIER, dtype=int, device="cpu")
        self._singles: dict[int, FrameGraph] = {}
        kernels = [*map(self._kernel, chain.from_iterable((stage, *stage.body) for stage in self.stages))]
        kernels += [meeting.resolve_barrier] if self.core_count > 1 else []
        load_modules(filter(None, kernels), self.device, available_cores())
        self._graphs = {cores: [self._capture(core, cores) for core in range(cores)] for cores in {1, self.core_count}}
        self._apart = self._places_apart()

    def _capture(self, core: int, core_count: int):
        with wp.ScopedCapture(self.device) as capture:  # on the CPU this records and does not run
            self._launch_all(self.stages, core, core_count)
        return capture.graph

    def _launch_all(self, stages: Sequence[Stage], core: int, core_count: int) -> None:
        """Launch one core's part of stages, one after the other; all cores meet after each, but between two that keep to their own."""
        for stage, following in zip(stages, [*stages[1:], None], strict=True):
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
            wp.launch(stage.loop, 1, [core, core_count, *stage.inputs], device=self.device)
        else:
            first, end = stage.count * core // core_count, stage.count * (core + 1) // core_count
            if end > first:
                wp.launch(stage.kernel, end - first, [first, *stage.inputs], device=self.device)

    def run(self, load: int) -> None:
        """Advance one frame; `load`, its work in particles that move alone, decides between one core and all. Raises BrokenFrame."""
        if self.device.is_cuda:
            wp.capture_launch(self._graphs[1][0])
            return
        many = self.core_count > 1 and load >= PARALLEL_FROM
        always = PARALLEL_FROM <= 0
        core_count = self.core_count if many and (always or not self.crowding.one) else 1
        began = time.perf_counter()
        share = self._carry_out(core_count)
        if many and not always and self.cores == core_count:
            self.crowding.told(time.perf_counter() - began, share)

    def _carry_out(self, core_count: int) -> float:
        """Carry a frame out and return for which share of the time its threads had cores, as far as that is known."""
        last, graphs = self._last[core_count], self._graphs[core_count]
        aside = last > STANDS_ASIDE
        alone = core_count == 1 and not aside or not crew().taken_by(self)  # another thread's frame may have the crew
        self.cores = 1 if alone else core_count
        if alone:
            began = time.thread_time()  # waiting for the interpreter lock is left out
            replay(self._graphs[1][0], worth_keeping_lock(last))
            self._last[1] = time.thread_time() - began
            return 1.0
        crew().order(graphs, self._barrier, self._apart if core_count > 1 else None, aside)
        crew().carry_out(worth_keeping_lock(last))
        self._last[core_count] = crew().taken
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

    def time_stages(self, load: int) -> dict[str, float]:
        """Advance one frame stage by stage and return the time each took [s]; for benchmarks, slower than run()."""
        times: dict[str, float] = {}
        for stage in self.stages:
            begin = time.perf_counter()
            self._alone(stage).run(load)
            wp.synchronize_device(self.device)
            times[stage.name] = times.get(stage.name, 0.0) + time.perf_counter() - begin
        return times

    def _alone(self, stage: Stage) -> "FrameGraph":
        """Return a graph of one stage, made once."""
        place = next(k for k, other in enumerate(self.stages) if other is stage)
        if place not in self._singles:
            self._singles[place] = FrameGraph([stage], self.device.alias, self.core_count, self.native)
        return self._singles[place]
