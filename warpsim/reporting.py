"""How a run is told: who hears of it, what a report says, and the watch that knows computing from waiting."""

import time
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from typing import Protocol

REPORT_PERIOD = 0.25  # s between reports
CROWDED_FROM = 50  # frames; fewer are trials, or a moment
CROWDED = "one core carries frames out while that is faster than all of them"
REPORT_SHARE = 0.02  # most of the time that reports may take: each one waits for the device and adds up energies


@dataclass(frozen=True)
class Report:
    """How far a run is. `frame_time` is computing time per frame [s], lately (at the end: of the whole run).

    crowded_frames: so many had one core, though they were worth all, because other programs used the machine.
    """

    index: int
    frame_count: int
    time: float
    frame_time: float
    speed: float  # simulated time over computing time
    statistics: dict[str, dict[str, float]]
    crowded_frames: int = 0


class Audience(Protocol):
    """Who hears how a run is going: a terminal, a pipe, a test."""

    def note(self, text: str) -> None:
        """Take one line that matters."""

    def showing(self, viewer) -> None:
        """Take the viewer that has just begun to serve (its `url`)."""

    def report(self, report: Report) -> None:
        """Take a report, a few times a second."""

    def end(self, report: Report | None = None) -> None:
        """Take the last report; nothing more happens, except perhaps on the screen."""


class Logged:
    """An audience whose notes are written into the run folder as well."""

    def __init__(self, audience: Audience, recorder):
        self.showing, self.report, self.end = audience.showing, audience.report, audience.end
        self._note, self._log = audience.note, recorder.log

    def note(self, text: str) -> None:
        """Tell the audience and the log; a log that cannot be written is no reason to lose what the note is about."""
        self._note(text)
        with suppress(OSError):
            self._log(text)


class Watch:
    """Counts frames as they are made and the time that went into them, waiting left out."""

    def __init__(self):
        self.made = 0
        self._began = time.perf_counter()
        self.waited = 0.0

    @property
    def busy(self) -> float:
        """Seconds since the beginning that were not waited away."""
        return time.perf_counter() - self._began - self.waited

    def wait(self, seconds: float) -> None:
        """Sleep."""
        began = time.perf_counter()
        time.sleep(seconds)
        self.waited += time.perf_counter() - began


class Reporter:
    """Reports to an audience how a story goes on, and notes once per system when its births begin to be refused."""

    def __init__(self, story, frame_count: int, audience: Audience, watch: Watch):
        self._story, self._frame_count, self._audience, self._watch = story, frame_count, audience, watch
        self._lap = (0, 0.0)
        self._due = time.perf_counter() + REPORT_PERIOD
        self._overflowing: set[str] = set()
        self._inexact: set[str] = set()
        self._pushed: set[str] = set()
        self._unconverged: set[str] = set()
        self._overlong: set[str] = set()
        self._crowded = False

    def report_if_due(self) -> None:
        """Tell how far the run is, a few times a second, with the speed since the last report."""
        began = time.perf_counter()
        if began < self._due:
            return
        (made, busy), self._lap = self._lap, (self._watch.made, self._watch.busy)
        self._audience.report(self._report(self._lap[1] - busy, self._lap[0] - made))
        ended = time.perf_counter()
        self._due = ended + max(REPORT_PERIOD, (ended - began) / REPORT_SHARE)

    def final_report(self) -> Report:
        """Tell and return how far the run came, with the speed of the whole of it."""
        report = self._report(self._watch.busy, self._watch.made)
        self._audience.end(report)
        return report

    def _report(self, busy: float, made: int) -> Report:
        story, statistics = self._story, self._story.statistics()
        for name in [name for name, numbers in statistics.items() if numbers["refused"] and name not in self._overflowing]:
            self._overflowing.add(name)
            self._note_overflow(self._audience.note, name)
        for name in [name for name, numbers in statistics.items() if numbers.get("inexact") and name not in self._inexact]:
            self._inexact.add(name)
            self._audience.note(f"{name} at frame {story.index}: the most substeps do not keep the tolerance {inexactly(name)}")
        for name in [name for name, numbers in statistics.items() if numbers.get("pushed") and name not in self._pushed]:
            self._pushed.add(name)
            words = "particles that begin inside a collider are put on its surface (move the emitter or the collider)"
            self._audience.note(f"{name} at frame {story.index}: {words}")
        for name in [name for name, numbers in statistics.items() if numbers.get("cg_unconverged") and name not in self._unconverged]:
            self._unconverged.add(name)
            self._audience.note(f"{name} at frame {story.index}: conjugate gradients {unconverged(name)}")
        for name in [name for name, numbers in statistics.items() if numbers.get("overlong") and name not in self._overlong]:
            self._overlong.add(name)
            self._audience.note(f"{name} at frame {story.index}: {overlong(int(statistics[name]['overlong']))}")
        if story.crowded_frames >= CROWDED_FROM and not self._crowded:
            self._crowded = True
            self._audience.note(f"frame {story.index}: other programs use the machine; {CROWDED}")
        frame_time = busy / max(1, made)
        speed = 1.0 / (story.scene.time.fps * max(frame_time, 1e-9))
        return Report(story.index, self._frame_count, story.time, frame_time, speed, statistics, story.crowded_frames)

    def _note_overflow(self, note: Callable[[str], None], name: str) -> None:
        note(f"{name} is full at frame {self._story.index}: births are refused (raise systems.{name}.capacity)")


def unconverged(name: str) -> str:
    """Return what it means that iterations ended before the tolerance was reached, and what to do about it."""
    return f"ended short of the tolerance: stable, but softened (raise systems.{name}.iterations, substeps or tolerance)"


def overlong(count: int) -> str:
    """Return what it means that springs are longer than their strain_limit allows."""
    springs = "1 spring is" if count == 1 else f"{count} springs are"
    return f"{springs} longer than strain_limit allows: pins or colliders pull harder than it can hold (more substeps, or a higher limit)"


def inexactly(name: str) -> str:
    """Return what to do about particles whom the most substeps do not suffice."""
    return f"(raise systems.{name}.max_substeps or systems.{name}.tolerance)"
