"""What every explicit method stands: oscillators against the twins' steps, and never above what a random network stands."""

import math

import numpy as np
import pytest

from tests.reference.staged import METHODS, step_matrix
from tests.simulation.networks import network, simulate, state, tangle
from tests.simulation.test_stability import matrices
from warpsim.amplification import GROWING, STAGED, largest_growth
from warpsim.networks import network_of
from warpsim.stability import GROWTH, Loads, longest_for, network_loads

SPLIT = ("euler", "semi_implicit_euler", "drift_kick", "verlet")
ALONE = (0.0, 0.0)


def growth(matrix: np.ndarray) -> float:
    return float(np.abs(np.linalg.eigvals(matrix)).max())


def split_matrix(solver: str, stiffness, damping, air, k: float, h: float, drag: float) -> np.ndarray:
    """The linear map of a substep of (x, v): springs, air across the sheet with its projector, and drag, in each method's order."""
    n, c = len(stiffness), h if not drag else -math.expm1(-drag * h) / drag
    one, none = np.eye(n), np.zeros((n, n))
    keep, slow = math.exp(-drag * h), math.exp(-0.5 * drag * h)
    lost = -math.expm1(-k * h) * air
    drift, still = np.block([[one, h * one], [none, one]]), np.block([[one, none], [none, keep * one]])
    if solver in ("euler", "semi_implicit_euler"):
        kick = np.block([[one, none], [-c * stiffness, keep * one - c * damping - (c / h) * lost]])
        return drift @ kick if solver == "semi_implicit_euler" else kick + drift - np.eye(2 * n)
    if solver == "drift_kick":
        return np.block([[one, none], [-h * stiffness, one - h * damping - lost]]) @ still @ drift
    half = np.block([[one, none], [none, slow * one]])
    pull = np.block([[-h * stiffness, -h * damping]])  # then the air, at the speed halfway through the kick
    kick = np.eye(2 * n)
    kick[n:] += pull - lost @ (np.block([[none, one]]) + 0.5 * pull)
    return kick @ half @ drift @ half


def random_network(seed: int, **keys):
    """A small random network at rest or stretched, with springs damped by no law, in proportion, or not at all."""
    net_keys = tangle(6 + seed % 3, 12, seed)
    damping = net_keys["damping"] if seed % 3 == 0 else [0.004 * k * (seed % 3 - 1) for k in net_keys["stiffness"]]
    spec = network(**(net_keys | {"damping": damping}), pins=[0, 5], **keys).systems["s"]
    net = network_of(spec, "s")
    length = np.linalg.norm(np.diff(net.points[net.springs], axis=1)[:, 0], axis=1)
    rest = length if seed % 2 else np.minimum(spec.rest_length, length)
    return spec.model_copy(update={"rest_length": tuple(rest.tolist())}), net


@pytest.mark.parametrize("solver", STAGED)
def test_an_oscillators_growth_is_the_twins(solver):
    """Both in float64, eigenvalues of the same small matrix by other formulas."""
    assert set(STAGED) == set(METHODS)
    rng = np.random.default_rng(1)
    for _ in range(40):
        a, g, z = rng.uniform(0.05, 4), rng.uniform(0, 2), rng.choice([0, 0.3, 0.99, 1.01, 5])
        expected = growth(step_matrix(solver, np.array([[a]]), np.array([[g]]), 1.0, z))
        assert largest_growth(solver, *(np.array([value]) for value in (a, g, z))) == pytest.approx(expected, rel=1e-12)


@pytest.mark.parametrize(("solver", "limit"), [("rk4", 2 * math.sqrt(2)), ("heun", 2.0), *((name, 2.0) for name in SPLIT[1:])])
def test_the_limits_that_are_known_by_name(solver, limit):
    """ω h without damping: Kutta's 2√2, and 2 of the symplectic methods and of Heun's by linear acceleration."""
    assert longest_for(solver, Loads(25.0, 0.0, 0.0, 0.0, ALONE)) == pytest.approx(limit / 5.0, rel=2e-5)


@pytest.mark.parametrize("solver", STAGED)
def test_which_methods_let_an_undamped_swing_grow(solver):
    """At ω h = 0.2 by 2.7e-4 a step with adams_bashforth_2, 8e-7 with abm_pece_4; all others take from it, rk4 4e-7, which is the least."""
    factor = largest_growth(solver, np.array([0.04]), np.zeros(1), np.zeros(1))
    assert factor > 1 + 5e-7 if solver in GROWING else factor < 1 - 1e-7


@pytest.mark.parametrize("solver", ["euler", *GROWING])
def test_where_a_swing_grows_damping_gives_a_bound_and_without_it_growth_has_one(solver):
    """Without damping a second makes of 1 what e^GROWTH is, at the substep that is told; damping in proportion allows a longer one."""
    bare, damped = Loads(400.0, 0.0, 0.0, 0.0, ALONE), Loads(400.0, 2.0, 2.0 / 400.0, 0.0, ALONE)
    h = longest_for(solver, bare)
    one = [np.array([[value]]) for value in (400.0, 0.0)]
    matrix = step_matrix(solver, *one, h) if solver in STAGED else split_matrix(solver, *one, one[1], 0.0, h, 0.0)
    assert math.log(growth(matrix)) / h == pytest.approx(GROWTH, rel=0.01)
    assert longest_for(solver, damped) > 1.5 * h


@pytest.mark.parametrize("seed", range(50))
def test_the_bound_is_never_above_what_a_random_network_stands(seed):
    """Every staged method at 0.999 of its bound and at 5 times it: there something grows, so that it is not just careful."""
    spec, net = random_network(seed)
    loads, (stiffness, damping) = network_loads(spec, net), matrices(spec, net)
    for solver in STAGED:
        longest = longest_for(solver, loads)
        allowed = 1 + 1e-6 + (GROWTH * longest if solver in GROWING else 0.0)
        assert growth(step_matrix(solver, stiffness, damping, 0.999 * longest)) < allowed, solver
        assert growth(step_matrix(solver, stiffness, damping, 5 * longest)) > 1 + 1e-6 or solver in GROWING, solver


@pytest.mark.parametrize("seed", range(50))
def test_air_and_drag_are_counted(seed):
    """Points in the wind, their normals any way, and drag: semi_implicit_euler and drift_kick stand less, verlet as much as without."""
    spec, net = random_network(seed)
    stiffness, damping = matrices(spec, net)
    rng = np.random.default_rng(seed)
    normals = rng.normal(size=(len(stiffness) // 3, 3))
    normals /= np.linalg.norm(normals, axis=1)[:, None]
    air = np.zeros_like(stiffness)
    for i, n in enumerate(normals):
        air[3 * i : 3 * i + 3, 3 * i : 3 * i + 3] = np.outer(n, n)
    k, drag = rng.uniform(0, 60, 2)
    loads = network_loads(spec, net)._replace(air=k, drag=(drag, drag))
    for solver in SPLIT:
        longest = longest_for(solver, loads)
        step = split_matrix(solver, stiffness, damping, air, k, 0.999 * longest, drag)
        assert growth(step) < 1 + 1e-6 + (GROWTH * longest if solver == "euler" else 0.0), solver
    for solver in STAGED:
        longest = longest_for(solver, loads)
        step = step_matrix(solver, stiffness, damping + k * air, 0.999 * longest, drag)
        assert growth(step) < 1 + 1e-6 + (GROWTH * longest if solver in GROWING else 0.0), solver


def test_air_and_drag_of_a_sheet_are_those_of_its_points():
    """air/density across the sheet; drag over the mass of a point, a quarter of it in a corner."""
    sheet = {"type": "cloth", "resolution": [5, 4], "edges": [[4, 0, 0], [0, -3, 0]], "density": 0.5, "air": 3.0, "drag": 0.2}
    spec = network(**sheet, structural={"stiffness": 10.0}).systems["s"]
    loads = network_loads(spec, network_of(spec, "s"))
    assert loads.air == pytest.approx(6.0) and loads.drag == pytest.approx((0.2 / 0.5, 0.2 / 0.125))
    spec = network(**tangle(), coupling={"viscosity": 2.0}, radius=0.1).systems["s"]
    loads = network_loads(spec, network_of(spec, "s"))
    assert loads.drag[1] == pytest.approx(6 * math.pi * 0.2 / min(spec.mass)) and loads.air == 0.0


@pytest.mark.parametrize("damping", [0.0, 2.0])
@pytest.mark.parametrize("solver", STAGED)
def test_a_mass_on_a_spring_swings_down_or_up_as_its_matrix_says(solver, damping):
    """ω h = 0.8, γ h = 0 or 0.08: the amplitude over as many steps as change it by e^1.5, its rate by a straight line, to 3 %.

    What is left of the swing's own ripple, at twice its frequency, is (ω h)²/4 of one period; with 8 periods and more it is below that.
    """
    omega, h = 20.0, 0.04
    rate = math.log(largest_growth(solver, np.array([0.64]), np.array([damping * h]), np.zeros(1)))
    count = min(max(70, math.ceil(1.5 / abs(rate))), 1500)
    away = 1.02 if rate < 0.0 else 1.0002  # neither to float32's digits nor to the other side
    keys = {"points": [[0, 0, 0], [away, 0, 0]], "springs": [[0, 1]], "rest_length": 1.0, "mass": 1.0, "stiffness": omega**2, "pins": [0]}
    sim = simulate(**keys, damping=damping, solver=solver, substeps=1, fps=1 / h)
    series = []
    for _ in range(count):
        sim.step_frame()
        x, v = (values[1, 0] for values in state(sim))
        series.append(math.log(math.hypot(x - 1.0, v / omega)))
    start = 10  # steps until what the start leaves of other roots has died away
    slope = np.polyfit(np.arange(start, count), series[start:], 1)[0]
    assert slope == pytest.approx(rate, rel=0.03)
