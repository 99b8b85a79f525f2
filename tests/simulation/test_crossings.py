"""Crossings of a surface with itself: against every edge and triangle tried by another formula, and where there is doubt."""

import numpy as np
import pytest

from warpsim.crossings import crossings, edges_of
from warpsim.networks import sheet


def crossings_by_solving(points: np.ndarray, triangles: np.ndarray) -> set[tuple[int, int]]:
    """Each edge p + s (q − p) with each triangle a + u (b − a) + w (c − a): a system of three equations, all shares inside."""
    found = set()
    for e, (i, j) in enumerate(edges_of(triangles)):
        for t, corners in enumerate(triangles):
            if {i, j} & set(corners.tolist()):
                continue
            a, b, c = points[corners]
            matrix = np.stack([points[i] - points[j], b - a, c - a], axis=1)
            if abs(np.linalg.det(matrix)) > 1e-15:
                s, u, w = np.linalg.solve(matrix, points[i] - a)
                if 0 < s < 1 and u > 0 and w > 0 and u + w < 1:
                    found.add((e, t))
    return found


@pytest.mark.parametrize("seed", range(6))
def test_crossings_equal_those_of_all_pairs(seed):
    """Crumpled sheets, flat and long cells, far from the origin."""
    rng = np.random.default_rng(seed)
    nx, ny = 7 + seed, 9
    points = np.stack([*np.meshgrid(np.arange(nx), np.arange(ny) * (0.2 + 0.3 * seed)), np.zeros((ny, nx))], axis=-1).reshape(-1, 3)
    points = 0.1 * points + 0.3 * np.sin(points @ rng.normal(0, 1.2, (3, 3))) + [0, 50.0 * seed, -7.0]
    triangles = sheet(np.arange(nx * ny).reshape(ny, nx))
    found = crossings(points, triangles)
    expected = crossings_by_solving(points, triangles)
    assert {tuple(pair) for pair in found.tolist()} == expected and len(found) == len(expected) > 1


def test_a_flat_sheet_does_not_cross_itself_however_it_is_turned():
    rng = np.random.default_rng(0)
    points = np.stack([*np.meshgrid(np.linspace(0, 1, 30), np.linspace(0, 1, 30)), np.zeros((30, 30))], axis=-1).reshape(-1, 3)
    triangles = sheet(np.arange(900).reshape(30, 30))
    for _ in range(5):
        turned = points @ np.linalg.qr(rng.normal(size=(3, 3)))[0]
        assert len(crossings(turned, triangles)) == 0 and len(crossings(turned.astype(np.float32), triangles)) == 0


def test_touching_is_not_crossing():
    """An edge that ends in a triangle, one that ends before it, and one that goes through."""
    corners = [[0, 0, 0], [1, 0, 0], [0, 1, 0]]
    for depth, expected in ((0.0, 0), (0.1, 0), (-1e-6, 1)):
        points = np.array([*corners, [0.2, 0.2, depth], [0.2, 0.3, 1.0], [0.3, 0.2, 1.0]])
        assert len(crossings(points, np.array([[0, 1, 2], [3, 4, 5]]))) == 2 * expected, depth


def test_nothing_crosses_where_there_is_nothing():
    points, none = np.zeros((3, 3)), np.zeros((0, 3), int)
    assert len(crossings(points, none)) == 0 and len(crossings(points, np.array([[0, 1, 2]]))) == 0
    assert len(crossings(np.full((6, 3), np.nan), np.array([[0, 1, 2], [3, 4, 5]]))) == 0
