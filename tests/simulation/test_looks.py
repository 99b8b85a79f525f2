"""Looks that the engine bakes: colors by a quantity, trails."""

import numpy as np
import pytest

from tests.simulation.scenes import burst, scene
from warpsim import Simulation


@pytest.mark.parametrize(("by", "values"), [
    ("speed", lambda p: np.linalg.norm(p.velocity, axis=1)),
    ("age", lambda p: p.age),
    ("height", lambda p: p.position[:, 1]),
    ("mass", lambda p: p.mass),
    ("radius", lambda p: p.radius),
])  # fmt: skip
def test_a_color_shows_its_quantity(by, values):
    emitter = {"mass": {"mean": 1e-3, "spread": 5e-4}, "radius": {"mean": 1e-3, "spread": 5e-4}}
    probe = Simulation(scene(emitter=emitter), device="cpu", threads=1)
    probe.run(0.2)
    low, high = (float(f(values(probe.frame()["p"]))) for f in (np.min, np.max))
    colored = scene({"look": {"color": {"by": by, "range": [low, high], "map": "coolwarm"}}}, emitter)
    sim = Simulation(colored, device="cpu", threads=1)
    sim.run(0.2)
    p = sim.frame()["p"]
    stops, colors = zip(*colored.systems["p"].look.color.stops, strict=True)
    share = (values(p) - low) / (high - low)
    expected = 255 * np.stack([np.interp(share, stops, channel) for channel in np.array(colors).T], axis=1)
    assert np.abs(p.packed().color - expected).max() < 5.0  # 256 steps over maps that change by up to 2 a step


def trailing(**more):
    look = {"look": {"trail": {"duration": 0.1, "points": 4}}}  # 0.1 s at 60 frames/s over 3 gaps: every second frame
    return scene(look, **more)


def test_a_trail_holds_the_last_places_oldest_first():
    sim = Simulation(
        trailing(emitter=burst(300, shape={"type": "sphere"} | {"radius": 1.0}, lifetime={"mean": 0.5, "spread": 0.3})), device="cpu"
    )
    places = []
    for frame in sim.frames(21):
        places.append(dict(zip(frame["p"].id.tolist(), frame["p"].position, strict=True)))
    frame = sim.frame()["p"]
    points = frame.packed()
    trail = points.trail[:, :, :3] * points.scale + points.offset
    assert trail.shape == (frame.count, 4, 3) and points.trail_color.shape == (frame.count, 4) and 0 < frame.count < 300
    # A slot holds the last frame of its pair: frames 15, 17 and 19; the newest follows the present frame.
    for k, age in enumerate((6, 4, 2, 0)):
        expected = np.array([places[20 - age][identity] for identity in frame.id.tolist()])
        assert np.abs(trail[:, k] - expected).max() < 1.1 * points.scale.max(), k


def test_a_newborn_s_trail_is_one_point():
    sim = Simulation(trailing(emitter=burst(3)), device="cpu", threads=1)
    points = sim.frame()["p"].packed()
    assert points.count == 3 and len(np.unique(points.trail.reshape(-1, 4), axis=0)) == 1


def test_trails_do_not_move_the_particles():
    plain, trails = (Simulation(s, device="cpu", threads=1) for s in (scene(), trailing()))
    for sim in (plain, trails):
        sim.run(0.3)
    assert np.array_equal(plain.frame()["p"].position, trails.frame()["p"].position)


def test_trails_are_the_same_for_any_number_of_threads(monkeypatch):
    monkeypatch.setattr("warpsim.launch.PARALLEL_FROM", 0)
    hashes = set()
    for threads in (1, 3):
        sim = Simulation(trailing(), device="cpu", threads=threads)
        sim.run(0.3)
        hashes.add(sim.state_hash())
    assert len(hashes) == 1
