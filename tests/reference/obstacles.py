"""Twin of warpsim/images.py, float64: not image by image but by the theorems themselves, so that one formula serves every kind of flow."""

import numpy as np

from tests.reference.flow import FLOWS, Primitive, sample, unit


def round_cylinder(primitives, center, axis, radius: float, circulation: float, x) -> np.ndarray:
    """Return the flow round a cylinder at x, outside of it.

    Milne-Thomson's circle theorem W(z) = w'(z) + d/dz conj(w(R²/conj z)) in the plane across the axis, complex velocities u − i v;
    flow along the axis stays as it is. The cylinder's own circulation is a vortex on its axis.
    """
    a, center = unit(axis), np.asarray(center, float)
    first = unit(np.cross(a, np.eye(3)[np.argmin(np.abs(a))]))
    second = np.cross(a, first)

    def complex_velocity(z: complex) -> complex:
        v = sample(primitives, center + z.real * first + z.imag * second)
        return complex(v @ first, -(v @ second))

    d = np.asarray(x, float) - center
    z = complex(d @ first, d @ second)
    turned = complex_velocity(z) - radius**2 / z**2 * complex_velocity(radius**2 / z.conjugate()).conjugate()
    turned += -1j * circulation / (2.0 * np.pi * z)
    return turned.real * first - turned.imag * second + (sample(primitives, x) @ a) * a


def before_walls(primitives, walls, x) -> np.ndarray:
    """Return the flow before walls (center, normal) that are perpendicular to each other: what is mirrored in all of their combinations."""
    x = np.asarray(x, float)
    mirrors = [np.eye(3)]
    places = [lambda y: y]
    for center, normal in walls:
        mirror = np.eye(3) - 2.0 * np.outer(unit(normal), unit(normal))
        c = np.asarray(center, float)
        places += [lambda y, place=place, m=mirror, c=c: c + m @ (place(y) - c) for place in places]
        mirrors += [mirror @ other for other in mirrors]
    wind = sum((FLOWS[p.type](p, x) for p in primitives if p.type == "uniform"), np.zeros(3))
    for _, normal in walls:
        wind = wind - (wind @ unit(normal)) * unit(normal)
    rest = [p for p in primitives if p.type != "uniform" and not any(stands_on(p, normal) for _, normal in walls)]
    return wind + sum(mirror.T @ sample(rest, place(x)) for mirror, place in zip(mirrors, places, strict=True))


def stands_on(p: Primitive, normal) -> bool:
    """Tell whether a line is perpendicular to a wall, so that it needs no image."""
    return p.type != "point_source" and abs(unit(p.axis) @ unit(normal)) > 0.999
