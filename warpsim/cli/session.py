"""One `run` or `view` from the first word to the exit code: signals, edits while it runs, the last words."""

import sys
import time
from pathlib import Path

from warpsim.cli.outcome import Exit, Failure, interruption_told, print_json
from warpsim.cli.progress import PlainLines
from warpsim.cli.scenes import WATCH_PERIOD, SceneFile
from warpsim.interruption import Interruption
from warpsim.observers.recorder import CHANGES, OccupiedFolder
from warpsim.observers.snapshot import NoPicture
from warpsim.reporting import CROWDED_FROM, inexactly, unconverged
from warpsim.runner import MisfitChange, NoSuchDevice, Outcome, Settings, Showing, run_scene
from warpsim.scene import SceneError

CROWDED_SHARE = 0.1  # of the frames that had one core: worth a word
EXITS = {"done": Exit.OK, "interrupted": Exit.INTERRUPTED, "unstable": Exit.UNSTABLE}


def run_session(source: SceneFile, settings: Settings, audience: PlainLines, watch: bool, json: bool) -> Exit:
    """Run the scene, again after every edit if it is watched, and return the exit code."""
    with interruption_told(), Interruption(audience.note) as stop:
        scene = source.load()
        with source.placing():
            outcome = _run_once(scene, settings, audience, stop)
        while watch and _edited(outcome, source, audience, stop):
            audience.note("the scene has changed: starting again")
            try:
                with source.placing():
                    outcome = _run_once(source.scene, settings, audience, stop)
            except SceneError as error:  # an edit that reads well but asks for too much memory
                audience.note(str(error))
                outcome = None
    if json and outcome:
        print_json(_result(source.scene, settings, outcome))
    return EXITS[outcome.kind] if outcome else Exit.BAD_SCENE


def show_session(folder: Path, showing: Showing, audience: PlainLines) -> Exit:
    """Show a recorded run and return the exit code."""
    from warpsim.replay import NoRun
    from warpsim.screening import show_run

    with interruption_told(), Interruption(audience.note) as stop:
        try:
            kind, report = show_run(folder, showing, audience, stop)
        except (NoRun, NoPicture) as error:
            raise Failure(Exit.INPUT_OUTPUT, str(error)) from None
        finally:
            audience.end()
    if kind == "interrupted":
        print(f"interrupted after frame {report.index}", file=sys.stderr)
    return EXITS[kind]


def _run_once(scene, settings: Settings, audience: PlainLines, stop: Interruption) -> Outcome:
    stop.patient = False
    try:
        outcome = run_scene(scene, settings, audience, stop)
    except (OccupiedFolder, NoPicture) as error:
        raise Failure(Exit.INPUT_OUTPUT, str(error)) from None
    except MisfitChange as error:
        raise Failure(Exit.BAD_SCENE, str(error)) from None
    except NoSuchDevice as error:
        raise Failure(Exit.USAGE, str(error)) from None
    finally:
        audience.end()  # the terminal must be whole again before anyone speaks
    _tell(outcome, settings, audience)
    return outcome


def _edited(outcome: Outcome | None, source: SceneFile, audience: PlainLines, stop: Interruption) -> bool:
    """Return whether there is an edited scene to run; waits for one after a run that cannot go on. False: a signal came first."""
    if outcome and outcome.kind == "changed":
        return True
    if not stop.requested:
        audience.note("waiting for an edit of the scene")
    while not stop.requested:
        if source.edited():
            return True
        time.sleep(WATCH_PERIOD)
    return False


def _tell(outcome: Outcome, settings: Settings, audience: PlainLines) -> None:
    """Say how a run ended, if it was not simply done."""
    report = outcome.report
    for name, numbers in report.statistics.items() if report else ():
        if numbers["refused"]:
            audience.note(f"{name}: {numbers['refused']} births were refused for lack of room (systems.{name}.capacity)")
        if numbers.get("pushed"):
            audience.note(f"{name}: {numbers['pushed']} times a particle began inside a collider and was put on its surface")
        if numbers.get("inexact"):
            words = f"{name}: the tolerance was not kept in {numbers['inexact']} frames of particles, counted one by one"
            audience.note(f"{words} {inexactly(name)}")
        if numbers.get("cg_unconverged"):
            audience.note(f"{name}: conjugate gradients of {numbers['cg_unconverged']} substeps {unconverged(name)}")
    if report and report.crowded_frames > max(CROWDED_FROM, CROWDED_SHARE * report.index):
        audience.note(f"{report.crowded_frames} of {report.index} frames had one core, because other programs used the machine")
    if report and settings.record:
        audience.note(f"recorded frames 0 to {report.index} in {settings.record}")
        changes = settings.record / CHANGES
        if changes.exists():
            audience.note(f"what was changed is in {changes}; again: warpsim run {settings.record / 'scene.yaml'} --changes {changes}")
    if outcome.error:
        print(f"error: {outcome.error}", file=sys.stderr)
    if outcome.kind == "interrupted":
        print(f"interrupted after frame {report.index}", file=sys.stderr)
    if outcome.saved:
        print(f"the last good state is in {outcome.saved}", file=sys.stderr)


def _result(scene, settings: Settings, outcome: Outcome) -> dict[str, object]:
    """Return what `run --json` prints."""
    report = outcome.report
    progress = report and {
        "frame": report.index,
        "time": report.time,
        "seconds_per_frame": report.frame_time,
        "times_real_time": report.speed,
        "crowded_frames": report.crowded_frames,
        "systems": report.statistics,
    }
    return {
        "scene": scene.name,
        "outcome": outcome.kind,
        "error": str(outcome.error) if outcome.error else None,
        **(progress or {}),
        "state_hash": outcome.state_hash,
        "run_folder": str(settings.record) if settings.record else None,
        "last_good_state": str(outcome.saved) if outcome.saved else None,
    }
