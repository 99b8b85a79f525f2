"""Cores: how many this process may use, and on how many a frame is carried out while other programs use them, too."""

import math
import os
import time
from pathlib import Path

CGROUPS = Path("/sys/fs/cgroup")
WINDOW = 0.03  # s of frames from which is judged
LEAST_FRAMES = 3  # of them
FREE = 0.88  # of the time that a frame's threads take they have a core on a machine that has nothing else to do
BETTER = 0.95  # of the time of a frame: what a change of cores has to bring
FIRST_HOLD, LONGEST_HOLD = 0.25, 2.0  # s between trials; each that brings nothing doubles them
MOST_LOST = 0.03  # of the time: what trials that bring nothing may cost, even where a frame of theirs takes ever so long


def available_cores() -> int:
    """Return the number of cores this process may use: those it may run on, but not more than its container has time for."""
    allowed = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    return max(1, min(allowed, math.ceil(container_cores() - 1e-9)))


def container_cores(groups: Path = CGROUPS, own: Path = Path("/proc/self/cgroup")) -> float:
    """Return how many cores' time the control groups of this process leave it, 1.5 for `docker run --cpus=1.5`; 1 << 20 without limit."""
    try:
        lines = [line.split(":", 2) for line in own.read_text().splitlines()]
    except OSError:
        return 1 << 20
    least = float(1 << 20)
    for _, controllers, path in (line for line in lines if len(line) == 3):
        if controllers and "cpu" not in controllers.split(","):
            continue
        roots = [groups / "cpu", groups / controllers] if controllers else [groups, groups / "unified"]
        inner = Path(path.lstrip("/"))
        for folder in {root / place for root in roots for place in (inner, *inner.parents)}:  # a limit of an outer group holds, too
            least = min(least, _quota(folder))
    return least


def _quota(folder: Path) -> float:
    """Return the cores' time that one control group leaves, of the second version or the first."""
    for names in (("cpu.max",), ("cpu.cfs_quota_us", "cpu.cfs_period_us")):
        try:
            quota, period = " ".join((folder / name).read_text() for name in names).split()
            return int(quota) / int(period) if quota.isdecimal() and int(period) > 0 else 1 << 20
        except (OSError, ValueError):
            continue
    return 1 << 20


class Crowding:
    """Decides, frame by frame, whether all cores or one carry a frame out, from the times of those before: others may use the machine.

    Threads that meet within a frame all wait for the one whose core somebody else has. Where their share of the cores says that this
    happens, or the time, one core is tried, and kept while it is faster; all are tried again after a while. No bits depend on it.
    """

    def __init__(self, now=time.monotonic):
        self._now = now
        self.alone = False  # whether one core is what is used at present
        self.frames, self.frames_alone = 0, 0  # carried out: all that were worth all cores, and those of them that had one
        self._one = math.inf
        self._usual: float | None = None  # s per frame of the last window that was no trial
        self._trying = False
        self._hold, self._next = FIRST_HOLD, 0.0
        self._open()

    def _open(self) -> None:
        self._count, self._time, self._had = 0, 0.0, 0.0

    @property
    def one(self) -> bool:
        """Whether the next frame is one core's."""
        return self.alone != self._trying

    def told(self, seconds: float, share: float, one: float = math.inf) -> None:
        """Take what the frame took [s], for which share of that its threads had cores, and what one core would take, as far as is known."""
        self.frames += 1
        self.frames_alone += self.one
        self._count += 1
        self._time += seconds
        self._had += seconds * share
        self._one = one
        taken = self._time / self._count
        if self._trying and self._time > WINDOW and self._usual is not None and taken > 1.5 * self._usual:
            self._end_trial(taken)  # that is enough to know
        elif self._count >= LEAST_FRAMES and self._time >= WINDOW:
            if self._trying:
                self._end_trial(taken)
            else:
                self._judge(taken, self._had / self._time)

    def _judge(self, taken: float, share: float) -> None:
        """Look at a window that was no trial: is it time for one?"""
        self._usual = taken
        self._trying = (self.alone or share < FREE or taken > self._one) and self._now() >= self._next
        self._open()

    def _end_trial(self, taken: float) -> None:
        """Stay with what was tried if it is faster; else leave it alone for longer than the last time."""
        lost = self._time - self._count * self._usual
        if lost < (BETTER - 1.0) * self._count * self._usual:
            self.alone = not self.alone
            self._usual, self._hold = taken, FIRST_HOLD
        else:
            self._hold = min(2.0 * self._hold, LONGEST_HOLD)
        self._trying = False
        self._next = self._now() + max(self._hold, min(lost / MOST_LOST, 5.0 * LONGEST_HOLD))
        self._open()
