"""Twin of kernels/springs.py: forces and motion of a network in float64, spring by spring.

A network is a list of springs (i, j, k, c, r): ends, stiffness [N/m], damping [N·s/m], rest length [m].
"""

import numpy as np

from tests.reference.integration import kick


def spring_force(xi, vi, xj, vj, k: float, c: float, r: float) -> np.ndarray:
    """Force on i: Hooke's along the spring, and damping of the rate at which it grows longer."""
    d = xj - xi
    length = np.sqrt(d @ d)
    if length == 0.0:
        return np.zeros(3)
    return (k * (length - r) + c * ((vj - vi) @ d) / length) * d / length


def forces(x: np.ndarray, v: np.ndarray, springs) -> np.ndarray:
    """Force on every point [N]; each spring pulls its two ends by the same amount."""
    total = np.zeros_like(x)
    for i, j, k, c, r in springs:
        f = spring_force(x[i], v[i], x[j], v[j], k, c, r)
        total[i] += f
        total[j] -= f
    return total


def frame(solver: str, x, v, internal, outer, k: np.ndarray, h: float, held: list[dict[int, np.ndarray]], air=None):
    """Return positions and velocities after one frame, a substep of h for each entry of `held`: where pins are at its end.

    internal(x, v), air(x, v, h) and outer(x) are accelerations, k drag rates; the air's is the mean over a time h. Verlet's two half kicks
    that meet between substeps are one, by the springs as they are after the first of them; between the two lies the air.
    """
    springs, air = internal, air or (lambda x, v, h: 0.0 * v)

    def internal(x, v):
        return springs(x, v) if solver == "verlet" else springs(x, v) + air(x, v, h)

    def kicked(v, a, h):
        return np.array([kick(v[i], 0.0, a[i], k[i], h) for i in range(len(v))])

    def hold(x, v, before, pins):
        for i, place in pins.items():
            v[i], x[i] = (place - before[i]) / h, place

    pulls = internal(x, v)
    for pins in held:
        before = x.copy()
        if solver == "euler":
            x, v = x + h * v, kicked(v, internal(x, v) + outer(x), h)
        elif solver == "semi_implicit_euler":
            v = kicked(v, internal(x, v) + outer(x), h)
            x = x + h * v
        elif solver == "drift_kick":
            x = x + h * v
            v = kicked(v, outer(x), h)
        elif solver == "verlet":
            v = v + 0.5 * h * air(x, v, 0.5 * h)
            v = kicked(v + 0.5 * h * pulls, outer(x), 0.5 * h)
            x = x + h * v
            v = kicked(v, outer(x), 0.5 * h)
        hold(x, v, before, pins)
        if solver in ("drift_kick", "verlet"):
            pulls = internal(x, v)
            v = v + (h if solver == "drift_kick" else 0.5 * h) * pulls
        if solver == "verlet":
            v = v + 0.5 * h * air(x, v, 0.5 * h)
    return x, v


def chain_modes(count: int, k: float, m: float) -> np.ndarray:
    """Angular frequencies of `count` masses between two walls, for motion along the chain [rad/s].  Source: Lagrange 1759."""
    n = np.arange(1, count + 1)
    return 2.0 * np.sqrt(k / m) * np.sin(n * np.pi / (2 * (count + 1)))
