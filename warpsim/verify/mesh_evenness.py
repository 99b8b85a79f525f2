"""Shares of a mesh's surface or volume between parallel planes, worked out exactly: cells for births that are to be even over it."""

import numpy as np

from warpsim.meshes import load_mesh

ACROSS = np.array([1.0, 2.0, 3.0]) / np.sqrt(14.0)  # normal of the planes: askew, so that no side of a mesh lies along them
LEVELS = 2000  # at which shares are looked up in order to cut them into equal ones


class MeshLayers:
    """A mesh cut by planes into layers of equal share of its surface, or of what it encloses."""

    def __init__(self, shape, bins: int):
        mesh = load_mesh(shape.file.path, "verify", shape.scale)
        corners = turned(mesh.vertices.astype(float), shape.rotation)[mesh.triangles] + np.array(shape.center)
        normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        self._heights = np.sort(corners @ ACROSS, axis=1)
        self._weights = 0.5 * (np.linalg.norm(normal, axis=1) if shape.fill == "surface" else normal @ ACROSS)
        self._fill = shape.fill
        self.low, self.high = float(self._heights.min()), float(self._heights.max())
        levels = np.linspace(self.low, self.high, LEVELS)
        below = np.array([self.below(level) for level in levels])
        self.edges = np.interp(np.arange(1, bins) / bins, below / below[-1], levels)
        self.shares = np.diff([0.0, *(self.below(edge) / below[-1] for edge in self.edges), 1.0])

    def below(self, level: float) -> float:
        """Return the area [m²], or the volume [m³], below a plane at a height [m].

        A triangle's part below is A F(t), F quadratic between its corners; by the divergence theorem the volume below is
        Σ A (n·e) E[min(h, t)] = Σ A (n·e) (t − ∫ F), which is cubic.
        """
        a, b, c = self._heights.T
        t = np.clip(level, a, c)
        span, lower, upper = np.maximum(c - a, 1e-30), np.maximum(b - a, 1e-30), np.maximum(c - b, 1e-30)
        if self._fill == "surface":
            part = np.where(t < b, (t - a) ** 2 / (lower * span), 1.0 - (c - t) ** 2 / (upper * span))
            return float((self._weights * np.where(c > a, part, level >= c)).sum())
        first = (t - a) ** 3 / (3.0 * lower * span)
        second = (b - a) ** 2 / (3.0 * span) + (t - b) - (upper**3 - (c - t) ** 3) / (3.0 * upper * span)
        return float((self._weights * (np.minimum(t, level) - np.where(t < b, first, second))).sum())

    def number(self, x: np.ndarray, beside: float) -> np.ndarray:
        """Return the layer of places (n, 3), -1 for those above or below the whole mesh."""
        height = x @ ACROSS
        slack = beside * (self.high - self.low)
        return np.where((height < self.low - slack) | (height > self.high + slack), -1, np.searchsorted(self.edges, height))


def turned(places: np.ndarray, degrees) -> np.ndarray:
    """Return places turned about x, then y, then z, axes that stay."""
    for axis, angle in enumerate(np.radians(degrees)):
        i, j = (axis + 1) % 3, (axis + 2) % 3
        places = places.copy()
        u, v = places[:, i].copy(), places[:, j].copy()
        places[:, i], places[:, j] = np.cos(angle) * u - np.sin(angle) * v, np.sin(angle) * u + np.cos(angle) * v
    return places
