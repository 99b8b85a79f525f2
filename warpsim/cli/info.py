"""info: one scene, or one field of scenes with its unit, default and range."""

import math
from pathlib import Path
from typing import Annotated

import typer

from warpsim.cli.validate import JSON


def info(
    name: Annotated[str, typer.Argument(metavar="NAME", help="A scene, or the path of a field: systems.particles.capacity.")],
    json: JSON = False,
) -> int:
    """Tell about a scene, or about one field: unit, default, range."""
    from warpsim.cli.outcome import Exit, print_json

    path = _scene_file(name)
    if path and json:
        print_json(_scene_as_data(path))
        return Exit.OK
    facts = _scene_facts(path) if path else _field_facts(name)
    if json:
        print_json(facts)
        return Exit.OK
    for key, value in facts.items():
        lines = value if isinstance(value, list) else [value]
        if key in ("choices", "keys", "types"):
            lines = [", ".join(map(str, lines))]
        for number, line in enumerate(lines):
            typer.echo(f"{'' if number else key.replace('_', ' ') + ':':<13} {_worded(line)}")
    return Exit.OK


def _scene_file(name: str) -> Path | None:
    """Return the file of a scene given by path or shipped name; None if the name must be a field's."""
    from warpsim.cli.scenes import found
    from warpsim.scene import UnknownSceneError

    try:
        return found(name)
    except UnknownSceneError:
        return None


def _scene_as_data(path: Path) -> dict[str, object]:
    from warpsim.footprint import footprints, scene_tables
    from warpsim.memory import network_advice
    from warpsim.scene import load_scene

    scene = load_scene(path)
    advised = network_advice(scene)
    stability = {
        name: {
            "longest_substep": None if advice.longest == math.inf else advice.longest,
            "least_substeps": advice.least,
            "substeps": advice.chosen,
        }
        for name, advice in advised.items()
    }
    systems = footprints(scene, advised)
    return {
        "file": str(path),
        "memory_bytes": scene_tables(scene) + sum(one.total for one in systems.values()),
        "memory": {
            name: {key: getattr(one, key) for key in ("unit", "count", "total", "each", "states", "parts")} for name, one in systems.items()
        },
        "stability": stability,
        "scene": scene.model_dump(mode="json", by_alias=True),
    }


def _scene_facts(path: Path) -> dict[str, object]:
    from warpsim.footprint import footprints, scene_tables
    from warpsim.memory import network_advice
    from warpsim.scene import load_scene

    scene = load_scene(path)
    advice = network_advice(scene)
    prewarm = f", after {scene.time.prewarm:g} s of prewarm" if scene.time.prewarm else ""
    facts = {
        "name": scene.name,
        "description": " ".join(scene.description.split()),
        "file": str(path),
        "duration": f"{scene.time.duration:g} s, {scene.time.fps:g} frames/s, substeps: {scene.time.substeps}{prewarm}",
        "seed": scene.seed,
        "gravity": _list_of(scene.gravity) + " m/s^2",
        "flow": [_entry(entry) for entry in scene.flow],
        "obstacles": [_entry(entry) for entry in scene.obstacles],
        "forces": [_entry(entry) for entry in scene.forces],
        "colliders": [_entry(entry) for entry in scene.colliders],
        "systems": [_system(name, system, advice) for name, system in scene.systems.items()],
        "controls": [f"{slider.label}: {slider.min:g} to {slider.max:g} ({slider.path})" for slider in scene.sliders],
        "verify": [_entry(oracle) for oracle in scene.verify],
        "memory": _memory(scene_tables(scene), footprints(scene, advice)),
    }
    return {key: value for key, value in facts.items() if value not in ("", [])}


def _system(name: str, system, advice: dict[str, object]) -> str:
    if system.type == "flock":
        others = f", attends to {' and '.join(system.attends)}" if system.attends else ""
        how = "Vicsek's model" if system.vicsek else system.method
        return f"{name}: flock, {system.count} {'boid' if system.count == 1 else 'boids'}, {how}{others}"
    if system.type != "particles":
        size = "a mesh's points and edges" if system.point_count is None else f"{system.point_count} points, {system.spring_count} springs"
        return f"{name}: {system.type}, {size}, {system.method}; {advice[name]}"
    motion = "ballistic" if system.motion == "ballistic" else "tracer" if system.coupling == "tracer" else system.method
    return f"{name}: {system.type}, capacity {system.capacity}, {motion}, {len(system.emitters)} emitter(s)"


def _memory(shared: int, systems: dict) -> list[str]:
    """Return what all takes, and each system: bytes of one particle, boid, vertex or point, by part where that is a byte or more."""
    from warpsim.footprint import KEPT

    lines = [f"about {_bytes(shared + sum(one.total for one in systems.values()))}"]
    for name, one in systems.items():
        parts = ", ".join(f"{part} {size / one.count:.0f}" for part, size in one.parts.items() if size >= one.count and part != KEPT)
        kept = f"{one.states} states to go back to, {one.state / one.count:.0f} each"
        lines.append(f"{name}: {_bytes(one.total)}; bytes per {one.unit}: {one.each:.0f} ({parts}); at most {kept}")
    return lines


def _bytes(size: int) -> str:
    """Return a size with three digits, in kB, MB or GB."""
    unit, name = next((unit, name) for unit, name in ((10**9, "GB"), (10**6, "MB"), (10**3, "kB")) if size >= unit or name == "kB")
    return f"{size / unit:.3g} {name}"


def _entry(entry) -> str:
    return f"{entry.name}: {entry.type}" if entry.name else entry.type


def _field_facts(path: str) -> dict[str, object]:
    """Return what there is to know about a field. Raises Failure or UnknownSceneError if there is neither."""
    from warpsim.cli.outcome import Exit, Failure
    from warpsim.scene import UnknownFieldError, describe_field, find_scene

    try:
        field = describe_field(path)
    except UnknownFieldError as unknown:
        if "." in path or unknown.problems[0].suggestion:
            raise Failure(Exit.USAGE, str(unknown)) from None
        find_scene(path)  # says which scenes there are; UnknownSceneError ends as a usage mistake too
        raise
    limits = [f"{'>' if field.minimum_excluded else '>='} {field.minimum:.12g}"] if field.minimum is not None else []
    limits += [f"<= {field.maximum:.12g}"] if field.maximum is not None else []
    facts = {
        "field": field.path,
        "meaning": field.prose,
        "value": field.expected,
        "unit": field.unit,
        "default": "none, it must be given" if field.required else field.default,
        "range": " and ".join(limits),
        "choices": list(field.choices),
        "keys": list(field.keys),
        "types": list(field.types),
    }
    return {key: value for key, value in facts.items() if value not in (None, "", [])}


def _list_of(numbers) -> str:
    """Return numbers the way a scene has them."""
    return f"[{', '.join(f'{number:g}' for number in numbers)}]"


def _worded(value: object) -> str:
    import json

    return value if isinstance(value, str) else json.dumps(value)
