"""Scenes: validated, frozen descriptions of what moves. Names load when first used, so that listing scenes imports no pydantic."""

from importlib import import_module

_HOMES = {
    "Scene": "scene",
    "SceneError": "problems",
    "UnknownSceneError": "problems",
    "UnknownFieldError": "problems",
    "Problem": "problems",
    "load_scene": "loader",
    "load_text": "loader",
    "shipped_scenes": "shipped",
    "find_scene": "shipped",
    "json_schema": "schema",
    "resolved_yaml": "resolved",
    "describe_field": "fields",
    "Strength": "strengths",
    "Keyframes": "strengths",
    "Sine": "strengths",
    "Formula": "strengths",
    "OPERATIONS": "expressions",
}

__all__ = list(_HOMES)  # noqa: PLE0604 (all of them are words)


def __getattr__(name: str):
    if name not in _HOMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    value = getattr(import_module(f"{__name__}.{_HOMES[name]}"), name)
    globals()[name] = value
    return value


def __dir__():
    return sorted([*globals(), *_HOMES])
