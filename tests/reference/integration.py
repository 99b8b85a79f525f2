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


METHODS = {
    "euler": euler,
    "drift_kick": drift_kick,
    "semi_implicit_euler": semi_implicit_euler,
    "verlet": verlet,
    "rk4": rk4,
    "tracer_euler": tracer_euler,
    "tracer_rk4": tracer_rk4,
}


def ballistic(x, v, gravity, t: float):
    """Galilei's parabola."""
    return x + v * t + 0.5 * np.asarray(gravity) * t**2, v + np.asarray(gravity) * t
