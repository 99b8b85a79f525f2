"""Twin of kernels/render.py: particles as quantized points."""

import numpy as np


def pack(position: np.ndarray, life: np.ndarray, size: np.ndarray, color: np.ndarray):
    """Return uint16 (n, 4) of x, y, z within the box round all, and size; uint8 (n, 4) of color; tables by share of life."""
    low, high = position.min(axis=0).astype(float), position.max(axis=0).astype(float)
    extent = np.where(high > low, high - low, 1.0)
    steps = np.where(high > low, (position - low) / extent * 65535.0, 0.0)
    k = np.clip((life * len(size)).astype(int), 0, len(size) - 1)
    place = np.concatenate([steps, size[k, None] * 65535.0], axis=1)
    return np.floor(np.clip(place + 0.5, 0.0, 65535.0)).astype(np.uint16), color[k]


def headings(course: np.ndarray, force: np.ndarray | None, mass: float) -> np.ndarray:
    """Return int8 (n, 4): unit vectors along courses (n, 3), and the sine of the roll a/√(a² + g²), a the acceleration to the right."""
    n = course / np.linalg.norm(course, axis=1)[:, None]
    roll = np.zeros(len(n))
    if force is not None:
        a = (force * np.cross(n, [0.0, 1.0, 0.0])).sum(axis=1) / mass
        roll = a / np.hypot(a, 9.81)
    return np.floor(np.concatenate([n, roll[:, None]], axis=1) * 127.0 + 0.5).astype(np.int8)
