"""Twin of kernels/integration.py: one substep of every method in float64.

A body is (x, v); `flow(x, m)` and `acceleration(x, m)` are the fields at moment m of the substep: 0 beginning, ½ middle, 1 end.
k is the drag rate [1/s], h the part of the substep in which the body lives [s].
"""

import math

import numpy as np


def mean_decay(z: float) -> float:
    return -math.expm1(-z) / z if z else 1.0


def kick(v, u, a, k: float, h: float):
    """Exact velocity after h under v' = a + k(u − v) with constant a and u."""
    return u + (v - u) * math.exp(-k * h) + a * h * mean_decay(k * h)


def euler(x, v, flow, acceleration, k, h):
    return x + h * v, kick(v, flow(x, 0), acceleration(x, 0), k, h)


def drift_kick(x, v, flow, acceleration, k, h):
    x = x + h * v
    return x, kick(v, flow(x, 1), acceleration(x, 1), k, h)


def semi_implicit_euler(x, v, flow, acceleration, k, h):
    v = kick(v, flow(x, 0), acceleration(x, 0), k, h)
    return x + h * v, v


def verlet(x, v, flow, acceleration, k, h):
    v = kick(v, flow(x, 0), acceleration(x, 0), k, h / 2)
    x = x + h * v
    return x, kick(v, flow(x, 1), acceleration(x, 1), k, h / 2)


def runge_kutta(y, slope, h):
    """Kutta 1901."""
    k1 = slope(y, 0)
    k2 = slope(y + h / 2 * k1, 0.5)
    k3 = slope(y + h / 2 * k2, 0.5)
    k4 = slope(y + h * k3, 1)
    return y + h / 6 * (k1 + 2 * k2 + 2 * k3 + k4)


def rk4(x, v, flow, acceleration, k, h):
    """Strang 1968: half the drag, the forces by Runge–Kutta, half the drag."""
    v = kick(v, flow(x, 0), 0.0, k, h / 2)
    x, v = runge_kutta(np.array([x, v]), lambda y, m: np.array([y[1], acceleration(y[0], m)]), h)
    return x, kick(v, flow(x, 1), 0.0, k, h / 2)


def tracer_euler(x, v, flow, acceleration, k, h):
    x = x + h * flow(x, 0)
    return x, flow(x, 1)


def tracer_rk4(x, v, flow, acceleration, k, h):
    x = runge_kutta(x, flow, h)
    return x, flow(x, 1)


POINTS, WEIGHTS = (0.5 * (part + shift) for part, shift in zip(np.polynomial.legendre.leggauss(16), (1.0, 0.0), strict=True))


def interpolate(nodes, values, s: float):
    """Lagrange's polynomial."""
    terms = [value * math.prod((s - b) / (a - b) for b in nodes if b != a) for a, value in zip(nodes, values, strict=True)]
    return sum(terms)


def ride(x, v, k: float, h: float, nodes, values):
    """Exact motion under v' = −k v + N with N the polynomial through values at nodes (in steps), the integrals by Gauss' rule."""
    z = k * h
    x, v = x + h * mean_decay(z) * v, v * math.exp(-z)
    for s, weight in zip(POINTS, WEIGHTS, strict=True):
        n = weight * interpolate(nodes, values, s)
        x, v = x + h * h * (1 - s) * mean_decay(z * (1 - s)) * n, v + h * math.exp(-z * (1 - s)) * n
    return x, v


def follow(x, h: float, nodes, values):
    """Exact motion under x' = N with that polynomial."""
    return x + h * sum(weight * interpolate(nodes, values, s) for s, weight in zip(POINTS, WEIGHTS, strict=True))


class Adams:
    """Heun (order 1, corrected), Adams–Bashforth, Adams–Bashforth–Moulton: a polynomial through past drives, then one through the next.

    Called with the drives at earlier substeps, latest first, and whether the body lives through the whole substep; returns x, v and the
    drives to keep. Too few of them, or part of a substep: one step by Runge and Kutta's or Nyström's method.
    """

    def __init__(self, order: int, corrects: bool, tracer: bool):
        self.order, self.corrects, self.tracer, self.past = order, corrects, tracer, order - 1

    def __call__(self, x, v, flow, acceleration, k, h, past=(), whole=True):
        def drive(y, m):
            return flow(y, m) if self.tracer else acceleration(y, m) + k * flow(y, m)

        def move(nodes, values):
            return (follow(x, h, nodes, values), v) if self.tracer else ride(x, v, k, h, nodes, values)

        now = drive(x, 0)
        if self.past and not (whole and len(past) >= self.past):
            x1, v1 = self._once(x, v, k, h, drive, now)
        else:
            values = [now, *past[: self.past]]
            x1, v1 = move(range(0, -self.order, -1), values)
            if self.corrects:
                lasting = values[: max(1, self.order - 1)]
                x1, v1 = move(range(1, -len(lasting), -1), [drive(x1, 1), *lasting])
        return x1, flow(x1, 1) if self.tracer else v1, [now, *past][:3] if whole else []

    def _once(self, x, v, k, h, drive, now):
        if self.tracer:
            return runge_kutta(x, drive, h), v
        middle = drive(ride(x, v, k, h / 2, [0], [now])[0], 0.5)
        end = drive(ride(x, v, k, h, [0], [middle])[0], 1)
        return ride(x, v, k, h, [0, 0.5, 1], [now, middle, end])


MULTISTEP = {"heun": (1, True), "abm_pece_2": (2, True), "abm_pece_4": (4, True)}
MULTISTEP |= {f"adams_bashforth_{order}": (order, False) for order in (2, 3, 4)}
METHODS = {
    "euler": euler,
    "drift_kick": drift_kick,
    "semi_implicit_euler": semi_implicit_euler,
    "verlet": verlet,
    "rk4": rk4,
    "tracer_euler": tracer_euler,
    "tracer_rk4": tracer_rk4,
}
METHODS |= {prefix + name: Adams(*what, tracer=bool(prefix)) for prefix in ("", "tracer_") for name, what in MULTISTEP.items()}


def ballistic(x, v, gravity, t: float):
    """Galilei's parabola."""
    return x + v * t + 0.5 * np.asarray(gravity) * t**2, v + np.asarray(gravity) * t
