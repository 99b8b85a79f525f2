"""Twin of kernels/staged.py: a substep of a whole network by Runge and Kutta's, Heun's and Adams' methods in float64.

drive(x, v, m) is the acceleration but for the drag, at moment m of the substep: 0 beginning, ½ middle, 1 end. x and v have any shape;
k is the drag rate [1/s] of all points, h the substep [s].
"""

import math

import numpy as np

from tests.reference.integration import interpolate, mean_decay, ride

ORDERS = {"heun": (1, True), "abm_pece_2": (2, True), "abm_pece_4": (4, True)}
ORDERS |= {f"adams_bashforth_{order}": (order, False) for order in (2, 3, 4)}
METHODS = ("rk4", *ORDERS)


def kicked(v, n, k: float, h: float):
    """v' = −k v + n with constant n."""
    return v * math.exp(-k * h) + n * h * mean_decay(k * h)


def runge_kutta(x, v, drive, k: float, h: float):
    """Cox & Matthews 2002, §3, the drag as their linear part: for k = 0 Kutta's method.

    Returns x, v, and the drives at the beginning, the middle (the mean of two) and the end.
    """
    n = drive(x, v, 0)
    va, xa = kicked(v, n, k, h / 2), x + h / 2 * v
    na = drive(xa, va, 0.5)
    vb, xb = kicked(v, na, k, h / 2), x + h / 2 * va
    nb = drive(xb, vb, 0.5)
    vc, xc = kicked(va, 2 * nb - n, k, h / 2), x + h * vb
    nc = drive(xc, vc, 1)
    middle = (na + nb) / 2
    _, after = ride(x, v, k, h, [0, 0.5, 1], [n, middle, nc])
    return x + h / 6 * (v + 2 * va + 2 * vb + vc), after, (n, middle, nc)


def step(solver: str, x, v, drive, k: float, h: float, past=(), first: bool = True):
    """One substep: x, v and the drives to keep, latest first.

    With too few of them the `first` substep of a frame is one by Runge and Kutta, whose parabola is the past; any other uses what there is.
    """
    if solver == "rk4":
        return *runge_kutta(x, v, drive, k, h)[:2], []
    order, corrects = ORDERS[solver]
    if first and order > 2 and len(past) < order - 1:
        x, v, (n, middle, end) = runge_kutta(x, v, drive, k, h)
        return x, v, [n, *(interpolate([0, 0.5, 1], [n, middle, end], s) for s in (-1, -2))]
    known = [drive(x, v, 0), *past[: order - 1]]
    x1, v1 = ride(x, v, k, h, range(0, -len(known), -1), known)
    if corrects:
        lasting = known[: max(1, order - 1)]
        x1, v1 = ride(x, v, k, h, range(1, -len(lasting), -1), [drive(x1, v1, 1), *lasting])
    elif len(known) == 1:
        x1 = x + h * v1  # kick, then drift: alone of the first order it does not let what swings grow
    return x1, v1, [known[0], *past][:3] if order > 1 else []


def step_matrix(solver: str, stiffness: np.ndarray, damping: np.ndarray, h: float, k: float = 0.0) -> np.ndarray:
    """The linear map of a step of h, once the past is known, for M⁻¹K and M⁻¹C (n, n): of x, h v, h² N₁ … stacked."""
    n, order = len(stiffness), ORDERS.get(solver, (1, True))[0]
    basis = np.eye((1 + order) * n).reshape(1 + order, n, -1)
    x, v, past = basis[0], basis[1] / h, [row / h**2 for row in basis[2:]]
    x, v, kept = step(solver, x, v, lambda x, v, m: -stiffness @ x - damping @ v, k, h, past, first=False)
    return np.concatenate([x, v * h, *(row * h**2 for row in kept[: order - 1])])
