"""Meshes: triangles from a file that a scene names, checked and mended before anything is built from them.

A file is read by trimesh (the extra `mesh`), which is imported on first use. What comes back is plain arrays: equal places are one
vertex, triangles without area are gone, and a closed mesh is wound so that its normals point out of what it encloses.
"""

import io
import math
from collections import deque
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

import numpy as np

from warpsim.scene import SceneError
from warpsim.scene.problems import Problem

KINDS = ("obj", "stl", "ply", "glb")
MOST_BYTES = 1 << 28  # of a file
MOST_TRIANGLES = 2_000_000
THINNEST = 1e-7  # height of a triangle over its longest side, relative to that side: float32 knows no thinner ones


@dataclass(frozen=True, eq=False)
class TriangleMesh:
    """A surface of triangles. Arrays are read-only."""

    vertices: np.ndarray
    """float32 (n, 3) [m]."""
    triangles: np.ndarray
    """int32 (m, 3), places in `vertices`; counterclockwise seen from outside."""
    dropped: int
    """Triangles of the file that had no area."""
    turned: int
    """Triangles that were wound against their neighbors, or all of an inside-out mesh."""
    open_edges: int
    """Edges that do not lie between exactly two triangles."""

    @property
    def closed(self) -> bool:
        """Whether it encloses a volume: every edge lies between two triangles that agree on its sense."""
        return self.open_edges == 0

    @property
    def area(self) -> np.ndarray:
        """float64 (m,): area of each triangle [m²]."""
        return 0.5 * np.linalg.norm(_doubled_areas(self.vertices.astype(float), self.triangles), axis=1)

    @property
    def normals(self) -> np.ndarray:
        """float64 (m, 3): unit normal of each triangle, outward."""
        normals = _doubled_areas(self.vertices.astype(float), self.triangles)
        return normals / np.linalg.norm(normals, axis=1, keepdims=True)

    @property
    def volume(self) -> float:
        """What it encloses [m³]; of no meaning for an open mesh.  Source: divergence theorem."""
        return _signed_volume(self.vertices.astype(float), self.triangles)

    @property
    def bounds(self) -> tuple[np.ndarray, np.ndarray]:
        """The lowest and the highest corner, float32 (3,) each [m]."""
        return self.vertices.min(axis=0), self.vertices.max(axis=0)


def load_mesh(path: Path, where: str, scale: float = 1.0) -> TriangleMesh:
    """Read an OBJ, STL, PLY or GLB file and scale it; `where` is the file's place in the scene, for messages ("colliders.0.file").

    Raises SceneError for a file that is missing, unreadable, too large, of another kind, empty, not finite, or all degenerate, and
    where trimesh is not installed. A mesh that is open is no error here; see `TriangleMesh.closed`.
    """
    path = Path(path)
    try:
        status = path.stat()
        if status.st_size > MOST_BYTES:
            raise _refusal(where, f"{path.name} has {status.st_size} bytes; at most {MOST_BYTES} are read")
        mesh = _read(path, status.st_mtime_ns, status.st_size, scale)
    except OSError as error:
        raise _refusal(where, f"{path.name} cannot be read: {error.strerror or error}") from None
    except UnusableMesh as error:
        raise _refusal(where, f"{path.name}: {error}") from None
    return mesh


class UnusableMesh(Exception):
    """What a file holds is no surface; the text says why."""


def _refusal(where: str, message: str) -> SceneError:
    return SceneError([Problem(message, path=where)])


@lru_cache(maxsize=8)
def _read(path: Path, changed: int, size: int, scale: float) -> TriangleMesh:
    """Read a file once for all who name it, as long as it stays the same."""
    return surface(*_arrays_of(path), scale)


def _arrays_of(path: Path) -> tuple[np.ndarray, np.ndarray]:
    kind = path.suffix.lower().removeprefix(".")
    if kind not in KINDS:
        raise UnusableMesh(f"is not a kind of file that is read; those are {', '.join(KINDS)}")
    try:
        import trimesh
    except ImportError:
        raise UnusableMesh("reading meshes needs trimesh: pip install 'warpsim[mesh]'") from None
    content = _with_ascii_words(kind, path.read_bytes())
    try:
        # From memory, so that a file can name no other file; without processing, because what is mended here is counted.
        loaded = trimesh.load(io.BytesIO(content), file_type=kind, process=False, force="mesh", skip_materials=True)
        return np.asarray(loaded.vertices, float).reshape(-1, 3), np.asarray(loaded.faces, np.int64).reshape(-1, 3)
    except MemoryError:
        raise
    except Exception as error:  # whatever a parser of four formats finds to say about bytes that are none of them
        raise UnusableMesh(f"holds no {kind.upper()} mesh ({str(error) or type(error).__name__})") from None


def _with_ascii_words(kind: str, content: bytes) -> bytes:
    """Return the file with its text in ASCII: names and comments may be of any encoding, and what counts is ASCII in every kind."""
    if kind == "ply":
        words, end, numbers = content.partition(b"end_header")
    elif kind == "obj" or (kind == "stl" and not _is_binary_stl(content)):
        words, end, numbers = content, b"", b""
    else:
        return content
    return words.decode("ascii", "replace").encode("ascii", "replace") + end + numbers


def _is_binary_stl(content: bytes) -> bool:
    """Whether it is as long as the number of triangles in its header says; a binary file, too, may begin with "solid"."""
    return len(content) >= 84 and len(content) == 84 + 50 * int.from_bytes(content[80:84], "little")


def surface(vertices: np.ndarray, triangles: np.ndarray, scale: float = 1.0) -> TriangleMesh:
    """Check and mend arrays of a surface, (n, 3) [m] and (m, 3). Raises UnusableMesh."""
    if not len(triangles):
        raise UnusableMesh("holds no triangles")
    if len(triangles) > MOST_TRIANGLES:
        raise UnusableMesh(f"has {len(triangles)} triangles; at most {MOST_TRIANGLES} are taken")
    if triangles.min() < 0 or triangles.max() >= len(vertices):
        raise UnusableMesh(f"a triangle names vertex {triangles.max()}, but there are {len(vertices)}")
    used = np.unique(triangles)
    places = (vertices[used] * scale).astype(np.float32)
    if not (np.isfinite(places).all() and np.abs(places).max() <= 1e9):
        raise UnusableMesh("a vertex is not finite, or farther than 1e9 m from the origin")
    places, merged = np.unique(places + np.float32(0.0), axis=0, return_inverse=True)  # + 0: minus zero is zero
    triangles = merged.reshape(-1)[np.searchsorted(used, triangles)].astype(np.int32)
    kept = _has_area(places.astype(float), triangles)
    dropped = int(len(triangles) - kept.sum())
    triangles = triangles[kept]
    if not len(triangles):
        raise UnusableMesh(f"none of its {dropped} triangles has an area")
    kept, triangles = np.unique(triangles, return_inverse=True)
    places, triangles = places[kept], triangles.reshape(-1, 3).astype(np.int32)
    triangles, turned, open_edges = _wound(places.astype(float), triangles)
    vertices = np.ascontiguousarray(places)
    for array in (vertices, triangles):
        array.flags.writeable = False
    return TriangleMesh(vertices, triangles, dropped, turned, open_edges)


def _doubled_areas(vertices: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    a, b, c = (vertices[triangles[:, k]] for k in range(3))
    return np.cross(b - a, c - a)


def _has_area(vertices: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    corners = vertices[triangles]
    longest = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).max(axis=1)
    return np.linalg.norm(_doubled_areas(vertices, triangles), axis=1) > THINNEST * longest**2


def _signed_volume(vertices: np.ndarray, triangles: np.ndarray) -> float:
    a, b, c = (vertices[triangles[:, k]] - vertices.mean(axis=0) for k in range(3))
    return float(np.einsum("ij,ij->", a, np.cross(b, c)) / 6.0)


def _wound(vertices: np.ndarray, triangles: np.ndarray) -> tuple[np.ndarray, int, int]:
    """Return triangles that agree with their neighbors and point outward, how many were turned, and how many edges are open."""
    starts, ends = triangles.reshape(-1), np.roll(triangles, -1, axis=1).reshape(-1)
    low, high = np.minimum(starts, ends).astype(np.int64), np.maximum(starts, ends).astype(np.int64)
    _, edge, count = np.unique(low * len(vertices) + high, return_inverse=True, return_counts=True)
    edge = edge.reshape(-1)
    open_edges = int((count != 2).sum())
    forward = np.bincount(edge, weights=starts < ends)
    turned = np.zeros(len(triangles), bool)
    if (forward[count == 2] != 1.0).any():
        turned = _against_neighbors(vertices, triangles, edge, count, starts < ends)
        triangles = np.where(turned[:, None], triangles[:, ::-1], triangles)
    if open_edges == 0 and not turned.any() and _signed_volume(vertices, triangles) < 0.0:  # a cavity's walls may well point inward
        triangles, turned = triangles[:, ::-1], ~turned
    return np.ascontiguousarray(triangles, np.int32), int(turned.sum()), open_edges


def _against_neighbors(vertices, triangles, edge: np.ndarray, count: np.ndarray, forward: np.ndarray) -> np.ndarray:
    """Return which triangles to turn so that those that share an edge agree; each connected part then points outward."""
    order = np.argsort(edge, kind="stable")
    ends = np.cumsum(count)
    pairs = [(order[ends[k] - 2], order[ends[k] - 1]) for k in np.flatnonzero(count == 2)]
    neighbors: list[list[tuple[int, bool]]] = [[] for _ in triangles]
    for i, j in pairs:
        same = bool(forward[i] == forward[j])  # both run along the edge in one sense: one of them is the wrong way round
        neighbors[i // 3].append((j // 3, same))
        neighbors[j // 3].append((i // 3, same))
    turned, seen = np.zeros(len(triangles), bool), np.zeros(len(triangles), bool)
    for start in range(len(triangles)):
        if seen[start]:
            continue
        part, queue = [start], deque([start])
        seen[start] = True
        while queue:
            here = queue.popleft()
            for other, same in neighbors[here]:
                if not seen[other]:
                    seen[other], turned[other] = True, turned[here] ^ same
                    part.append(other)
                    queue.append(other)
        members = np.array(part)
        wound = np.where(turned[members, None], triangles[members][:, ::-1], triangles[members])
        if _signed_volume(vertices, wound) < 0.0 or (math.isclose(_signed_volume(vertices, wound), 0.0) and turned[members].mean() > 0.5):
            turned[members] = ~turned[members]
    return turned
