"""Meshes that particles are born on or in, as tables for the device."""

import math

import numpy as np
import warp as wp

from warpsim.kernels.mesh_births import MeshTable
from warpsim.meshes import TriangleMesh, load_mesh
from warpsim.scene import SceneError
from warpsim.scene.emitters import Mesh
from warpsim.scene.problems import Problem

MOST_CELLS = 128  # of the grid along its longest side
MOST_PAIRS = 1 << 22  # of a triangle and a cell within its box
ACCEPTED = 0.5  # share of the cells that should be inside: a finer grid costs more than it saves
UNLIKELY = 1e-9  # chance that every attempt of one birth is outside


def mesh_table(spec: Mesh, where: str, device: str) -> MeshTable:
    """Make the table of a mesh. Raises SceneError for an unusable file, and for an open or empty mesh that is to be filled."""
    mesh = load_mesh(spec.file.path, f"{where}.file")
    table = MeshTable()
    corners = mesh.vertices[mesh.triangles]
    table.corners = wp.array(corners, dtype=wp.vec3, device=device)
    shares = np.cumsum(mesh.area)
    table.areas = wp.array(shares / shares[-1], dtype=wp.float64, device=device)
    if spec.fill == "volume":
        _refuse_unfillable(mesh, where)
        _divide(table, corners.astype(float), mesh.volume, device)
    return table


def _refuse_unfillable(mesh: TriangleMesh, where: str) -> None:
    if not mesh.closed:
        words = f"an open mesh encloses nothing: {mesh.open_edges} of its edges do not lie between two triangles"
        raise SceneError([Problem(f"{words} (close it, or take fill: surface)", path=f"{where}.fill")])
    low, high = mesh.bounds
    if not mesh.volume > 1e-9 * float(np.prod(np.maximum(high - low, 1e-9))):
        raise SceneError([Problem("the mesh encloses no volume (take fill: surface)", path=f"{where}.fill")])


def _divide(table: MeshTable, corners: np.ndarray, volume: float, device: str) -> None:
    """Fill in the grid: the coarsest of which half the candidate cells' volume is inside, or the finest that can be afforded."""
    low, high = corners.min(axis=(0, 1)), corners.max(axis=(0, 1))
    margin = 1e-5 * (high - low) + 4e-7 * np.abs(corners).max() + 1e-30  # float32 rounds places, and so borders of cells
    low, high = low - margin, high + margin
    chosen, fineness = None, 8
    while chosen is None or fineness <= MOST_CELLS:
        count = np.maximum(1, np.ceil(fineness * (high - low) / (high - low).max() - 1e-9)).astype(int)
        step = (high - low) / count
        first = np.clip(np.floor((corners.min(axis=1) - margin - low) / step), 0, count - 1).astype(int)
        last = np.clip(np.floor((corners.max(axis=1) + margin - low) / step), 0, count - 1).astype(int)
        if np.prod(last - first + 1, axis=1).sum() > MOST_PAIRS and fineness > 1:
            if chosen is not None:
                break
            fineness //= 2
            continue
        cells = _cells_inside(corners, low, step, count, first, last)
        chosen = count, step, first, last, cells
        if volume / (len(cells) * np.prod(step)) > ACCEPTED or fineness * 2 > MOST_CELLS:
            break
        fineness *= 2
    _store(table, low, *chosen, volume, device)


def _store(table: MeshTable, low, count, step, first, last, cells, volume: float, device: str) -> None:
    triangle, place = expanded(first[:, 1:], last[:, 1:])
    column = place[:, 0] * count[2] + place[:, 1]
    order = np.argsort(column, kind="stable")
    begins = np.searchsorted(column[order], np.arange(count[1] * count[2] + 1))
    accepted = min(max(volume / (len(cells) * np.prod(step)), 1e-3), 0.99)
    table.low, table.step, table.column_count = wp.vec3(*low), wp.vec3(*step), int(count[2])
    table.cells = wp.array(cells, dtype=wp.vec3i, device=device)
    table.begins = wp.array(begins, dtype=int, device=device)
    table.columns = wp.array(triangle[order], dtype=int, device=device)
    table.attempts = math.ceil(math.log(UNLIKELY) / math.log(1.0 - accepted))


def expanded(first: np.ndarray, last: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return every pair of a box k and a cell from first[k] to last[k], (n, axes) each: the k's, and the cells (pairs, axes)."""
    size = last - first + 1
    pairs = size.prod(axis=1)
    box = np.repeat(np.arange(len(first)), pairs)
    number = np.arange(pairs.sum()) - np.repeat(np.cumsum(pairs) - pairs, pairs)
    place = np.empty((len(box), first.shape[1]), int)
    for axis in range(first.shape[1] - 1, -1, -1):
        place[:, axis] = first[box, axis] + number % size[box, axis]
        number = number // size[box, axis]
    return box, place


def _cells_inside(corners, low, step, count, first, last) -> np.ndarray:
    """Return the cells that meet the inside, (n, 3): those whose box a triangle's plane cuts, and those whose middle is inside."""
    triangle, place = expanded(first, last)
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    middle = low + (place + 0.5) * step
    distance = np.abs(((middle - corners[triangle, 0]) * normal[triangle]).sum(axis=1))
    reach = 0.5 * (np.abs(normal[triangle]) * step).sum(axis=1)
    cut = place[distance <= reach * 1.001]
    touched = np.zeros(count, bool)
    touched[cut[:, 0], cut[:, 1], cut[:, 2]] = True
    return np.argwhere(touched | _middles_inside(corners, low, step, count, first, last)).astype(np.int32)


def _middles_inside(corners, low, step, count, first, last) -> np.ndarray:
    """Return bool (x, y, z): whether an odd number of triangles lies ahead of each cell's middle along x; of cells that none touches."""
    triangle, place = expanded(first[:, 1:], last[:, 1:])
    y, z = (low[1:] + (place + 0.5) * step[1:]).T
    a, b, c = (corners[triangle, k] for k in range(3))
    odd = _edge_ahead(a, b, y, z) ^ _edge_ahead(b, c, y, z) ^ _edge_ahead(c, a, y, z)
    a, b, c, y, z, place = a[odd], b[odd], c[odd], y[odd], z[odd], place[odd]
    area = (b - a)[:, 1] * (c - a)[:, 2] - (b - a)[:, 2] * (c - a)[:, 1]
    area = np.where(area == 0.0, 1.0, area)
    s = ((y - a[:, 1]) * (c - a)[:, 2] - (z - a[:, 2]) * (c - a)[:, 1]) / area
    t = ((b - a)[:, 1] * (z - a[:, 2]) - (b - a)[:, 2] * (y - a[:, 1])) / area
    x = a[:, 0] + s * (b - a)[:, 0] + t * (c - a)[:, 0]
    behind = np.clip(np.ceil((x - low[0]) / step[0] - 0.5), 0, count[0]).astype(int)  # middles of cells 0 … behind − 1 have it ahead
    crossings = np.zeros((count[0] + 1, count[1], count[2]), int)
    np.add.at(crossings, (behind, place[:, 0], place[:, 1]), 1)
    ahead = np.cumsum(crossings[::-1], axis=0)[::-1]
    return ahead[1:] % 2 == 1


def _edge_ahead(p, q, y, z) -> np.ndarray:
    """Return whether each edge, seen along x, crosses the ray from (y, z) toward +y; for q p the same as for p q."""
    swap = (q[:, 2] < p[:, 2]) | ((q[:, 2] == p[:, 2]) & (q[:, 1] < p[:, 1]))
    a, b = np.where(swap[:, None], q, p), np.where(swap[:, None], p, q)
    crosses = (a[:, 2] > z) != (b[:, 2] > z)
    rise = (z - a[:, 2]) / np.where(crosses, b[:, 2] - a[:, 2], 1.0)
    return crosses & (a[:, 1] + rise * (b[:, 1] - a[:, 1]) > y)
