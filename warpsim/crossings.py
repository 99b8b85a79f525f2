"""Crossings: where the edges of a surface go through its own triangles, counted in float64 on a grid of cells."""

import numpy as np

_ROUNDING = 1.0e-13  # of the longest edge cubed: what float64 makes of the volume of a flat tetrahedron


def edges_of(triangles: np.ndarray) -> np.ndarray:
    """Return each edge of the triangles (k, 3) once, as pairs of points (m, 2), the smaller number first."""
    sides = np.sort(np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]]), axis=1)
    return np.unique(sides, axis=0)


def crossings(points: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """Return the pairs (edge of edges_of(triangles), triangle) in which the edge goes through the triangle, (c, 2); none share a corner.

    points: (n, 3) [m]; triangles: (k, 3). An edge that only touches, or lies in the triangle's plane, does not cross it.
    """
    points, edges = np.asarray(points, float), edges_of(triangles)
    if not len(edges) or not np.isfinite(points).all():
        return np.zeros((0, 2), int)
    sides = points[edges]
    longest = np.linalg.norm(sides[:, 1] - sides[:, 0], axis=1).max()
    # Where they cross is within 1/2 of the longest edge from the middle of one, and within 2/3 from the center of a triangle.
    found = [
        pair[_pierces(points, edges, triangles, pair, longest)]
        for pair in _near(sides.mean(axis=1), points[triangles].mean(axis=1), 1.17 * longest)
    ]
    return np.concatenate(found) if found else np.zeros((0, 2), int)


def _near(places: np.ndarray, centers: np.ndarray, reach: float):
    """Yield arrays of pairs (place, center) among which are all that are nearer than the reach [m]."""
    low = np.minimum(places.min(axis=0), centers.min(axis=0))
    cells = [np.floor((x - low) / max(reach, 1e-300)).astype(np.int64) + 1 for x in (places, centers)]
    size = cells[0].max(axis=0).clip(cells[1].max(axis=0)) + 2
    number, wanted = (c @ np.array([size[1] * size[2], size[2], 1]) for c in cells)
    order = np.argsort(number, kind="stable")
    ranked = number[order]
    for across in (-1, 0, 1):
        for down in (-1, 0, 1):
            row = wanted + across * size[1] * size[2] + down * size[2]
            begin, end = np.searchsorted(ranked, row - 1, "left"), np.searchsorted(ranked, row + 1, "right")
            count = end - begin
            center = np.repeat(np.arange(len(centers)), count)
            turn = np.arange(len(center)) - np.repeat(np.cumsum(count) - count, count)
            place = order[np.repeat(begin, count) + turn]
            d = places[place] - centers[center]
            near = np.einsum("ij,ij->i", d, d) < reach * reach
            yield np.stack([place[near], center[near]], axis=1)


def _pierces(points: np.ndarray, edges: np.ndarray, triangles: np.ndarray, pair: np.ndarray, longest: float) -> np.ndarray:
    """Return which of the pairs (edge, triangle) cross: the ends lie on both sides, and the line passes the three edges on one side."""
    ends, corners = edges[pair[:, 0]], triangles[pair[:, 1]]
    apart = np.flatnonzero((ends[:, :, None] != corners[:, None, :]).all(axis=(1, 2)))
    p, q = points[ends[apart, 0]], points[ends[apart, 1]]
    a, b, c = (points[corners[apart, k]] for k in range(3))
    least, flat = _ROUNDING * longest**3, np.zeros(len(pair), bool)
    sides = [_volume(a, b, c, p), _volume(a, b, c, q)]
    passing = [_volume(p, q, a, b), _volume(p, q, b, c), _volume(p, q, c, a)]
    through = (np.minimum(*sides) < -least) & (np.maximum(*sides) > least)
    through &= (np.min(passing, axis=0) > least) | (np.max(passing, axis=0) < -least)
    flat[apart[through]] = True
    return flat


def _volume(a: np.ndarray, b: np.ndarray, c: np.ndarray, d: np.ndarray) -> np.ndarray:
    """Return six times the signed volume of tetrahedra (m,) [m³]."""
    return np.einsum("ij,ij->i", np.cross(b - a, c - a), d - a)
