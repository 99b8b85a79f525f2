"""Twin of kernels/steering.py: forces of one boid at x with velocity v in float64, by Reynolds 1999 and the fields of the scene."""

import numpy as np


def along(d, length):
    n = np.linalg.norm(d)
    return d * (length / n) if n > 0 else np.zeros(3)


def seek(x, v, s, goal, drift, radius=np.inf):
    return along(goal - x, s) - v if np.linalg.norm(goal - x) <= radius else np.zeros(3)


def flee(x, v, s, goal, drift, radius=np.inf):
    return along(x - goal, s) - v if np.linalg.norm(goal - x) <= radius else np.zeros(3)


def arrive(x, v, s, goal, drift, radius=1.0):
    d = goal - x
    return along(d, s * min(1.0, np.linalg.norm(d) / radius)) - v


def future(x, s, goal, drift, horizon):
    return goal + drift * min(np.linalg.norm(goal - x) / s, horizon)


def pursue(x, v, s, goal, drift, horizon=2.0):
    return along(future(x, s, goal, drift, horizon) - x, s) - v


def evade(x, v, s, goal, drift, radius=np.inf, horizon=2.0):
    return along(x - future(x, s, goal, drift, horizon), s) - v if np.linalg.norm(goal - x) <= radius else np.zeros(3)


def path(x, v, s, points, closed=False, radius=0.5, horizon=0.5):
    ends = list(zip(points, points[1:] + ([points[0]] if closed else []), strict=False))
    ahead, best = x + v * horizon, None
    for a, b in ends:
        a, e = np.array(a, float), np.array(b, float) - a
        if e @ e == 0:
            continue
        near = a + e * np.clip((ahead - a) @ e / (e @ e), 0, 1)
        gap = np.linalg.norm(ahead - near)
        if best is None or gap < best[0]:
            best = gap, near, e
    gap, near, e = best
    return along(e, s) - v if gap <= radius else along(near + along(e, s * max(horizon, 1e-3)) - x, s) - v


def leader(x, v, s, goal, drift, distance=1.0, radius=1.0):
    behind = x - goal
    ahead = behind @ along(drift, 1.0)
    aside = behind - along(drift, ahead)
    if ahead > 0 and np.linalg.norm(behind) < 2 * distance and np.linalg.norm(aside) < distance:
        return along(aside, s) - v
    return arrive(x, v, s, goal - along(drift, distance), None, radius)


def contain(x, v, s, low, size, radius=1.0, horizon=0.5):
    ahead = x + v * horizon
    below, above = (low + radius - ahead) / radius, (ahead - (low + size - radius)) / radius
    return s * (np.clip(below, 0, 1) - np.clip(above, 0, 1))
