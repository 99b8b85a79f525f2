"""Cores, streams and graphs: a frame is a list of stages, captured once and replayed. Only this file knows threads and streams."""

import ctypes
import os
import sys
import threading
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cache, partial
from itertools import chain
from queue import SimpleQueue

import warp as wp

from warpsim.kernels import lifecycle_loops

MOST_CORES = 64  # that share a frame: some stages keep a row for each
PARALLEL_FROM = 15_000  # particles; with fewer the barriers cost more than a second core brings (docs/adr/0003-native-loops.md)


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


def available_cores() -> int:
    """Return the number of cores this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def yield_address() -> int:
    """Return the address of the system's `let another thread run`, 0 if there is none: the compiler of kernels resolves no such name."""
    library, name = ("kernel32", "SwitchToThread") if sys.platform == "win32" else (None, "sched_yield")
    function = getattr(ctypes.CDLL(library), name, None)
    return (ctypes.cast(function, ctypes.c_void_p).value or 0) if function else 0


_present = threading.local()


def _stay_on(cores: frozenset[int]) -> None:
    """Let the present thread run on these cores alone, where the system can be told; the call is made only where that is new."""
    if hasattr(os, "sched_setaffinity") and getattr(_present, "cores", None) != cores:
        os.sched_setaffinity(0, cores)
        _present.cores = cores


def _work(inbox: SimpleQueue) -> None:
    """Live the life of a thread of the crew."""
    while True:
        job, reply = inbox.get()
        reply.put(job())


@cache
def _crew(process: int, core_count: int) -> list[SimpleQueue]:
    """Return the inboxes of one thread per core, shared by all graphs; keyed by process, because threads do not survive a fork."""
    inboxes = [SimpleQueue() for _ in range(core_count)]
    for core, inbox in enumerate(inboxes):
        threading.Thread(target=_work, args=(inbox,), daemon=True, name=f"warpsim-core-{core}").start()
    return inboxes


class FrameGraph:
    """A captured frame. CUDA: one graph. CPU: one graph per core with native barriers between the stages, and one for a single core.

    Only the crew replays, and it never sees KeyboardInterrupt: a frame once begun is finished. `native=False` runs the plain
    kernels on the CPU. The bits are the same either way, for any number of cores.
    """

    def __init__(self, stages: Sequence[Stage], device: str, core_count: int, native: bool):
        self.device = wp.get_device(device)
        self.core_count = 1 if self.device.is_cuda else core_count
        self.native = native and self.device.is_cpu
        self.stages = list(stages)
        self._barrier = wp.zeros(48, dtype=int, device="cpu")
        self._lock = threading.Lock()  # on a Python without the interpreter lock, orders must still go out as one
        self._singles: dict[int, FrameGraph] = {}
        for kernel in map(self._kernel, chain.from_iterable((stage, *stage.body) for stage in self.stages)):
            if kernel is not None:
                # Compiles what is not in the cache, which a CUDA capture could not; on the CPU every launch has blocks of one.
                kernel.module.load(self.device, 1 if self.device.is_cpu else 256)
        self._everywhere = frozenset(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else frozenset()
        self._graphs = {cores: [self._capture(core, cores) for core in range(cores)] for cores in {1, self.core_count}}

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
                inputs = [core_count, wp.uint64(yield_address()), self._barrier]
                wp.launch(lifecycle_loops.resolve_barrier, 1, inputs, device=self.device)

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
        return stage.loop if self.native and stage.loop is not None else stage.kernel

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

    def _replay(self, graph, cores: frozenset[int]) -> BaseException | None:
        try:
            _stay_on(cores)
            wp.capture_launch(graph)
        except BaseException as error:
            self._barrier.numpy()[32] = 1  # the other cores must not wait for this one
            return error
        return None

    def _together(self, jobs: list[Callable]) -> None:
        reply: SimpleQueue = SimpleQueue()
        orders = [(job, reply) for job in jobs]
        with self._lock:
            any(map(SimpleQueue.put, _crew(os.getpid(), self.core_count), orders))  # in C: no signal gets between
        for error in [reply.get() for _ in jobs]:
            if error:
                raise error

    def run(self, particle_count: int) -> None:
        """Advance one frame; `particle_count` decides between one core and all."""
        if self.device.is_cuda:
            wp.capture_launch(self._graphs[1][0])
        else:
            core_count = self.core_count if particle_count >= PARALLEL_FROM else 1
            self._together([partial(self._replay, *each) for each in zip(self._graphs[core_count], self._places(core_count), strict=True)])

    def _places(self, core_count: int) -> list[frozenset[int]]:
        """Return where each graph runs: each on a core of its own where all are used, else wherever the system likes.

        Threads that wait for each other all the time and are put on one core, which a busy machine does, take turns of milliseconds.
        """
        cores = self._everywhere
        return [frozenset((core,)) for core in sorted(cores)] if core_count == len(cores) > 1 else [cores] * core_count

    def settle(self) -> None:
        """Wait for a frame that KeyboardInterrupt left running."""
        if self.device.is_cpu:
            self._together([lambda: None] * self.core_count)
        wp.synchronize_device(self.device)

    def time_stages(self, particle_count: int) -> dict[str, float]:
        """Advance one frame stage by stage and return the time each took [s]; for benchmarks, slower than run()."""
        times: dict[str, float] = {}
        for stage in self.stages:
            begin = time.perf_counter()
            self._alone(stage).run(particle_count)
            wp.synchronize_device(self.device)
            times[stage.name] = times.get(stage.name, 0.0) + time.perf_counter() - begin
        return times

    def _alone(self, stage: Stage) -> "FrameGraph":
        """Return a graph of one stage, made once."""
        place = next(k for k, other in enumerate(self.stages) if other is stage)
        if place not in self._singles:
            self._singles[place] = FrameGraph([stage], self.device.alias, self.core_count, self.native)
        return self._singles[place]
