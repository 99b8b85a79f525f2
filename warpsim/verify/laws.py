"""Laws of motion in closed form, in float64, from the scene's own numbers and never from the kernels.

Symbols: x place [m], v velocity [m/s], m mass [kg], g gravity [m/s²], w wind [m/s], τ = 1/rate relaxation time [s], d distance from a
center [m], k strength of an attractor.
"""

import math
from dataclasses import dataclass

import numpy as np

from warpsim.scene.oracles import felt
from warpsim.scene.particles import Drag, StokesDrag
from warpsim.verify.amounts import value_at
from warpsim.verify.pairs import pair_energy


@dataclass(frozen=True)
class Body:
    """A test particle at its release, and what acts on it everywhere alike."""

    x: np.ndarray
    v: np.ndarray
    m: float
    radius: float
    g: np.ndarray
    rate: float
    """Of relaxation, 1/τ [1/s]; 0: no drag; infinite: a tracer."""
    wind: np.ndarray
    """The sum of the uniform flows it feels, at its release."""


def body_of(oracle, scene) -> Body:
    """Return the test particle of an oracle: as the oracle says, else as its emitter is on average."""
    emitter, feels, coupling = oracle.emitter_in(scene), oracle.feels_in(scene), oracle.spec_in(scene).coupling
    m = oracle.mass or (emitter.mass.mean if emitter else 1e-3)
    radius = oracle.radius or (emitter.radius.mean if emitter else 1e-3)
    x = oracle.start if oracle.start is not None else middle_of(emitter.shape) if emitter else (0.0, 0.0, 0.0)
    v = oracle.velocity if oracle.velocity is not None else mean_velocity(emitter)
    winds = felt(feels.flow, scene.flow) if coupling is not None else []
    uniform = [[value_at(c, oracle.release) for c in wind.velocity] for wind in winds if wind.type == "uniform"]
    gravity = scene.gravity if feels.gravity and coupling != "tracer" else (0.0, 0.0, 0.0)
    arrays = (np.array(each, float) for each in (x, v, gravity, np.sum([(0.0, 0.0, 0.0), *uniform], axis=0)))
    x, v, g, wind = arrays
    return Body(x, v, m, radius, g, drag_rate(coupling, m, radius), wind)


def drag_rate(coupling, m: float, radius: float) -> float:
    """Return 1/τ = α/m, or 6π μ a/m by Stokes [1/s]; 0 without coupling, infinite for a tracer."""
    if isinstance(coupling, Drag):
        return coupling.alpha / m
    if isinstance(coupling, StokesDrag):
        return 6.0 * math.pi * coupling.viscosity * radius / m
    return 0.0 if coupling is None else math.inf


def middle_of(shape) -> tuple[float, float, float]:
    """Return the middle of an emitter's shape [m]."""
    if hasattr(shape, "center"):
        return shape.center
    return tuple((a + b) / 2.0 for a, b in zip(shape.start, shape.end, strict=True))


def mean_velocity(emitter) -> tuple[float, ...]:
    """Return an emitter's mean speed along its direction [m/s]."""
    if emitter is None or emitter.velocity is None:
        return (0.0, 0.0, 0.0)
    direction = np.array(emitter.velocity.direction, float)
    return tuple(emitter.velocity.speed.mean * direction / np.linalg.norm(direction))


def terminal_speed(body: Body) -> float:
    """Return |g| τ = m g/α, at which drag carries the weight [m/s].  Source: Stokes 1851."""
    return float(np.linalg.norm(body.g)) / body.rate


def velocity_after(body: Body, t: float) -> np.ndarray:
    """Return v∞ + (v0 − v∞) e^{−t/τ}, v∞ = w + g τ [m/s]: the solution of dv/dt = g + (w − v)/τ."""
    if body.rate == 0.0:
        return body.v + body.g * t
    if math.isinf(body.rate):
        return body.wind
    end = body.wind + body.g / body.rate
    return end + (body.v - end) * math.exp(-body.rate * t)


def place_after(body: Body, t: float) -> np.ndarray:
    """Return x0 + v0 t + ½ g t², or with drag the integral of velocity_after [m].  Source: Galilei 1638; Newton 1687, II, 1."""
    if body.rate == 0.0:
        return body.x + body.v * t + 0.5 * body.g * t * t
    if math.isinf(body.rate):
        return body.x + body.wind * t
    end = body.wind + body.g / body.rate
    return body.x + end * t - (body.v - end) * math.expm1(-body.rate * t) / body.rate


def potential_energy(x: np.ndarray, m: np.ndarray, g: np.ndarray, forces, time: float) -> np.ndarray:
    """Return −m g·x + Σ U at places (n, 3) [J]: U = k s, −k/s, ½ k d² for constant, inverse_square, spring; s = √(d² + ε²)."""
    total = -m * (x @ g)
    for force in forces:
        k, d2 = value_at(force.strength, time), ((x - np.array(force.center)) ** 2).sum(axis=1)
        s = np.sqrt(d2 + force.softening**2)
        total = total + {"constant": k * s, "inverse_square": -k / s, "spring": 0.5 * k * d2}[force.law]
    return total


def orbit_period(body: Body, center, time: float) -> float:
    """Return the time of one turn [s]: about an attractor by its law, of a tracer about a vortex or a rotation; nan without a law."""
    try:
        return _period(body, center, time)
    except (ValueError, ZeroDivisionError):  # repelled, not held at all, or in the very center
        return math.nan


def _period(body: Body, center, time: float) -> float:
    r = body.x - np.array(center.center, float)
    if center.type == "attractor":
        return _period_of_attraction(center.law, value_at(center.strength, time), r, body, center.softening)
    axis = np.array(center.axis, float) / np.linalg.norm(center.axis)
    d2 = float(r @ r - (r @ axis) ** 2)
    if center.type == "rotation":
        return 2.0 * math.pi / abs(value_at(center.angular_velocity, time))
    return 4.0 * math.pi**2 * d2 / abs(value_at(center.circulation, time) * share_of_core(center.core, d2))


def share_of_core(core, d2: float) -> float:
    """Return the part of a vortex's circulation within the distance d: 1, min(1, q), 1 − e^{−q}, q/(1 + q) by core, q = d²/R²."""
    if core.model == "ideal":
        return 1.0
    q = d2 / core.radius**2
    return {"rankine": min(1.0, q), "lamb_oseen": -math.expm1(-q), "scully": q / (1.0 + q)}[core.model]


def _period_of_attraction(law: str, k: float, r: np.ndarray, body: Body, softening: float) -> float:
    d, speed2 = float(np.linalg.norm(r)), float(body.v @ body.v)
    if law == "spring":
        return 2.0 * math.pi * math.sqrt(body.m / k)  # whatever the ellipse
    s = math.hypot(d, softening)
    pull = k / s if law == "constant" else k / s**3  # per distance: a circle has v² = pull d²/m
    if math.isclose(speed2, pull * d * d / body.m, rel_tol=1e-3) and abs(r @ body.v) <= 1e-3 * d * math.sqrt(speed2):
        return 2.0 * math.pi * math.sqrt(body.m / pull)
    if law == "constant":
        return math.nan  # a rosette: it turns, but has no period in closed form
    a = 1.0 / (2.0 / d - body.m * speed2 / k)  # vis-viva; without softening an ellipse
    return 2.0 * math.pi * math.sqrt(a**3 * body.m / k) if a > 0.0 else math.inf


def energy(oracle, scene, x: np.ndarray, v: np.ndarray, m: np.ndarray, time: float) -> float:
    """Return kinetic and potential energy of particles at places x (n, 3) with velocities v (n, 3), under what acts on them [J]."""
    feels = oracle.feels_in(scene)
    g = np.array(scene.gravity if feels.gravity else (0.0, 0.0, 0.0))
    forces = felt(feels.forces, scene.forces)
    potential = potential_energy(x, m, g, [force for force in forces if force.type != "pairwise"], time)
    between = pair_energy(x, [force for force in forces if force.type == "pairwise"], time)
    return float((0.5 * m * (v * v).sum(axis=1) + potential).sum()) + between


def height_above(d: np.ndarray, v: np.ndarray, normal: np.ndarray, g: float) -> float:
    """Return the height to which a throw rises over a plane, d·n + (v·n)²/(2g) [m]: it stays from bounce to bounce."""
    return float(d @ normal + (v @ normal) ** 2 / (2.0 * g))


def height_after(start: tuple[float, float, float], restitution: float, t: float) -> tuple[float, int]:
    """Return the height of the present bounce [m] and how many there have been, after a time t [s].

    `start` is the height over the plane [m], the speed away from it [m/s], and g [m/s²]. Source: Newton 1687: each bounce gives back the
    restitution's part of the speed.
    """
    height, speed, g = start
    if height < 0.0:
        return math.nan, 0
    top = height + speed * speed / (2.0 * g)
    impact, landing = math.sqrt(2.0 * g * top), (speed + math.sqrt(speed * speed + 2.0 * g * height)) / g
    bounces = 0
    while landing < t and bounces < 10_000:
        impact, top, bounces = restitution * impact, restitution**2 * top, bounces + 1
        landing += 2.0 * impact / g
    return top, bounces
