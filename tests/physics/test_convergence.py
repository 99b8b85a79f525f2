"""Orders of convergence, measured in float64 on the lecture's test equation and on a driven oscillator with and without drag."""

import math

import numpy as np
import pytest

from tests.physics.scenes import scene, start
from warpsim import SceneError, Simulation
from warpsim.convergence import Experiment, convergence_order, study
from warpsim.integrators import FIRST_ORDER_FORM, SECOND_ORDER_FORM

EQUATION = {"type": "expression", "velocity": ["1", "y*x^2*exp(-x)", "0"]}
WIND = {"type": "uniform", "velocity": [{"sine": {"amplitude": 1.0, "period": 3.0}}, 0.3, 0.0]}
SPRING = {"type": "attractor", "center": [0, 0, 0], "strength": 4.0, "law": "spring"}
TABLE = {  # largest error on [0, 10] for steps 0.2, 0.1, 0.05, 0.025, 0.0125, worked out apart from this program
    "euler": (4.610e-1, 2.409e-1, 1.232e-1, 6.234e-2, 3.135e-2),
    "heun": (1.533e-2, 3.766e-3, 9.321e-4, 2.318e-4, 5.780e-5),
    "adams_bashforth_2": (2.179e-2, 7.136e-3, 2.018e-3, 5.352e-4, 1.377e-4),
    "abm_pece_2": (1.356e-3, 9.684e-4, 3.415e-4, 9.896e-5, 2.652e-5),
    "adams_bashforth_4": (8.697e-3, 9.037e-4, 6.998e-5, 4.807e-6, 3.138e-7),
    "abm_pece_4": (1.582e-4, 4.778e-5, 4.637e-6, 3.439e-7, 2.315e-8),
    "rk4": (1.389e-5, 9.218e-7, 5.937e-8, 3.766e-9, 2.371e-10),
}


def lasting(document, seconds: float):
    return document.model_copy(update={"time": document.time.model_copy(update={"duration": seconds})})


def equation(at: float = 0.0, y: float = 0.91, seconds: float = 10.0):
    """f' = f x² e^{−x} as a tracer that goes along x at 1 m/s."""
    first = start((at, y, 0))
    return lasting(scene(first, flow=(EQUATION,), coupling="tracer"), seconds)


def solution(x):
    return 0.91 * np.exp(2.0 - np.exp(-x) * (x * x + 2.0 * x + 2.0))


def oscillator(alpha: float, x=(1.0, 0.2, 0.0), v=(0.0, 1.0, 0.0), at: float = 0.0, seconds: float = 5.0):
    """A spring, gravity, and where there is drag a wind that swings."""
    first = start(x, v)
    first["burst"]["at"] = at
    keys = {"gravity": (0, -1, 0), "forces": (SPRING,), "flow": (WIND,), "coupling": {"alpha": alpha} if alpha else None}
    return lasting(scene(first, **keys), seconds)


def test_the_solution_is_the_one_that_was_worked_out():
    known = {1: 1.068538807443, 2: 1.737307477781, 5: 5.240334234783, 10: 6.686900939689}
    assert [solution(float(x)) for x in known] == pytest.approx(list(known.values()), rel=1e-12)


@pytest.mark.parametrize("solver", TABLE)
def test_errors_on_the_test_equation_are_those_of_the_table(solver):
    """Multistep methods begin with three Runge-Kutta steps. Four digits are printed: half a unit of the last, of the smallest mantissa."""
    experiment, errors = Experiment(equation()), []
    for count in (50, 100, 200, 400, 800):
        y = experiment.path(solver, count).position[:, 1]
        errors.append(np.abs(y - solution(np.linspace(0.0, 10.0, count + 1))).max())
    assert errors == pytest.approx(TABLE[solver], rel=6e-4)


def test_what_passes_for_exact_is_exact():
    """51 200 roundings of numbers up to 10, at worst all one way."""
    exact = Experiment(equation()).exact(6400)
    assert np.abs(exact[:, 1] - solution(exact[:, 0])).max() < len(exact) * np.spacing(10.0) / 2


@pytest.mark.parametrize("solver", FIRST_ORDER_FORM)
def test_orders_of_tracers(solver):
    """A slope over halvings of a step that is not yet small is off by the next power of the step: 0.15 at the largest of them."""
    (method,) = study(equation(), solvers=[solver]).methods
    assert method.order == pytest.approx(method.theory, abs=0.15) and method.theory == FIRST_ORDER_FORM[solver].order


@pytest.mark.parametrize("alpha", [0.0, 0.7, 8.0])
@pytest.mark.parametrize("solver", SECOND_ORDER_FORM)
def test_orders_on_an_oscillator(solver, alpha):
    """Without drag, with some, and overdamped; rk4 splits the drag off and is then of second order."""
    (method,) = study(oscillator(alpha), solvers=[solver]).methods
    assert method.order == pytest.approx(method.theory, abs=0.15)
    assert method.theory == (2 if solver == "rk4" and alpha else SECOND_ORDER_FORM[solver].order)


def test_float32_falls_as_float64_does_down_to_its_floor():
    """One mass on a spring, size 2 m: errors of more than 1e-4 m are the method's, to a percent; none is below a rounding."""
    for method in study(oscillator(0.0), solvers=["euler", "verlet", "adams_bashforth_2"]).methods:
        for error, error32 in zip(method.errors, method.errors32, strict=True):
            assert error32 > 6e-8 and (error < 1e-4 or error32 == pytest.approx(error, rel=0.01))


# ---- Milne's estimate


@pytest.mark.parametrize("solver", ["abm_pece_2", "abm_pece_4"])
def test_milnes_estimate_for_tracers(solver):
    """Within a factor 2 of the true error of each step, wherever it is not about to change its sign."""
    count = 200
    path = Experiment(equation()).path(solver, count)
    ratios = []
    for s in range(10, 120, 5):
        x, y, _ = path.position[s]
        grown = y * solution(x + 10.0 / count) / solution(x)
        ratios.append(path.estimates[s + 1, 0] / abs(path.position[s + 1, 1] - grown))
    assert within_a_factor_of_two(ratios)


@pytest.mark.parametrize("alpha", [0.0, 0.7])
@pytest.mark.parametrize("solver", ["abm_pece_2", "abm_pece_4"])
def test_milnes_estimate_with_inertia(solver, alpha):
    """Of position and of velocity, against the exact path from each step's beginning."""
    count, seconds = 100, 5.0
    path, h = Experiment(oscillator(alpha)).path(solver, count), seconds / count
    ratios = []
    for s in range(6, count, 4):
        after = Experiment(oscillator(alpha, tuple(path.position[s]), tuple(path.velocity[s]), s * h, h)).path("abm_pece_4", 1600)
        off = [np.linalg.norm(end[s + 1] - true[-1]) for end, true in ((path.position, after.position), (path.velocity, after.velocity))]
        ratios.append(path.estimates[s + 1] / off)
    for ratio in np.array(ratios).T:
        assert within_a_factor_of_two(ratio)


def within_a_factor_of_two(ratios) -> bool:
    """Nine in ten: where the error passes through zero, no estimate of its leading term can follow."""
    ratios = np.asarray(ratios)
    return np.mean((ratios > 0.5) & (ratios < 2.0)) >= 0.9


# ---- the flow in float64

VORTEX = {
    "type": "vortex",
    "axis": [1, 2, 3],
    "center": [0.1, 0, 0.2],
    "circulation": {"sine": {"mean": 2.0, "amplitude": 1.0, "period": 0.7}},
}
CORES = [{"model": "ideal"}, *({"model": model, "radius": 0.5} for model in ("rankine", "lamb_oseen", "scully"))]
PRIMITIVES = [dict(VORTEX, core=core) for core in CORES] + [
    {"type": "source", "axis": [0, 1, 1], "center": [0.2, 0, 0], "rate": -0.7},
    {"type": "point_source", "center": [0.3, -0.5, 0.1], "rate": 2.0},
    {"type": "doublet", "axis": [0, 0, 2], "direction": [1, 1, 1], "center": [0, -0.2, 0], "strength": 0.3},
    {"type": "rotation", "axis": [3, 0, 1], "center": [0, 1, 0], "angular_velocity": 1.5},
    {"type": "uniform", "velocity": [0.5, {"keyframes": [[0, 0], [1, 2]]}, 0]},
    EQUATION,
]


@pytest.mark.parametrize("primitive", PRIMITIVES, ids=lambda primitive: primitive["type"])
def test_the_flow_in_float64_is_the_one_that_particles_feel(primitive):
    """Along a path, against the probe, which is in float32: 2e-6 of the speed, and of the largest on the way."""
    document = lasting(scene(start((0.9, 0.4, -0.3)), flow=(primitive,), coupling="tracer"), 1.0)
    path, probe = Experiment(document).path("rk4", 40), Simulation(document, device="cpu", threads=1).flow
    for s in range(1, 41):
        felt = probe.sample(path.position[s : s + 1].astype(np.float32), time=s / 40)[0]
        assert np.abs(felt - path.velocity[s]).max() < 2e-6 * np.abs(path.velocity).max() + 2e-6, s


# ---- what it asks of a scene


@pytest.mark.parametrize(
    ("keys", "path", "words"),
    [
        ({"flow": ({"type": "curl_noise", "amplitude": 1.0, "length": 1.0},), "coupling": "tracer"}, "flow.0", "float64"),
        ({"flow": (dict(VORTEX, travel=[1, 0, 0]),), "coupling": {"alpha": 1.0}}, "flow.0.travel", "travels"),
        ({"motion": "ballistic"}, "systems.p.motion", "closed form"),
    ],
)
def test_scenes_that_do_not_suit_are_refused_in_words(keys, path, words):
    with pytest.raises(SceneError) as error:
        study(lasting(scene(start(), **keys), 1.0))
    assert error.value.problems[0].path == path and words in error.value.problems[0].message


def test_an_unknown_solver_is_named():
    with pytest.raises(ValueError, match="verlet is no solver of this system"):
        study(equation(), solvers=["verlet"])


def test_exact_methods_show_no_order():
    """A parabola is exact for all but the Euler methods: nothing but rounding is left."""
    flight = lasting(scene(start(velocity=(1, 2, 0)), gravity=(0, -9.81, 0), solver="adams_bashforth_3"), 1.0)
    assert convergence_order(flight) is None
    assert convergence_order(flight, solver="euler") == pytest.approx(1.0, abs=0.01)


def test_instability_is_no_error_of_ours():
    stiff = dict(SPRING, strength=1e6)
    method = study(lasting(scene(start((1, 0, 0)), forces=(stiff,)), 5.0), solvers=["adams_bashforth_4"], rungs=3).methods[0]
    assert method.errors[0] == math.inf


def test_orders_round_a_vortex():
    """The classical flow in float64: a tracer on a circle, where Runge-Kutta keeps the radius to the sixth power of the step."""
    whirl = scene(start((0.5, 0, 0)), flow=({"type": "vortex", "axis": [0, 0, 1], "circulation": 2.0},), coupling="tracer")
    for method in study(lasting(whirl, 3.0), solvers=["euler", "heun", "adams_bashforth_3", "abm_pece_4"]).methods:
        assert method.order == pytest.approx(method.theory, abs=0.15)


def test_a_path_into_a_singularity_is_refused():
    drain = scene(start((0.0, 0, 0)), flow=({"type": "expression", "velocity": ["1/x", "0", "0"]},), coupling="tracer")
    with pytest.raises(SceneError, match="leaves the finite world"):
        study(lasting(drain, 1.0))
