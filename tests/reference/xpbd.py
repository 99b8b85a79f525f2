"""Twin of kernels/xpbd.py: extended position-based dynamics of a network in float64, spring by spring, in the paper's symbols.

A network is a list of springs (i, j, k, c, r) as in springs.py; w are inverse masses, 0 for pins. Macklin, Müller & Chentanez 2016,
algorithm 1 and eq. 18: Δλ = (−C − α̃ λ)/(∇C M⁻¹ ∇Cᵀ + α̃), Δx = M⁻¹ ∇Cᵀ Δλ, with the compliance α̃ = 1/(k h²).
"""

import numpy as np

from tests.reference.integration import kick, mean_decay


def project(x: np.ndarray, v: np.ndarray, multipliers: np.ndarray, e: int, spring, w: np.ndarray, h: float) -> None:
    """Move the ends of spring e, and change their velocities by as much per substep; in place."""
    i, j, k, _, r = spring
    d = x[j] - x[i]
    length = np.linalg.norm(d)
    if k == 0.0 or length == 0.0 or w[i] + w[j] == 0.0:
        return
    compliance, gradient = 1.0 / (k * h * h), d / length  # of the constraint C = |d| − r, for point j; that for i is its opposite
    change = (-(length - r) - compliance * multipliers[e]) / (w[i] + w[j] + compliance)
    multipliers[e] += change
    for end, sign in ((i, -1.0), (j, 1.0)):
        x[end] += sign * w[end] * change * gradient
        v[end] += sign * w[end] * change * gradient / h


def damp(x: np.ndarray, v: np.ndarray, spring, w: np.ndarray, h: float) -> None:
    """Let the damper of a spring act alone for h by backward Euler, in place: one linear equation for its impulse."""
    i, j, _, c, _ = spring
    d = x[j] - x[i]
    length = np.linalg.norm(d)
    if length == 0.0:
        return
    n = d / length
    speed = n @ (v[j] - v[i])
    impulse = c * h * speed / (1.0 + c * h * (w[i] + w[j]))
    v[i] += w[i] * impulse * n
    v[j] -= w[j] * impulse * n


def frame(x, v, springs, order, w: np.ndarray, outer, k: np.ndarray, h: float, held: list[dict[int, np.ndarray]], turns: int = 1):
    """Return positions and velocities after one frame, a substep of h for each entry of `held`: where pins are at its end.

    outer(x, v) is the acceleration by all but springs, k drag rates, `order` in which the springs are answered.
    """
    for pins in held:
        before, a = x.copy(), outer(x, v)
        v = np.array([kick(v[i], 0.0, a[i], k[i], h) for i in range(len(v))])
        x = x + h * v
        for i, place in pins.items():
            v[i], x[i] = (place - before[i]) / h, place
        multipliers = np.zeros(len(springs))
        response = w * [mean_decay(k[i] * h) for i in range(len(w))]  # drag takes of a spring's impulse as of any other
        for _ in range(turns):
            for e in order:
                project(x, v, multipliers, e, springs[e], response, h)
        for e in order:
            damp(x, v, springs[e], w, h)
    return x, v
