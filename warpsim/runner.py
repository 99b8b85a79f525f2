"""The runner: builds what a scene describes, plays it, and sees to it that nothing is lost however it ends.

It owns the order (build, play, save, close); it knows neither YAML nor terminals. `screening.py` does the same for a recorded run.
"""

import errno
import ipaddress
import os
import sys
import tempfile
from collections.abc import Callable
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path

from warpsim.changes import Change, FixedField, changed_scene
from warpsim.filming import Filming, file_stem
from warpsim.interruption import Interruption
from warpsim.playback import Playback, never, reason_of
from warpsim.reporting import Audience, Logged, Report
from warpsim.scene import SceneError
from warpsim.scene.assets import recorded_assets

SWITCH_INTERVAL = 1e-4  # s; a run waits so long for a viewer that is at work, once a frame; with Python's 5 ms a frame of 4 ms took 6.7


class NoSuchDevice(Exception):
    """This machine does not have the device that was asked for."""


class MisfitChange(Exception):
    """A change of another run does not fit this scene; the text says which and why."""


@dataclass(frozen=True)
class Picture:
    """A picture to take of the last frame: where, and of how many pixels."""

    path: Path
    size: tuple[int, int] = (1280, 720)


@dataclass(frozen=True)
class Showing:
    """How a run is shown, be it computed or read."""

    viewer: bool = False
    host: str = "127.0.0.1"  # with another than a loopback address the viewer asks every page for a token
    port: int | None = None
    stay: bool = False  # keep the last frame on show until a signal
    frame_count: int | None = None  # None: all there are
    film: Path | None = None  # an HTML recording of what is shown
    picture: Picture | None = None
    changed: Callable[[], bool] = never  # asked between frames; true ends the run with "changed"


@dataclass(frozen=True)
class Settings:
    """What a run is asked for beside its scene. `record` names a run folder and `record_text` is what its scene.yaml tells."""

    device: str = "auto"
    threads: int | None = None
    showing: Showing = Showing()
    record: Path | None = None
    record_text: Callable[[object, str, int | None], str] | None = None  # (scene, device, threads) -> text
    overwrite: bool = False
    changes: tuple[tuple[int, str, str], ...] = ()  # (frame, path, value as YAML) of a run to be repeated


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

    Raises what building raises (SceneError, MemoryLimitError), OccupiedFolder and OSError from the recorder, NoSuchDevice, MisfitChange,
    NoPicture, and KeyboardInterrupt at a signal before there is anything worth saving and at the second signal.
    """
    showing = settings.showing
    check_outlets(showing)
    check_changes(scene, settings.changes)
    with ExitStack() as stack:
        recorder = _recorder(settings, stack)
        if recorder:
            audience = Logged(audience, recorder)
        viewer = open_viewer(scene, showing, audience, stack)
        device = ready_device(settings.device, audience)
        from warpsim.simulation import UnstableError
        from warpsim.streamlines import streamlines

        simulation = playback = None
        try:
            simulation = _built(scene, device, settings.threads, audience, viewer)
            for name, advice in simulation.advice.items():
                if not advice.sufficient:
                    audience.note(f"{name}: {advice}")
            simulation.changes = [Change(*change) for change in settings.changes]
            if recorder:
                recorder.begin(settings.record_text(scene, device, simulation.threads), recorded_assets(scene))
            frame_count = simulation.frame_count if showing.frame_count is None else showing.frame_count
            lines = (lambda: streamlines(simulation)) if scene.viewer.streamlines else None
            filming = Filming(scene, showing.film, audience.note, lines)
            stack.callback(filming.abandon)
            playback = Playback(
                simulation, frame_count, audience, stop, viewer, recorder, filming, showing.changed, stays=showing.stay, lines=lines
            )
            stop.patient = True
            return _played(playback, showing)
        except UnstableError as error:
            saved = save_state(error.last_good, scene.name, recorder and recorder.folder, audience.note) if error.last_good else None
            if recorder:
                if not recorder.begun:
                    recorder.begin(settings.record_text(scene, device, settings.threads), recorded_assets(scene))
                recorder.log(f"unstable: {error}")
            report = playback and playback.final_report()
            if playback:
                playback.filming.close()
            return Outcome("unstable", report, error=error, saved=saved)
        except KeyboardInterrupt:
            if simulation:
                simulation.settle()
            raise


def _played(playback: Playback, showing: Showing) -> Outcome:
    """Play to the end and save what an early end leaves."""
    simulation = playback.story
    try:
        kind = playback.play()
    except (SceneError, FixedField) as error:  # of --changes: those of a page are refused and the run goes on
        raise MisfitChange(f"the change after frame {simulation.index} does not fit this scene: {reason_of(error)}") from None
    report, state_hash, saved = playback.final_report(), simulation.state_hash(), None
    if kind == "interrupted":
        folder = playback.recorder and playback.recorder.folder
        saved = save_state(simulation.frame(), simulation.scene.name, folder, playback.audience.note)
    kind = finish(playback, showing, kind)
    return Outcome(kind, report, state_hash, saved=saved)


def finish(playback: Playback, showing: Showing, kind: str) -> str:
    """Write film and picture of what was played, and keep the last frame on show where that was asked for; return how it ended."""
    playback.filming.close()
    if kind == "done" and showing.picture:
        playback.stop.patient = False  # there is nothing left to lose
        take_picture(playback, showing.picture)
        playback.stop.patient = True
    if kind == "done" and showing.stay:
        playback.audience.note("done; Ctrl-C ends")
        kind = "changed" if playback.stay() == "changed" else kind
        playback.filming.close()
    return kind


def take_picture(playback: Playback, picture: Picture) -> None:
    """Save the present frame as a headless browser draws it. Raises NoPicture, OSError."""
    from warpsim.observers.snapshot import take_snapshot
    from warpsim.observers.viewer import Viewer

    story = playback.story
    with ExitStack() as stack:
        viewer = playback.viewer or stack.enter_context(Viewer(story.scene, port=0))
        if playback.lines:
            viewer.show_lines(playback.lines())
        viewer.publish(story.frame(), full=True)
        take_snapshot(viewer.url, picture.path, picture.size)
    playback.audience.note(f"frame {story.index} is pictured in {picture.path}")


def check_outlets(showing: Showing) -> None:
    """Raise NoPicture or OSError now rather than after a long run: where no browser is, or no folder for a file."""
    if showing.picture:
        from warpsim.observers.snapshot import required_browser

        required_browser()
    for path in filter(None, (showing.film, showing.picture and showing.picture.path)):
        if path.is_dir() or not path.absolute().parent.is_dir():
            number = errno.EISDIR if path.is_dir() else errno.ENOENT
            raise OSError(number, os.strerror(number), str(path))


def check_changes(scene, changes: tuple[tuple[int, str, str], ...]) -> None:
    """Raise MisfitChange for the first change whose path leads nowhere in the scene, or to what cannot change while it runs."""
    known = set()
    for index, path, value in changes:
        if path in known:  # a dragged slider leaves thousands of lines; trying each would take minutes
            continue
        known.add(path)
        try:
            changed_scene(scene, path, value)
        except (SceneError, FixedField) as error:
            raise MisfitChange(f"the change of frame {index}, {path} = {value}, does not fit this scene: {reason_of(error)}") from None


def save_state(frame, scene_name: str, folder: Path | None, note: Callable[[str], None]) -> Path | None:
    """Save a state where the user will find it: the run folder, else the current folder, else the temporary one; None if all refuse."""
    from warpsim.observers.recorder import save_frame

    name = f"{file_stem(scene_name)}.lastgood.npz"
    for path in [*([folder / "lastgood.npz"] if folder else []), Path.cwd() / name, Path(tempfile.gettempdir()) / name]:
        try:
            save_frame(path, frame)
            return path
        except OSError as error:
            note(f"cannot save the last good state as {path}: {error.strerror}")
    return None


def ready_device(name: str, audience: Audience) -> str:
    """Make Warp ready and return its name for the device. Raises NoSuchDevice."""
    from warpsim.kernel_cache import prepare_kernel_cache

    prepare_kernel_cache(audience.note)
    from warpsim.simulation import resolve_device

    try:
        return resolve_device(name)
    except ValueError as error:
        raise NoSuchDevice(str(error)) from None


def built(build: Callable[[], object], audience: Audience):
    """Return what `build` returns, with a word where kernels compile and a second try where the cache is damaged."""
    from warpsim.compiling import announced_compiling
    from warpsim.kernel_cache import rebuilding

    with announced_compiling(audience.note):
        return rebuilding(build, audience.note)


def _built(scene, device: str, threads: int | None, audience: Audience, viewer):
    """Build the simulation and show its first frame."""
    from warpsim.simulation import Simulation

    def build():
        simulation = Simulation(scene, device, threads)
        if viewer:
            viewer.publish(simulation.frame())  # whether or not somebody looks: packing has kernels of its own to compile
        return simulation

    return built(build, audience)


def _recorder(settings: Settings, stack: ExitStack):
    if settings.record is None:
        return None
    from warpsim.observers.recorder import Recorder

    recorder = Recorder(settings.record, settings.overwrite)
    stack.callback(recorder.close)
    return recorder


def open_viewer(scene, showing: Showing, audience: Audience, stack: ExitStack):
    """Return a viewer that serves until the stack is unwound; None where none is wanted."""
    if not showing.viewer:
        return None
    from warpsim.observers.viewer import Viewer, fresh_token

    stack.callback(sys.setswitchinterval, sys.getswitchinterval())
    sys.setswitchinterval(SWITCH_INTERVAL)
    token = None if ipaddress.IPv4Address(showing.host).is_loopback else fresh_token()
    viewer = Viewer(scene, showing.host, showing.port, token)
    stack.callback(viewer.close)
    audience.showing(viewer)
    return viewer
