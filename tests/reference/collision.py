"""Twin of kernels/clearance, contact, response and collision: distances from the definition, touches by search, responses from the laws."""

import numpy as np


def gap(solid: dict, q) -> float:
    """Signed distance of q [m] to a solid in its own frame, positive where particles may be."""
    q = np.asarray(q, float)
    kind, inside = solid["type"], solid.get("side") == "inside"
    if kind == "plane":
        n = np.asarray(solid["normal"], float)
        return float(q @ n / np.linalg.norm(n))
    if kind == "sphere":
        g = np.linalg.norm(q) - solid["radius"]
    elif kind == "capsule":
        half = np.asarray(solid["half"], float)
        share = np.clip(q @ half / (half @ half), -1.0, 1.0)
        g = np.linalg.norm(q - share * half) - solid["radius"]
    else:
        half = 0.5 * np.asarray(solid["size"], float)
        if (np.abs(q) <= half).all():
            g = -(half - np.abs(q)).min()
        else:
            g = np.linalg.norm(q - np.clip(q, -half, half))
    return float(-g if inside else g)


def normal(solid: dict, q, step: float = 1e-6) -> np.ndarray:
    """Gradient of the gap, by central differences."""
    q = np.asarray(q, float)
    slope = np.array([gap(solid, q + step * e) - gap(solid, q - step * e) for e in np.eye(3)])
    return slope / np.linalg.norm(slope)


def first_touch(solid: dict, q, w, a, duration: float, samples: int = 1000) -> float | None:
    """First time at which the gap of q + w t + ½ a t² is zero, by dense sampling and bisection; None if it stays positive."""
    q, w, a = (np.asarray(x, float) for x in (q, w, a))

    def at(t: float) -> float:
        return gap(solid, q + w * t + 0.5 * a * t * t)

    times = np.linspace(0.0, duration, samples)
    for early, late in zip(times, times[1:], strict=False):
        if at(late) <= 0.0:
            while late - early > 1e-12 * duration:
                middle = 0.5 * (early + late)
                early, late = (early, middle) if at(middle) <= 0.0 else (middle, late)
            return late
    return None


def bounce(w, n, restitution: float, friction: float) -> np.ndarray:
    """Velocity after an impact: −e of the normal part; the tangential part loses at most μ times the normal impulse."""
    w, n = np.asarray(w, float), np.asarray(n, float)
    into = -(w @ n)
    along = w + into * n
    speed = np.linalg.norm(along)
    kept = max(0.0, 1.0 - friction * (1.0 + restitution) * into / speed) if speed else 0.0
    return along * kept + restitution * into * n


def slide(w, a, brake: float, duration: float, steps: int = 200_000) -> tuple[np.ndarray, np.ndarray]:
    """Way and last velocity of a point with tangential w and a, decelerated by `brake` against its motion: small explicit steps."""
    w, way, h = np.array(w, float), np.zeros(3), duration / steps
    for _ in range(steps):
        free = w + np.asarray(a, float) * h
        speed = np.linalg.norm(free)
        later = free * max(0.0, 1.0 - brake * h / speed) if speed else free
        way += 0.5 * (w + later) * h
        w = later
    return way, w


def rotation(degrees) -> np.ndarray:
    """The matrix that turns about x, then y, then z."""
    (cx, cy, cz), (sx, sy, sz) = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    about_x = np.array([[1, 0, 0], [0, cx, -sx], [0, sx, cx]])
    about_y = np.array([[cy, 0, sy], [0, 1, 0], [-sy, 0, cy]])
    about_z = np.array([[cz, -sz, 0], [sz, cz, 0], [0, 0, 1]])
    return about_z @ about_y @ about_x


def bouncing_height(height: float, restitution: float, gravity: float, t: float) -> float:
    """Height [m] at time t of a ball dropped from rest: arcs between impacts, each with −e of the speed of the last."""
    time, speed = np.sqrt(2.0 * height / gravity), np.sqrt(2.0 * gravity * height)
    if t <= time:
        return height - 0.5 * gravity * t * t
    while True:
        speed *= restitution
        if t <= time + 2.0 * speed / gravity:
            s = t - time
            return speed * s - 0.5 * gravity * s * s
        time += 2.0 * speed / gravity
