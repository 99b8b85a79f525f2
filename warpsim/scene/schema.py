"""The JSON schema of a scene (draft 2020-12), for editors: descriptions with units, bounds, choices, short forms."""

from typing import Any

from warpsim.scene.base import ShortSpec, Spec
from warpsim.scene.fields import item_of, keys_of, scene_slot, specs_of

DIALECT = "https://json-schema.org/draft/2020-12/schema"


def json_schema() -> dict[str, Any]:
    """Return the JSON schema that a scene file fulfills."""
    from warpsim.scene.scene import Scene

    schema = Scene.model_json_schema(by_alias=True, mode="validation")
    definitions = schema.get("$defs", {})
    specs = all_specs()
    for definition in (schema, *definitions.values()):
        _tidied(definition)
    for name, definition in definitions.items():
        properties = definition.get("properties", {})
        if "const" in properties.get("type", {}):
            # The format wants `type` always, so that a reader knows what an entry is.
            definition["required"] = ["type", *definition.get("required", [])]
        spec = specs.get(name)
        if spec is not None and issubclass(spec, ShortSpec):
            definitions[name] = _with_short_form(definition, spec)
    for key in ("burst", "color"):
        _one_or_many(definitions["Emitter"]["properties"][key])
    return {"$schema": DIALECT, "title": "warpsim scene", **{key: value for key, value in schema.items() if key != "title"}}


def all_specs() -> dict[str, type[Spec]]:
    """Return every spec class that a scene may hold, by class name."""
    found: dict[str, type[Spec]] = {}
    waiting = [scene_slot()]
    while waiting:
        slot = waiting.pop()
        inner = item_of(slot)
        if inner is not None:
            waiting.append(inner)
        for spec in specs_of(slot):
            if spec.__name__ not in found:
                found[spec.__name__] = spec
                waiting += keys_of(spec).values()
    return found


def _tidied(node: Any) -> None:
    """Drop pydantic's made-up titles, and write a list of like entries the way every editor reads it."""
    if isinstance(node, list):
        for item in node:
            _tidied(item)
    if not isinstance(node, dict):
        return
    for key, value in node.items():
        if key == "properties":
            for inner in value.values():
                _tidied(inner)
        elif key != "default":
            _tidied(value)
    if isinstance(node.get("title"), str):
        del node["title"]
    if "patternProperties" in node:
        node["additionalProperties"] = False
    entries = node.get("prefixItems")
    if entries and all(entry == entries[0] for entry in entries):
        node["items"] = node.pop("prefixItems")[0]


def _with_short_form(definition: dict[str, Any], spec: type[ShortSpec]) -> dict[str, Any]:
    long = {key: value for key, value in definition.items() if key != "description"}
    return {"description": definition.get("description", ""), "anyOf": [*_short_forms(definition, spec), long]}


def _short_forms(definition: dict[str, Any], spec: type[ShortSpec]) -> list[dict[str, Any]]:
    inner = definition["properties"][spec.shorthand]
    if inner.get("type") == "array":
        # Stops over life: a bare value is one stop's second entry.
        inner = inner["items"]["prefixItems"][1]
    return [{key: value for key, value in inner.items() if key not in ("description", "default")}]


def _one_or_many(field: dict[str, Any]) -> None:
    many = {key: field.pop(key) for key in ("items", "type", "maxItems") if key in field}
    field["anyOf"] = [many["items"], many]
