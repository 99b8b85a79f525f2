"""What every registered kind owes its users, asked of the registry: whoever adds a kind adds no test here.

A kind of flow has a shipped scene of its own name; one of another family appears in some shipped scene. In that scene it runs
finite, twice the same, and a key that it does not have is refused where it stands.
"""

import json
from functools import cache

import numpy as np
import pytest
import yaml

from warpsim import SceneError, Simulation, load_scene
from warpsim.images import IMAGES
from warpsim.integrators import FIRST_ORDER_FORM, SECOND_ORDER_FORM
from warpsim.kernels.birth import SHAPES
from warpsim.kernels.clearance import CLEARANCES
from warpsim.kernels.flow import FLOWS
from warpsim.kernels.forces import FORCES
from warpsim.kernels.pairwise import PAIR_LAWS
from warpsim.scene import colliders, emitters, flow, forces, json_schema, load_text, obstacles, shipped_scenes

FAMILIES = {  # spec's base class -> the registry of formulas in kernels/
    flow.FlowPrimitive: FLOWS,
    forces.Force: FORCES | {"pairwise": PAIR_LAWS},
    emitters.EmitterShape: SHAPES,
    obstacles.Obstacle: IMAGES,
    colliders.Collider: CLEARANCES,
}
KINDS = [(base, spec.model_fields["type"].default) for base in FAMILIES for spec in base.__subclasses__()]
SCENES = {name: yaml.safe_load(path.read_text()) for name, path in shipped_scenes().items()}


def mappings(node):
    """Every mapping inside a scene's text."""
    if isinstance(node, dict):
        yield node
    for child in node.values() if isinstance(node, dict) else node if isinstance(node, list) else ():
        yield from mappings(child)


def scene_of(kind: str) -> str:
    """The shipped scene that shows a kind: the one of its name, else the first that has it."""
    has = [name for name in SCENES if any(part.get("type") == kind for part in mappings(SCENES[name]))]
    assert has, f'no shipped scene has "type: {kind}"'
    return kind if kind in has else has[0]


@cache
def run(name: str) -> tuple[str, bool]:
    """Hash and finiteness after ten substeps and more; without the prewarm, which only takes time here."""
    scene = load_scene(name, overrides=["time.prewarm=0"])
    simulation = Simulation(scene, device="cpu", threads=1)
    substeps = 1 if scene.time.substeps == "auto" else scene.time.substeps
    frame = list(simulation.frames(max(3, -(-10 // substeps))))[-1]
    finite = all(np.isfinite(frame[system].position).all() and np.isfinite(frame[system].velocity).all() for system in frame.names)
    return simulation.state_hash(), finite


@pytest.mark.parametrize("base", FAMILIES, ids=lambda base: base.__name__)
def test_specs_and_formulas_are_the_same_kinds(base):
    assert {kind for family, kind in KINDS if family is base} == set(FAMILIES[base])


def test_every_kind_of_flow_has_a_scene_of_its_name():
    assert set(FLOWS) <= set(SCENES)


@pytest.mark.parametrize(("base", "kind"), KINDS, ids=lambda value: value if isinstance(value, str) else value.__name__)
def test_unknown_key_is_refused_in_its_place(base, kind):
    text = shipped_scenes()[scene_of(kind)].read_text()
    wrong = text.replace(f"type: {kind},", f"type: {kind}, nonsense: 1,", 1)
    with pytest.raises(SceneError) as refused:
        load_text(wrong, "wrong.yaml")
    line = next(number for number, line in enumerate(wrong.splitlines(), 1) if "nonsense" in line)
    assert any(problem.line == line and "nonsense" in problem.message for problem in refused.value.problems), str(refused.value)


@pytest.mark.parametrize("name", SCENES)
def test_shipped_scene_runs_finite_and_twice_the_same(name):
    first, finite = run(name)
    run.cache_clear()
    assert finite and run(name)[0] == first


@pytest.mark.parametrize("name", SCENES)
def test_shipped_scene_tells_what_it_is(name):
    assert shipped_scenes()[name].read_text().startswith("# yaml-language-server: $schema=scene.schema.json\n")
    scene = load_scene(name)
    assert scene.description and scene.camera and scene.systems
    assert scene.verify and all(oracle.reason for oracle in scene.verify), "what must come out of it, and why just so exactly"


def test_schema_beside_the_scenes_is_the_present_one():
    """Written by `python -m warpsim schema --out scenes/scene.schema.json`; editors read it from the scenes' first line."""
    beside = shipped_scenes()["campfire"].with_name("scene.schema.json")
    assert json.loads(beside.read_text()) == json.loads(json.dumps(json_schema()))


def test_every_solver_is_in_a_scene():
    used = {part.get("solver") for scene in SCENES.values() for part in mappings(scene)}
    assert set(SECOND_ORDER_FORM) <= used | {"semi_implicit_euler"} and set(FIRST_ORDER_FORM) <= set(SECOND_ORDER_FORM)
