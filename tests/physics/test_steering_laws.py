"""Steering laws: who seeks gets up to speed and passes, who arrives rests, who follows a path stays near it, who avoids touches nothing."""

import numpy as np
import pytest

from tests.kernels.flocks import flock
from tests.kernels.test_steering import SOLIDS
from warpsim import Simulation

ALONE = {"separation": 0, "cohesion": 0, "alignment": 0}


def run(folder, x, v=None, seconds=10.0, fps=60, **keys):
    """Places (frames, n, 3) and velocities of a flock that knows its steering alone."""
    sim = Simulation(flock(folder, np.atleast_2d(x), None if v is None else np.atleast_2d(v), fps=fps, **{**ALONE, **keys}), device="cpu")
    frames = []
    for _ in range(round(seconds * fps)):
        sim.step_frame()
        frames.append((sim.frame()["f"].position.astype(float), sim.frame()["f"].velocity.astype(float)))
    return np.array([frame[0] for frame in frames]), np.array([frame[1] for frame in frames]), sim


def test_who_seeks_takes_up_speed_as_relaxation_has_it(tmp_path):
    """v' = (weight/m)(s − v) toward a far goal: v = s (1 − e^(−t/τ)); kick–drift errs by h/(2τ) of it, 0.8 % at its largest times e^−1."""
    _, v, _ = run(tmp_path, [0, 0, 0], seconds=3, steering=[{"type": "seek", "target": [1000, 0, 0], "speed": 4}], mass=1.0)
    t = np.arange(1, 181) / 60
    assert np.abs(v[:, 0, 0] - 4 * (1 - np.exp(-t))).max() < 4 * 0.0084 * np.exp(-1)


def test_who_arrives_rests_at_the_goal(tmp_path):
    """x'' = (weight/m)((s/R)(c − x) − x') within R: critically damped for weight/m = 4 s/R, at 2 1/s; 10 s leave nothing."""
    x, v, _ = run(tmp_path, [5, 1, -3], steering=[{"type": "arrive", "target": [1, 2, 0], "speed": 2, "radius": 2, "weight": 4}])
    assert np.linalg.norm(x[-1] - [1, 2, 0]) < 1e-4 and np.linalg.norm(v[-1]) < 1e-4
    assert np.linalg.norm(x - [1, 2, 0], axis=2).max() <= np.linalg.norm([4, 1, 3]) + 1e-5  # it never turns back


def test_who_pursues_is_nearer_than_who_seeks(tmp_path):
    """The goal crosses at 3 m/s, the boid makes 4: pursuit goes straight for the meeting point, seeking draws a dog's curve."""
    course = {"keyframes": [[0, [-10, 0, 8]], [20, [50, 0, 8]]]}
    goal = np.stack([-10 + 3 * np.arange(1, 301) / 60, np.zeros(300), np.full(300, 8.0)], axis=1)
    first = {}
    for kind in ("seek", "pursue"):
        behavior = {"type": kind, "target": course, "speed": 4, "weight": 10} | ({"horizon": 10} if kind == "pursue" else {})
        x, _, _ = run(tmp_path, [0, 0, 0], [0, 0, 4], seconds=5, steering=[behavior])
        near = np.linalg.norm(x[:, 0] - goal, axis=1)
        first[kind] = np.argmax(near < 1.0) if (near < 1.0).any() else 300
    assert first["pursue"] < first["seek"]


def test_who_follows_a_path_stays_within_its_radius(tmp_path):
    square = [[-4, 0, -4], [4, 0, -4], [4, 0, 4], [-4, 0, 4]]
    behavior = {"type": "path", "points": square, "closed": True, "radius": 0.4, "horizon": 0.4, "weight": 6}
    x, v, _ = run(tmp_path, [-4, 0, -4.2], [2, 0, 0], seconds=30, steering=[behavior], speed=[1, 2])
    away = np.minimum(np.abs(np.abs(x[:, 0, 0]) - 4), np.abs(np.abs(x[:, 0, 2]) - 4))
    angle = np.unwrap(np.arctan2(x[:, 0, 2], x[:, 0, 0]))
    assert away[120:].max() < 0.4 + 0.4 * 2 * 0.5 and (angle[-1] - angle[0]) / (2 * np.pi) > 1.3  # 60 m of 32 m round, corners cut


def test_wandering_is_smooth_and_has_no_favorite_direction(tmp_path):
    """500 boids after 20 s: the mean of unit vectors is within 4/√(3·500) of none; no frame turns a boid faster than its force can."""
    behavior = {"type": "wander", "radius": 2, "distance": 1, "period": 0.5, "weight": 3}
    x, v, _ = run(
        tmp_path,
        np.zeros((500, 3)),
        np.tile([1.0, 0, 0], (500, 1)),
        seconds=20,
        fps=30,
        steering=[behavior],
        speed=[1, 1],
        perception={"radius": 1e-3},
    )
    assert np.linalg.norm(v[-1].mean(axis=0)) < 4 / np.sqrt(1500) + 0.1
    assert np.linalg.norm(np.diff(v, axis=0), axis=2).max() < 2.2 * 3 / 30


@pytest.mark.parametrize("kind", SOLIDS)
def test_who_avoids_does_not_touch(kind, tmp_path):
    """Forty boids fly at a solid from all sides: nobody's way is bent by contact, seen in speeds that stay as the band has them."""
    rng = np.random.default_rng(2)
    heading = rng.normal(size=(40, 3))
    heading /= np.linalg.norm(heading, axis=1)[:, None]
    if kind == "plane":
        heading[:, 1] = np.abs(heading[:, 1])
    center = np.array(SOLIDS[kind].get("center", [0, 0, -1]), float)
    more = {"colliders": [{"type": kind, **SOLIDS[kind], "restitution": 0}]}
    behavior = {"type": "avoid", "radius": 0.4, "horizon": 1.5, "weight": 8}
    x, v, sim = run(tmp_path, center + 4 * heading, -2 * heading, seconds=4, more=more, steering=[behavior], speed=[2, 2])
    gaps = clearance(kind, x.reshape(-1, 3))
    assert gaps.min() > 0.01, "contacts happen at a gap of 1e-5 m"
    assert np.abs(np.linalg.norm(v, axis=2) - 2).max() < 1e-5


def clearance(kind, x):
    """Distance to a solid of SOLIDS, by geometry."""
    solid = SOLIDS[kind]
    if kind == "plane":
        return x[:, 1] + 2.5
    if kind == "sphere":
        return np.linalg.norm(x - solid["center"], axis=1) - solid["radius"]
    if kind == "capsule":
        nearest = np.stack([np.zeros(len(x)), np.clip(x[:, 1], -2, 2), np.full(len(x), -1.0)], axis=1)
        return np.linalg.norm(x - nearest, axis=1) - solid["radius"]
    turn = np.radians(30)
    d = x - solid["center"]
    local = np.stack([np.cos(turn) * d[:, 0] - np.sin(turn) * d[:, 2], d[:, 1], np.sin(turn) * d[:, 0] + np.cos(turn) * d[:, 2]], axis=1)
    q = np.abs(local) - 0.5 * np.array(solid["size"])
    return np.linalg.norm(np.maximum(q, 0), axis=1) + np.minimum(q.max(axis=1), 0)


def test_soft_walls_turn_boids_before_they_touch(tmp_path):
    rng = np.random.default_rng(3)
    box = {"min": [-5, -5, -5], "max": [5, 5, 5], "boundary": "contain"}
    behavior = {"type": "contain", "radius": 2, "horizon": 0.5, "weight": 10}
    x, _, _ = run(
        tmp_path, rng.uniform(-3, 3, (50, 3)), 2 * rng.normal(size=(50, 3)) / 1.7, seconds=20, steering=[behavior], speed=[1, 3], domain=box
    )
    assert np.abs(x).max() < 5 - 1e-3


def test_followers_come_to_rest_behind_their_leader(tmp_path):
    x0 = np.array([[0, 0, 0], [-6, 0, 3], [-5, 0, -4], [4, 0, 0.3]], float)
    behavior = {"type": "leader", "boid": 0, "distance": 1.0, "radius": 2.0, "weight": 3}
    x, v, _ = run(tmp_path, x0, np.array([[1.0, 0, 0], [0, 0, 0], [0, 0, 0], [0, 0, 0]]), seconds=30, steering=[behavior | {"speed": 3}])
    assert np.abs(v[-1] - [1, 0, 0]).max() < 1e-2
    # Behind by the distance, and by what speed 1 needs: s min(1, |d|/R) = 1 at |d| = R/3.
    assert np.abs(x[-1, 1:] - x[-1, 0] - [-1 - 2 / 3, 0, 0]).max() < 0.05
