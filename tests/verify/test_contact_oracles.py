"""Oracles of contact: distances from solids, least clearance, crossings; each passes, fails where it must, and names what is not there."""

import numpy as np
import pytest

from tests.simulation.layers import WILD_RAIL, folding
from tests.simulation.networks import network
from warpsim import Scene
from warpsim.verify import verify_scene
from warpsim.verify.solids import clearance

BALL = {"name": "ball", "type": "sphere", "center": [0.1, -0.5, 0], "radius": 0.3, "friction": 0.9, "restitution": 0}
CLOTH = {"type": "cloth", "resolution": [9, 9], "corner": [-0.3, 0, -0.4], "edges": [[0.8, 0, 0], [0, 0, 0.8]], "density": 0.3}
CLOTH |= {"structural": {"stiffness": 30, "damping": 0.05}, "shear": {"stiffness": 9}, "gravity": (0, -9.81, 0), "thickness": 0.02}


def found(oracle, colliders=(BALL,), **keys):
    scene = network(**{**CLOTH, **keys}, more={"colliders": list(colliders), "verify": [{"system": "s", **oracle}]})
    (finding,) = verify_scene(scene, "cpu", threads=1)
    return finding


def test_clearance_is_the_thickness_where_cloth_lies_and_fails_where_that_is_another():
    oracle = {"type": "clearance", "to": 0.6, "tolerance": 1e-4}
    assert found(oracle).verdict == "pass" and "ball" in found(oracle).remark
    assert found({**oracle, "expect": 0.0202}).verdict == "fail"
    assert (
        found({**oracle, "collider": "ball", "expect": 0.02}, colliders=[{"type": "plane", "center": [0, -0.3, 0]}, BALL]).verdict == "pass"
    )
    assert found(oracle, feels={"colliders": ["ball"]}, colliders=[{"type": "plane", "center": [0, 9, 0]}, BALL]).verdict == "pass"
    assert found({**oracle, "to": 0.1}).verdict == "fail"  # it has not fallen so far yet


@pytest.mark.parametrize("time", [0.0, 0.3, 2.0])
def test_distances_from_solids_are_those_to_their_nearest_points(time):
    """Against points all over their surfaces, 0.01 to 0.02 apart."""
    rng = np.random.default_rng(4)
    t = np.linspace(-1, 1, 200)
    face = np.stack(np.meshgrid(t, t), axis=-1).reshape(-1, 2)
    ball = rng.normal(size=(60_000, 3))
    ball /= np.linalg.norm(ball, axis=1)[:, None]
    half, a, b = np.array([0.5, 0.3, 0.7]), np.array([-0.4, 0.1, 0]), np.array([0.4, 0.3, 0.2])
    box = np.concatenate([np.insert(face, axis, side, axis=1) for axis in range(3) for side in (-1, 1)]) * half
    axis = 0.5 * (b - a)
    rod = 0.2 * ball + np.sign(ball @ axis)[:, None] * axis
    side = np.cross(axis, ball)
    side = 0.2 * side / np.linalg.norm(side, axis=1)[:, None] + rng.uniform(-1, 1, 60_000)[:, None] * axis
    motion = {"center": [0.1, {"expression": "0.3*t"}, -0.2], "rotation": {"keyframes": [[0, [0, 0, 0]], [1, [40, -70, 110]]]}}
    document = {"name": "x", "colliders": [
        {"type": "sphere", "radius": 0.6, "side": "inside", "motion": motion},
        {"type": "box", "size": list(2 * half), "motion": motion},
        {"type": "capsule", "start": list(a), "end": list(b), "radius": 0.2, "motion": motion},
    ]}  # fmt: skip
    points = rng.uniform(-1, 1, (60, 3))
    angles = np.radians(np.array([40, -70, 110]) * min(time, 1.0))
    turn = np.eye(3)
    for k, angle in enumerate(angles):
        i, j = (k + 1) % 3, (k + 2) % 3
        one = np.eye(3)
        one[[i, i, j, j], [i, j, i, j]] = np.cos(angle), -np.sin(angle), np.sin(angle), np.cos(angle)
        turn = one @ turn
    for spec, surface in zip(Scene.model_validate(document).colliders, (0.6 * ball, box, np.concatenate([rod, side])), strict=True):
        placed = surface @ turn.T + [0.1, 0.3 * time, -0.2]
        nearest = np.linalg.norm(placed[None] - points[:, None], axis=2).min(axis=1)
        distance = clearance(spec, points, time)
        assert np.abs(np.abs(distance) - nearest).max() < 0.02 and np.abs(nearest).max() > 0.3
        assert (distance < 0).any() and (distance > 0).any()


def test_a_plane_has_no_size():
    (plane,) = Scene.model_validate({"name": "x", "colliders": [{"type": "plane", "center": [0, 1, 0], "normal": [0, 3, 4]}]}).colliders
    assert clearance(plane, np.array([[0.0, 1.0, 1.0], [5.0, 0.0, 0.0]]), 0.0) == pytest.approx([0.8, -0.6])


@pytest.mark.parametrize(("met", "verdict"), [(True, "pass"), (False, "fail")])
def test_crossings_are_counted(met, verdict):
    keys = folding(WILD_RAIL, points=15, substeps=24, self_collision=met)
    more = {**keys.pop("more"), "verify": [{"type": "crossings", "system": "s", "to": 0.8, "every": 8, "tolerance": 0}]}
    (finding,) = verify_scene(network(**keys, more=more), "cpu", threads=1)
    assert finding.verdict == verdict and "in 7 frames" in finding.remark and (finding.measured > 20) != met


@pytest.mark.parametrize(("oracle", "keys", "says"), [
    ({"type": "clearance", "collider": "bal"}, {}, 'there is no collider "bal"'),
    ({"type": "clearance"}, {"colliders": ()}, "no collider that it feels"),
    ({"type": "clearance"}, {"feels": {"colliders": False}}, "no collider that it feels"),
    ({"type": "clearance", "collider": "ball"}, {"feels": {"colliders": False}}, "no collider that it feels"),
    ({"type": "clearance"}, {"colliders": [{**BALL, "action": "kill"}]}, "no collider that it feels"),
    ({"type": "clearance", "system": "z"}, {}, "there is no network"),
    ({"type": "clearance", "from": 3}, {}, "must come after from"),
    ({"type": "crossings", "every": 0}, {}, "every"),
])  # fmt: skip
def test_what_is_not_there_is_named(oracle, keys, says):
    with pytest.raises(ValueError, match=says):
        found({"to": 1, "tolerance": 0, **oracle}, **keys)


def test_a_chain_has_no_surface_to_cross():
    chain = {"generator": {"type": "chain", "count": 3, "start": [0, 0, 0], "end": [1, 0, 0]}, "stiffness": 1}
    with pytest.raises(ValueError, match="s has no surface"):
        network(**chain, more={"verify": [{"type": "crossings", "system": "s", "to": 1, "tolerance": 0}]})
