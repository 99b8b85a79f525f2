"""info: one scene, or one field of scenes with its unit, default and range."""

from typing import Annotated

import typer

from warpsim.cli.validate import JSON


def info(
    name: Annotated[str, typer.Argument(metavar="NAME", help="A scene, or the path of a field: systems.particles.capacity.")],
    json: JSON = False,
) -> int:
    """Tell about a scene, or about one field: unit, default, range."""
    from warpsim.cli.outcome import Exit, print_json

    told = _scene(name) or _field(name)
    if json:
        print_json(told)
    else:
        for key, value in told.items():
            typer.echo(f"{key + ':':<14}{value}")
    return Exit.OK


def _scene(name):
    return {}


def _field(name):
    return {}
