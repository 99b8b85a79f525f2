"""Twin of kernels/flow.py: every primitive in float64, from the textbook form, singular where it is singular."""

import math
from dataclasses import dataclass, field

import numpy as np

from tests.reference import noise
from tests.reference.grids import grid
from tests.reference.programs import evaluate
from warpsim.scene.expressions import PLACE, compile_expression


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
    half_length: float = 1.0
    radius: float = 1.0
    formulas: tuple[str, str, str] = ("0", "0", "0")
    time: float = 0.0
    length: float = 1.0
    seed: int = 0
    clock: int = 0
    nodes: np.ndarray = field(default_factory=lambda: np.zeros((2, 2, 2, 3), np.float32))
    spacing: tuple[float, float, float] = (1.0, 1.0, 1.0)
    outside: str = "zero"


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


NODES, WEIGHTS = np.polynomial.legendre.leggauss(60)


def mean_decay_integral(q: float) -> float:
    """Return Ein(q) = ∫ (1 − e^{−t})/t dt from 0 to q, by quadrature on [0, min(q, 40)]; beyond, the exponential is nothing."""
    t = 0.5 * min(q, 40.0) * (NODES + 1.0)
    return float(0.5 * min(q, 40.0) * (WEIGHTS @ (-np.expm1(-t) / t)) + math.log(max(q, 40.0) / 40.0))


SOFTENED = {  # square of the distance s from a line -> what stands for it, so that d ln P/d ln s² is the core's share of the circulation
    "ideal": lambda s2, R: s2,
    "rankine": lambda s2, R: R**2 * math.exp(s2 / R**2 - 1.0) if s2 < R**2 else s2,
    "lamb_oseen": lambda s2, R: R**2 * math.exp(mean_decay_integral(s2 / R**2) - np.euler_gamma),
    "scully": lambda s2, R: s2 + R**2,
}


def line_integral(p: Primitive, x: np.ndarray, places: np.ndarray, tangents: np.ndarray, away: np.ndarray) -> np.ndarray:
    """Return Γ/(4π) ∫ dl × g/D^{3/2}: D = |x − x'|² + P − s², g half its gradient; away: from the nearest point of the line."""
    s = float(np.linalg.norm(away))
    softened = SOFTENED[p.core](s**2, p.core_radius)
    slope = CORES[p.core](s, p.core_radius) * softened / s
    d = x - places
    square = (d * d).sum(axis=1) + softened - s**2
    g = d + (slope - 1.0) * away
    return p.strength / (4.0 * math.pi) * (np.cross(tangents, g) / square[:, None] ** 1.5).sum(axis=0)


def vortex_segment(p: Primitive, x: np.ndarray) -> np.ndarray:
    """Biot and Savart's integral, by Gauss's rule on pieces that grow with the distance from the nearest point of the segment."""
    r, _, _ = cylinder(p, x)
    a, half = unit(p.axis), p.half_length
    nearest = float(np.clip((x - np.asarray(p.center)) @ a, -half, half))
    cuts = nearest + 0.5 * r * np.concatenate([-(2.0 ** np.arange(16.0))[::-1], [0.0], 2.0 ** np.arange(16.0)])
    cuts = np.unique(np.clip(cuts, -half, half))
    middles, halves = 0.5 * (cuts[1:] + cuts[:-1]), 0.5 * np.diff(cuts)
    along = (middles[:, None] + halves[:, None] * NODES).ravel()
    lengths = (halves[:, None] * WEIGHTS).ravel()
    return line_integral(p, x, np.asarray(p.center) + np.outer(along, a), np.outer(lengths, a), x - p.center - nearest * a)


def vortex_ring(p: Primitive, x: np.ndarray) -> np.ndarray:
    """Biot and Savart's integral round the circle by the trapezoid rule, which converges exponentially there."""
    a = unit(p.axis)
    first = unit(np.cross(np.eye(3)[np.argmin(np.abs(a))], a))
    second = np.cross(a, first)
    d = x - np.asarray(p.center, float)
    rho = np.linalg.norm(d - (d @ a) * a)
    nearest = (d - (d @ a) * a) * (p.radius / rho) if rho > 0.0 else p.radius * first
    count = 64 + int(40.0 * p.radius / np.linalg.norm(d - nearest))
    angle = 2.0 * math.pi * np.arange(count) / count
    outward = np.outer(np.cos(angle), first) + np.outer(np.sin(angle), second)
    tangents = np.cross(a, outward) * (2.0 * math.pi * p.radius / count)
    return line_integral(p, x, np.asarray(p.center) + p.radius * outward, tangents, d - nearest)


def curl_noise(p: Primitive, x: np.ndarray) -> np.ndarray:
    """The curl in cells, brought to a root mean square of the strength: a corner has 1/3 per component, a cell 1.0974211434 of it."""
    return p.strength / math.sqrt(1.0974211434 / 3.0) * noise.curl_noise((x - np.asarray(p.center, float)) / p.length, p.seed, p.clock)


def expression(p: Primitive, x: np.ndarray) -> np.ndarray:
    return np.array([evaluate(compile_expression(text, PLACE), p.time, x - np.asarray(p.center)) for text in p.formulas])


FLOWS = {
    "uniform": uniform,
    "source": source,
    "point_source": point_source,
    "vortex": vortex,
    "doublet": doublet,
    "rotation": rotation,
    "vortex_segment": vortex_segment,
    "vortex_ring": vortex_ring,
    "curl_noise": curl_noise,
    "expression": expression,
    "grid": grid,
}


def sample(primitives, x) -> np.ndarray:
    """Return the superposition at one point."""
    x = np.asarray(x, float)
    return sum((FLOWS[p.type](p, x) for p in primitives), np.zeros(3))
