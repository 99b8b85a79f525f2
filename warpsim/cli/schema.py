"""schema: the JSON schema of a scene, for editors."""

from pathlib import Path
from typing import Annotated

import typer


def schema(
    out: Annotated[Path | None, typer.Option("--out", metavar="FILE", help="Write it there instead of printing it.")] = None,
) -> None:
    """Print the JSON schema of a scene: names, units, bounds, defaults and prose for every field."""
    text = schema_text()
    if out is None:
        print(text, end="")
        return
    from warpsim.files import write_text

    write_text(out, text)


def schema_text() -> str:
    """Return the schema as JSON text."""
    import json

    from warpsim.scene import json_schema

    return json.dumps(json_schema(), indent=2) + "\n"
