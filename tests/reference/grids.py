"""Twin of kernels/grids.py, float64: every node's tent function times its velocity."""

import numpy as np


def grid(p, x: np.ndarray) -> np.ndarray:
    """Return the trilinear interpolation of velocities (nx, ny, nz, 3) whose first node is at p.center, times the strength."""
    counts = np.array(p.nodes.shape[:3])
    place = (x - np.asarray(p.center, float)) / np.asarray(p.spacing, float)
    within = np.clip(place, 0.0, counts - 1.0)
    if p.outside == "zero" and (within != place).any():
        return np.zeros(3)
    i, j, k = (np.maximum(0.0, 1.0 - np.abs(within[axis] - np.arange(counts[axis]))) for axis in range(3))
    return p.strength * np.einsum("i,j,k,ijkc->c", i, j, k, np.asarray(p.nodes, float))
