"""Flocks: neighbors against brute force, forces against the twin, native loops, plain kernels and any parts to the bit."""

import numpy as np
import pytest

from tests.kernels.flocks import flock, found_neighbors
from tests.reference import flock as twin
from warpsim import Simulation


def configurations():
    """200 random ones: uniform, clustered, on cell borders, negative and far coordinates; endless, contained, periodic in 1, 2, 3 axes."""
    rng = np.random.default_rng(6)
    for number in range(200):
        count = int(rng.choice([0, 1, 2, 3, 20, 150, 400] if number < 195 else [2000]))
        boundary = ("none", "contain", "periodic")[number % 3]
        axes = 3 if number % 2 else int(rng.integers(1, 4))
        size = np.where(np.arange(3) < axes, rng.uniform(2.0, 7.0, 3), 0.0)[rng.permutation(3)]
        low = np.where(size > 0, rng.uniform(-40, 40, 3), rng.choice([0.0, -3.5]))
        kind = ("uniform", "clustered", "borders", "coincident")[number // 3 % 4]
        share = rng.random((count, 3))
        if kind == "clustered":
            share = np.clip(rng.random((5, 3))[rng.integers(0, 5, count)] + 0.02 * rng.normal(size=(count, 3)), 0, 0.999999)
        x = low + share * size
        if kind == "borders":
            x = low + np.minimum(np.round(share * size), size * 0.999999)
        if kind == "coincident":
            x = x[rng.integers(0, max(1, count // 3), count)] if count else x
        if boundary == "none" and number % 4 == 0:
            x = x + rng.choice([-3e4, 3e4], (count, 3))  # far apart: buckets are shared
        view = float(rng.choice([360.0, 270.0, 90.0, 0.0]))
        domain = {"min": low.tolist(), "max": (low + size).tolist(), "boundary": boundary}
        yield number, x.astype(np.float32), rng.normal(size=(count, 3)).astype(np.float32), domain, view


def brute_force(x, v, domain, view, nearest=None, reach=1.0):
    """By the float32 arithmetic of the kernels, so that one at the very reach is judged the same, and so are two as far as each other."""
    size = np.array([b - a for a, b in zip(domain["min"], domain["max"], strict=True)]).astype(np.float32)
    rate = np.where(size > 0, np.float32(1) / np.where(size > 0, size, 1).astype(np.float32), 0).astype(np.float32)
    cosine = np.float32(np.cos(np.radians(0.5 * view))) if view < 360 else np.float32(-2)
    found = []
    for i in range(len(x)):
        d = x - x[i]
        if domain["boundary"] == "periodic":
            d = d - size * np.floor(d * rate + np.float32(0.5))
        d2 = d[:, 0] * d[:, 0] + d[:, 1] * d[:, 1] + d[:, 2] * d[:, 2]
        q = d[:, 0] * v[i, 0] + d[:, 1] * v[i, 1] + d[:, 2] * v[i, 2]
        v2 = v[i, 0] * v[i, 0] + v[i, 1] * v[i, 1] + v[i, 2] * v[i, 2]
        limit = np.float32(-1e37) if cosine < -1 else cosine * abs(cosine) * v2
        with np.errstate(over="ignore"):
            seen = (d2 < np.float32(reach**2)) & (q * np.abs(q) >= limit * d2)
        seen[i] = False
        j = np.flatnonzero(seen)
        found.append(set(j[np.lexsort((j, d2[j]))][:nearest].tolist()))
    return found


def test_neighbors_are_those_of_brute_force_and_each_once(tmp_path, device):
    for number, x, v, domain, view in configurations():
        scene = flock(tmp_path, x, v, domain=domain, perception={"radius": 1.0, "field_of_view": view})
        expected, orders = brute_force(x, v, domain, view), []
        for native in (True, False) if device == "cpu" and number % 5 == 0 else (True,):
            met = found_neighbors(Simulation(scene, device=device, native=native))
            assert [set(row) for row in met] == expected and all(len(set(row)) == len(row) for row in met), (number, domain, view)
            orders.append(met)
        assert all(order == orders[0] for order in orders)


def test_the_nearest_are_those_of_brute_force_and_what_they_make_a_boid_do_has_the_same_bits(tmp_path, device):
    for number, x, v, domain, view in configurations():
        nearest = (1, 2, 7, 8, 9, 64)[number % 6]
        scene = flock(tmp_path, x, v, domain=domain, perception={"radius": 1.0, "field_of_view": view, "nearest": nearest})
        expected, told = brute_force(x, v, domain, view, nearest), []
        for native in (True, False) if device == "cpu" else (True,):
            sim = Simulation(scene, device=device, native=native)
            told.append((sim.systems["f"].steering.numpy().tobytes(), sim.frame()["f"].neighbors.tobytes()))
        met = found_neighbors(sim)
        assert [set(row) for row in met] == expected and all(len(set(row)) == len(row) for row in met), (number, domain, view)
        assert sim.frame()["f"].neighbors.tolist() == [len(row) for row in met] and all(each == told[0] for each in told), number


def cloud(count, seed, size=3.0):
    rng = np.random.default_rng(seed)
    return rng.uniform(0, size, (count, 3)).astype(np.float32), rng.normal(size=(count, 3)).astype(np.float32)


PERIODIC = {"min": [0, 0, 0], "max": [3, 3, 3], "boundary": "periodic"}
RULES = [
    ({}, twin.Rules(1.0)),
    ({"perception": {"radius": 0.9, "field_of_view": 250}}, twin.Rules(0.9, 250)),
    ({"domain": PERIODIC, "perception": {"radius": 1.2, "field_of_view": 300}}, twin.Rules(1.2, 300, period=(3, 3, 3))),
    (
        {"separation": {"weight": 0.3, "radius": 0.5}, "cohesion": -2, "alignment": {"weight": 4, "radius": 0.8}},
        twin.Rules(1.0, 360, {"separation": 0.3, "cohesion": -2, "alignment": 4}, {"separation": 0.5, "alignment": 0.8}),
    ),
    (
        {"domain": PERIODIC, "perception": {"radius": 1.2, "field_of_view": 300, "nearest": 7}},
        twin.Rules(1.2, 300, period=(3, 3, 3), nearest=7),
    ),
]


@pytest.mark.parametrize("native", [True, False])
@pytest.mark.parametrize("case", range(len(RULES)))
def test_forces_equal_the_twin(case, native, tmp_path, device):
    """float32: about 40 neighbors, the nearest at 0.05 m with 20 N: 50 roundings of a sum of sizes of 400 N, 2e-5 N each at most."""
    keys, rules = RULES[case]
    x, v = cloud(300, 7)
    sim = Simulation(flock(tmp_path, x, v, **keys), device=device, native=native)
    f = sim.systems["f"].steering.numpy()[:, :300].T
    expected = twin.forces(x.astype(float), v.astype(float), rules)
    assert np.abs(f - expected).max() < 2e-4 and np.abs(expected).max() > 5


def test_an_isolated_boid_feels_nothing_and_two_at_one_point_part(tmp_path, device):
    x = np.array([[0, 0, 0], [5, 0, 0], [9, 9, 9], [9, 9, 9]], np.float32)
    v = np.array([[1, 2, 3], [0, 0, 0], [1, 0, 0], [1, 0, 0]], np.float32)
    sim = Simulation(flock(tmp_path, x, v), device=device)
    f = sim.systems["f"].steering.numpy()[:, :4].T
    assert not f[:2].any()
    # As if they were the closest that counts, a thousandth of the radius: 1/0.001 N, whose direction takes 4 roundings.
    assert (f[2] == -f[3]).all() and abs(np.linalg.norm(f[2]) - 1000) < 1e-3
    sim.step_frame()
    assert np.isfinite(sim.frame()["f"].position).all() and np.linalg.norm(np.diff(sim.frame()["f"].position[2:], axis=0)) > 0.1


@pytest.mark.parametrize("boundary", ["none", "contain", "periodic"])
@pytest.mark.parametrize(("count", "nearest"), [(1, True), (63, False), (64, True), (65, False), (700, False), (700, True)])
def test_parts_and_plain_kernels_share_their_bits(count, nearest, boundary, monkeypatch, tmp_path):
    monkeypatch.setattr("warpsim.launch.PARALLEL_FROM", 0)
    x, v = cloud(count, 3)
    x[count // 2 :: 9] = x[count // 3]  # some at one place
    domain = {"min": [0, 0, 0], "max": [3, 3, 3], "boundary": boundary}
    keys = {
        "speed": [0.2, 2],
        "turn_rate": 200,
        "max_force": 5,
        "coupling": {"alpha": 0.1},
        "perception": {"radius": 1.0, "field_of_view": 200} | ({"nearest": 5} if nearest else {}),
    }
    more = {"flow": [{"type": "uniform", "velocity": [0.3, 0, 0]}], "colliders": [{"type": "sphere", "center": [1, 1, 1], "radius": 0.4}]}
    scene, hashes = flock(tmp_path, x, v, domain=domain, more=more, **keys), set()
    for native, threads in ((True, 1), (True, 2), (True, 3), (True, 5), (False, 1), (False, 3)):
        sim = Simulation(scene, device="cpu", threads=threads, native=native)
        for _ in range(6):
            sim.step_frame()
        hashes.add(sim.state_hash())
    assert len(hashes) == 1


def test_a_shuffled_flock_moves_the_same_but_for_rounding(tmp_path, device):
    """Sums go by cell and then by slot, so that another order of slots rounds otherwise: 5 frames of 60 neighbors, 1e-6 m."""
    x, v = cloud(300, 5)
    order = np.random.default_rng(1).permutation(300)
    frames = []
    for places, speeds in ((x, v), (x[order], v[order])):
        sim = Simulation(flock(tmp_path, places, speeds), device=device)
        for _ in range(5):
            sim.step_frame()
        frames.append(sim.frame()["f"].position)
    assert np.abs(frames[0][order] - frames[1]).max() < 1e-5
