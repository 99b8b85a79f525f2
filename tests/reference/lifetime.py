"""Twin of kernels/lifetime.py."""

from fractions import Fraction

import numpy as np


def age_at(frame: int, birth_frame: int, birth_age: float, fps: float) -> Fraction:
    """Return the age at a frame, without any rounding."""
    return Fraction(frame - birth_frame) / Fraction(fps) + Fraction(birth_age)


def active_step(age: float, dt: float, lifetime: float) -> float:
    """Return the length of [age − dt, age] ∩ [0, lifetime]: of the substep that ends at this age, what lies between birth and death."""
    return max(0.0, min(age, lifetime) - max(age - dt, 0.0))


def compact(slab: np.ndarray, alive: np.ndarray) -> np.ndarray:
    """Return the survivors' columns, in order."""
    return np.stack([slab[:, i] for i in range(slab.shape[1]) if alive[i]], axis=1) if alive.any() else slab[:, :0]
