"""Twin of kernels/strain.py in float64: one sweep over springs, one after the other."""

import numpy as np


def begin(x, v, springs, inverse_mass, multiplier, h: float, kept: float = 0.8):
    """Pull every spring (i, j) again by `kept` of what pulled it in the substep before."""
    x, v, multiplier = x.copy(), v.copy(), kept * multiplier
    for (i, j), pull in zip(springs, multiplier, strict=True):
        n = x[j] - x[i]
        move(x, v, i, j, pull * n / np.sqrt(n @ n), inverse_mass, h)
    return x, v, multiplier


def sweep(x, v, springs, rest, inverse_mass, multiplier, strain: float, h: float, aim: float = 0.9):
    """Bring springs (i, j), one after the other, to (1 + aim strain) rest if they are longer, or give back what pulled them too far."""
    x, v, multiplier = x.copy(), v.copy(), multiplier.copy()
    for k, (i, j) in enumerate(springs):
        d = x[j] - x[i]
        length = np.sqrt(d @ d)
        change = max((length - (1 + aim * strain) * rest[k]) / (inverse_mass[i] + inverse_mass[j]), -multiplier[k])
        multiplier[k] += change
        move(x, v, i, j, change * d / length, inverse_mass, h)
    return x, v, multiplier


def late_sweep(x, springs, rest, inverse_mass, strain: float, aim: float):
    """Move the ends of those springs (i, j) that are longer than (1 + strain) rest to (1 + aim strain) rest."""
    x, v = x.copy(), np.zeros_like(x)
    for (i, j), r in zip(springs, rest, strict=True):
        d = x[j] - x[i]
        length = np.sqrt(d @ d)
        if length > (1 + strain) * r:
            move(x, v, i, j, (length - (1 + aim * strain) * r) / (inverse_mass[i] + inverse_mass[j]) * d / length, inverse_mass, np.inf)
    return x


def move(x, v, i, j, pull, inverse_mass, h: float) -> None:
    """Move two points towards each other by a pull [kg m], and change their velocities by as much over h."""
    for p, sign in ((i, 1.0), (j, -1.0)):
        x[p] += sign * pull * inverse_mass[p]
        v[p] += sign * pull * inverse_mass[p] / h
