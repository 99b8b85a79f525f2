"""Colliders that cannot be: told where they stand, with the way out. And which of a scene's a system feels."""

import pytest

from warpsim import SceneError, Simulation
from warpsim.scene import Scene, load_text

HEAD = "name: x\ncolliders:\n"
SYSTEM = "systems: {p: {type: particles, emitters: [{rate: 1, lifetime: 1}]%s}}\n"


@pytest.mark.parametrize(
    ("entry", "path", "words"),
    [
        ("{type: plain}", "colliders.0.type", "did you mean plane"),
        ("{type: sphere}", "colliders.0", '"radius" is missing'),
        ("{type: sphere, radius: 0}", "colliders.0.radius", "greater than 0"),
        ("{type: sphere, radius: 1, restitution: 1.2}", "colliders.0.restitution", "at most 1|0 to 1|less than or equal"),
        ("{type: plane, friction: -1}", "colliders.0.friction", "at least 0|0 to|greater than or equal"),
        ("{type: plane, normal: [0, 0, 0]}", "colliders.0.normal", "must not be zero"),
        ("{type: box, size: [1, 1]}", "colliders.0.size", "3"),
        ("{type: box, size: [1, 1, -1]}", "colliders.0.size.2", "greater than 0"),
        ("{type: capsule, start: [0, 0, 0], radius: 1}", "colliders.0", '"end" is missing'),
        ("{type: sphere, radius: 1, side: insid}", "colliders.0.side", "did you mean inside"),
        ("{type: sphere, radius: 1, motion: {}}", "colliders.0.motion", "give center, rotation or both"),
        ("{type: plane, motion: {center: {keyframes: [[1, [0, 0, 0]], [1, [1, 0, 0]]]}}}", "colliders.0.motion.center", "times must rise"),
        ("{type: mesh, file: nowhere.obj}", "colliders.0.file", "no such file"),
        ("{type: mesh, file: ../secret.obj}", "colliders.0.file", "under the scene's folder|no such file"),
        ("{type: mesh, file: scene.yaml}", "colliders.0.file", ".obj or .stl or .ply or .glb"),
    ],
)
def test_a_mistake_is_told_at_its_place(entry, path, words, tmp_path):
    (tmp_path / "scene.yaml").write_text(text := f"{HEAD}  - {entry}\n" + SYSTEM % "")
    with pytest.raises(SceneError, match=words) as refused:
        load_text(text, str(tmp_path / "scene.yaml"), folder=tmp_path)
    assert any(problem.path.startswith(path) and problem.line == 3 for problem in refused.value.problems), str(refused.value)


def test_names_are_looked_for_among_the_colliders():
    text = f"{HEAD}  - {{type: plane, name: ground}}\n  - {{type: plane, name: ground}}\n" + SYSTEM % ", feels: {colliders: [grund, 7]}"
    with pytest.raises(SceneError) as refused:
        load_text(text, "x.yaml")
    told = {problem.path: problem.headline for problem in refused.value.problems}
    assert 'the name "ground" is taken by colliders.0' in told["colliders.1.name"]
    assert "did you mean ground" in told["systems.p.feels.colliders.0"] and "there is no colliders.7" in told["systems.p.feels.colliders.1"]


def test_closed_form_motion_meets_nothing():
    text = f"{HEAD}  - {{type: plane}}\n" + SYSTEM % ", motion: ballistic"
    with pytest.raises(SceneError, match=r"feels: \{colliders: false\}"):
        load_text(text, "x.yaml")
    load_text(text.replace("motion: ballistic", "motion: ballistic, feels: {colliders: false}"), "x.yaml")


def one(**collider) -> Scene:
    return Scene.model_validate({"name": "m", "colliders": [{"type": "mesh", **collider}]})


def test_an_open_mesh_needs_a_thickness(tmp_path):
    path = tmp_path / "sheet.obj"
    path.write_text("v 0 0 0\nv 1 0 0\nv 0 0 1\nf 1 3 2\n")
    with pytest.raises(SceneError, match=r"colliders\.0\.file: .*3 of its edges .* give thickness"):
        Simulation(one(file=str(path)), device="cpu")
    Simulation(one(file=str(path), thickness=0.01), device="cpu")
    with pytest.raises(SceneError, match=r"colliders\.0\.side: a sheet has no inside"):
        Simulation(one(file=str(path), thickness=0.01, side="inside"), device="cpu")


def test_a_broken_file_is_told_at_its_place(tmp_path):
    path = tmp_path / "noise.ply"
    path.write_bytes(b"noise")
    with pytest.raises(SceneError, match=r"colliders\.0\.file: noise\.ply: holds no PLY mesh"):
        Simulation(one(file=str(path)), device="cpu")


def test_numbers_may_change_while_it_runs_and_shapes_may_not():
    from warpsim.changes import FixedField

    document = {"name": "c", "colliders": [{"type": "sphere", "radius": 1.0, "side": "inside"}], "systems": {"p": {"type": "particles"}}}
    sim = Simulation(Scene.model_validate(document), device="cpu", threads=1)
    for path, value in {"restitution": 0.9, "friction": 0.1, "radius": 2.0, "center.1": 3.0, "rotation.0": 10.0}.items():
        sim.change(f"colliders.0.{path}", value)
    sim.step_frame()
    for path, value in {"side": "outside", "action": "kill", "type": "box"}.items():
        with pytest.raises((FixedField, SceneError)):
            sim.change(f"colliders.0.{path}", value)
