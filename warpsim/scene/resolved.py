"""A scene written out in full, defaults and all: loading it gives an equal Scene."""

from typing import Any

import yaml

from warpsim.scene.assets import Asset, recorded_name
from warpsim.scene.base import ShortSpec, Spec
from warpsim.scene.scene import Scene
from warpsim.scene.yaml12 import SCALAR_FORMS

_PLAIN_LINE = 140


def resolved_yaml(scene: Scene, recorded: bool = False) -> str:
    """Return the YAML text of a scene with every value in effect; `recorded`: for a run folder, which has copies of the scene's files."""
    return yaml.dump(
        as_plain(scene, recorded), Dumper=_Dumper, sort_keys=False, allow_unicode=True, width=_PLAIN_LINE, default_flow_style=None
    )


def as_plain(value: Any, recorded: bool = False) -> Any:
    """Return a spec as dicts, lists and numbers in the order a reader expects; fields without a value are left out.

    Name and type come first, what all kinds of a family have comes last.
    """
    if isinstance(value, Spec):
        dumped = value.model_dump(mode="json", by_alias=True) if isinstance(value, ShortSpec) else None
        if dumped is not None and value.shorthand == "over_life":
            return dumped["over_life"][0][1] if len(value.stops) == 1 and value.stops[0][0] == 0.0 else dumped
        own = type(value).__annotations__
        keys = sorted(type(value).model_fields, key=lambda key: {"name": 0, "type": 1}.get(key, 2 if key in own else 3))
        fields = {type(value).model_fields[key].alias or key: as_plain(getattr(value, key), recorded) for key in keys}
        return {key: field for key, field in fields.items() if field is not None}
    if isinstance(value, Asset):
        return recorded_name(value) if recorded else str(value)
    if isinstance(value, (tuple, list)):
        return [as_plain(item, recorded) for item in value]
    if isinstance(value, dict):
        return {key: as_plain(item, recorded) for key, item in value.items()}
    return value


class _Dumper(yaml.SafeDumper):
    """Writes YAML 1.2: `1e-05` stands as it is, and text that would read as a number is quoted."""

    yaml_implicit_resolvers: dict = {}

    def ignore_aliases(self, data: Any) -> bool:
        """Write everything out where it belongs."""
        return True


for _kind, _forms in SCALAR_FORMS.items():
    _Dumper.add_implicit_resolver(f"tag:yaml.org,2002:{_kind}", _forms, None)
_Dumper.add_representer(float, lambda dumper, value: dumper.represent_scalar("tag:yaml.org,2002:float", repr(value)))
