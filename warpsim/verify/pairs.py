"""Potential energy of the forces between particles, over all pairs, in float64 and never from the kernels.

Symbols: s = √(d² + ε²) of two particles at distance d [m], R radius [m], k strength.
"""

import numpy as np

from warpsim.verify.amounts import value_at

ROWS = 256  # particles at a time, against all that follow: what is worked on stays in the cache


def pair_energy(x: np.ndarray, pairs: list, time: float) -> float:
    """Return Σ U(s) − U(R) over the pairs of places x (n, 3) with s < R [J]; U is what the law is the slope of."""
    total = 0.0
    for pair in pairs:
        k = value_at(pair.strength, time)
        at_radius = float(potential(pair.law, k, np.array(pair.radius), pair.radius))
        for begin in range(0, len(x), ROWS):
            rows = x[begin : begin + ROWS]
            d2 = sum((rows[:, None, axis] - x[None, begin:, axis]) ** 2 for axis in range(3))
            later = np.arange(len(x) - begin)[None, :] > np.arange(len(rows))[:, None]  # each pair once
            s = np.sqrt(d2[later] + pair.softening**2)
            s = s[s < pair.radius]
            total += float(potential(pair.law, k, s, pair.radius).sum()) - len(s) * at_radius
    return total


def potential(law: str, k: float, s: np.ndarray, radius: float) -> np.ndarray:
    """Return U(s) [J]: k s, −k/s, ½ k s², k (s − s²/2R), ½ k (s + (R/π) sin(π s/R)) by law."""
    if law == "constant":
        return k * s
    if law == "inverse_square":
        return -k / s
    if law == "spring":
        return 0.5 * k * s**2
    if law == "linear":
        return k * (s - 0.5 * s**2 / radius)
    return 0.5 * k * (s + radius / np.pi * np.sin(np.pi * s / radius))
