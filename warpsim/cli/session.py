"""One `run` from the first word to the exit code: signals, edits while it runs, the last words."""

import sys
import time

from warpsim.cli.outcome import Exit, Failure, print_json
from warpsim.cli.progress import PlainLines
from warpsim.cli.scenes import WATCH_PERIOD, SceneFile
from warpsim.interruption import Interruption
from warpsim.observers.recorder import OccupiedFolder
from warpsim.runner import NoSuchDevice, Outcome, Settings, run_scene

EXITS = {"done": Exit.OK, "interrupted": Exit.INTERRUPTED, "unstable": Exit.UNSTABLE}


def run_session(source: SceneFile, settings: Settings, audience: PlainLines, watch: bool, json: bool) -> Exit:
    """Run the scene, again after every edit if it is watched, and return the exit code."""
    with Interruption() as stop:
        scene = source.load()
        while scene:
            outcome = _run_once(scene, settings, audience, stop)
            _tell(outcome, settings, audience)
            scene = _next_scene(outcome, source, audience, stop) if watch else None
    if json:
        print_json(_result(source.scene, settings, outcome))
    return EXITS[outcome.kind]


def _run_once(scene, settings: Settings, audience: PlainLines, stop: Interruption) -> Outcome:
    try:
        stop.patient = False
        outcome = run_scene(scene, settings, audience, stop)
        audience.end(outcome.report)
        return outcome
    except OccupiedFolder as error:
        raise Failure(Exit.INPUT_OUTPUT, str(error)) from None
    except NoSuchDevice as error:
        raise Failure(Exit.USAGE, str(error)) from None
    finally:
        audience.end()  # the terminal must be whole again before anyone speaks


def _next_scene(outcome: Outcome, source: SceneFile, audience: PlainLines, stop: Interruption):
    """Return the edited scene of a watched run; None if the run was ended by a signal."""
    if outcome.kind == "unstable":
        audience.note("waiting for an edit of the scene")
        while not source.edited() and not stop.requested:
            time.sleep(WATCH_PERIOD)
    if stop.requested:
        return None
    audience.note("the scene has changed: starting again")
    return source.scene


def _tell(outcome: Outcome, settings: Settings, audience: PlainLines) -> None:
    """Say how a run ended, if it was not simply done."""
    report = outcome.report
    for name, numbers in report.statistics.items() if report else ():
        if numbers["refused"]:
            audience.note(f"{name}: {numbers['refused']} births were refused for lack of room (systems.{name}.capacity)")
    if report and settings.record:
        audience.note(f"recorded frames 0 to {report.index} in {settings.record}")
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
