"""Census: nearest distances and clusters against all pairs, order, polarization and milling of courses that are known."""

import numpy as np
import pytest

from tests.kernels.flocks import flock
from warpsim import Simulation
from warpsim.systems.census import Census, course_numbers

DOMAINS = {
    "none": {"min": [-9, -9, -9], "max": [9, 9, 9]},
    "periodic": {"min": [0, 0, 0], "max": [6, 6, 6], "boundary": "periodic"},
    "flat": {"min": [0, 0, 1], "max": [7, 5, 1], "boundary": "periodic"},
}


def by_all_pairs(x, reach, edges):
    """Mean distance of those who have somebody within reach to the nearest, and the number of clusters."""
    d = x[:, None] - x[None]
    d -= edges * np.floor(d / np.where(edges > 0, edges, 1.0) + 0.5) * (edges > 0)
    distance = np.linalg.norm(d, axis=2)
    linked = distance < reach
    np.fill_diagonal(distance, np.inf)
    nearest = distance.min(axis=1)
    label = np.arange(len(x))
    while True:
        lower = np.where(linked, label[None], len(x)).min(axis=1)
        if (lower == label).all():
            break
        label = lower
    near = nearest[nearest < reach]
    return (near.mean() if len(near) else 0.0), len(set(label))


@pytest.mark.parametrize("native", [True, False])
@pytest.mark.parametrize("name", DOMAINS)
@pytest.mark.parametrize("count", [1, 2, 40, 400])
def test_distances_and_clusters_are_those_of_all_pairs(name, count, native, tmp_path, device, rng):
    domain = DOMAINS[name]
    low, high = np.array(domain["min"], float), np.array(domain["max"], float)
    x = (low + rng.random((count, 3)) * (high - low) * 0.999).astype(np.float32)
    sim = Simulation(flock(tmp_path, x, np.ones_like(x), domain=domain, perception={"radius": 0.7}), device=device, native=native)
    found = sim.statistics()["f"]
    edges = high - low if domain.get("boundary") == "periodic" else np.zeros(3)
    nearest, clusters = by_all_pairs(x.astype(float), 0.7, edges)
    assert found["clusters"] == clusters and found["nearest"] == pytest.approx(nearest, abs=1e-6)


def test_a_copy_on_the_cpu_says_the_same(tmp_path):
    """As a GPU asks for."""
    x = np.random.default_rng(2).random((300, 3)) * 6
    sim = Simulation(flock(tmp_path, x, x - 3, domain=DOMAINS["periodic"], perception={"radius": 0.7}), device="cpu")
    sim.step_frame()
    system = sim.systems["f"]
    assert Census(system, True, copied=True).numbers() == Census(system, True).numbers() == system.statistics()


def test_clusters_follow_a_radius_that_changes(tmp_path):
    x = np.array([[0, 0, 0], [1, 0, 0], [5, 0, 0]], np.float32)
    sim = Simulation(flock(tmp_path, x, 0 * x, perception={"radius": 2.0}), device="cpu")
    assert sim.statistics()["f"]["clusters"] == 2
    sim.change("systems.f.perception.radius", 0.5)
    assert sim.statistics()["f"]["clusters"] == 3


def test_asking_changes_nothing(tmp_path):
    x = np.random.default_rng(1).random((200, 3)) * 4
    hashes = []
    for asks in (True, False):
        sim = Simulation(flock(tmp_path, x, x - 2, perception={"radius": 1.0}), device="cpu")
        for _ in range(5):
            sim.step_frame()
            if asks:
                sim.statistics()
        hashes.append(sim.state_hash())
    assert hashes[0] == hashes[1]


def test_numbers_of_known_courses():
    ring = np.linspace(0, 2 * np.pi, 60, endpoint=False)
    x = np.stack([np.cos(ring), np.sin(ring), 0 * ring], axis=1)
    around = np.stack([-np.sin(ring), np.cos(ring), 0 * ring], axis=1)
    along = np.tile([0.0, 0.0, 3.0], (60, 1))
    assert course_numbers(x, around, False) == pytest.approx({"order": 0, "polarization": 90, "milling": 1}, abs=1e-9)
    assert course_numbers(x, along, False) == pytest.approx({"order": 1, "polarization": 0, "milling": 0}, abs=1e-6)
    half = np.concatenate([along[:30], np.tile([3.0, 0.0, 0.0], (30, 1))])
    assert course_numbers(x, half, False)["order"] == pytest.approx(np.sqrt(0.5))
    assert course_numbers(x, half, False)["polarization"] == pytest.approx(45)
    assert course_numbers(x, 0 * along, False) == {"order": 0.0, "polarization": 0.0, "milling": 0.0}
