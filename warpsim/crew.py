"""The crew: threads that carry out parts of a frame side by side, natively, so that nobody needs the interpreter lock within a frame."""

import atexit
import ctypes
import os
import sys
import threading
import time
from collections.abc import Sequence
from contextlib import suppress
from functools import cache

import numpy as np
import warp as wp

from warpsim.kernels import crew as native

MOST_CORES = 64  # that share a frame: some stages keep a row for each
STANDS_ASIDE = 2e-2  # s; of a frame that takes more the calling thread does no part, so that it hears of signals meanwhile


class BrokenFrame(RuntimeError):
    """A part of a frame could not be carried out; Warp has said why on stderr."""


@cache
def function_addresses() -> wp.array:
    """Return the addresses of what native code calls, in the order of kernels/crew.py; 0 for what this system does not have."""
    if sys.platform == "win32":
        system, waiting = ctypes.WinDLL("kernel32"), ctypes.WinDLL("api-ms-win-core-synch-l1-2-0")
        places = [
            (system, "SwitchToThread"),
            (waiting, "WaitOnAddress"),
            (waiting, "WakeByAddressAll"),
            (ctypes.CDLL("ucrtbase"), "_timespec64_get"),
        ]
        places += [(system, "")] * 2
    else:
        sleep = ("syscall", "syscall") if sys.platform == "linux" else ("usleep", "")
        names = ("sched_yield", *sleep, "clock_gettime", "sched_getaffinity", "sched_setaffinity")
        places = [(ctypes.CDLL(None), name) for name in names]
    words = [_address(_warp_library(), "wp_apic_cpu_replay_state"), *(_address(*place) for place in places)]
    return wp.array(np.array(words, dtype=np.uint64), dtype=wp.uint64, device="cpu", copy=False)  # a copy would be captured, if one is


def _warp_library() -> ctypes.CDLL | None:
    """Return Warp's own native library; None if this Warp keeps it elsewhere, for it does not promise where."""
    wp.init()
    return getattr(getattr(sys.modules.get("warp._src.context"), "runtime", None), "core", None)


def _address(library, name: str) -> int:
    function = getattr(library, name, None) if name else None
    return (ctypes.cast(function, ctypes.c_void_p).value or 0) if function else 0


def calls() -> wp.uint64:
    """Return where native code finds the addresses of what it calls."""
    return wp.uint64(function_addresses().ptr)


def can_share() -> bool:
    """Return whether this Warp tells where its replay is, without which a frame is one core's."""
    return bool(function_addresses().numpy()[native.REPLAY])


def replay(graph: wp.Graph, keeping_lock: bool) -> None:
    """Replay a graph of the CPU on the present thread, keeping the interpreter lock or not."""
    if keeping_lock and can_share():
        if not _replay_with_lock()(graph.apic_state):
            raise BrokenFrame("a part of the frame failed")
    else:
        wp.capture_launch(graph)


@cache
def _replay_with_lock():
    return ctypes.PYFUNCTYPE(ctypes.c_bool, ctypes.c_void_p)(int(function_addresses().numpy()[native.REPLAY]))


def worth_keeping_lock(seconds: float) -> bool:
    """Return whether a frame of so many seconds keeps the interpreter lock: a busy thread would not give it back sooner than this."""
    return seconds < sys.getswitchinterval()


class Crew:
    """The threads of one process, shared by all frames; at most one frame at a time has them.

    A frame's first part is the calling thread's own, but where it stands aside; the crew has the others.
    """

    def __init__(self):
        self._process = os.getpid()
        self._holders: dict[str, object] = {}
        self._board = wp.zeros(native.BOARD, dtype=int, device="cpu")
        self._orders = wp.zeros((MOST_CORES + 1, native.ORDER), dtype=wp.uint64, device="cpu")
        self._place = wp.zeros(17, dtype=wp.uint64, device="cpu")  # whether the leader moves, and the mask of where to
        self._words, self._rows, self._mask = self._board.numpy(), self._orders.numpy(), self._place.numpy()
        self._threads: dict[int, threading.Thread] = {}
        self._places: dict[int, frozenset[int]] = {}
        self._told: tuple | None = None  # what stands in the orders
        self._parts = slice(0)
        native.lead_round.module.load("cpu", 1)
        self._round = self._captured(native.lead_round, 0, self._board, self._orders, wp.uint64(self._place.ptr), calls())
        atexit.register(self._dismiss)

    def _captured(self, kernel: wp.Kernel, *inputs) -> wp.Graph:
        """Return a launch that starts on any thread whatever is being captured on another."""
        with wp.ScopedCapture("cpu") as capture:
            wp.launch(kernel, 1, inputs, device="cpu")
        return capture.graph

    def taken_by(self, frame: object) -> bool:
        """Take the crew for a frame, if no other has it, and return whether the frame has it now."""
        return self._holders.setdefault("frame", frame) is frame  # in C: neither a thread nor a signal gets between

    def held_by(self, frame: object) -> bool:
        """Return whether a frame has the crew."""
        return self._holders.get("frame") is frame

    def order(self, graphs: Sequence[wp.Graph], barrier: wp.array, places: Sequence[frozenset[int]] | None, aside: bool) -> None:
        """Give each part of a frame to a thread; `places` are the cores on which they stay. With `aside` the crew has all parts."""
        self._wait()  # for what KeyboardInterrupt may have left, if nobody has
        states = tuple(getattr(graph.apic_state, "value", graph.apic_state) for graph in graphs)
        orders = (states, barrier.ptr, places, aside)
        if orders != self._told:
            self._told = None
            self._hire(len(graphs) - (not aside))
            self._parts = slice(int(aside), len(graphs) + aside)
            self._rows[:, native.GIVEN] = 0
            self._rows[self._parts, native.GIVEN] = 1
            self._rows[self._parts, native.STATE] = states
            self._rows[self._parts, native.MEETING] = barrier.ptr
            self._words[native.AWAITED] = len(graphs) - (not aside)
            self._put(places, aside)
            self._told = orders
        self._rows[:, native.FAILED] = 0

    def carry_out(self, keeping_lock: bool) -> None:
        """Do what was ordered, to the end. KeyboardInterrupt may leave it under way: finish() waits for it. Raises BrokenFrame."""
        self._words[native.OPENS] = 1
        replay(self._round, keeping_lock)
        self.finish()

    def finish(self) -> None:
        """Wait for a frame that is under way, if there is one, and let others have the crew. Raises BrokenFrame."""
        self._wait()
        self._holders.clear()
        if self._rows[self._parts, native.FAILED].any():
            raise BrokenFrame("a part of the frame could not be carried out")

    def _wait(self) -> None:
        while self._words[native.UNDER_WAY]:
            wp.capture_launch(self._round)
        self._words[native.OPENS] = 0  # interrupted before it began

    @property
    def taken(self) -> float:
        """How long the last frame took [s]; 1e-3 where the system does not tell."""
        return int(self._rows[self._parts, native.TAKEN].max()) * 1e-9 or 1e-3

    @property
    def share(self) -> float:
        """Of the time that the last frame took, the share in which the thread that had least had a core; 1 where nobody tells."""
        worked, taken = (self._rows[self._parts, word].astype(float) for word in (native.WORKED, native.TAKEN))
        return float((worked / np.maximum(taken, 1.0)).min()) if taken.all() else 1.0

    def _hire(self, count: int) -> None:
        """Have at least so many threads, all of them within their native loop; whom KeyboardInterrupt left half hired is hired again."""
        for part in range(1, count + 1):
            if not self._rows[part, native.HIRED]:
                rounds = self._captured(native.follow_rounds, part, MOST_CORES, self._board, self._orders, calls())
                thread = threading.Thread(target=wp.capture_launch, args=(rounds,), daemon=True, name=f"warpsim-core-{part}")
                self._threads[part] = thread
                self._places.pop(part, None)
                thread.start()
        while not self._rows[1 : count + 1, native.HIRED].all():
            time.sleep(1e-4)  # without the interpreter lock, which they need on their way

    def _put(self, places: Sequence[frozenset[int]] | None, aside: bool) -> None:
        """Say where each thread of the next frame runs; the leader, who has a life beside it, goes there for its duration only."""
        self._mask[:] = 0
        if not hasattr(os, "sched_setaffinity"):
            return
        count, everywhere = self._parts.stop - self._parts.start, frozenset(os.sched_getaffinity(0))
        for part in range(count):
            place = places[part] if places else everywhere
            if part == 0 and not aside:
                self._mask[0] = places is not None
                for core in place:
                    self._mask[1 + core // 64] |= np.uint64(1 << core % 64)
            elif self._places.get(follower := part + aside) != place:
                with suppress(ProcessLookupError):  # one that was hired twice
                    os.sched_setaffinity(self._threads[follower].native_id, place)
                self._places[follower] = place

    def _dismiss(self) -> None:
        """Let the threads end: what they run is unloaded soon."""
        if self._threads and os.getpid() == self._process:
            self._wait()
            self._words[[native.QUIT, native.OPENS]] = 1
            self._words[native.AWAITED] = 0
            self._rows[:, native.GIVEN] = 0
            wp.capture_launch(self._round)
            for thread in self._threads.values():
                thread.join(1.0)


_crews: dict[int, Crew] = {}


def crew() -> Crew:
    """Return the crew of this process: threads do not survive a fork."""
    process = os.getpid()
    return _crews.get(process) or _crews.setdefault(process, Crew())
