"""Faint drawings of what is in a scene but not to be seen: where particles are born, what moves the air, what stands in it, what pulls."""

import math

Vector = tuple[float, float, float]
_ROUND = 48  # sides of a circle
_STAVES, _BARS = 12, 8  # lines along a cylinder, cells along an edge of a wall
KINDS = ("emitters", "flow", "obstacles", "forces")


def scene_outlines(scene) -> dict[str, list[float]]:
    """Return per kind the ends of line segments, flat: x, y, z of one end, of the other, and so on [m]."""
    emitters = [emitter for system in scene.systems.values() for emitter in getattr(system, "emitters", ())]
    drawn = {"emitters": emitters, "flow": scene.flow, "obstacles": scene.obstacles, "forces": scene.forces}
    reach = _reach(scene, emitters)
    found: dict[str, list[float]] = {}
    for kind in KINDS:
        segments: list[Vector] = []
        for thing in drawn[kind]:
            segments += _emitter(thing, reach) if kind == "emitters" else _FORMS.get(thing.type, _cross)(thing, reach)
        found[kind] = [float(x) for point in segments for x in point]
    return found


def _reach(scene, emitters: list) -> float:
    """Return a length that suits the scene [m]: of what has no size of its own."""
    if scene.camera is not None:
        return 0.12 * math.dist(scene.camera.eye, scene.camera.target)
    sizes = [getattr(emitter.shape, "radius", 0.0) for emitter in emitters]
    return max([0.4, *sizes])


def _emitter(emitter, reach: float) -> list[Vector]:
    shape, small = emitter.shape, 0.15 * reach
    if emitter.on is not None:
        return []  # it is where its events are
    match shape.type:
        case "segment":
            return [shape.start, shape.end]
        case "disc":
            return _circle(shape.center, shape.normal, shape.radius)
        case "sphere":
            return _ball(shape.center, shape.radius)
        case "box":
            return _box(shape.center, shape.size)
    return _star(getattr(shape, "center", (0.0, 0.0, 0.0)), small)


def _line_with_rings(primitive, reach: float) -> list[Vector]:
    """A line along the axis and rings round it: a vortex (its core, if it has one), a line source, a doublet, a rotation."""
    axis = _unit(primitive.axis)
    radius = getattr(getattr(primitive, "core", None), "radius", None) or 0.35 * reach
    ends = [_along(primitive.center, axis, -reach), _along(primitive.center, axis, reach)]
    return [*ends, *_circle(primitive.center, axis, radius), *_arrow(ends[0], ends[1], 0.12 * reach)]


def _tube(cylinder, reach: float) -> list[Vector]:
    """A piece of a cylinder without end: rings, and lines along it."""
    axis = _unit(cylinder.axis)
    ends = [_along(cylinder.center, axis, side * reach) for side in (-1.0, 1.0)]
    rings = [_circle(place, axis, cylinder.radius) for place in (ends[0], cylinder.center, ends[1])]
    u, v = _across(axis)
    angles = [2.0 * math.pi * k / _STAVES for k in range(_STAVES)]
    spokes = [_along(_along((0.0, 0.0, 0.0), u, cylinder.radius * math.cos(a)), v, cylinder.radius * math.sin(a)) for a in angles]
    staves = [_along(end, spoke, 1.0) for spoke in spokes for end in ends]
    return [*(point for ring in rings for point in ring), *staves]


def _plane(wall, reach: float) -> list[Vector]:
    """A piece of a plane without end: a lattice, and an arrow along its normal."""
    normal = _unit(wall.normal)
    u, v = _across(normal)
    half = 2.0 * reach
    lattice = []
    for k in range(_BARS + 1):
        aside = half * (2.0 * k / _BARS - 1.0)
        for first, second in ((u, v), (v, u)):
            middle = _along(wall.center, first, aside)
            lattice += [_along(middle, second, -half), _along(middle, second, half)]
    tip = _along(wall.center, normal, 0.5 * reach)
    return [*lattice, wall.center, tip, *_arrow(wall.center, tip, 0.12 * reach)]


def _grid(primitive, reach: float) -> list[Vector]:
    """The box of a grid; that of an nvdb file stands in the file and is not drawn."""
    return [] if primitive.size is None else _box(primitive.center or (0.0, 0.0, 0.0), primitive.size)


def _wind(primitive, reach: float) -> list[Vector]:
    """An arrow along the wind; none for one that varies or is still."""
    velocity = [component if isinstance(component, float | int) else 0.0 for component in primitive.velocity]
    if math.hypot(*velocity) == 0.0:
        return []
    tip = _along((0.0, 0.0, 0.0), _unit(velocity), reach)
    return [(0.0, 0.0, 0.0), tip, *_arrow((0.0, 0.0, 0.0), tip, 0.2 * reach)]


def _segment(primitive, reach: float) -> list[Vector]:
    """The segment, an arrow's head at its end, its core round its middle."""
    axis = _unit([b - a for a, b in zip(primitive.start, primitive.end, strict=True)])
    middle = tuple(0.5 * (a + b) for a, b in zip(primitive.start, primitive.end, strict=True))
    radius = primitive.core.radius or 0.1 * reach
    return [primitive.start, primitive.end, *_arrow(primitive.start, primitive.end, 0.12 * reach), *_circle(middle, axis, radius)]


def _ring(primitive, reach: float) -> list[Vector]:
    """The circle as it is at first, and an arrow where the fluid goes through it."""
    radius = _first_number(primitive.radius) or reach
    tip = _along(primitive.center, _unit(primitive.normal), 0.5 * radius)
    arrow = [primitive.center, tip, *_arrow(primitive.center, tip, 0.15 * radius)]
    return [*_circle(primitive.center, primitive.normal, radius), *arrow]


def _first_number(strength) -> float | None:
    """The number that a strength is, or begins with; None where a formula would have to be worked out."""
    if isinstance(strength, float | int):
        return strength
    knots = getattr(strength, "keyframes", None)
    wave = getattr(strength, "sine", None)
    return knots[0][1] if knots else wave.mean if wave else None


def _cross(thing, reach: float) -> list[Vector]:
    center = getattr(thing, "center", None)
    return [] if center is None else _star(center, 0.3 * reach) + _ball(center, 0.15 * reach)


_FORMS = {
    "uniform": _wind,
    "vortex": _line_with_rings,
    "source": _line_with_rings,
    "doublet": _line_with_rings,
    "rotation": _line_with_rings,
    "vortex_segment": _segment,
    "vortex_ring": _ring,
    "cylinder": _tube,
    "wall": _plane,
    "grid": _grid,
}


def _unit(vector) -> Vector:
    length = math.hypot(*vector)
    return tuple(x / length for x in vector)


def _along(point, direction, distance: float) -> Vector:
    return tuple(p + distance * d for p, d in zip(point, direction, strict=True))


def _across(axis) -> tuple[Vector, Vector]:
    """Two unit vectors across an axis and across each other."""
    ax, ay, az = _unit(axis)
    bx, by, bz = (0.0, 1.0, 0.0) if abs(ay) < 0.9 else (1.0, 0.0, 0.0)
    u = _unit((ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx))
    return u, (ay * u[2] - az * u[1], az * u[0] - ax * u[2], ax * u[1] - ay * u[0])


def _circle(center, normal, radius: float) -> list[Vector]:
    u, v = _across(normal)
    angles = [2.0 * math.pi * k / _ROUND for k in range(_ROUND + 1)]
    rim = [_along(_along(center, u, radius * math.cos(a)), v, radius * math.sin(a)) for a in angles]
    return [end for pair in zip(rim, rim[1:], strict=False) for end in pair]


def _ball(center, radius: float) -> list[Vector]:
    return [end for axis in ((1, 0, 0), (0, 1, 0), (0, 0, 1)) for end in _circle(center, axis, radius)]


def _star(center, size: float) -> list[Vector]:
    axes = ((1, 0, 0), (0, 1, 0), (0, 0, 1))
    return [_along(center, axis, side * size) for axis in axes for side in (-1.0, 1.0)]


def _box(center, size) -> list[Vector]:
    corners = [tuple(c + 0.5 * s * sign for c, s, sign in zip(center, size, signs, strict=True)) for signs in _SIGNS]
    return [corners[k] for i in range(8) for j in range(i) if _neighbors(i, j) for k in (i, j)]


_SIGNS = [(x, y, z) for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]


def _neighbors(i: int, j: int) -> bool:
    return sum(a != b for a, b in zip(_SIGNS[i], _SIGNS[j], strict=True)) == 1


def _arrow(start, tip, size: float) -> list[Vector]:
    """The two barbs of an arrow's head."""
    direction = _unit([b - a for a, b in zip(start, tip, strict=True)])
    u, _ = _across(direction)
    base = _along(tip, direction, -size)
    return [tip, _along(base, u, 0.5 * size), tip, _along(base, u, -0.5 * size)]
