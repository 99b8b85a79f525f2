"""Twin of kernels/flock.py and flight.py: whom a boid sees among all others, and what it does, in float64 and without a grid."""

from dataclasses import dataclass, field

import numpy as np


@dataclass
class Rules:
    """The flock's numbers, by the fields of the scene; radii per rule are absent where they are the perception's."""

    radius: float
    field_of_view: float = 360.0
    weights: dict = field(default_factory=lambda: {"separation": 1.0, "cohesion": 1.0, "alignment": 1.0})
    radii: dict = field(default_factory=dict)
    period: tuple = (0.0, 0.0, 0.0)  # edges of a periodic domain, 0 along an axis that is not
    nearest: int | None = None  # how many of those seen count


def differences(x: np.ndarray, rules: Rules) -> np.ndarray:
    """Return d = x_j − x_i, (n, n, 3), the shortest way round a periodic domain."""
    d = x[None] - x[:, None]
    for axis, edge in enumerate(rules.period):
        if edge:
            d[..., axis] -= edge * np.floor(d[..., axis] / edge + 0.5)
    return d


def sees(d: np.ndarray, v: np.ndarray, rules: Rules) -> np.ndarray:
    """Return whether i has j for a neighbor, (n, n): within reach, at an angle of at most half the field of view, and not itself; of these
    all, or the nearest."""
    distance = np.linalg.norm(d, axis=2)
    ahead = (d * v[:, None]).sum(axis=2)
    half = np.cos(np.radians(0.5 * rules.field_of_view))
    in_view = ahead >= half * distance * np.linalg.norm(v, axis=1)[:, None] if rules.field_of_view < 360 else np.ones_like(distance, bool)
    seen = (distance < rules.radius) & in_view & ~np.eye(len(d), dtype=bool)
    if rules.nearest is not None:
        rank = np.argsort(np.argsort(np.where(seen, distance, np.inf), axis=1, kind="stable"), axis=1, kind="stable")
        seen &= rank < rules.nearest
    return seen


def forces(x: np.ndarray, v: np.ndarray, rules: Rules) -> np.ndarray:
    """Return F = w_s Σ (P_i − P_j)/|d|² + w_c (centroid − P_i) + w_a (mean v − v_i), (n, 3) [N]; a rule without neighbors is silent."""
    d, count = differences(x, rules), len(x)
    seen, square = sees(d, v, rules), (d**2).sum(axis=2)
    total = np.zeros((count, 3))
    for i in range(count):
        near = {key: np.flatnonzero(seen[i] & (square[i] < rules.radii.get(key, rules.radius) ** 2)) for key in rules.weights}
        j = near["separation"]
        closest = 1e-3 * rules.radius
        total[i] -= rules.weights["separation"] * (d[i, j] / np.maximum(square[i, j], closest**2)[:, None]).sum(axis=0)
        if len(near["cohesion"]):
            total[i] += rules.weights["cohesion"] * d[i, near["cohesion"]].mean(axis=0)
        if len(near["alignment"]):
            total[i] += rules.weights["alignment"] * (v[near["alignment"]].mean(axis=0) - v[i])
    return total


def step(x: np.ndarray, v: np.ndarray, rules: Rules, h: float, mass: float, band: tuple, low: np.ndarray, size: np.ndarray) -> tuple:
    """Return x and v after a substep: v ← v + h F/m within the band of speeds, x ← x + h v, thrown back by the walls of a box."""
    v = v + h * forces(x, v, rules) / mass
    speed = np.linalg.norm(v, axis=1)
    v = v * (np.clip(speed, *band) / speed)[:, None]
    x = x + h * v
    below, above = x < low, x > low + size
    v = np.where(below, np.abs(v), np.where(above, -np.abs(v), v))
    return np.where(below, 2 * low - x, np.where(above, 2 * (low + size) - x, x)), v


def vicsek_courses(x: np.ndarray, v: np.ndarray, rules: Rules) -> np.ndarray:
    """Return the unit vectors along the sum of the velocities of each boid's neighborhood, itself included, (n, 3)."""
    seen = sees(differences(x, rules), v, rules) | np.eye(len(x), dtype=bool)
    course = seen.astype(float) @ v
    return course / np.linalg.norm(course, axis=1)[:, None]


def forces_of_others(x: np.ndarray, v: np.ndarray, y: np.ndarray, w: np.ndarray, rules: Rules) -> np.ndarray:
    """Return what the boids of another flock, at y with velocities w, make those at x do, (n, 3) [N]."""
    total = np.zeros((len(x), 3))
    for i in range(len(x)):
        both = forces(np.concatenate([x[i : i + 1], y]), np.concatenate([v[i : i + 1], w]), rules)
        total[i] = both[0]
    return total
