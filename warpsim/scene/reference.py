"""The reference of the scene format, written from the models: `python -m warpsim.scene.reference > docs/scene.md`."""

from typing import Any

import yaml

from warpsim.scene.base import ShortSpec, Spec
from warpsim.scene.camera import Camera
from warpsim.scene.cloth import Cloth, SpringKind
from warpsim.scene.colliders import Collider, Course, Motion
from warpsim.scene.emitters import Burst, Distribution, Emitter, EmitterShape, Rate, Velocity
from warpsim.scene.expressions import DEEPEST_STACK, FUNCTIONS, LONGEST_PROGRAM
from warpsim.scene.fields import Slot, bounds_of, choices_of, default_of, forms, keys_of
from warpsim.scene.flocks import Attends, Domain, Flock, FlockColor, FlockLook, Perception, Rule, Start, Vicsek
from warpsim.scene.flow import Core, FlowPrimitive
from warpsim.scene.forces import Force
from warpsim.scene.generators import Generator
from warpsim.scene.look import ColorBy, ColorRamp, Look, Ramp, Trail
from warpsim.scene.obstacles import Obstacle
from warpsim.scene.oracles import Oracle, Tolerance
from warpsim.scene.particles import Drag, Feels, Particles, StokesDrag
from warpsim.scene.phrases import in_words, range_in_words
from warpsim.scene.scene import Limits, Scene
from warpsim.scene.springs import NetworkLook, PinMotion, Springs
from warpsim.scene.steering import Behavior
from warpsim.scene.strengths import Formula, Keyframes, Sine, SineWave
from warpsim.scene.timing import Time
from warpsim.scene.viewing import Control, Viewing

_HEAD = """# Scene reference

Written from the models by `python -m warpsim.scene.reference > docs/scene.md`; do not edit. `python -m warpsim info flow.vortex.core` says
the same of one field, `python -m warpsim schema` gives the JSON schema for editors.

A scene is YAML 1.2: `1e-3` is a number, `no` is text, unknown and duplicate keys are mistakes, tags are refused. SI units throughout, y is
up. A file has at most 1 MiB, 64 levels, 200 000 values and 1 000 aliases.
"""

_PARTS: tuple[tuple[str, str, tuple[type[Spec], ...]], ...] = (
    ("Scene", "The top level.", (Scene, Time, Limits, Camera, Viewing, Control)),
    ("Flow", "Entries of `flow`, told apart by `type`; their velocities add up.", (FlowPrimitive, Core)),
    ("Obstacles", "Entries of `obstacles`, told apart by `type`; the flow goes round them.", (Obstacle,)),
    ("Forces", "Entries of `forces`, told apart by `type`.", (Force,)),
    ("Colliders", "Entries of `colliders`, told apart by `type`.", (Collider, Motion, Course)),
    ("Particles", "Entries of `systems` with `type: particles`.", (Particles, Feels, Drag, StokesDrag)),
    ("Springs", "Entries of `systems` with `type: springs`: points joined by damped springs.", (Springs, PinMotion, NetworkLook)),
    ("Cloth", "Entries of `systems` with `type: cloth`; `look` and `pin_motion` as for springs.", (Cloth, SpringKind)),
    ("Generators", "What `generator` may be, told apart by `type`.", (Generator,)),
    (
        "Flocks",
        "Entries of `systems` with `type: flock`.",
        (Flock, Domain, Perception, Rule, Attends, Start, Vicsek, FlockLook, FlockColor),
    ),
    ("Steering", "Entries of `steering` of a flock, told apart by `type`.", (Behavior,)),
    ("Emitters", "Entries of `emitters`.", (Emitter, Rate, Burst, Velocity, Distribution)),
    ("Emitter shapes", "What `shape` may be, told apart by `type`.", (EmitterShape,)),
    ("Look", "How particles are drawn.", (Look, Ramp, ColorRamp, ColorBy, Trail)),
    ("Oracles", "Entries of `verify`, told apart by `type`; [verify.md](verify.md) says how each is measured.", (Oracle, Tolerance)),
    ("Strengths", "A strength is a number or one of these mappings; t is in seconds.", (Keyframes, Sine, SineWave, Formula)),
)


def scene_reference() -> str:
    """Return the whole reference as Markdown."""
    parts = [_HEAD]
    for title, lead, specs in _PARTS:
        parts.append(f"## {title}\n\n{lead}\n")
        for spec in specs:
            parts += [_section(member) for member in (spec.__subclasses__() if _is_family(spec) else [spec])]
    parts.append(_expressions())
    return "\n".join(parts)


def _is_family(spec: type[Spec]) -> bool:
    """Tell whether a spec stands for its subclasses, which are told apart by `type`."""
    return "type" not in spec.model_fields and any("type" in one.model_fields for one in spec.__subclasses__())


def _section(spec: type[Spec]) -> str:
    kind = spec.model_fields["type"].default if "type" in spec.model_fields else None
    title = f"`{kind}`" if kind else spec.__name__
    lines = [f"### {title}", "", " ".join((spec.__doc__ or "").split()), ""]
    if issubclass(spec, ShortSpec):
        lines += [f"Short for `{{{spec.shorthand}: …}}`: the bare value.", ""]
    lines += ["| key | value | default | meaning |", "|---|---|---|---|"]
    # What all kinds of a family have comes with them in any order; a reader looks for these two first.
    rows = sorted(keys_of(spec).items(), key=lambda row: {"name": 0, "type": 1}.get(row[0], 2))
    lines += [_row(key, slot) for key, slot in rows]
    return "\n".join(lines) + "\n"


def _row(key: str, slot: Slot) -> str:
    return "| " + " | ".join(_cell(text) for text in (f"`{key}`", _value(slot), _default(slot), slot.prose)) + " |"


def _cell(text: str) -> str:
    return text.replace("|", "\\|").replace("\n", " ")


def _value(slot: Slot) -> str:
    choices = choices_of(slot)
    if choices:
        return ", ".join(f"`{choice}`" for choice in choices)
    limits = range_in_words(Slot(slot.annotation, slot.metadata)) if len(forms(slot)) == 1 or bounds_of(slot) else ""
    unit = f" [{slot.unit}]" if slot.unit else ""
    return in_words(slot) + (f", {limits}" if limits else "") + unit


def _default(slot: Slot) -> str:
    if slot.required:
        return "**required**"
    default = default_of(slot)
    return "–" if default is None or default in ([], {}, "", ()) else f"`{_written(default)}`"


def _written(value: Any) -> str:
    if isinstance(value, (tuple, list)):
        return "[" + ", ".join(_written(item) for item in value) + "]"
    if isinstance(value, float):
        return f"{value:g}"
    return yaml.safe_dump(value, default_flow_style=True).splitlines()[0]


def _expressions() -> str:
    rows = "\n".join(f"| `{meaning.split('), ')[0].split(')')[0]})` | {meaning.split('), ', 1)[1]} |" for meaning in _meanings())
    return f"""## Expressions

`{{expression: "2 + sin(2*pi*t)"}}`: numbers, `t` in seconds, `pi`, `e`, `+ - * /`, parentheses, the functions below, and `^` (or `**`),
which binds tightest and to the right, so that `-t^2` is `-(t^2)`. In the `velocity` of a flow of type `expression` also `x`, `y` and `z` in
meters. At most {LONGEST_PROGRAM} numbers, names and operations, of which at most {DEEPEST_STACK} wait for their operation.

| function | value |
|---|---|
{rows}
"""


def _meanings() -> list[str]:
    return [meaning if "), " in meaning else f"{meaning}, {name}" for name, meaning in FUNCTIONS.items()]


if __name__ == "__main__":
    print(scene_reference(), end="")
