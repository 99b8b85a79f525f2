"""Twin of kernels/mesh_births.py in float64: areas summed and searched, inside told from outside by the solid angle of the surface."""

import math

import numpy as np

from tests.reference.random import BULK, POSITION, random_words, uniform, uniform64


def rotation(degrees) -> np.ndarray:
    """Return the rotation about x, then y, then z, fixed axes."""
    a, b, c = np.radians(degrees)
    x = np.array([[1, 0, 0], [0, math.cos(a), -math.sin(a)], [0, math.sin(a), math.cos(a)]])
    y = np.array([[math.cos(b), 0, math.sin(b)], [0, 1, 0], [-math.sin(b), 0, math.cos(b)]])
    z = np.array([[math.cos(c), -math.sin(c), 0], [math.sin(c), math.cos(c), 0], [0, 0, 1]])
    return z @ y @ x


def on_surface(corners: np.ndarray, key, ordinal: int) -> np.ndarray:
    """Return a place on triangles (m, 3, 3), uniform by area."""
    pick, words = random_words(key, ordinal, BULK), random_words(key, ordinal, POSITION)
    areas = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
    k = int(np.searchsorted(np.cumsum(areas) / areas.sum(), uniform64(*pick[:2]), side="right"))
    root, w = math.sqrt(uniform(words[0])), uniform(words[1])
    a, b, c = corners[min(k, len(corners) - 1)]
    return (1 - root) * a + root * (1 - w) * b + root * w * c


def winding(corners: np.ndarray, x: np.ndarray) -> float:
    """Return how often triangles (m, 3, 3) wind round x: 1 inside.  Source: Van Oosterom & Strackee 1983."""
    a, b, c = (corners[:, k] - x for k in range(3))
    la, lb, lc = (np.linalg.norm(v, axis=1) for v in (a, b, c))
    above = np.einsum("ij,ij->i", a, np.cross(b, c))
    below = la * lb * lc + (a * b).sum(axis=1) * lc + (b * c).sum(axis=1) * la + (c * a).sum(axis=1) * lb
    return float(2.0 * np.arctan2(above, below).sum() / (4.0 * math.pi))


def in_volume(corners: np.ndarray, grid, key, ordinal: int) -> np.ndarray:
    """Return the first of the places drawn in the grid's cells (low, step, cells) that is inside."""
    low, step, cells = np.array(grid[0], float), np.array(grid[1], float), grid[2]
    for attempt in range(1000):
        drawn = key[0], (key[1] + attempt) & 0xFFFFFFFF
        share, words = uniform64(*random_words(drawn, ordinal, BULK)[:2]), random_words(drawn, ordinal, POSITION)
        x = low + (cells[int(share * len(cells))] + np.array([uniform(word) for word in words[:3]])) * step
        if winding(corners, x) > 0.5:
            return x
    raise AssertionError("never inside")


def distance(corners: np.ndarray, x: np.ndarray) -> float:
    """Return the distance from x to triangles (m, 3, 3): to their planes where x is over them, else to their edges."""
    a, b, c = (corners[:, k] for k in range(3))
    normal = np.cross(b - a, c - a)
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    height = np.abs(((x - a) * normal).sum(axis=1))
    foot = x - ((x - a) * normal).sum(axis=1)[:, None] * normal
    over = np.ones(len(corners), bool)
    nearest = np.full(len(corners), np.inf)
    for p, q in ((a, b), (b, c), (c, a)):
        edge = q - p
        over &= (np.cross(edge, foot - p) * normal).sum(axis=1) >= 0.0
        t = np.clip(((x - p) * edge).sum(axis=1) / (edge**2).sum(axis=1), 0.0, 1.0)
        nearest = np.minimum(nearest, np.linalg.norm(p + t[:, None] * edge - x, axis=1))
    return float(np.where(over, height, nearest).min())
