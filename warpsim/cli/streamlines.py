"""streamlines: lines of a scene's flow as data."""

import sys
from pathlib import Path
from typing import Annotated

import typer

from warpsim.cli.run import DEVICE
from warpsim.cli.validate import JSON

MOST_LINES = 10_000
MOST_POINTS = 2_000_000


def streamlines(
    scene: Annotated[str, typer.Argument(metavar="SCENE", help="A scene file or the name of a shipped scene.")],
    out: Annotated[Path, typer.Option("--out", metavar="FILE", help="Where to write them: a .npz, .csv or .json file.")],
    time: Annotated[float, typer.Option(metavar="T", help="Moment at which the flow is frozen [s].")] = 0.0,
    count: Annotated[int, typer.Option(min=1, max=MOST_LINES, metavar="N", help="How many, spread over what the camera sees.")] = 60,
    places: Annotated[
        list[str] | None, typer.Option("--through", metavar="X,Y,Z", help="A place that a line passes, instead of --count. Repeatable.")
    ] = None,
    length: Annotated[float | None, typer.Option(metavar="L", help="Length of each [m]; default: half of what the camera sees.")] = None,
    steps: Annotated[int, typer.Option(min=2, max=100_000, metavar="N", help="Steps along each.")] = 100,
    device: Annotated[str, typer.Option(metavar="auto|cpu|cuda:N", help="Where to compute.")] = "auto",
    overrides: Annotated[list[str] | None, typer.Option("--set", metavar="PATH=VALUE", help="Change a value. Repeatable.")] = None,
    json: JSON = False,
) -> int:
    """Write streamlines of a scene's flow as data: places and velocities."""
    from warpsim.cli.outcome import Exit, Failure, print_json
    from warpsim.cli.scenes import found

    if not DEVICE.fullmatch(device):
        raise Failure(Exit.USAGE, f"--device {device}: say auto, cpu, cuda or cuda:N")
    if out.suffix.lower() not in (".npz", ".csv", ".json"):
        raise Failure(Exit.USAGE, f"--out {out}: the name must end in .npz, .csv or .json")
    if not -1e7 <= time <= 1e7 or not (length is None or 0.0 < length <= 1e9):
        raise Failure(Exit.USAGE, "--time must be from -1e7 to 1e7 s, --length above 0 and at most 1e9 m")
    points = [_place(text) for text in places or []]
    lines = (len(points) or count) * (steps + 1)
    if lines > MOST_POINTS:
        raise Failure(Exit.USAGE, f"{lines} points are too many: at most {MOST_POINTS} (--count times --steps)")
    from warpsim.scene import load_scene
    from warpsim.scene.placing import placed_in

    loaded = load_scene(found(scene), overrides=overrides or [])
    with placed_in(found(scene), overrides or []):
        made = _lines(loaded, points, count, length, steps, time, device)
    from warpsim.streamlines import write_lines

    write_lines(out, made)
    if json:
        line_count, point_count, _ = made.position.shape
        print_json({"scene": loaded.name, "file": str(out), "time": time, "lines": line_count, "points": point_count})
    else:
        print(f"{made.position.shape[0]} streamlines of {made.position.shape[1]} points are in {out}")
    return Exit.OK


def _place(text: str) -> tuple[float, ...]:
    """Return the place that --through names. Raises Failure (usage)."""
    from warpsim.cli.outcome import Exit, Failure

    try:
        place = tuple(float(part) for part in text.split(","))
    except ValueError:
        place = ()
    if len(place) != 3 or not all(abs(x) <= 1e9 for x in place):
        raise Failure(Exit.USAGE, f"--through {text}: say three numbers [m], as in 0,1.5,-2")
    return place


def _lines(scene, points, count: int, length: float | None, steps: int, time: float, device: str):
    """Return the lines; the flow is built without the scene's systems. Raises Failure, SceneError."""
    import numpy as np

    from warpsim.cli.outcome import Exit, Failure
    from warpsim.cli.progress import PlainLines
    from warpsim.runner import NoSuchDevice, built, ready_device

    audience = PlainLines(sys.stderr)
    try:
        name = ready_device(device, audience)
    except NoSuchDevice as error:
        raise Failure(Exit.USAGE, str(error)) from None
    from warpsim.simulation import Simulation
    from warpsim.streamlines import lines_of, region, seeds

    still = scene.model_copy(update={"systems": {}, "verify": (), "time": scene.time.model_copy(update={"prewarm": 0.0})})
    starts = np.array(points) if points else seeds(scene, count)
    length = region(scene)[1] if length is None else length
    lines = built(lambda: lines_of(Simulation(still, name).flow, starts, length, steps, time), audience)
    if not (np.isfinite(lines.position).all() and np.isfinite(lines.velocity).all()):
        raise Failure(Exit.UNSTABLE, f"the flow is not finite somewhere along the streamlines at t = {time:g} s: nothing is written")
    return lines
