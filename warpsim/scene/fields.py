"""The format seen from its models: which keys a place has, what a value there may be, its unit, default and range.

`validate` walks it to word its messages, `--set` to find its place, `info` and the reference to describe a field.
"""

import re
from dataclasses import dataclass, replace
from functools import cache
from types import NoneType, UnionType
from typing import Annotated, Any, Literal, Union, get_args, get_origin

import annotated_types
from pydantic import Tag
from pydantic.fields import FieldInfo
from pydantic_core import PydanticUndefined

from warpsim.scene.base import Floor, ShortSpec, Spec, is_tag, tag
from warpsim.scene.nearest import nearest
from warpsim.scene.problems import Problem, UnknownFieldError

_LIMITS = {"gt": annotated_types.Gt, "ge": annotated_types.Ge, "lt": annotated_types.Lt, "le": annotated_types.Le}
_UNIT = re.compile(r"\s*\[([^\[\]]+)\]\.?$")


@dataclass(frozen=True)
class Slot:
    """A place in the format: what may stand there."""

    annotation: Any
    metadata: tuple[Any, ...] = ()
    field: FieldInfo | None = None
    unit: str | None = None
    """SI unit, "1" for none; None where the value is no quantity."""

    @property
    def prose(self) -> str:
        """The description without its unit."""
        return _UNIT.sub(".", self.field.description or "") if self.field else ""

    @property
    def required(self) -> bool:
        """Whether the key must be given."""
        # A kind's own `type` has a default for Python's sake; in a scene it tells the kinds apart.
        return self.field is not None and (self.field.is_required() or get_args(self.annotation) == (self.field.default,))


@cache
def keys_of(spec: type[Spec]) -> dict[str, Slot]:
    """Return the keys of a spec class as they are written in YAML."""
    slots = {}
    for name, field in spec.model_fields.items():
        match = _UNIT.search(field.description or "")
        slots[field.alias or name] = Slot(field.annotation, tuple(field.metadata), field, match.group(1) if match else None)
    return slots


def forms(slot: Slot) -> list[tuple[str | None, Slot]]:
    """Return what may stand at a slot, one entry per member of a union, with the member's tag; null is left out."""
    annotation = slot.annotation
    origin = get_origin(annotation)
    if origin is Annotated:
        base, *metadata = get_args(annotation)
        found = next((item.tag for item in metadata if isinstance(item, Tag)), None)
        inner = forms(replace(slot, annotation=base, metadata=(*metadata, *slot.metadata)))
        return [(found or word, form) for word, form in inner]
    if origin in (Union, UnionType):
        return [form for member in get_args(annotation) if member is not NoneType for form in forms(replace(slot, annotation=member))]
    return [(None, slot)]


def spec_of(slot: Slot) -> type[Spec] | None:
    """Return the spec class of a slot that is one."""
    return slot.annotation if isinstance(slot.annotation, type) and issubclass(slot.annotation, Spec) else None


def specs_of(slot: Slot) -> list[type[Spec]]:
    """Return every spec class that may stand at a slot."""
    return [spec for _, form in forms(slot) if (spec := spec_of(form))]


def types_of(slot: Slot) -> dict[str, type[Spec]]:
    """Return the spec classes of a slot by the word that `type:` takes, empty where `type` does not tell them apart."""
    return {spec.model_fields["type"].default: spec for spec in specs_of(slot) if "type" in spec.model_fields}


def item_of(slot: Slot, index: int = 0) -> Slot | None:
    """Return the slot of an entry of a list, or of a mapping with free keys."""
    for _, form in forms(slot):
        origin, args = get_origin(form.annotation), get_args(form.annotation)
        if origin is tuple:
            if len(args) == 2 and args[1] is Ellipsis:
                return Slot(args[0], unit=form.unit)
            return Slot(args[index], unit=form.unit) if 0 <= index < len(args) else None
        if origin is dict:
            return Slot(args[1], unit=form.unit)
    return None


def has_free_keys(slot: Slot) -> bool:
    """Tell whether the keys of a slot are names that the user chooses."""
    return any(get_origin(form.annotation) is dict for _, form in forms(slot))


def fixed_length(slot: Slot) -> int | None:
    """Return how many entries a list of fixed length has."""
    for _, form in forms(slot):
        args = get_args(form.annotation)
        if get_origin(form.annotation) is tuple and Ellipsis not in args:
            return len(args)
    return None


def is_list(slot: Slot) -> bool:
    """Tell whether a list of any length may stand at a slot."""
    return any(get_origin(form.annotation) is tuple and Ellipsis in get_args(form.annotation) for _, form in forms(slot))


def child_of(slot: Slot, part: str | int) -> Slot | None:
    """Follow one part of a pydantic error's path: a union's tag, a key or an index."""
    if isinstance(part, str) and is_tag(part):
        chosen = [form for word, form in forms(slot) if word == part]
        return chosen[0] if chosen else slot
    if isinstance(part, int):
        return item_of(slot, part)
    for spec in specs_of(slot):
        if part in keys_of(spec):
            child = keys_of(spec)[part]
            return child if child.unit or not slot.unit else replace(child, unit=slot.unit)
    return item_of(slot) if has_free_keys(slot) else None


def choices_of(slot: Slot) -> tuple[Any, ...]:
    """Return the words a slot takes, empty where it takes other values, too."""
    found = [get_args(form.annotation) for _, form in forms(slot) if get_origin(form.annotation) is Literal]
    return found[0] if found and len(forms(slot)) == 1 else ()


def bounds_of(slot: Slot) -> dict[str, float]:
    """Return the range of a number: any of "gt", "ge", "lt", "le"."""
    limits = [limit for item in slot.metadata for limit in (item.metadata if isinstance(item, FieldInfo) else [item])]
    found = {word: getattr(limit, word) for limit in limits for word, kind in _LIMITS.items() if isinstance(limit, kind)}
    for floor in (item for item in slot.metadata if isinstance(item, Floor)):
        found.pop("ge", None)
        found |= {word: bound for word, bound in (("ge", floor.ge), ("gt", floor.gt)) if bound is not None}
    return found


def number_bounds_of(slot: Slot) -> dict[str, float]:
    """Return the range of a number that may stand at a slot, beside a list or a mapping, say."""
    return bounds_of(slot) or next((bounds for _, form in forms(slot) if (bounds := bounds_of(form))), {})


@dataclass(frozen=True)
class FieldDescription:
    """What `info` says of one field."""

    path: str
    prose: str
    expected: str
    """What may stand there, in words."""
    unit: str | None
    required: bool
    default: Any
    """Plain value as in YAML; None where there is none."""
    minimum: float | None
    minimum_excluded: bool
    maximum: float | None
    choices: tuple[Any, ...]
    keys: tuple[str, ...]
    """Keys below, for a mapping."""
    types: tuple[str, ...]
    """Words for `type`, where several kinds may stand."""


def scene_slot() -> Slot:
    """Return the slot of a whole scene."""
    from warpsim.scene.scene import Scene  # the models import nothing from here; this keeps it one way

    return Slot(Scene)


def describe_field(path: str) -> FieldDescription:
    """Describe a field: its unit, default, range and prose.

    The path is dotted; a kind (`flow.vortex.circulation`), a name, an index, or nothing (`flow.circulation`) stands for an entry of a list.
    Raises UnknownFieldError with the nearest key.
    """
    slot, walked = scene_slot(), []
    for part in filter(None, path.split(".")):
        slot = _follow(slot, part, walked)
        walked.append(part)
    return _describe(path, slot)


def _follow(slot: Slot, part: str, walked: list[str]) -> Slot:
    entry = False
    for _ in range(3):
        if part in types_of(slot):
            return next(form for word, form in forms(slot) if word in (tag(part), None))
        if part in _known_keys(slot):
            return next(child_of(Slot(spec, unit=slot.unit), part) for spec in specs_of(slot) if part in keys_of(spec))
        item = item_of(slot)
        if item is None:
            break
        slot, entry = item, True
    allowed = [*(types_of(slot) if len(types_of(slot)) > 1 else ()), *_known_keys(slot)]
    # For an entry of a list its number or name may stand: any word that is not nearly a known one.
    if entry and (part.isdigit() or nearest(part, allowed) is None):
        return slot
    where = ".".join(walked) or "a scene"
    message = f'{where} has no field "{part}" (known: {", ".join(allowed) or "none, it is a plain value"})'
    raise UnknownFieldError([Problem(message, path=".".join([*walked, part]), suggestion=nearest(part, allowed))])


def _known_keys(slot: Slot) -> list[str]:
    return list(dict.fromkeys(key for spec in specs_of(slot) for key in keys_of(spec)))


def _describe(path: str, slot: Slot) -> FieldDescription:
    from warpsim.scene.phrases import in_words

    specs = specs_of(slot)
    kinds = types_of(slot) or types_of(item_of(slot) or slot)
    number = number_bounds_of(slot)
    keys = keys_of(specs[0]) if len(specs) == 1 else {}
    prose = slot.prose or (specs[0].__doc__ or "" if len(specs) == 1 else "")
    return FieldDescription(
        path=path,
        prose=prose.strip().splitlines()[0] if prose.strip() else "",
        expected=in_words(slot),
        unit=slot.unit,
        required=slot.required,
        default=default_of(slot),
        minimum=number.get("ge", number.get("gt")),
        minimum_excluded="gt" in number,
        maximum=number.get("le", number.get("lt")),
        choices=choices_of(slot),
        keys=tuple(keys),
        types=tuple(kinds) if len(kinds) > 1 else (),
    )


def default_of(slot: Slot) -> Any:
    """Return a slot's default as it would be written in YAML, None where there is none."""
    default = slot.field.get_default(call_default_factory=True) if slot.field else PydanticUndefined
    if default is PydanticUndefined:
        return None
    return plain(default)


def plain(value: Any) -> Any:
    """Return a spec's values as YAML would have them, the shortest form that means the same."""
    if isinstance(value, Spec):
        dumped = value.model_dump(mode="json", by_alias=True, exclude_defaults=True)
        if isinstance(value, ShortSpec) and set(dumped) == {value.shorthand}:
            dumped = dumped[value.shorthand]
            if isinstance(dumped, list) and len(dumped) == 1 and dumped[0][0] == 0.0:
                return dumped[0][1]
        return dumped
    return [plain(item) for item in value] if isinstance(value, tuple) else value
