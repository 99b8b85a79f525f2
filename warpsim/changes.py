"""Changes while a scene runs: which numbers may change without building it anew, and the log that makes such a run repeatable."""

from dataclasses import dataclass
from typing import Any

from pydantic import BaseModel

from warpsim.scene import Scene
from warpsim.scene.assets import assets_of
from warpsim.scene.loader import load_text
from warpsim.scene.resolved import resolved_yaml
from warpsim.scene.strengths import Formula, Keyframes, Sine

# What arrays, graphs and identities are built from.
FIXED = frozenset(
    (
        "name description seed fps substeps prewarm capacity count motion solver type interval start stop burst feels memory law model "
        "fill answers octaves max_substeps action side min_speed points springs generator pins iterations resolution corner edges "
        "triangles chains part"
    ).split()
)


@dataclass(frozen=True)
class Change:
    """One change of a running scene: before the step from frame `index`, the number at `path` became `value` (YAML text)."""

    index: int
    path: str
    value: str


class FixedField(ValueError):
    """This field cannot change while the scene runs."""


def changed_scene(scene: Scene, path: str, value: str) -> Scene:
    """Return the scene with one number changed. Raises SceneError if the change is not valid, FixedField if it needs a new start."""
    folder = next((asset.folder for asset in assets_of(scene)), None)
    fresh = load_text(resolved_yaml(scene), "the running scene", overrides=[f"{path}={value}"], folder=folder)
    obstacle = difference(scene, fresh, ())
    if obstacle:
        raise FixedField(f"{obstacle} cannot change while the scene runs: restart it with --set {path}={value}")
    return fresh


def difference(old: Any, new: Any, path: tuple[str, ...]) -> str | None:
    """Return the path of the first difference that is more than a number's, None if there is none."""
    where = ".".join(path) or "the scene"
    if isinstance(old, Keyframes | Sine | Formula) and isinstance(new, int | float):
        return None  # a strength that varied is held by hand now
    if isinstance(old, bool) or isinstance(new, bool) or isinstance(old, str) or old is None or new is None:
        return None if type(old) is type(new) and (old == new or _is_text(path)) else where
    if isinstance(old, int | float) and isinstance(new, int | float):
        return where if old != new and path and path[-1] in FIXED else None
    if type(old) is not type(new):
        return where
    if isinstance(old, BaseModel):
        pairs = [(name, getattr(old, name), getattr(new, name)) for name in type(old).model_fields]
    elif isinstance(old, dict):
        if list(old) != list(new):
            return where
        pairs = [(key, old[key], new[key]) for key in old]
    else:
        if len(old) != len(new):
            return where
        pairs = [(str(k), a, b) for k, (a, b) in enumerate(zip(old, new, strict=True))]
    for name, a, b in pairs:
        if name in FIXED and a != b and not (name == "start" and _is_place(a)):
            return ".".join([*path, name])
        if found := difference(a, b, (*path, name)):
            return found
    return None


def _is_place(value: Any) -> bool:
    """Whether this is a point: the `start` of a segment is one, an emitter's is a time."""
    return isinstance(value, tuple) and len(value) == 3 and all(isinstance(component, int | float) for component in value)


def _is_text(path: tuple[str, ...]) -> bool:
    """Whether text may change here: nowhere but in the fields that only the eye sees."""
    return "look" in path or "camera" in path
