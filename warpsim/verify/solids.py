"""Solids: how far points are from a collider's surface, in float64, from the scene's own words."""

import numpy as np

from warpsim.scene.colliders import Course
from warpsim.verify.amounts import value_at


def clearance(spec, points: np.ndarray, time: float) -> np.ndarray:
    """Return the distance of points (n, 3) from a plane, sphere, box or capsule at a time [s], negative in what is solid [m]."""
    q = (points - _placed(spec, "center", time)) @ _turned(_placed(spec, "rotation", time))
    distance = _DISTANCES[spec.type](spec, q)
    return -distance if getattr(spec, "side", "outside") == "inside" else distance


def _placed(spec, key: str, time: float) -> np.ndarray:
    """Return the center [m] or the angles [degrees] at a time."""
    course = getattr(spec.motion, key, None) or getattr(spec, key)
    if isinstance(course, Course):
        times, places = zip(*course.keyframes, strict=True)
        return np.array([np.interp(time, times, values) for values in zip(*places, strict=True)])
    return np.array([value_at(component, time) for component in course])


def _turned(degrees: np.ndarray) -> np.ndarray:
    """Return the rotation about x, then y, then z, R = Rz Ry Rx; rows of points times R are in the collider's own frame."""
    (a, b, c), (sa, sb, sc) = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    x = np.array([[1, 0, 0], [0, a, -sa], [0, sa, a]])
    y = np.array([[b, 0, sb], [0, 1, 0], [-sb, 0, b]])
    return np.array([[c, -sc, 0], [sc, c, 0], [0, 0, 1]]) @ y @ x


def _from_plane(spec, q: np.ndarray) -> np.ndarray:
    return q @ (np.array(spec.normal, float) / np.linalg.norm(spec.normal))


def _from_sphere(spec, q: np.ndarray) -> np.ndarray:
    return np.linalg.norm(q, axis=1) - spec.radius


def _from_box(spec, q: np.ndarray) -> np.ndarray:
    beyond = np.abs(q) - 0.5 * np.array(spec.size)
    return np.linalg.norm(np.maximum(beyond, 0.0), axis=1) + np.minimum(beyond.max(axis=1), 0.0)


def _from_capsule(spec, q: np.ndarray) -> np.ndarray:
    axis = 0.5 * (np.array(spec.end) - np.array(spec.start))
    share = np.clip(q @ axis / max(float(axis @ axis), 1e-300), -1.0, 1.0)
    return np.linalg.norm(q - share[:, None] * axis, axis=1) - spec.radius


_DISTANCES = {"plane": _from_plane, "sphere": _from_sphere, "box": _from_box, "capsule": _from_capsule}
