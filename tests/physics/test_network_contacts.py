"""Networks among colliders: no point comes nearer than the thickness, whatever the shape, moving or not; the bits are the same."""

import numpy as np
import pytest

from tests.simulation.networks import network, simulate, state
from warpsim import Simulation

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


def test_contacts_share_their_bits(monkeypatch):
    monkeypatch.setattr("warpsim.launch.PARALLEL_FROM", 0)
    colliders = [spec | {"friction": 0.3} for name, spec in COLLIDERS.items() if name != "bowl"]
    hashes = set()
    for native, threads in ((True, 1), (True, 3), (False, 1)):
        sim = Simulation(network(**CLOTH, more={"colliders": colliders}), device="cpu", threads=threads, native=native)
        sim.run(0.6)
        hashes.add(sim.state_hash())
    assert len(hashes) == 1


def test_colliders_that_kill_leave_a_network_whole():
    spec = {**COLLIDERS["plane"], "action": "kill"}
    sim = simulate(**CLOTH, more={"colliders": [spec]})
    sim.run(1.0)
    assert sim.frame()["s"].count == 289 and state(sim)[0][:, 1].max() < -2.0
