"""The runner: takes a scene through its frames, in real time or at full speed, and shows every frame to the observers.

It owns the order (build, step, record, wait, show), the clock and how a run ends; it knows neither YAML nor terminals.
"""

import re
import sys
import tempfile
import time
from collections.abc import Callable
from contextlib import ExitStack, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol

from warpsim.interruption import Interruption

REPORT_PERIOD = 0.25  # s between reports
REPORT_SHARE = 0.02  # most of the time that reports may take: each one waits for the device and adds up energies
IDLE_SLICE = 0.02  # s of sleep between looks at the signal: a handler must not touch a lock that the sleeper may hold
SWITCH_INTERVAL = 5e-4  # s; Python's 5 ms, with the viewer's thread beside the run, makes a frame of 2 ms take 21


class NoSuchDevice(Exception):
    """This machine does not have the device that was asked for."""


@dataclass(frozen=True)
class Report:
    """How far a run is. `frame_time` is computing time per frame [s], lately (at the end: of the whole run)."""

    index: int
    frame_count: int
    time: float
    frame_time: float
    speed: float  # simulated time over computing time
    statistics: dict[str, dict[str, float]]


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


@dataclass(frozen=True)
class Settings:
    """What a run is asked for beside its scene. `record` names a run folder and `record_text` is what its scene.yaml tells."""

    device: str = "auto"
    threads: int | None = None
    frame_count: int | None = None  # None: the scene's duration
    viewer: bool = False
    port: int | None = None
    stay: bool = False  # keep the last frame on show until a signal
    record: Path | None = None
    record_text: Callable[[object, str, int | None], str] | None = None  # (scene, device, threads) -> text
    overwrite: bool = False
    changed: Callable[[], bool] = lambda: False  # asked between frames; true ends the run with "changed"


@dataclass(frozen=True)
class Outcome:
    """How a run ended: "done", "interrupted", "unstable" (then `error` tells) or "changed". `saved` is the last good state."""

    kind: str
    report: Report | None  # None: it blew up in the prewarm
    state_hash: str | None = None
    error: Exception | None = None
    saved: Path | None = None


def run_scene(scene, settings: Settings, audience: Audience, stop: Interruption) -> Outcome:
    """Run a scene to its end, to the first signal, or to a blow-up; in the last two the last good state is saved.

    Raises what building raises (SceneError, MemoryLimitError), OccupiedFolder and OSError from the recorder, NoSuchDevice, and
    KeyboardInterrupt at a signal before there is anything worth saving and at the second signal.
    """
    with ExitStack() as stack:
        recorder = _recorder(settings, stack)
        if recorder:
            audience = Logged(audience, recorder)
        viewer = _viewer(scene, settings, audience, stack)
        device = _device(settings.device, audience)
        from warpsim.simulation import UnstableError

        simulation = playback = None
        try:
            simulation = _built(scene, device, settings.threads, audience, viewer)
            if recorder:
                recorder.begin(settings.record_text(scene, device, simulation.threads))
            frame_count = simulation.frame_count if settings.frame_count is None else settings.frame_count
            playback = Playback(simulation, frame_count, audience, stop, viewer, recorder, settings.changed)
            stop.patient = True
            return _played(playback, settings.stay)
        except UnstableError as error:
            saved = save_state(error.last_good, scene.name, recorder and recorder.folder, audience.note) if error.last_good else None
            if recorder:
                if not recorder.begun:
                    recorder.begin(settings.record_text(scene, device, settings.threads))
                recorder.log(f"unstable: {error}")
            return Outcome("unstable", playback and playback.final_report(), error=error, saved=saved)
        except KeyboardInterrupt:
            if simulation:
                simulation.settle()
            raise


def _played(playback: "Playback", stay: bool) -> Outcome:
    """Play to the end and save what an early end leaves."""
    simulation, kind = playback.simulation, playback.play()
    report, state_hash, saved = playback.final_report(), simulation.state_hash(), None
    if kind == "interrupted":
        folder = playback.recorder and playback.recorder.folder
        saved = save_state(simulation.frame(), simulation.scene.name, folder, playback.audience.note)
    elif kind == "done" and stay:
        playback.audience.note("done; Ctrl-C ends")
        kind = "changed" if playback.stay() == "changed" else kind
    return Outcome(kind, report, state_hash, saved=saved)


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


class Playback:
    """Takes a simulation through its frames and shows each one, frame k at k/fps where there is a viewer."""

    def __init__(self, simulation, frame_count: int, audience: Audience, stop: Interruption, viewer, recorder, changed: Callable[[], bool]):
        self.simulation, self.frame_count, self.audience, self.stop = simulation, frame_count, audience, stop
        self.viewer, self.recorder, self.changed = viewer, recorder, changed
        self._waited = 0.0
        self._started = time.perf_counter()
        self._lap = (simulation.index, 0.0)
        self._report_due = self._started + REPORT_PERIOD
        self._overflowing: set[str] = set()

    def play(self) -> str:
        """Run from the present frame to the last; return "done", "interrupted" or "changed"."""
        period = 1.0 / self.simulation.scene.time.fps
        self._record()
        self._publish()
        clock = time.perf_counter()
        while self.simulation.index < self.frame_count:
            if self.stop.requested or self.changed():
                return "interrupted" if self.stop.requested else "changed"
            self.simulation.step_frame()
            self._record()
            if self.simulation.index == 1:  # kernels may have been compiled meanwhile; nobody wants to catch up with that
                clock = time.perf_counter() - period
            if self.viewer:
                self._wait_until(clock + self.simulation.index * period)
                self._publish()
            if time.perf_counter() >= self._report_due:
                self.report()
        return "done"

    def stay(self) -> str:
        """Keep the last frame on show until a signal or a change; return "interrupted" or "changed"."""
        while not self.stop.requested:
            if self.changed():
                return "changed"
            self._publish()  # to pages that fell behind or come late
            time.sleep(IDLE_SLICE)
        return "interrupted"

    def report(self) -> None:
        """Tell how far the run is, with the speed since the last report."""
        began = time.perf_counter()
        (first, busy_before), self._lap = self._lap, (self.simulation.index, self._busy())
        self.audience.report(self._report(self._lap[1] - busy_before, self.simulation.index - first))
        ended = time.perf_counter()
        self._report_due = ended + max(REPORT_PERIOD, (ended - began) / REPORT_SHARE)

    def final_report(self) -> Report:
        """Tell and return how far the run came, with the speed of the whole of it."""
        report = self._report(self._busy(), self.simulation.index)
        self.audience.end(report)
        return report

    def _busy(self) -> float:
        return time.perf_counter() - self._started - self._waited

    def _report(self, busy: float, frame_count: int) -> Report:
        """Return how far the run is; note once per system when its births begin to be refused."""
        simulation = self.simulation
        statistics = simulation.statistics()
        for name in [name for name, numbers in statistics.items() if numbers["refused"] and name not in self._overflowing]:
            self._overflowing.add(name)
            self.audience.note(f"{name} is full at frame {simulation.index}: births are refused (raise systems.{name}.capacity)")
        frame_time = busy / max(1, frame_count)
        speed = 1.0 / (simulation.scene.time.fps * max(frame_time, 1e-9))
        return Report(simulation.index, self.frame_count, simulation.time, frame_time, speed, statistics)

    def _record(self) -> None:
        if self.recorder:
            self.recorder.record(self.simulation.frame(), self.simulation.statistics(), self.simulation.state_hash())

    def _publish(self) -> None:
        if self.viewer and self.viewer.wants_frame():
            self.viewer.publish(self.simulation.frame())

    def _wait_until(self, moment: float) -> None:
        began = time.perf_counter()
        while (left := moment - time.perf_counter()) > 0 and not self.stop.requested:
            time.sleep(min(left, IDLE_SLICE))
        self._waited += time.perf_counter() - began


def save_state(frame, scene_name: str, folder: Path | None, note: Callable[[str], None]) -> Path | None:
    """Save a state where the user will find it: the run folder, else the current folder, else the temporary one; None if all refuse."""
    from warpsim.observers.recorder import save_frame

    stem = re.sub(r"[^\w.-]+", "-", scene_name).strip("-.") or "scene"
    name = f"{stem}.lastgood.npz"
    for path in [*([folder / "lastgood.npz"] if folder else []), Path.cwd() / name, Path(tempfile.gettempdir()) / name]:
        try:
            save_frame(path, frame)
            return path
        except OSError as error:
            note(f"cannot save the last good state as {path}: {error.strerror}")
    return None


def _device(name: str, audience: Audience) -> str:
    """Make Warp ready and return its name for the device. Raises NoSuchDevice."""
    from warpsim.kernel_cache import prepare_kernel_cache

    prepare_kernel_cache(audience.note)
    from warpsim.simulation import resolve_device

    try:
        return resolve_device(name)
    except ValueError as error:
        raise NoSuchDevice(str(error)) from None


def _built(scene, device: str, threads: int | None, audience: Audience, viewer):
    """Build the simulation and show its first frame, with a word where kernels compile and a second try where the cache is damaged."""
    from warpsim.kernel_cache import announced_compiling, rebuilding
    from warpsim.simulation import Simulation

    def build():
        simulation = Simulation(scene, device, threads)
        if viewer:
            viewer.publish(simulation.frame())  # whether or not somebody looks: packing has kernels of its own to compile
        return simulation

    with announced_compiling(audience.note):
        return rebuilding(build, audience.note)


def _recorder(settings: Settings, stack: ExitStack):
    if settings.record is None:
        return None
    from warpsim.observers.recorder import Recorder

    recorder = Recorder(settings.record, settings.overwrite)
    stack.callback(recorder.close)
    return recorder


def _viewer(scene, settings: Settings, audience: Audience, stack: ExitStack):
    if not settings.viewer:
        return None
    from warpsim.observers.viewer import Viewer

    stack.callback(sys.setswitchinterval, sys.getswitchinterval())
    sys.setswitchinterval(SWITCH_INTERVAL)
    viewer = Viewer(scene, port=settings.port)
    stack.callback(viewer.close)
    audience.showing(viewer)
    return viewer
