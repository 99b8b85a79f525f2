"""Twin of kernels/implicit.py: one substep of backward Euler, linear in the substep, by a dense system in float64.

A network is a list of springs (i, j, k, c, r) as in springs.py. The matrix is put together spring by spring and solved by elimination,
which knows nothing of weaves, preconditioners or conjugate gradients.
"""

import numpy as np

from tests.reference.springs import spring_force


def tie_matrix(d: np.ndarray, k: float, c: float, r: float, h: float) -> np.ndarray:
    """h² K + h C of one spring between its ends, 3 × 3 [kg]: the force's derivative, without what pushes a compressed one sideways."""
    length = np.sqrt(d @ d)
    if length == 0.0:
        return h * h * k * np.eye(3) if r == 0.0 else np.zeros((3, 3))
    along = np.outer(d, d) / length**2
    return h * h * k * (along + max(0.0, 1.0 - r / length) * (np.eye(3) - along)) + h * c * along


def system(x, u, mass, springs, h: float) -> tuple[np.ndarray, np.ndarray]:
    """Return the matrix (3n, 3n) [kg] and the right side (3n,) [kg m/s] for the change of velocity, pins not yet left out."""
    n = len(x)
    matrix, right = np.kron(np.diag(mass), np.eye(3)), np.zeros((n, 3))
    for i, j, k, c, r in springs:
        block = tie_matrix(x[j] - x[i], k, c, r, h)
        for a, b in ((i, j), (j, i)):
            matrix[3 * a : 3 * a + 3, 3 * a : 3 * a + 3] += block
            matrix[3 * a : 3 * a + 3, 3 * b : 3 * b + 3] -= block
        pull = h * spring_force(x[i], np.zeros(3), x[j], np.zeros(3), k, 0.0, r) + block @ (u[j] - u[i])
        right[i] += pull
        right[j] -= pull
    return matrix, right.reshape(-1)


def substep(x, u, mass, springs, h: float, held=()) -> tuple[np.ndarray, np.ndarray]:
    """Return positions and velocities at the end of a substep; u are the velocities when all but the springs has acted."""
    matrix, right = system(x, u, mass, springs, h)
    free = np.repeat(~np.isin(np.arange(len(x)), list(held)), 3)
    change = np.zeros(3 * len(x))
    change[free] = np.linalg.solve(matrix[np.ix_(free, free)], right[free])
    v = u + change.reshape(-1, 3)
    return x + h * v, v
