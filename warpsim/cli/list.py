"""list: the shipped scenes."""

from pathlib import Path

import typer

from warpsim.cli.validate import JSON


def list_scenes(json: JSON = False) -> None:
    """List the shipped scenes."""
    from warpsim.cli.outcome import print_json
    from warpsim.scene import shipped_scenes

    scenes = [{"scene": name, **_title(path), "file": str(path)} for name, path in sorted(shipped_scenes().items())]
    if json:
        print_json(scenes)
        return
    width = max((len(scene["scene"]) for scene in scenes), default=0)
    for scene in scenes:
        typer.echo(f"{scene['scene']:<{width}}  {_first_sentence(scene['description']) or scene['name']}")


def _title(path: Path) -> dict[str, str]:
    """Return name and description as the file has them. They are read, not validated: a list of a hundred scenes must be quick."""
    from warpsim.scene.yaml12 import decode, parse

    root, _ = parse(decode(path.read_bytes(), str(path)), str(path))
    facts = root.data()
    return {key: str(facts.get(key, "")) for key in ("name", "description")}


def _first_sentence(text: str) -> str:
    return " ".join(text.split()).partition(". ")[0]
