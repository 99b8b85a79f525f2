"""Twin of a whole scene of flocks: rules, species, steering, current, limits and borders, in float64, over all pairs and without a grid.

What it does not know: contacts (ask for boids that touch nothing), and flows but a uniform current about an upright cylinder.
"""

import math

import numpy as np

from tests.reference import flock as rules
from tests.reference import signals, steering
from tests.reference.birth import isotropic
from tests.reference.random import random_words
from warpsim.systems.emitters import random_key

WANDER = 11
KEYS = ("separation", "cohesion", "alignment")


def fly(sim, scene, frames: int) -> dict[str, np.ndarray]:
    """Return the places of all flocks after so many frames from where a simulation starts them, (n, 3) each [m]."""
    flocks = {name: spec for name, spec in scene.systems.items() if spec.type == "flock"}
    state = {name: (column(sim, name, "position"), column(sim, name, "velocity")) for name in flocks}
    for frame in range(frames):
        seen, after = {name: state[name] for name in flocks}, {}
        for name in flocks:
            after[name] = through_frame(name, scene, seen, frame)
        state = after
    return {name: x for name, (x, _) in state.items()}


def column(sim, name: str, field: str) -> np.ndarray:
    """Return a field of a flock as the simulation has it, (n, 3)."""
    return getattr(sim.frame()[name], field).astype(float)


def through_frame(name: str, scene, seen: dict, frame: int) -> tuple[np.ndarray, np.ndarray]:
    """Return places and velocities of a flock after a frame, those of others being as they were when it began."""
    spec, (x, v) = scene.systems[name], seen[name]
    count = spec.substeps or scene.time.substeps
    h = 1.0 / (scene.time.fps * count)
    for s in range(count):
        force = rules.forces(x, v, own_rules(spec))
        for other, one in spec.attends.items():
            force += across(x, v, *seen[other], rules_toward(spec, one))
        force += np.array([steered(name, scene, i, x[i], v[i], (frame * count + s) * h, h) for i in range(len(x))])
        x, v = advance(spec, scene, x, v, force, h)
    return x, v


def across(x, v, y, w, r: rules.Rules) -> np.ndarray:
    """Return what boids at y with velocities w make those at x do, (n, 3) [N]."""
    d = y[None] - x[:, None]
    for axis, edge in enumerate(r.period):
        if edge:
            d[..., axis] -= edge * np.floor(d[..., axis] / edge + 0.5)
    distance = np.linalg.norm(d, axis=2)
    ahead, half = (d * v[:, None]).sum(axis=2), np.cos(np.radians(0.5 * r.field_of_view))
    seen = (distance < r.radius) & ((ahead >= half * distance * np.linalg.norm(v, axis=1)[:, None]) | (r.field_of_view >= 360))
    near = {key: seen & (distance < r.radii.get(key, r.radius)) for key in KEYS}
    share = {key: near[key] / np.maximum(near[key].sum(axis=1, keepdims=True), 1) for key in KEYS}
    total = -r.weights["separation"] * ((near["separation"] / np.maximum(distance, 1e-3 * r.radius) ** 2)[..., None] * d).sum(axis=1)
    total += r.weights["cohesion"] * (share["cohesion"][..., None] * d).sum(axis=1)
    return total + r.weights["alignment"] * (share["alignment"] @ w - near["alignment"].any(axis=1)[:, None] * v)


def own_rules(spec) -> rules.Rules:
    """Return the twin's rules of a flock among its own."""
    return rules_of(spec, spec.perception.radius, spec.perception.field_of_view, spec)


def rules_toward(spec, one) -> rules.Rules:
    """Return the twin's rules toward another flock."""
    view = spec.perception.field_of_view if one.field_of_view is None else one.field_of_view
    return rules_of(one, one.radius or spec.perception.radius, view, spec)


def rules_of(one, radius: float, view: float, spec) -> rules.Rules:
    weights = {key: getattr(one, key).weight for key in KEYS}
    radii = {key: getattr(one, key).radius for key in KEYS if getattr(one, key).radius}
    return rules.Rules(radius, view, weights, radii, spec.domain.size if spec.domain.boundary == "periodic" else (0.0, 0.0, 0.0))


def steered(name: str, scene, i: int, x, v, t: float, h: float) -> np.ndarray:
    """Return the sum of what a flock's behaviors make boid i do at time t."""
    spec, total = scene.systems[name], np.zeros(3)
    for place, one in enumerate(spec.steering):
        s = spec.pace if one.speed is None else one.speed
        total += one.weight * BEHAVIORS[one.type](one, x, v, s, (name, scene, place, i, t))
    return total


def goal(one, t: float) -> np.ndarray:
    return np.array([signals.sample(each if isinstance(each, float) else each.model_dump(exclude_none=True), t) for each in one.target])


def wander(one, x, v, s, asked) -> np.ndarray:
    """Toward a place on a sphere ahead, between random ones by 3 s² − 2 s³; in the axes that the domain has."""
    name, scene, place, i, t = asked
    key = tuple(int(word) for word in random_key(scene.seed, name, place))
    n, part = int(t // one.period), t / one.period - t // one.period
    part = part * part * (3 - 2 * part)
    here, there = (isotropic(random_words(key, (n + k) << 32 | i, WANDER)) for k in (0, 1))
    roam = (here * (1 - part) + there * part) * (np.array(scene.systems[name].domain.size) > 0)
    return steering.along(steering.along(v, one.distance) + roam * one.radius, s) - v


def avoid(one, x, v, s, asked) -> np.ndarray:
    """Past colliders that have a clearance here, by the gaps along the heading."""
    speed, heading = np.linalg.norm(v), steering.along(v, 1.0)
    reach = speed * one.horizon
    nearest, away = reach + one.radius, np.zeros(3)
    for solid in asked[1].colliders:
        way = 0.0
        for _ in range(8):
            gap, normal = CLEARANCES[solid.type](solid, x + heading * way)
            if gap < one.radius:
                if way < nearest:
                    nearest, away = way, normal
                break
            way += gap - 0.5 * one.radius
            if way > reach:
                break
    if nearest > reach:
        return np.zeros(3)
    urgency = 1 - nearest / (reach + one.radius)
    aside = away - heading * (away @ heading)
    return (steering.along(aside, s) - heading * (heading @ v * urgency)) * urgency


def follow(one, x, v, s, asked) -> np.ndarray:
    """steering.path over all segments at once."""
    a = np.array(one.points if one.closed else one.points[:-1])
    e, ahead = np.roll(np.array(one.points), -1, axis=0)[: len(a)] - a, x + v * one.horizon
    near = a + e * np.clip(((ahead - a) * e).sum(axis=1) / (e * e).sum(axis=1), 0, 1)[:, None]
    gap = np.linalg.norm(ahead - near, axis=1)
    k = gap.argmin()
    if gap[k] <= one.radius:
        return steering.along(e[k], s) - v
    return steering.along(near[k] + steering.along(e[k], s * max(one.horizon, 1e-3)) - x, s) - v


def of_capsule(solid, x) -> tuple[float, np.ndarray]:
    """Return the gap between a place and a capsule, and the normal there."""
    a, b = np.array(solid.start), np.array(solid.end)
    d = x - (a + (b - a) * np.clip((x - a) @ (b - a) / ((b - a) @ (b - a)), 0, 1))
    return np.linalg.norm(d) - solid.radius, d / np.linalg.norm(d)


CLEARANCES = {"capsule": of_capsule}

BEHAVIORS = {
    "seek": lambda one, x, v, s, asked: steering.seek(x, v, s, goal(one, asked[4]), None, one.radius or np.inf),
    "arrive": lambda one, x, v, s, asked: steering.arrive(x, v, s, goal(one, asked[4]), None, one.radius),
    "contain": lambda one, x, v, s, asked: contain(one, x, v, s, asked[1].systems[asked[0]].domain),
    "path": follow,
    "wander": wander,
    "avoid": avoid,
}


def contain(one, x, v, s, domain) -> np.ndarray:
    """Turn away from the walls of the axes that the domain has."""
    size = np.array(domain.size)
    return np.where(size > 0, steering.contain(x, v, s, np.array(domain.min), size, one.radius, one.horizon), 0.0)


def current(scene, x: np.ndarray) -> np.ndarray:
    """Return the flow at places: uniform along x, about a cylinder along y as its potential has it, W = U (z + R²/z)."""
    u = np.zeros_like(x)
    for one in scene.flow:
        u += np.array([float(each) for each in one.velocity])
    for rock in scene.obstacles:
        z = (x[:, 0] - rock.center[0]) + 1j * (x[:, 2] - rock.center[2])
        w = -u[:, 0] * (rock.radius / z) ** 2
        u = u + np.stack([w.real, 0 * w.real, -w.imag], axis=1)
    return u


def advance(spec, scene, x, v0, force, h) -> tuple[np.ndarray, np.ndarray]:
    """Kick with drag, largest turn and band of speeds through the water, drift, borders."""
    strength = np.linalg.norm(force, axis=1, keepdims=True)
    if spec.max_force:
        force = force * np.minimum(1, spec.max_force / np.maximum(strength, 1e-30))
    u = current(scene, x) if spec.coupling else np.zeros_like(x)
    k = spec.coupling.alpha / spec.mass if spec.coupling else 0.0
    mean = -math.expm1(-k * h) / (k * h) if k else 1.0
    v = u + (v0 - u) * math.exp(-k * h) + force / spec.mass * h * mean
    w = turned(v0 - u, v - u, math.radians(spec.turn_rate) * h) if spec.turn_rate else v - u
    if spec.speed:
        pace = np.linalg.norm(w, axis=1, keepdims=True)
        w = w * np.clip(pace, *spec.speed) / np.maximum(pace, 1e-30)
    v = w + u
    x = x + h * v
    return borders(spec.domain, x, v)


def turned(v0: np.ndarray, v: np.ndarray, most: float) -> np.ndarray:
    """Return v turned back so far that it is at most an angle from v0."""
    out = v.copy()
    for i, (before, after) in enumerate(zip(v0, v, strict=True)):
        a, b = np.linalg.norm(before), np.linalg.norm(after)
        if a and b and before @ after < math.cos(most) * a * b:
            ahead = before / a
            aside = after - ahead * (ahead @ after)
            out[i] = b * (ahead * math.cos(most) + aside / np.linalg.norm(aside) * math.sin(most))
    return out


def borders(domain, x: np.ndarray, v: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Throw boids back at the walls of a box, or let them come in on the other side."""
    low, size = np.array(domain.min), np.array(domain.size)
    lives = size > 0
    if domain.boundary == "periodic":
        return np.where(lives, low + np.mod(x - low, np.where(lives, size, 1.0)), x), v
    if domain.boundary == "none":
        return x, v
    below, above = lives & (x < low), lives & (x > low + size)
    v = np.where(below, np.abs(v), np.where(above, -np.abs(v), v))
    return np.where(below, 2 * low - x, np.where(above, 2 * (low + size) - x, x)), v
