"""Twin of kernels/pairwise.py: forces between all pairs in float64, and their potential energy, by the laws alone and without a grid."""

import math
from dataclasses import dataclass

import numpy as np


@dataclass
class Pair:
    """A force between particles, by the fields of the scene."""

    strength: float
    radius: float
    law: str = "inverse_square"
    softening: float = 1e-3


FORCES = {  # f(s) > 0 pulls together for k > 0
    "constant": lambda k, s, r: k + 0.0 * s,
    "inverse_square": lambda k, s, r: k / s**2,
    "spring": lambda k, s, r: k * s,
    "linear": lambda k, s, r: k * (1.0 - s / r),
    "cosine": lambda k, s, r: 0.5 * k * (1.0 + np.cos(math.pi * s / r)),
}
POTENTIALS = {  # U(s) with U' = f
    "constant": lambda k, s, r: k * s,
    "inverse_square": lambda k, s, r: -k / s,
    "spring": lambda k, s, r: 0.5 * k * s**2,
    "linear": lambda k, s, r: k * (s - 0.5 * s**2 / r),
    "cosine": lambda k, s, r: 0.5 * k * (s + r / math.pi * np.sin(math.pi * s / r)),
}


def distances(pair: Pair, x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return d = x_j − x_i (n, n, 3) and the softened distances s (n, n)."""
    d = x[None, :, :] - x[:, None, :]
    return d, np.sqrt((d**2).sum(axis=2) + pair.softening**2)


def pair_forces(pairs: list[Pair], x: np.ndarray) -> np.ndarray:
    """Return the force on each particle, (n, 3) [N]: the sum over all others nearer than the radius; nothing acts on itself."""
    x = np.asarray(x, float)
    total = np.zeros_like(x)
    for pair in pairs:
        d, s = distances(pair, x)
        np.fill_diagonal(s, math.inf)
        f = np.where(s < pair.radius, FORCES[pair.law](pair.strength, np.minimum(s, pair.radius), pair.radius), 0.0)
        total += (d * (f / s)[:, :, None]).sum(axis=1)
    return total


def pair_energy(pairs: list[Pair], x: np.ndarray) -> float:
    """Return the potential energy of all pairs [J]; zero for pairs beyond the radius, and none at it."""
    x = np.asarray(x, float)
    total = 0.0
    for pair in pairs:
        _, s = distances(pair, x)
        s = s[np.triu_indices(len(x), 1)]
        potential = POTENTIALS[pair.law]
        inside = potential(pair.strength, np.minimum(s, pair.radius), pair.radius) - potential(pair.strength, pair.radius, pair.radius)
        total += float(np.where(s < pair.radius, inside, 0.0).sum())
    return total
