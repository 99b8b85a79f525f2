"""Orders of every explicit solver on networks: springs with damping, drag, a swinging flow, a moving pin, and cloth in the wind.

What passes for exact is the twin of rk4 in float64 at a quarter of the smallest substep; the solvers run as they do, in float32, whose
roundings of 1e-7 m over a hundred substeps leave 5e-7 m: no error that is compared is below 1e-6 m. Between two substeps that are not yet
small an order shows as a slope that the next terms change: by less than 0.45 downward, which tells it from that of the order below.
"""

import math

import numpy as np
import pytest

from tests.kernels.test_staged import ALPHA, GRAVITY, SWING, WIND, TwinNet, twin_of_a_net, wind
from tests.reference import cloth as sheets
from tests.reference import springs
from tests.simulation.networks import network, simulate, state, tangle

FPS, FRAMES, EXACT = 30, 15, 32
ORDERS = {  # with damping: order, and the substeps per frame between which it shows
    "euler": (1, 4, 16), "semi_implicit_euler": (1, 2, 8), "drift_kick": (1, 2, 8), "verlet": (1, 4, 16), "heun": (2, 4, 16),
    "adams_bashforth_2": (2, 4, 16), "adams_bashforth_3": (3, 4, 16), "adams_bashforth_4": (4, 2, 8), "abm_pece_2": (2, 4, 16),
    "abm_pece_4": (4, 2, 8), "rk4": (4, 1, 4),
}  # fmt: skip


def exact(twin: TwinNet, x: np.ndarray) -> np.ndarray:
    """Places at the end."""
    v = np.zeros_like(x)
    for s in range(FRAMES * EXACT):
        x, v = twin.substep("rk4", x, v, s, EXACT)
    return x


def order(expected: np.ndarray, coarse: int, fine: int, **keys) -> float:
    """Order that shows between two numbers of substeps."""
    errors = []
    for count in (coarse, fine):
        sim = simulate(**keys, substeps=count, fps=FPS, more=WIND)
        sim.run(FRAMES / FPS)
        errors.append(np.abs(state(sim)[0] - expected).max())
    assert errors[1] > 1e-6, "larger than what rounding leaves"
    return math.log(errors[0] / errors[1]) / math.log(fine / coarse)


def net(damping: bool) -> dict:
    """Eight points, swung by a pin, in a flow."""
    keys = tangle(8, 14) | {"mass": 0.8, "pins": [3], "pin_motion": SWING, "coupling": {"alpha": ALPHA}, "gravity": tuple(GRAVITY)}
    return keys if damping else keys | {"damping": [0.0] * len(keys["springs"])}


@pytest.fixture(scope="module", params=[True, False], ids=["damped", "undamped"])
def a_net(request):
    keys = net(request.param)
    return request.param, keys, exact(twin_of_a_net(keys, 1 / FPS / EXACT), np.array(keys["points"]))


@pytest.mark.parametrize("solver", ORDERS)
def test_orders_on_a_net(solver, a_net):
    """Verlet takes the springs' damping at the speed before its kick, which is of first order; without damping it is of second."""
    damped, keys, expected = a_net
    theory, coarse, fine = ORDERS[solver]
    theory = 2 if solver == "verlet" and not damped else theory
    assert theory - 0.45 < order(expected, coarse, fine, **keys, solver=solver) < theory + 0.9


@pytest.fixture(scope="module")
def a_sheet():
    """An undamped sheet of 4 × 3 points in a strong wind across it, held at two corners: air/density is 20/s, 0.67 over a frame."""
    nx, ny, density, edges = 4, 3, 0.1, np.array([[0.6, 0, 0], [0.1, -0.4, 0.05]])
    numbers = {"structural": (6.0, 0.0), "shear": (3.0, 0.0), "bend": (0.5, 0.0)}
    kinds = {kind: {"stiffness": k} for kind, (k, _) in numbers.items()}
    keys = {"type": "cloth", "resolution": [nx, ny], "edges": edges.tolist(), "density": density, "air": 2.0, **kinds}
    keys |= {"pins": [[0, 0], [3, 0]], "gravity": tuple(GRAVITY)}
    table, spec = springs_of(nx, ny, edges, numbers), network(**keys).systems["s"]
    mass = simulate(**keys).frame()["s"].mass.astype(float)

    def forces(x, v, t):
        return springs.forces(x, v, table) + mass[:, None] * sheets.pull(nx, ny, x, v, wind(t), 20.0, 1e-7)

    twin = TwinNet(spec, forces, mass, 0.0, 0.0, 1 / FPS / EXACT)
    return keys, exact(twin, twin.home.copy())


def springs_of(nx, ny, edges, numbers):
    return sheets.springs(nx, ny, edges[0] / (nx - 1), edges[1] / (ny - 1), numbers)


@pytest.mark.parametrize(("solver", "theory", "coarse", "fine", "below"), [
    ("semi_implicit_euler", 1, 4, 16, 0.45), ("verlet", 2, 4, 16, 0.45), ("heun", 2, 4, 16, 0.45), ("adams_bashforth_3", 3, 4, 16, 0.45),
    ("abm_pece_4", 4, 4, 8, 0.45), ("rk4", 4, 2, 8, 0.75),
])  # fmt: skip
def test_orders_of_cloth_in_the_wind(solver, theory, coarse, fine, below, a_sheet):
    """Verlet has half of the air's decay before and half after each half kick (Strang): second order; the staged ones take it as a force.

    rk4 is at rounding where its slope has risen from 3.3 to 4.
    """
    keys, expected = a_sheet
    assert theory - below < order(expected, coarse, fine, **keys, solver=solver) < theory + 0.9
