"""Colliders on the device: a row of numbers each, their courses as signals, and the triangles of meshes."""

import numpy as np
import warp as wp

from warpsim.kernels import collider
from warpsim.kernels.clearance import CLEARANCES, measure_cells
from warpsim.meshes import TriangleMesh, load_mesh
from warpsim.scene import Scene, SceneError
from warpsim.scene.colliders import Course
from warpsim.scene.problems import Problem
from warpsim.signals import SignalTable, components, strength_signals

MOST_CELLS = 32_768  # of a mesh's box: some tenths of a second to fill
SMALL = 0.1  # [m]: a plane has no size; this is what its skin would be of at the origin


class Colliders:
    """The rows of a scene's colliders; meshes are read and built once, the rest may change while it runs.

    Raises SceneError for a mesh that cannot be used.
    """

    def __init__(self, scene: Scene, device: str):
        meshes = [(k, spec) for k, spec in enumerate(scene.colliders) if spec.type == "mesh"]
        self._meshes = {k: built(mesh_of(spec, k), device) for k, spec in meshes}
        self._cells = {k: clearance_cells(self._mesh_row(k, spec), device) for k, spec in meshes}

    def rows(self, scene: Scene, table: SignalTable) -> list[collider.Collider]:
        """Return the rows; their courses are added to the table of signals."""
        return [self._row(k, spec, table) for k, spec in enumerate(scene.colliders)]

    def _row(self, k: int, spec, table: SignalTable) -> collider.Collider:
        row = course_row(spec, table)
        row.kind, row.action = list(CLEARANCES).index(spec.type), collider.ACTIONS[spec.action]
        row.inside = int(getattr(spec, "side", "") == "inside")
        row.restitution, row.friction, row.moves = spec.restitution, spec.friction, int(spec.motion is not None)
        row.radius = getattr(spec, "radius", 0.0)
        match spec.type:
            case "plane":
                row.axis, row.reach = wp.normalize(wp.vec3(*spec.normal)), SMALL
            case "sphere":
                row.reach = spec.radius
            case "box":
                row.half, row.reach = wp.vec3(*(0.5 * edge for edge in spec.size)), 0.5 * max(spec.size)
            case "capsule":
                row.axis = wp.vec3(*(0.5 * (b - a) for a, b in zip(spec.start, spec.end, strict=True)))
                row.reach = spec.radius + max(map(abs, row.axis))
            case "mesh":
                surface = self._mesh_row(k, spec)
                for name in ("mesh", "radius", "middle", "half", "reach"):
                    setattr(row, name, getattr(surface, name))
                row.cells, row.cells_per_meter, row.clearance = self._cells[k]
        return row

    def _mesh_row(self, k: int, spec) -> collider.Collider:
        """Return a row that knows a mesh, and how large it is."""
        row, points = collider.Collider(), self._meshes[k].points.numpy()
        low, high = points.min(axis=0), points.max(axis=0)
        row.mesh, row.radius, row.inside = wp.uint64(self._meshes[k].id), 0.5 * (spec.thickness or 0.0), int(spec.side == "inside")
        row.middle, row.half = wp.vec3(*(0.5 * (low + high)).tolist()), wp.vec3(*(0.5 * (high - low)).tolist())
        row.reach = float(max(np.abs(low).max(), np.abs(high).max()))
        return row


def mesh_of(spec, place: int) -> TriangleMesh:
    """Return a collider's surface [m]. Raises SceneError for a file that cannot be used, or an open surface without a thickness."""
    where = f"colliders.{place}"
    mesh = load_mesh(spec.file.path, f"{where}.file", spec.scale)
    if not mesh.closed and spec.thickness is None:
        words = f"{spec.file} is open ({mesh.open_edges} of its edges do not lie between two triangles), so that it has no inside"
        raise SceneError(
            [Problem(f"{words}: mend it, or give thickness: [m], which makes it a sheet with two sides", path=f"{where}.file")]
        )
    if spec.thickness is not None and spec.side == "inside":
        raise SceneError([Problem("a sheet has no inside: leave thickness or side out", path=f"{where}.side")])
    return mesh


def built(mesh: TriangleMesh, device: str) -> wp.Mesh:
    """Return the surface on the device, with the tree that its queries walk."""
    points = wp.array(mesh.vertices, dtype=wp.vec3, device=device)
    return wp.Mesh(points, wp.array(mesh.triangles.reshape(-1), dtype=int, device=device))


def clearance_cells(row: collider.Collider, device: str) -> tuple[wp.vec3i, wp.vec3, wp.array]:
    """Return the cells of a mesh's box along x, y, z, how many of them to a meter, and the clearance of each [m]."""
    size = np.maximum(2.0 * np.array(row.half), 1e-3 * row.reach + 1e-9)
    edge = (size.prod() / MOST_CELLS) ** (1.0 / 3.0)
    counts = np.clip((size / edge).astype(int), 1, MOST_CELLS)
    while counts.prod() > MOST_CELLS:  # a flat box has no cells across
        counts[counts.argmax()] //= 2
    row.cells, row.cells_per_meter = wp.vec3i(*counts.tolist()), wp.vec3(*(counts / size).tolist())
    clearance = wp.empty(int(counts.prod()), dtype=float, device=device)
    wp.launch(measure_cells, len(clearance), [0, row, wp.vec3(*(size / counts).tolist()), clearance], device=device)
    return row.cells, row.cells_per_meter, clearance


def course_row(spec, table: SignalTable) -> collider.Collider:
    """Return a row that knows where its collider is; its courses are added to the table of signals."""
    row = collider.Collider()
    row.center_signal = course_signals(getattr(spec.motion, "center", None) or spec.center, table)
    row.rotation_signal = course_signals(getattr(spec.motion, "rotation", None) or spec.rotation, table)
    return row


def course_signals(course, table: SignalTable) -> wp.vec3i:
    """Add the three components of a place or of angles, constant or in time, to the signals."""
    return strength_signals(components(course.keyframes) if isinstance(course, Course) else course, table)
