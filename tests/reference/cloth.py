"""Twin of kernels/cloth.py: forces on a sheet and the wind's pull in float64, point by point."""

import numpy as np

KINDS = {"structural": [(1, 0), (0, 1)], "shear": [(1, 1), (1, -1)], "bend": [(2, 0), (0, 2)]}


def springs(nx: int, ny: int, along, down, numbers: dict[str, tuple[float, float]]):
    """Return springs (i, j, k, c, r) of a sheet with cells spanned by `along` and `down`; numbers: kind -> stiffness, damping."""
    found = []
    for kind, steps in KINDS.items():
        k, c = numbers[kind]
        for a, b in steps:
            r = float(np.linalg.norm(a * np.asarray(along, float) + b * np.asarray(down, float)))
            for j in range(ny):
                for i in range(nx):
                    if 0 <= i + a < nx and 0 <= j + b < ny:
                        found.append((j * nx + i, (j + b) * nx + i + a, k, c, r))
    return found


def areas(nx: int, ny: int, x: np.ndarray) -> np.ndarray:
    """Area vector of every point (n, 3) [m²]: the sum of those of the cells round it, each half the product of its diagonals."""
    total = np.zeros((ny, nx, 3))
    p = x.reshape(ny, nx, 3)
    for j in range(ny - 1):
        for i in range(nx - 1):
            cell = 0.5 * np.cross(p[j + 1, i + 1] - p[j, i], p[j, i + 1] - p[j + 1, i])
            for a, b in ((0, 0), (1, 0), (0, 1), (1, 1)):
                total[j + b, i + a] += cell
    return total.reshape(-1, 3)


def pull(nx: int, ny: int, x, v, u, k: float, h: float) -> np.ndarray:
    """Acceleration by the air: the part of u − v along the normal dies away by e^(−k h) within h."""
    a = areas(nx, ny, x)
    n = a / np.linalg.norm(a, axis=1)[:, None]
    return n * ((u - v) * n).sum(axis=1)[:, None] * (1.0 - np.exp(-k * h)) / h
