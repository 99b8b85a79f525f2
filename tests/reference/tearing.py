"""Twin of kernels/tearing.py in float64: which springs are torn, and what is left of the cells round a point of a sheet."""

import numpy as np


def torn(x: np.ndarray, springs: np.ndarray, rest: np.ndarray, strain: float) -> np.ndarray:
    """Return which springs (m, 2) are longer than (1 + strain) times their rest length, bool (m,)."""
    length = np.linalg.norm(x[springs[:, 1]] - x[springs[:, 0]], axis=1)
    return (rest > 0.0) & (length > (1.0 + strain) * rest)


def areas(nx: int, ny: int, x: np.ndarray, whole: set[tuple[int, int]]) -> np.ndarray:
    """Area vector of every point (n, 3) [m²]: of the cells round it whose four sides are whole, each half the product of its diagonals."""
    total = np.zeros((nx * ny, 3))
    for j in range(ny - 1):
        for i in range(nx - 1):
            nw, ne, sw, se = j * nx + i, j * nx + i + 1, (j + 1) * nx + i, (j + 1) * nx + i + 1
            if {(nw, ne), (sw, se), (nw, sw), (ne, se)} <= whole:
                for p in (nw, ne, sw, se):
                    total[p] += 0.5 * np.cross(x[se] - x[nw], x[ne] - x[sw])
    return total
