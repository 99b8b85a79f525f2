"""Twin of kernels/flow.py: every primitive in float64, from the textbook form, singular where it is singular."""

import math
from dataclasses import dataclass

import numpy as np


@dataclass
class Primitive:
    """One primitive, by the fields of the scene; axis and direction of any length."""

    type: str
    strength: float | tuple[float, float, float]
    center: tuple[float, float, float] = (0.0, 0.0, 0.0)
    axis: tuple[float, float, float] = (0.0, 1.0, 0.0)
    direction: tuple[float, float, float] = (1.0, 0.0, 0.0)
    core: str = "ideal"
    core_radius: float = 1.0


def unit(vector) -> np.ndarray:
    return np.asarray(vector, float) / np.linalg.norm(vector)


def cylinder(p: Primitive, x: np.ndarray) -> tuple[float, np.ndarray, np.ndarray]:
    """Return the distance from the axis, and the unit vectors away from and round it."""
    a, d = unit(p.axis), x - np.asarray(p.center, float)
    d = d - (d @ a) * a
    r = float(np.linalg.norm(d))
    return r, d / r, np.cross(a, d / r)


def uniform(p: Primitive, x: np.ndarray) -> np.ndarray:
    return np.asarray(p.strength, float)


def source(p: Primitive, x: np.ndarray) -> np.ndarray:
    r, outward, _ = cylinder(p, x)
    return p.strength / (2.0 * math.pi * r) * outward


def point_source(p: Primitive, x: np.ndarray) -> np.ndarray:
    d = x - np.asarray(p.center, float)
    return p.strength / (4.0 * math.pi * (d @ d)) * unit(d)


CORES = {
    "ideal": lambda r, R: 1.0 / r,
    "rankine": lambda r, R: r / R**2 if r < R else 1.0 / r,
    "lamb_oseen": lambda r, R: -math.expm1(-(r**2) / R**2) / r,
    "scully": lambda r, R: r / (R**2 + r**2),
}


def vortex(p: Primitive, x: np.ndarray) -> np.ndarray:
    r, _, around = cylinder(p, x)
    return p.strength / (2.0 * math.pi) * CORES[p.core](r, p.core_radius) * around


def doublet(p: Primitive, x: np.ndarray) -> np.ndarray:
    """Radial −μ cos θ/r², tangential −μ sin θ/r²: minus the gradient of the potential −μ cos θ/r of a dipole against the stream."""
    r, outward, around = cylinder(p, x)
    a = unit(p.axis)
    e = unit(np.asarray(p.direction) - (np.asarray(p.direction) @ a) * a)
    cos, sin = e @ outward, -(e @ around)
    return p.strength / r**2 * (-cos * outward - sin * around)


def rotation(p: Primitive, x: np.ndarray) -> np.ndarray:
    r, _, around = cylinder(p, x)
    return p.strength * r * around


FLOWS = {
    "uniform": uniform,
    "source": source,
    "point_source": point_source,
    "vortex": vortex,
    "doublet": doublet,
    "rotation": rotation,
}


def sample(primitives, x) -> np.ndarray:
    """Return the superposition at one point."""
    x = np.asarray(x, float)
    return sum((FLOWS[p.type](p, x) for p in primitives), np.zeros(3))
