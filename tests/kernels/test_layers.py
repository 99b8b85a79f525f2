"""Layers of a sheet that meets itself: pushes and brakes against the twin; native loops, plain kernels and any parts to the bit."""

import numpy as np
import pytest

from tests.reference import layers as twin
from tests.simulation.layers import Crumpled, crumple, sheet
from tests.simulation.networks import network
from warpsim import Simulation
from warpsim.kernels import layers


def disorder(one: Crumpled, size: float, seed: int = 0) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """A crumpled sheet, on its way for one substep."""
    rng = np.random.default_rng(seed)
    x0 = crumple(one.system.net.points, size, seed)
    v = rng.normal(0, 0.5, x0.shape) + [0.3, -2.0, 0.1]
    x = (x0 + one.h * v).astype(np.float32).astype(float)
    return x0, x, v.astype(np.float32).astype(float)


@pytest.mark.parametrize("native", [True, False])
@pytest.mark.parametrize("pins", [[], ["top", [6, 5]]])
def test_pushes_equal_the_twin(native, pins):
    """Float32 of places below 0.5 m and velocities below 4 m/s, a dozen pairs to a point: 64 roundings of the largest."""
    one = Crumpled(native=native, **sheet(13, 11, pins=pins, self_collision={"friction": 0.4}, substeps=20))
    for seed in range(3):
        x0, x, v = disorder(one, 0.25, seed)
        one.put(x0, x, v)
        pairs = twin.meeting(one.places, *one.cell, one.w, one.distance)
        found = one.play("constrain")
        expected = twin.pushed(x, v, one.w, pairs, one.distance, 0.4, 0.05 * one.distance, one.h)
        assert np.array_equal(one.touches, expected[2]) and one.touches.max() > 5, seed
        assert np.abs(found[0] - expected[0]).max() < 2e-6 and np.abs(found[1] - expected[1]).max() < 2e-5, seed
        assert np.abs(found[1] - v).max() > 0.3


def test_points_at_one_place_part_and_nothing_is_lost():
    """Two layers of a strip at exactly the same places: no direction between them, so they part along y, by opposite amounts."""
    one = Crumpled(**sheet(2, 12, substeps=20))
    x = one.system.net.points.copy()
    x[12:] = x[:12][::-1]
    one.put(x, x, np.zeros_like(x))
    moved = one.play("constrain")[0]
    assert one.touches[3] > 0 and np.isfinite(moved).all() and np.ptp(moved[:, 1] - x[:, 1]) > 1e-3
    mass = 1.0 / one.w
    assert np.abs(mass @ (moved - x)).max() < 1e-7 * mass.sum()


@pytest.mark.parametrize("native", [True, False])
@pytest.mark.parametrize("pins", [[], ["left"]])
def test_brakes_equal_the_twin(native, pins):
    """A substep at 3 m/s through a crumpled sheet whose pairs began outside each other's core."""
    one = Crumpled(native=native, **sheet(12, 9, pins=pins, substeps=20))
    numbers = one.part.layers.numbers.numpy()
    core, stride = (float(numbers[k]) for k in (layers.CORE, layers.STRIDE))
    rng, x0 = np.random.default_rng(5), one.system.net.points.copy()
    x0[one.places[:, 1] > 4] = x0[one.places[:, 1] <= 4][: (one.places[:, 1] > 4).sum()] + [0.011, 0.02, 0.115]
    x0 = x0.astype(np.float32).astype(float)
    v = rng.normal(0, 2.0, x0.shape) * (one.w > 0)[:, None]
    x1 = (x0 + one.h * v * [1, 1, 20]).astype(np.float32).astype(float)
    one.put(x0, x0, v)
    one.play("constrain")  # makes the lists; the common motion is none
    one.put(x0, x1, v)
    x, u = one.play("after")
    pairs = twin.meeting(one.places, *one.cell, one.w, one.distance)
    near = [(i, j) for i, j in pairs if np.linalg.norm(x0[i] - x0[j]) < numbers[layers.REACH]]
    expected = twin.braked(x0, x1, v.astype(np.float32).astype(float), one.w, near, core, stride, np.zeros(3), one.h)
    assert np.abs(x - expected[0]).max() < 1e-6 and np.abs(u - expected[1]).max() < 1e-4
    assert (np.abs(x - x1).max(axis=1) > 1e-4).sum() > 20 and one.part.statistics()["self_brakes"] == 1


def test_lists_hold_everybody_within_reach_in_order():
    one = Crumpled(**sheet(30, 21, substeps=20))
    x0, x, v = disorder(one, 0.4)
    one.put(x0, x, v)
    one.play("constrain")
    reach, rows = one.part.layers.numbers.numpy()[layers.REACH], one.part.layers.rows
    near, count = one.part.layers.near.numpy().reshape(-1, rows, 64), one.part.layers.count.numpy()
    pairs = twin.meeting(one.places, *one.cell, one.w, one.distance)
    inside, border = np.zeros((2, one.count, one.count), bool)
    for i, j in pairs:
        r = np.linalg.norm(x0[i] - x0[j])
        inside[i, j] = inside[j, i] = r < reach
        border[i, j] = border[j, i] = abs(r - reach) < 1e-6  # float32 decides
    for i in range(one.count):
        found = near[i // 64, : count[i], i % 64]
        assert (np.diff(found) > 0).all() and set(found) - set(np.flatnonzero(border[i])) == set(np.flatnonzero(inside[i] & ~border[i])), i
    assert 20 < count[: one.count].max() < rows


@pytest.mark.parametrize("native", [True, False])
def test_a_crowd_is_listed_by_distance_and_looked_for_again(native):
    """All points within a tenth of the distance: more than a list holds. The nearest are in it, and the next substep searches anew."""
    one = Crumpled(native=native, **sheet(25, 24, substeps=20))
    rng = np.random.default_rng(1)
    x0 = rng.uniform(-1, 1, (one.count, 3)) * one.distance
    one.put(x0, x0, np.zeros_like(x0))
    one.play("constrain")
    assert one.part.layers.count.numpy()[: one.count].max() == one.part.layers.rows
    assert one.part.layers.flags.numpy()[layers.CROWDED] == 1
    one.play("constrain")
    assert one.part.layers.flags.numpy()[layers.SEARCH] == 1


@pytest.mark.parametrize("size", [(5, 5), (9, 40), (33, 21)])
@pytest.mark.parametrize("solver", ["semi_implicit_euler", "verlet"])
def test_parts_and_plain_kernels_share_their_bits(size, solver, monkeypatch):
    """A sheet falls on edge and folds up: searches, pushes, friction, brakes."""
    monkeypatch.setattr("warpsim.launch.PARALLEL_FROM", 0)
    floor = {"type": "plane", "center": [0, -0.75 * size[1] * 0.05, 0], "friction": 0.5}
    keys = sheet(*size, side=0.05, gravity=(0.4, -9.81, 0.5), substeps=24, thickness=0.01, solver=solver, more={"colliders": [floor]})
    hashes, touched = set(), 0
    for native, threads in ((True, 1), (True, 3), (False, 1), (False, 2)):
        sim = Simulation(network(**keys), device="cpu", threads=threads, native=native)
        for _ in sim.frames(45):
            touched += sim.systems["s"].statistics()["self_contacts"]
        hashes.add(sim.state_hash())
    assert len(hashes) == 1 and (touched > 0 or size == (5, 5))
