"""Bending: hinges against the twin; native rows, plain kernels and any parts to the bit."""

import numpy as np
import pytest

from tests.reference import bending as twin
from tests.simulation.networks import accelerations, network, simulate, state
from warpsim import Simulation
from warpsim.networks import hinge_energy, hinge_numbers

B, C, H = 3e-3, 2e-4, 1.0 / 600.0
SIDES = (0.9, 0.5)


def sheet(nx: int, ny: int, **keys) -> dict:
    """Keys of a sheet without springs that pull, so that its hinges alone act."""
    edges = [[SIDES[0], 0, 0], [0, -SIDES[1], 0]]
    loose = {"type": "cloth", "resolution": [nx, ny], "edges": edges, "density": 0.4, "structural": {"stiffness": 0.0}}
    return {**loose, "bending": {"stiffness": B, "damping": C}, **keys}


def crumpled(sim, seed=5):
    """Put the points of the present frame near their places, in motion, and return both in float64 as the device has them."""
    rng = np.random.default_rng(seed)
    for key, scale in (("position", 0.05), ("velocity", 1.0)):
        field = sim.systems["s"].population.field(key)
        array = field.numpy()
        array[:, : len(sim.systems["s"].net.points)] += rng.normal(scale=scale, size=(3, len(sim.systems["s"].net.points)))
        field.assign(array)
    return state(sim)


@pytest.mark.parametrize("size", [(2, 2), (3, 2), (2, 4), (3, 3), (7, 5), (66, 4)])
def test_forces_are_those_of_the_twins_energy(size, device):
    """float32 places of 1 m are rounded by 6e-8 m; a hinge multiplies that by 4 k and a point has ten: relative to the largest term."""
    sim = simulate(**sheet(*size), device=device)
    x, v = crumpled(sim)
    found = twin.hinges(*size, SIDES[0] / (size[0] - 1), SIDES[1] / (size[1] - 1))
    expected = twin.forces(x, v, found, B, C)
    mass = sim.frame()["s"].mass.astype(float)[:, None]
    scale = max(k for _, k in found) * (B * 4 * 0.2 + C * 4 * 4)
    assert np.abs(accelerations(sim) * mass - expected).max() < 40 * 2**-24 * scale * (1 + 1 / 0.05)
    assert np.abs(expected).max() > 1e-3 * scale
    spec = sim.scene.systems["s"]
    assert hinge_energy(spec, x) == pytest.approx(twin.energy(x, found, B), rel=1e-9)
    assert sim.statistics()["s"]["elastic_energy"] == pytest.approx(hinge_energy(spec, x), rel=1e-6)


def test_the_twins_force_is_minus_the_gradient_of_its_energy():
    """Central differences of a quadratic function are exact but for rounding."""
    rng = np.random.default_rng(8)
    x, found, step = rng.normal(size=(20, 3)), twin.hinges(5, 4, 0.2, 0.1), 1e-3
    force = twin.forces(x, np.zeros_like(x), found, B, 0.0)
    for p, axis in ((0, 0), (7, 1), (19, 2)):
        there, here = x.copy(), x.copy()
        there[p, axis] += step
        here[p, axis] -= step
        slope = (twin.energy(there, found, B) - twin.energy(here, found, B)) / (2 * step)
        assert force[p, axis] == pytest.approx(-slope, rel=1e-6)


def test_hinges_are_those_of_the_sheet_and_half_along_rims():
    spec = network(**sheet(4, 3)).systems["s"]
    k, c = hinge_numbers(spec)
    a, b = SIDES[0] / 3, SIDES[1] / 2
    assert k == pytest.approx([B * b / a**3, B * a / b**3, 2 * B / (a * b)]) and c == pytest.approx(k * C / B)


@pytest.mark.parametrize("size", [(2, 2), (3, 3), (63, 3), (64, 4), (65, 3), (130, 5), (3, 70)])
def test_parts_and_plain_kernels_share_their_bits(size, monkeypatch):
    monkeypatch.setattr("warpsim.launch.PARALLEL_FROM", 0)
    hashes = set()
    numbers = {"structural": {"stiffness": 20.0, "damping": 0.02}, "pins": ["top"], "gravity": (0.3, -9.81, 0.4), "substeps": 3}
    edges = [[0.1 * (size[0] - 1), 0, 0], [0, -0.12 * (size[1] - 1), 0]]
    scene = network(**sheet(*size, edges=edges, **numbers))
    for native, threads in ((True, 1), (True, 2), (True, 3), (True, 5), (False, 1), (False, 3)):
        sim = Simulation(scene, device="cpu", threads=threads, native=native)
        crumpled(sim)
        sim.run(0.1)
        hashes.add(sim.state_hash())
    assert len(hashes) == 1 and np.isfinite(state(sim)[0]).all()
