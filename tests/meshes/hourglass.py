"""Makes scenes/meshes/hourglass.ply: `python -m tests.meshes.hourglass`. A closed surface of revolution: two bulbs and a neck."""

from pathlib import Path

import numpy as np

PLACE = Path(__file__).resolve().parents[2] / "scenes" / "meshes" / "hourglass.ply"
BULB, NECK, HEIGHT = 0.5, 0.03, 1.0  # [m]: largest and smallest radius, half of the height
SIDES, RINGS = 48, 28


def radius(y: np.ndarray) -> np.ndarray:
    """The profile: r(y) [m], from the neck at 0 to the flat ends at ±HEIGHT."""
    s = np.abs(y) / HEIGHT
    cone = NECK + (BULB - NECK) * np.sin(0.5 * np.pi * np.clip(s / 0.72, 0.0, 1.0)) ** 2
    shoulder = np.sqrt(np.maximum(1.0 - (np.clip(s - 0.72, 0.0, None) / 0.30) ** 2, 0.0))
    return cone * shoulder


def hourglass() -> tuple[np.ndarray, np.ndarray]:
    """Vertices (n, 3) [m] and triangles (m, 3), wound so that normals point out."""
    y = np.linspace(-HEIGHT, HEIGHT, 2 * RINGS + 1)
    angle = 2.0 * np.pi * np.arange(SIDES) / SIDES
    ring = np.stack([np.cos(angle), np.zeros(SIDES), -np.sin(angle)], axis=1)
    vertices = [np.array([0.0, height, 0.0]) + r * ring for height, r in zip(y, radius(y), strict=True)]
    ends = [[0.0, -HEIGHT, 0.0], [0.0, HEIGHT, 0.0]]
    count, k = len(y), np.arange(SIDES)
    after = (k + 1) % SIDES
    triangles = []
    for j in range(count - 1):
        low, high = j * SIDES, (j + 1) * SIDES
        triangles += [np.stack([low + k, low + after, high + k], 1), np.stack([high + k, low + after, high + after], 1)]
    bottom, top = count * SIDES, count * SIDES + 1
    triangles += [np.stack([np.full(SIDES, bottom), after, k], 1)]
    triangles += [np.stack([np.full(SIDES, top), (count - 1) * SIDES + k, (count - 1) * SIDES + after], 1)]
    return np.concatenate([*vertices, ends]).astype("<f4"), np.concatenate(triangles)


def as_ply(vertices: np.ndarray, triangles: np.ndarray) -> bytes:
    """A binary PLY file."""
    head = f"""ply
format binary_little_endian 1.0
comment made by tests/meshes/hourglass.py
element vertex {len(vertices)}
property float x
property float y
property float z
element face {len(triangles)}
property list uchar int vertex_indices
end_header
"""
    faces = np.empty(len(triangles), dtype=[("count", "u1"), ("corners", "<i4", 3)])
    faces["count"], faces["corners"] = 3, triangles
    return head.encode() + vertices.tobytes() + faces.tobytes()


if __name__ == "__main__":
    PLACE.write_bytes(as_ply(*hourglass()))
