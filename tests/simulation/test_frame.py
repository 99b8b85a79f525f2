"""Frames: snapshots that stay as they are."""

import numpy as np
import pytest

from tests.simulation.scenes import burst, scene
from warpsim import Simulation


def test_a_frame_that_is_held_keeps_its_moment():
    sim = Simulation(scene(), device="cpu", threads=1)
    frames = list(sim.frames(4))
    again = Simulation(scene(), device="cpu", threads=1)
    for kept, fresh in zip(frames, again.frames(4), strict=True):
        assert kept.index == fresh.index and kept.time == fresh.index / 60
        for name in ("position", "velocity", "id", "age", "lifetime", "mass", "radius"):
            assert np.array_equal(getattr(kept["p"], name), getattr(fresh["p"], name)), name


def test_arrays_are_read_only_and_do_not_reach_the_simulation():
    sim = Simulation(scene(), device="cpu", threads=1)
    sim.run(0.1)
    before = sim.state_hash()
    with pytest.raises(ValueError, match="read-only"):
        sim.frame()["p"].position[:] = 0.0
    assert sim.state_hash() == before


def test_an_unknown_system_names_those_there_are():
    with pytest.raises(KeyError, match="there are p"):
        Simulation(scene(), device="cpu").frame()["q"]


def test_the_present_frame_is_made_once_and_shared():
    sim = Simulation(scene(), device="cpu", threads=1)
    first = sim.frame()
    assert sim.frame() is first and first["p"].position is sim.frame()["p"].position


def test_an_empty_scene_runs():
    sim = Simulation(scene().model_copy(update={"systems": {}}), device="cpu")
    sim.run(0.1)
    assert sim.index == 6 and len(sim.frame()) == 0 and sim.statistics() == {}


def test_packed_points_lie_where_the_particles_are():
    look = {"size": {"over_life": [[0, 0.1], [1, 0.3]]}, "color": {"over_life": [[0, "#ff0000"], [1, "#0000ff80"]]}}
    sim = Simulation(scene({"look": look}), device="cpu", threads=1)
    sim.run(0.25)
    frame = sim.frame()
    p, points = frame["p"], frame["p"].packed()
    assert points.count == p.count > 1000 and points.size_max == pytest.approx(0.3, abs=1e-3)
    place = points.position[:, :3] * points.scale + points.offset
    assert np.abs(place - p.position).max() <= 0.51 * points.scale.max() + 1e-6  # half a step, and float32's rounding
    life = p.age / p.lifetime  # the look has 256 steps over life
    assert np.abs(points.position[:, 3] / 65535 * points.size_max - (0.1 + 0.2 * life)).max() < 0.2 / 256 + 1e-4
    assert np.abs(points.color[:, 0].astype(float) - 255 * (1 - life)).max() <= 2.0
    assert np.abs(points.color[:, 3].astype(float) - (255 - 127 * life)).max() <= 2.0


def test_a_limit_packs_a_subset_that_stays_the_same():
    sim = Simulation(scene(emitter=burst(5000, shape={"type": "sphere", "radius": 1.0})), device="cpu", threads=1)
    chosen = []
    for frame in sim.frames(3):
        points = frame["p"].packed(limit=1000)
        assert 0 < points.count <= 1000
        place = points.position[:, :3] * points.scale + points.offset
        nearest = [np.argmin(((frame["p"].position - q) ** 2).sum(axis=1)) for q in place[:50]]
        chosen.append(frame["p"].id[nearest].tolist())
    assert chosen[0] == chosen[1] == chosen[2]


def test_packing_the_past_is_refused():
    sim = Simulation(scene(), device="cpu", threads=1)
    frame = sim.frame()
    assert frame["p"].packed().count == 0
    sim.step_frame()
    with pytest.raises(RuntimeError, match="moved on"):
        frame["p"].packed()
