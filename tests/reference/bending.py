"""Twin of kernels/bending.py: hinges of a flat sheet in float64, hinge by hinge, from the energy of a plate."""

import numpy as np


def hinges(nx: int, ny: int, a: float, b: float):
    """Return hinges ({point: weight}, k) of unit stiffness: the second differences of a plate's energy ½ ∫ (κ_aa² + κ_bb² + 2 κ_ab²) dA.

    κ = (weighted sum of places)/(a², b² or a b); each stands for a cell's area, for half of it along a rim.
    """
    found = []

    def at(i, j):
        return j * nx + i

    for j in range(ny):
        for i in range(1, nx - 1):
            area = a * b * (0.5 if j in (0, ny - 1) else 1.0)
            found.append(({at(i - 1, j): 1.0, at(i, j): -2.0, at(i + 1, j): 1.0}, area / a**4))
    for j in range(1, ny - 1):
        for i in range(nx):
            area = a * b * (0.5 if i in (0, nx - 1) else 1.0)
            found.append(({at(i, j - 1): 1.0, at(i, j): -2.0, at(i, j + 1): 1.0}, area / b**4))
    for j in range(ny - 1):
        for i in range(nx - 1):
            corners = {at(i, j): 1.0, at(i + 1, j): -1.0, at(i, j + 1): -1.0, at(i + 1, j + 1): 1.0}
            found.append((corners, 2.0 * a * b / (a * b) ** 2))
    return found


def forces(x: np.ndarray, v: np.ndarray, found, stiffness: float, damping: float, torn=()) -> np.ndarray:
    """Force on every point [N]: minus the gradient of Σ ½ k B |m|², and along m what damps the rate of |m|."""
    total = np.zeros_like(x)
    for weights, k in found:
        if any({i, j} <= set(weights) for i, j in torn):
            continue
        m = sum(w * x[p] for p, w in weights.items())
        rate = sum(w * v[p] for p, w in weights.items())
        pull = k * stiffness * m
        if m.any():
            pull = pull + k * damping * (m @ rate) / (m @ m) * m
        for p, w in weights.items():
            total[p] -= w * pull
    return total


def energy(x: np.ndarray, found, stiffness: float) -> float:
    """Σ ½ k B |m|² [J]."""
    return 0.5 * stiffness * sum(k * (sum(w * x[p] for p, w in weights.items()) ** 2).sum() for weights, k in found)
