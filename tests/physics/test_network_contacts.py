"""Networks among colliders: no point comes nearer than the thickness, whatever the shape, moving or not; the bits are the same."""

import numpy as np
import pytest

from tests.simulation.networks import network, simulate, state
from warpsim import Scene, Simulation
from warpsim.scene import load_scene
from warpsim.verify.solids import clearance as distance

THICKNESS = 0.02
CLOTH = {"type": "cloth", "resolution": [17, 17], "corner": [-0.8, 0.45, -0.8], "edges": [[1.6, 0, 0], [0, 0, 1.6]], "density": 0.3}
CLOTH |= {"structural": {"stiffness": 40, "damping": 0.03}, "shear": {"stiffness": 20, "damping": 0.02}, "bend": {"stiffness": 2}}
CLOTH |= {"thickness": THICKNESS, "gravity": (0, -9.81, 0), "substeps": 16}
COLLIDERS = {
    "plane": {"type": "plane", "center": [0, 0.1, 0], "normal": [0.3, 1, 0]},
    "sphere": {"type": "sphere", "center": [0, 0, 0], "radius": 0.4},
    "box": {"type": "box", "center": [0, 0, 0], "size": [0.8, 0.6, 0.5], "rotation": [0, 30, 0]},
    "capsule": {"type": "capsule", "start": [-0.3, 0, 0], "end": [0.3, 0.1, 0], "radius": 0.25},
    "bowl": {"type": "sphere", "center": [0, 0.9, 0], "radius": 1.6, "side": "inside"},
}


def clearance(spec: dict, x: np.ndarray) -> np.ndarray:
    """Distance of points from the surface, on the side where they may be."""
    if spec["type"] == "plane":
        n = np.array(spec["normal"]) / np.linalg.norm(spec["normal"])
        return (x - spec["center"]) @ n
    if spec["type"] == "sphere":
        g = np.linalg.norm(x - spec["center"], axis=1) - spec["radius"]
        return -g if spec.get("side") == "inside" else g
    if spec["type"] == "capsule":
        a, b = np.array(spec["start"]), np.array(spec["end"])
        share = np.clip((x - a) @ (b - a) / ((b - a) @ (b - a)), 0, 1)[:, None]
        return np.linalg.norm(x - a - share * (b - a), axis=1) - spec["radius"]
    turn = np.radians(spec["rotation"][1])
    back = np.array([[np.cos(turn), 0, -np.sin(turn)], [0, 1, 0], [np.sin(turn), 0, np.cos(turn)]])
    beyond = np.abs((x - spec["center"]) @ back.T) - 0.5 * np.array(spec["size"])
    return np.linalg.norm(np.maximum(beyond, 0), axis=1) + np.minimum(beyond.max(axis=1), 0)


@pytest.mark.parametrize("name", COLLIDERS)
def test_no_point_comes_nearer_than_the_thickness(name):
    """150 frames of falling, folding and sliding: the skin of a contact, 64 roundings of 1.6 m, is what it may be nearer."""
    spec = {**COLLIDERS[name], "friction": 0.4, "restitution": 0.0}
    sim = simulate(**CLOTH, more={"colliders": [spec]})
    touched = False
    for frame in sim.frames(150):
        g = clearance(spec, frame["s"].position.astype(float))
        assert g.min() > THICKNESS - 2e-5, frame.index
        touched = touched or g.min() < THICKNESS + 1e-3
    assert touched


def test_a_ball_that_moves_pushes_a_curtain():
    """It swings through where the curtain hangs: the curtain gives way and no point is ever inside it."""
    curtain = CLOTH | {"corner": [-0.8, 1.6, 0], "edges": [[1.6, 0, 0], [0, -1.6, 0]], "pins": ["top"]}
    ball = {"type": "sphere", "radius": 0.3, "motion": {"center": {"keyframes": [[0, [0, 0.8, -1]], [1, [0, 0.8, 0.5]]]}}}
    sim = simulate(**curtain, more={"colliders": [ball]})
    for frame in sim.frames(90):
        center = [0, 0.8, -1 + 1.5 * min(frame.time, 1.0)]
        assert np.linalg.norm(frame["s"].position - center, axis=1).min() > 0.3 + THICKNESS - 1e-3, frame.index
    assert state(sim)[0][:, 2].max() > 0.7


@pytest.mark.parametrize("keys", [{}, {"self_collision": True}, {"solver": "xpbd"}], ids=["within", "constrained", "xpbd"])
def test_contacts_share_their_bits(keys, monkeypatch):
    """Within the particles' kernels, and in a pass of their own after a constraint or a solver that moves points in its own way."""
    monkeypatch.setattr("warpsim.launch.PARALLEL_FROM", 0)
    colliders = [spec | {"friction": 0.3} for name, spec in COLLIDERS.items() if name != "bowl"]
    motion = {"center": [{"sine": {"amplitude": 0.3, "period": 0.4}}, 0.5, 0.2], "rotation": [0, {"expression": "90*t"}, 0]}
    colliders.append({"type": "box", "size": [0.2, 0.3, 0.2], "motion": motion})
    hashes = set()
    for native, threads in ((True, 1), (True, 3), (False, 1)):
        sim = Simulation(network(**CLOTH, **keys, more={"colliders": colliders}), device="cpu", threads=threads, native=native)
        sim.run(0.6)
        hashes.add(sim.state_hash())
    assert len(hashes) == 1


def test_colliders_that_kill_leave_a_network_whole():
    spec = {**COLLIDERS["plane"], "action": "kill"}
    sim = simulate(**CLOTH, more={"colliders": [spec]})
    sim.run(1.0)
    assert sim.frame()["s"].count == 289 and state(sim)[0][:, 1].max() < -2.0


@pytest.mark.parametrize("name", [*COLLIDERS, "ball"])
@pytest.mark.parametrize("keys", [{}, {"self_collision": True}, {"solver": "xpbd"}], ids=["within", "constrained", "xpbd"])
def test_cloth_born_inside_a_collider_is_put_on_its_surface(keys, name):
    """In the first frame that moves, by the nearest way; nobody flies off, and nobody is inside again afterwards."""
    spec = COLLIDERS[name] if name in COLLIDERS else {"type": "sphere", "center": [0.1, 0.3, 0], "radius": 0.5}
    corner = [-0.8, 2.2, -0.8] if name == "bowl" else [-0.8, 0.05, -0.8]
    sim = simulate(**{**CLOTH, "corner": corner}, **keys, more={"colliders": [{**spec, "restitution": 0}]})
    born = clearance(spec, state(sim)[0])
    assert born.min() < -0.02
    for frame in sim.frames(40):
        if frame.index > 1:
            assert clearance(spec, frame["s"].position.astype(float)).min() > THICKNESS - 2e-5, frame.index
    assert np.abs(state(sim)[1]).max() < 12.0  # a fall of 0.7 s and what it was stretched by, not a throw of 0.5 m in a substep


SHEET = "v -0.5 0 -0.5\nv 0.5 0 -0.5\nv 0.5 0 0.5\nv -0.5 0 0.5\nf 1 3 2\nf 1 4 3\n"


@pytest.mark.parametrize("side", [1.0, -1.0])
@pytest.mark.parametrize("keys", [{}, {"self_collision": True}], ids=["within", "constrained"])
def test_a_sheet_of_triangles_holds_cloth_from_either_side(keys, side, tmp_path):
    """A square of two triangles, 0.03 thick: cloth falls onto it, or rises against it, and stays half of that and the thickness away."""
    (tmp_path / "sheet.obj").write_text(SHEET)
    mesh = {"type": "mesh", "file": str(tmp_path / "sheet.obj"), "thickness": 0.03, "friction": 0.9, "restitution": 0}
    cloth = {**CLOTH, "corner": [-0.4, 0.1 * side, -0.4], "edges": [[0.8, 0, 0], [0, 0, 0.8]], "gravity": (0, -9.81 * side, 0)}
    sim = simulate(**cloth, **keys, more={"colliders": [mesh]})
    for frame in sim.frames(60):
        assert (side * frame["s"].position[:, 1]).min() > THICKNESS + 0.015 - 2e-5, frame.index
    assert (side * state(sim)[0][:, 1]).max() < THICKNESS + 0.016


def test_a_drape_stays_above_its_colliders_for_a_thousand_frames():
    """The shipped drape on a coarser grid: it falls over the ball, folds on the floor, lies, and nothing creeps in."""
    scene = load_scene("drape")
    document = scene.model_dump(by_alias=True, exclude_unset=True) | {"verify": []}
    document["systems"]["tablecloth"]["resolution"] = [41, 41]
    sim = Simulation(Scene.model_validate(document), device="cpu", threads=1)
    thickness, least = scene.systems["tablecloth"].thickness, []
    for frame in sim.frames(1000):
        x = frame["tablecloth"].position.astype(float)
        least.append(min(distance(one, x, frame.time).min() for one in scene.colliders))
    assert thickness - 2e-5 < min(least) < thickness + 1e-4
