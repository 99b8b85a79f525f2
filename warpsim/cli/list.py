"""list: the shipped scenes."""

import typer

from warpsim.cli.validate import JSON


def list_scenes(json: JSON = False) -> None:
    """List the shipped scenes."""
    from warpsim.cli.outcome import print_json
    from warpsim.scene import load_scene, shipped_scenes

    scenes = [(name, path, load_scene(path)) for name, path in sorted(shipped_scenes().items())]
    if json:
        print_json([{"scene": n, "name": s.name, "description": s.description, "file": str(path)} for n, path, s in scenes])
        return
    width = max((len(name) for name, _, _ in scenes), default=0)
    for name, _, scene in scenes:
        typer.echo(f"{name:<{width}}  {_first_sentence(scene.description) or scene.name}")


def _first_sentence(text: str) -> str:
    return " ".join(text.split()).partition(". ")[0]
