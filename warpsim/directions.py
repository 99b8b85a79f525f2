"""Directions: unit vectors and frames, worked out in float64."""

import math
from collections.abc import Sequence

import numpy as np
import warp as wp


def unit(vector: Sequence[float]) -> wp.vec3:
    """Return the vector's direction."""
    length = math.hypot(*vector)
    return wp.vec3(*(component / length for component in vector))


def across(axis: Sequence[float], vector: Sequence[float]) -> wp.vec3:
    """Return the direction of the vector's part across the axis."""
    a, v = np.array(axis, float), np.array(vector, float)
    return unit(v - a * (a @ v) / (a @ a))


def perpendiculars(axis: Sequence[float]) -> tuple[np.ndarray, np.ndarray]:
    """Return two unit vectors (3,) that make a right-handed frame with a unit vector, which comes third."""
    a = np.array(axis, dtype=float)
    first = np.cross(np.eye(3)[np.argmin(np.abs(a))], a)
    first /= np.linalg.norm(first)
    return first, np.cross(a, first)


def rotation_matrix(degrees: Sequence[float]) -> np.ndarray:
    """Return the rotation about x, then y, then z, all of them fixed axes, (3, 3)."""
    result = np.eye(3)
    for axis, angle in enumerate(np.radians(degrees)):
        i, j = (axis + 1) % 3, (axis + 2) % 3
        turn = np.eye(3)
        turn[i, i] = turn[j, j] = math.cos(angle)
        turn[j, i], turn[i, j] = math.sin(angle), -math.sin(angle)
        result = turn @ result
    return result
