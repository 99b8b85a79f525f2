"""A scene written out in full, defaults and all: loading it gives an equal Scene."""

from typing import Any

import yaml

from warpsim.scene.base import ShortSpec, Spec
from warpsim.scene.scene import Scene

_PLAIN_LINE = 140


def resolved_yaml(scene: Scene) -> str:
    """Return the YAML text of a scene with every value in effect."""
    return yaml.dump(as_plain(scene), Dumper=_Dumper, sort_keys=False, allow_unicode=True, width=_PLAIN_LINE, default_flow_style=None)


def as_plain(value: Any) -> Any:
    """Return a spec as dicts, lists and numbers in the order a reader expects: name and type first; fields without a value left out."""
    if isinstance(value, Spec):
        dumped = value.model_dump(mode="json", by_alias=True) if isinstance(value, ShortSpec) else None
        if dumped is not None and value.shorthand == "over_life":
            return dumped["over_life"][0][1] if len(dumped["over_life"]) == 1 else dumped
        keys = sorted(type(value).model_fields, key=lambda key: {"name": 0, "type": 1}.get(key, 2))
        fields = {type(value).model_fields[key].alias or key: as_plain(getattr(value, key)) for key in keys}
        return {key: field for key, field in fields.items() if field is not None}
    if isinstance(value, (tuple, list)):
        return [as_plain(item) for item in value]
    if isinstance(value, dict):
        return {key: as_plain(item) for key, item in value.items()}
    return value


class _Dumper(yaml.SafeDumper):
    """Writes YAML 1.2: text that 1.2 or 1.1 would read as something else is quoted, numbers are as short as they can be."""

    def ignore_aliases(self, data: Any) -> bool:
        return True


def _text(dumper: _Dumper, value: str) -> yaml.Node:
    style = '"' if _needs_quotes(value) else None
    return dumper.represent_scalar("tag:yaml.org,2002:str", value, style)


def _needs_quotes(value: str) -> bool:
    first = value[:1]
    return not value or first.isdigit() or first in "+-.~#\"'" or value.lower() in ("null", "true", "false") or not value.isprintable()


def _number(dumper: _Dumper, value: float) -> yaml.Node:
    return dumper.represent_scalar("tag:yaml.org,2002:float", repr(float(value)))


_Dumper.add_representer(str, _text)
_Dumper.add_representer(float, _number)
