"""Twin of kernels/forces.py: force fields in float64."""

import math
from dataclasses import dataclass

import numpy as np


@dataclass
class Field:
    """One force field, by the fields of the scene."""

    type: str
    strength: float
    center: tuple[float, float, float] = (0.0, 0.0, 0.0)
    law: str = "constant"
    softening: float = 1e-3


ATTRACTOR_LAWS = {
    "constant": lambda k, s: k / s,
    "inverse_square": lambda k, s: k / s**3,
    "spring": lambda k, s: k,
}


def attractor(f: Field, x: np.ndarray) -> np.ndarray:
    """Return the pull along d = C − x, its length softened as √(d² + ε²); a spring needs no softening."""
    d = np.asarray(f.center, float) - x
    return ATTRACTOR_LAWS[f.law](f.strength, math.sqrt(d @ d + f.softening**2)) * d


FORCES = {"attractor": attractor}


def acceleration(fields, gravity, mass: float, x) -> np.ndarray:
    """Return gravity and the forces per mass at one point."""
    x = np.asarray(x, float)
    return sum((FORCES[f.type](f, x) / mass for f in fields), np.asarray(gravity, float))
