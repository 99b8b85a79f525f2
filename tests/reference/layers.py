"""Twin of kernels/layers.py: what the layers of a sheet do to each other, in float64, pair by pair.

A sheet is given by the places (i, j) of its points in it and the edges of a cell at rest; w are inverse masses, d is the distance.
"""

import numpy as np

RELAXATION = 1.75


def meeting(places: np.ndarray, along: np.ndarray, down: np.ndarray, w: np.ndarray, d: float) -> list[tuple[int, int]]:
    """Pairs that must not touch: no neighbors in the sheet, neither by steps nor by their distance at rest, and not both pinned."""
    pairs = []
    for i in range(len(places)):
        for j in range(i):
            a, b = places[j] - places[i]
            if max(abs(a), abs(b)) > 1 and np.linalg.norm(a * along + b * down) > 1.25 * d and w[i] + w[j] > 0.0:
                pairs.append((i, j))
    return pairs


def pushed(x, v, w, pairs, d: float, friction: float, most: float, h: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Places and velocities after all pairs that touch have pushed at once, and how many touch each point."""
    touching = [(i, j) for i, j in pairs if np.linalg.norm(x[i] - x[j]) < d]
    count = np.zeros(len(x), int)
    for i, j in touching:
        count[i] += 1
        count[j] += 1
    dx, dv = np.zeros_like(x), np.zeros_like(v)
    for i, j in touching:
        r, u = x[i] - x[j], v[i] - v[j]
        length = np.linalg.norm(r)
        n = r / length
        closing = max(-(u @ n), 0.0)
        slip = u - n * (u @ n)
        speed = np.linalg.norm(slip)
        rub = -slip * (min(1.0, friction * closing / speed) if speed > 0.0 else 0.0)
        share = min(RELAXATION / max(count[i], count[j]), 1.0) / (w[i] + w[j])
        change = share * (n * min(d - length, most) + rub * h), share * (n * closing + rub)
        for point, sign in ((i, 1.0), (j, -1.0)):
            dx[point] += sign * w[point] * change[0]
            dv[point] += sign * w[point] * change[1]
    return x + dx, v + dv, count


def least_distance(r0: np.ndarray, r1: np.ndarray) -> float:
    """Least |r| on the straight way from r0 to r1."""
    d = r1 - r0
    s = np.clip(-(r0 @ d) / max(d @ d, 1e-300), 0.0, 1.0)
    return float(np.linalg.norm(r0 + s * d))


def braked(x0, x1, v, w, pairs, core: float, stride: float, t, h: float) -> tuple[np.ndarray, np.ndarray]:
    """Places and velocities after a substep in which somebody went too far: each goes half of what is left to another's core."""
    share = np.minimum(stride / np.maximum(np.linalg.norm(x1 - x0 - t, axis=1), 1e-300), 1.0)
    for i, j in [*pairs, *((j, i) for i, j in pairs)]:
        r = x0[i] - x0[j]
        n, room = r / np.linalg.norm(r), np.linalg.norm(r) - core
        room = 0.5 * room if w[j] > 0.0 else room - max((x1[j] - x0[j] - t) @ n, 0.0)
        nearer = -(x1[i] - x0[i] - t) @ n
        if nearer > 0.0 and np.linalg.norm(r) > 0.97 * core:  # deeper ones are left to contact
            share[i] = min(share[i], max(room, 0.0) / nearer)
    share = np.where(w > 0.0, share, 1.0)[:, None]
    return x0 + t + share * (x1 - x0 - t), t / h + share * (v - t / h)
