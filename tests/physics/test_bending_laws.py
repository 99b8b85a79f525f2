"""Laws of bending: M = B κ in every direction and on every grid, conserved momentum, what damping leaves alone, the longest substep."""

import math

import numpy as np
import pytest

from tests.physics.test_cloth_laws import put
from tests.reference.bending import hinges
from tests.simulation.networks import accelerations, network, simulate, state
from warpsim.networks import network_of
from warpsim.stability import longest_substep

B = 4e-3


def sheet(nx: int, ny: int, a=0.05, b=0.05, **keys) -> dict:
    """Keys of a flat sheet with cells a × b whose hinges alone act."""
    edges = [[a * (nx - 1), 0, 0], [0, -b * (ny - 1), 0]]
    loose = {"type": "cloth", "resolution": [nx, ny], "edges": edges, "density": 0.4, "structural": {"stiffness": 0.0}}
    return {**loose, "bending": {"stiffness": B}, **keys}


def rolled(home: np.ndarray, angle: float, curvature: float) -> np.ndarray:
    """Return a flat sheet (n, 3) in x and y rolled onto a cylinder across the direction at an angle to x; no length changes."""
    along, across = np.array([math.cos(angle), math.sin(angle), 0]), np.array([-math.sin(angle), math.cos(angle), 0])
    s = (home - home.mean(axis=0)) @ along
    up = np.array([0, 0, 1.0])
    bent = np.outer(np.sin(curvature * s) / curvature, along) + np.outer((1 - np.cos(curvature * s)) / curvature, up)
    return bent + np.outer((home - home.mean(axis=0)) @ across, across)


def work(n: int, angle: float, curvature: float, a: float, b: float) -> float:
    """Return −Σ F·∂x/∂κ of a rolled sheet of n × n cells: the moment times its area, but for what its rims do not have [N·m²]."""
    sim = simulate(**sheet(n + 1, n + 1, a, b))
    home, _ = state(sim)
    put(sim, rolled(home, angle, curvature), np.zeros_like(home))
    step = 1e-6 * curvature
    way = (rolled(home, angle, curvature + step) - rolled(home, angle, curvature - step)) / (2 * step)
    mass = sim.frame()["s"].mass.astype(float)[:, None]
    return -float((accelerations(sim) * mass * way).sum())


@pytest.mark.parametrize("cells", [(0.05, 0.05), (0.05, 0.03)])
@pytest.mark.parametrize("degrees", [0, 90, 45, -45, 20])
def test_the_moment_is_stiffness_times_curvature_in_every_direction(degrees, cells):
    """M = Bκ within 3 % where neighboring cells are folded by 0.1 and by 0.25 rad: sin θ/θ, and chords shorter than the arc, leave 2 %.

    The work of a sheet of n × n cells is M times its area, and rims and corners ∝ n and 1: the second difference is without them.
    """
    a, b = cells
    for fold in (0.1, 0.25):
        curvature = fold / max(a, b)
        sizes = (12, 18, 24)
        first, second, third = (work(n, math.radians(degrees), curvature, a, b) for n in sizes)
        moment = (first - 2 * second + third) / (2 * 6**2 * a * b)
        assert moment == pytest.approx(B * curvature, rel=0.03), fold
        if fold == 0.1:
            assert moment == pytest.approx(B * curvature, rel=0.004)  # (0.1)²/6 and the roundings of places near 1 m


def test_the_moment_grows_linearly_where_that_of_springs_does_not():
    """Twice the curvature: twice the moment within 1 %; bend springs k_b a⁵κ³/8 per row give eight times as much."""
    ratio = work(20, 0.0, 1.0, 0.05, 0.05) / work(20, 0.0, 0.5, 0.05, 0.05)
    assert ratio == pytest.approx(2.0, rel=0.01)


def test_a_cantilever_sags_by_its_weight():
    """ρ g L⁴/(8 B) for small slopes, clamped half a cell past the second row: within 1 %, of which the 24 cells leave 0.5 %."""
    n, a, density, g = 25, 0.02, 0.05, 0.2
    length = (n - 1.5) * a
    keys = {"structural": {"stiffness": 200.0, "damping": 0.05}, "density": density, "substeps": "auto", "drag": 2e-5}
    pins = [[0, 0], [1, 0], [0, 1], [1, 1]]
    sim = simulate(**sheet(n, 2, a, a, **keys, pins=pins), gravity=(0, 0, -g))
    sim.run(8.0)
    x, v = state(sim)
    expected = density * g * length**4 / (8 * B)
    assert -x.reshape(2, n, 3)[:, -1, 2] == pytest.approx([expected] * 2, rel=0.01)
    assert np.abs(v).max() < 0.02 * expected and expected < 0.1 * length


def test_momentum_stays_and_damping_leaves_fall_and_spin_alone():
    """The weights of a hinge add up to nothing and its force lies along m: 2000 substeps of strong damping on a rumpled, spinning sheet."""
    sim = simulate(**sheet(9, 7, bending={"stiffness": B, "damping": 2e-5}, solver="verlet"), fps=100, substeps=20)
    rng, mass = np.random.default_rng(3), sim.frame()["s"].mass.astype(float)[:, None]
    home, _ = state(sim)
    x = rolled(home, 0.4, 6.0) + 0.002 * rng.normal(size=home.shape)
    center = (mass * x).sum(axis=0) / mass.sum()
    put(sim, x - center, np.cross([0.5, 2.0, 1.0], x - center) + np.array([0.2, -0.1, 0.3]))

    def momenta():
        x, v = state(sim)
        return (mass * v).sum(axis=0), np.cross(x, mass * v).sum(axis=0)

    before, scale = momenta(), np.abs(mass * state(sim)[1]).sum()
    sim.run(1.0)
    after = momenta()
    assert after[0] == pytest.approx(before[0], abs=1e-5 * scale)
    assert after[1] == pytest.approx(before[1], abs=1e-4 * scale * 0.3)  # the sheet is 0.3 m wide


def test_a_rigid_turn_is_not_damped_at_all():
    """A rolled sheet in rigid rotation: no hinge changes its length, so that damping is a rounding of the hinge's own force."""
    pulls = []
    for damping in (0.0, 1e-2):
        sim = simulate(**sheet(9, 7, bending={"stiffness": B, "damping": damping}))
        home, _ = state(sim)
        x = rolled(home, 0.4, 6.0)
        put(sim, x, np.cross([1.0, 2.0, -3.0], x))
        pulls.append(accelerations(sim))
    assert np.abs(pulls[1] - pulls[0]).max() < 1e-3 * np.abs(pulls[0]).max()


def test_energy_only_falls_with_damping():
    sim = simulate(**sheet(9, 7, bending={"stiffness": B, "damping": 1e-5}, pins=["left"]), fps=240, substeps=64)
    home, _ = state(sim)
    put(sim, rolled(home, 0.0, 3.0) + home.mean(axis=0))
    energy = []
    for _ in range(60):
        numbers = sim.statistics()["s"]
        energy.append(numbers["kinetic_energy"] + numbers["elastic_energy"])
        sim.step_frame()
    assert (np.diff(energy[1:]) < 1e-4 * energy[1]).all() and energy[-1] < 0.5 * energy[1]


@pytest.mark.parametrize("pins", [[], ["left"]])
@pytest.mark.parametrize("size", [(16, 16), (3, 9), (2, 8)])
def test_the_longest_substep_is_never_too_long(size, pins):
    """λ of the hinges' own matrix in float64: h = 2/√λ; on a large sheet the bound is reached within 5 %."""
    a, b = 0.05, 0.04
    spec = network(**sheet(*size, a, b, pins=pins, solver="verlet")).systems["s"]
    mass = simulate(**sheet(*size, a, b)).frame()["s"].mass.astype(float)
    matrix = np.zeros((len(mass), len(mass)))
    for weights, k in hinges(*size, a, b):
        for p, u in weights.items():
            for q, w in weights.items():
                matrix[p, q] += B * k * u * w
    free = np.setdiff1d(np.arange(len(mass)), spec.pinned(spec.pins))
    root = np.sqrt(mass[free])
    largest = np.linalg.eigvalsh(matrix[np.ix_(free, free)] / np.outer(root, root))[-1]
    bound, exact = longest_substep(spec, network_of(spec, "systems.s")), 2 / math.sqrt(largest)
    assert bound <= exact and (size != (16, 16) or bound > 0.95 * exact)
