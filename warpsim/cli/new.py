"""new: a commented starter scene with its schema beside it."""

from pathlib import Path
from typing import Annotated

import typer

SCHEMA_NAME = "scene.schema.json"
STARTER = """\
# yaml-language-server: $schema=scene.schema.json
# A scene of warpsim. Lengths are in meters, times in seconds, masses in kilograms; y is up.
# Run it:    python -m warpsim run THIS_FILE --watch       (save the file: the run starts again with what you changed)
# Ask:       python -m warpsim info systems.sparks.emitters.0.rate     (unit, default and range of any field)
name: {name}
seed: 1                                   # same seed, same run, bit for bit
time: {{fps: 60, substeps: 4, duration: 8.0}}
gravity: [0, -9.81, 0]                    # m/s^2

flow:                                     # velocity fields; they add up
  - {{name: wind, type: uniform, velocity: [0.5, 0, 0]}}                               # m/s
  - {{name: swirl, type: vortex, center: [0, 0, 0], axis: [0, 1, 0], circulation: 1.5,
     core: {{model: lamb_oseen, radius: 0.2}}}}                                        # m^2/s, m

systems:
  sparks:
    type: particles
    capacity: 20000                       # births beyond it are refused, and reported
    coupling: {{alpha: 0.001}}              # drag towards the flow, kg/s; or the word: tracer
    emitters:
      - shape: {{type: disc, center: [0, 0, 0], normal: [0, 1, 0], radius: 0.2}}
        rate: {{mean: 3000, spread: 500}}   # particles per second
        velocity: {{direction: [0, 1, 0], cone: 15, speed: {{mean: 5.0, spread: 0.5}}}}  # half-angle in degrees, m/s
        lifetime: {{mean: 0.9, spread: 0.3}}
        mass: 1.0e-3
    look:
      as: sprites                         # or points
      blend: additive                     # or alpha
      size: 0.03                          # m; or over_life, like the color
      color: {{over_life: [[0, "#fff2a0"], [0.5, "#ff7a18"], [1, "#ff300000"]]}}

controls: [gravity.1, flow.swirl.circulation, systems.sparks.emitters.0.rate]   # sliders in the viewer
camera: {{eye: [2, 1.4, 3], target: [0.1, 0.6, 0], field_of_view: 45}}
"""


def new(file: Annotated[Path, typer.Argument(metavar="FILE", help="The scene file to write; it must not exist yet.")]) -> int:
    """Write a commented starter scene, with the JSON schema beside it for editors."""
    from warpsim.cli.outcome import Exit, Failure
    from warpsim.cli.schema import schema_text
    from warpsim.files import write_text

    if file.exists() or file.is_symlink():
        raise Failure(Exit.INPUT_OUTPUT, f"{file} exists already and is left as it is: choose another name")
    name = " ".join(file.stem.replace("_", " ").replace("-", " ").split()).capitalize()
    text, schema, schema_file = STARTER.format(name=_quoted(name or "Scene")), schema_text(), file.parent / SCHEMA_NAME
    if schema_file.exists() and schema_file.read_text(encoding="utf-8", errors="replace") != schema:
        typer.echo(f"{schema_file} exists already and differs; it is left as it is (renew it: warpsim schema --out {schema_file})")
    else:
        write_text(schema_file, schema)
    write_text(file, text)
    typer.echo(f"wrote {file}; now: python -m warpsim run {file}")
    return Exit.OK


def _quoted(name: str) -> str:
    import json

    return json.dumps(name, ensure_ascii=False)  # a JSON string is a YAML string
