"""Colliders in the viewer: what a page is told once, and where they are in every frame."""

import numpy as np
import pytest

from tests.viewer.watcher import read_frame
from warpsim import Scene, Simulation
from warpsim.meshes import surface
from warpsim.observers.viewer.blocks import frame_blocks
from warpsim.observers.viewer.protocol import Attribute, pack_frame
from warpsim.observers.viewer.solids import is_smooth, solid_commands

SOLIDS = [
    {"type": "plane", "normal": [0, 2, 0]},
    {"type": "sphere", "radius": 2, "side": "inside", "motion": {"center": [{"expression": "t"}, 1, 2]}},
    {"type": "box", "size": [1, 2, 3], "rotation": [0, 0, 90]},
    {"type": "capsule", "start": [0, 0, 0], "end": [0, 2, 0], "radius": 0.5},
]


def made(**viewer) -> Scene:
    return Scene.model_validate({"name": "s", "time": {"fps": 10}, "colliders": SOLIDS, "viewer": viewer})


def test_a_page_is_told_every_shape_once():
    commands = solid_commands(made())
    assert [(c["place"], c["shape"], c["glass"]) for c in commands] == [
        (0, "plane", False),
        (1, "sphere", True),
        (2, "box", False),
        (3, "capsule", False),
    ]
    assert commands[3]["axis"] == [0.0, 1.0, 0.0] and commands[2]["size"] == [1.0, 2.0, 3.0]
    assert solid_commands(made(colliders=False)) == []


def test_every_frame_says_where_they_are():
    sim = Simulation(made(), device="cpu", threads=1)
    sim.run(0.5)
    message = pack_frame(1, 0.5, frame_blocks(sim.frame(), [], None))
    poses = read_frame(message).blocks[0, Attribute.POSES]
    half = np.sqrt(0.5)
    expected = [[0, 0, 0, 0, 0, 0, 1], [0.5, 1, 2, 0, 0, 0, 1], [0, 0, 0, 0, 0, half, half], [0, 1, 0, 0, 0, 0, 1]]
    assert poses == pytest.approx(np.array(expected), abs=1e-6)


def test_a_change_moves_what_is_drawn():
    sim = Simulation(made(), device="cpu", threads=1)
    sim.change("colliders.0.center.1", 3.0)
    sim.step_frame()
    assert sim.frame().collider_poses[0, 1] == 3.0


def test_a_ball_is_smooth_and_a_box_is_not():
    trimesh = pytest.importorskip("trimesh")
    ball, box = trimesh.creation.icosphere(2), trimesh.creation.box((1, 1, 1))
    assert is_smooth(surface(np.array(ball.vertices), np.array(ball.faces)))
    assert not is_smooth(surface(np.array(box.vertices), np.array(box.faces)))
