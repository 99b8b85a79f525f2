"""converge: errors against step for every method, and the orders that they show."""

import sys
from pathlib import Path
from typing import Annotated

import typer

from warpsim.cli.validate import JSON


def converge(
    scene: Annotated[str, typer.Argument(metavar="SCENE", help="Scene file or name of a shipped scene.")],
    system: Annotated[str | None, typer.Option("--system", metavar="NAME", help="System to follow; default: the first that suits.")] = None,
    solver: Annotated[
        list[str] | None, typer.Option("--solver", metavar="NAME", help="Method to measure; default: all. Repeatable.")
    ] = None,
    steps: Annotated[int, typer.Option("--steps", min=1, max=10_000, help="Steps of the coarsest path over the scene's duration.")] = 50,
    rungs: Annotated[int, typer.Option("--rungs", min=2, max=12, help="How many steps are tried, each half as long.")] = 8,
    plot: Annotated[
        Path | None, typer.Option("--plot", metavar="FILE.png", help="Draw errors over steps; the name says the format.")
    ] = None,
    changes: Annotated[
        list[str] | None, typer.Option("--set", metavar="PATH=VALUE", help="Change a value of the scene. Repeatable.")
    ] = None,
    json: JSON = False,
) -> int:
    """Measure every method on one particle of a scene: errors against step in 64 bits and in 32, and the orders that they show."""
    from warpsim.cli.outcome import Exit, Failure, print_json
    from warpsim.cli.scenes import found

    draw = _pen(plot) if plot else None
    from warpsim.cli.progress import PlainLines
    from warpsim.convergence import study
    from warpsim.runner import built, ready_device
    from warpsim.scene import load_scene

    loaded = load_scene(found(scene), overrides=tuple(changes or ()))
    audience = PlainLines(sys.stderr)
    ready_device("cpu", audience)
    try:
        result = built(lambda: study(loaded, system, solver, steps, rungs), audience)
    except ValueError as error:
        raise Failure(Exit.USAGE, str(error)) from None
    if draw:
        draw(result, plot, loaded.name)
    if json:
        print_json(_plain(result))
        return Exit.OK
    _print(result)
    if plot:
        typer.echo(f"drawn: {plot}")
    return Exit.OK


def _pen(plot: Path):
    """Return what draws, before anything is computed. Raises Failure where it is missing, or the file's folder is."""
    from warpsim.cli.outcome import Exit, Failure

    if plot.suffix.lower() not in (".png", ".svg", ".pdf"):
        raise Failure(Exit.USAGE, f"--plot {plot}: the name ends in .png, .svg or .pdf, which says the format")
    if not plot.absolute().parent.is_dir():
        raise Failure(Exit.INPUT_OUTPUT, f"--plot {plot}: there is no folder {plot.absolute().parent}")
    try:
        from warpsim.plotting import draw_study
    except ModuleNotFoundError as error:
        if error.name is None or error.name.split(".")[0] != "matplotlib":
            raise
        raise Failure(Exit.INPUT_OUTPUT, "--plot needs matplotlib: pip install 'warpsim[plot]'") from None
    return draw_study


def _print(study) -> None:
    """Print the table: a row per method and precision."""
    form = "x' = u (tracers)" if study.form == "first-order" else "x' = v, v' = forces"
    typer.echo(f"{study.system}: largest distance from the exact path in {study.duration:g} s [m]; {form}\n")
    typer.echo(f"{'step [s]':<27}" + "".join(f"{step:>9.3g}" for step in study.steps) + "  order  theory")
    for method in study.methods:
        order = "    -" if method.order is None else f"{method.order:5.2f}"
        typer.echo(f"{method.solver:<20}64 bit" + " " + "".join(map(_number, method.errors)) + f"  {order}  {method.theory:>6}")
        typer.echo(f"{'':<20}32 bit" + " " + "".join(map(_number, method.errors32)))
    if any(method.order is None for method in study.methods):
        typer.echo("\n-: no order to see; the method is exact here, or all steps are too long for it (inf: it left the finite world)")


def _number(error: float) -> str:
    return f"{error:>9.1e}" if error < float("inf") else f"{'inf':>9}"


def _plain(study) -> dict[str, object]:
    """Return the study as data; what is not finite is null."""
    from dataclasses import asdict

    data = asdict(study)
    for method in data["methods"]:
        for key in ("errors", "errors32"):
            method[key] = [error if error < float("inf") else None for error in method[key]]
    return data
