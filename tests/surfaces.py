"""Surfaces for tests, as corners of triangles (m, 3, 3) [m], and files of them; bad on purpose."""

from pathlib import Path

import numpy as np


def uneven(count: int, ratio: float) -> np.ndarray:
    """Return places from 0 to 1 whose distances grow by a ratio."""
    steps = ratio ** np.arange(count)
    return np.concatenate([[0.0], np.cumsum(steps)]) / steps.sum()


def quad(corner, u, v, cuts_u, cuts_v) -> np.ndarray:
    """Return a parallelogram from a corner along u and v, cut into pairs of triangles at shares of u and v."""
    corner, u, v = (np.asarray(a, float) for a in (corner, u, v))
    grid = corner + cuts_u[:, None, None] * u + cuts_v[None, :, None] * v
    a, b, c, d = grid[:-1, :-1], grid[1:, :-1], grid[1:, 1:], grid[:-1, 1:]
    return np.concatenate([np.stack([a, b, c], axis=2).reshape(-1, 3, 3), np.stack([a, c, d], axis=2).reshape(-1, 3, 3)])


def block(low, high, cuts=None) -> np.ndarray:
    """Return a box, its sides cut at shares of their length, outward."""
    cuts = np.array([0.0, 1.0]) if cuts is None else cuts
    low, high = np.asarray(low, float), np.asarray(high, float)
    sides = []
    for axis in range(3):
        u, v = (np.eye(3)[(axis + k) % 3] * (high - low) for k in (1, 2))
        across = np.eye(3)[axis] * (high - low)
        sides += [quad(low, v, u, cuts, cuts), quad(low + across, u, v, cuts, cuts)]
    return np.concatenate(sides)


def ring(major=1.0, minor=0.35, around=40, across=16) -> np.ndarray:
    """Return a torus about z, turned so that no edge lies along an axis."""
    s, t = np.meshgrid(np.linspace(0, 2 * np.pi, around + 1), np.linspace(0, 2 * np.pi, across + 1), indexing="ij")
    rho = major + minor * np.cos(t)
    grid = np.stack([rho * np.cos(s), rho * np.sin(s), minor * np.sin(t)], axis=-1) @ turn().T
    grid[-1], grid[:, -1] = grid[0], grid[:, 0]
    a, b, c, d = grid[:-1, :-1], grid[1:, :-1], grid[1:, 1:], grid[:-1, 1:]
    return np.concatenate([np.stack([a, b, c], axis=2).reshape(-1, 3, 3), np.stack([a, c, d], axis=2).reshape(-1, 3, 3)])


def turn() -> np.ndarray:
    """Return a rotation that favors no axis, (3, 3)."""
    q, _ = np.linalg.qr(np.array([[1.0, 2.0, 0.5], [-0.7, 1.0, 1.3], [0.4, -1.1, 2.0]]))
    return q * np.sign(np.linalg.det(q))


def write_obj(path: Path, corners: np.ndarray) -> Path:
    """Write triangles as an OBJ file and return its path."""
    lines = ["v " + " ".join(map(repr, map(float, place))) for place in corners.reshape(-1, 3)]
    lines += [f"f {3 * k + 1} {3 * k + 2} {3 * k + 3}" for k in range(len(corners))]
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return path
