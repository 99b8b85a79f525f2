"""Twin of kernels/birth.py: initial values of one particle in float64, from its key and ordinal."""

import math

import numpy as np

from tests.reference.flow import unit
from tests.reference.random import (
    BULK,
    LIFE,
    POSITION,
    SIZE,
    VELOCITY,
    normal,
    random_words,
    uniform,
    uniform_positive,
    uniform_signed,
)


def across(axis) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return two unit vectors across an axis, then the axis: the first across the axis and the coordinate it has least of."""
    a = unit(axis)
    first = unit(np.cross(np.eye(3)[np.argmin(np.abs(a))], a))
    return first, np.cross(a, first), a


def isotropic(words) -> np.ndarray:
    z, turn = uniform_signed(words[0]), 2.0 * math.pi * uniform(words[1])
    rho = math.sqrt(1.0 - z * z)
    return np.array([rho * math.cos(turn), rho * math.sin(turn), z])


def point(shape, key, ordinal):
    return np.zeros(3)


def segment(shape, key, ordinal):
    half = 0.5 * (np.array(shape["end"], float) - shape["start"])
    return 0.5 * (np.array(shape["end"], float) + shape["start"]) + half * uniform_signed(random_words(key, ordinal, POSITION)[0])


def disc(shape, key, ordinal):
    words = random_words(key, ordinal, POSITION)
    first, second, _ = across(shape.get("normal", (0, 1, 0)))
    r = shape["radius"] * (1.0 if shape.get("fill") == "surface" else math.sqrt(uniform(words[0])))
    turn = 2.0 * math.pi * uniform(words[1])
    return r * math.cos(turn) * first + r * math.sin(turn) * second


def sphere(shape, key, ordinal):
    largest = max(uniform(word) for word in random_words(key, ordinal, BULK)[:3])
    r = shape["radius"] * (1.0 if shape.get("fill") == "surface" else largest)
    return r * isotropic(random_words(key, ordinal, POSITION))


def box(shape, key, ordinal):
    h = 0.5 * np.array(shape["size"], float)
    p = np.array([uniform_signed(word) for word in random_words(key, ordinal, POSITION)[:3]])
    if shape.get("fill") == "surface":
        areas = np.array([h[1] * h[2], h[2] * h[0], h[0] * h[1]])
        face = int(np.searchsorted(np.cumsum(areas), uniform(random_words(key, ordinal, BULK)[0]) * areas.sum(), side="right"))
        p[face] = -1.0 if p[face] < 0.0 else 1.0
    return h * p


SHAPES = {"point": point, "segment": segment, "disc": disc, "sphere": sphere, "box": box}
VALUE_LAWS = {"uniform": lambda first, second: uniform_signed(first), "normal": normal}


def position(shape, key, ordinal) -> np.ndarray:
    return np.array(shape.get("center", (0, 0, 0)), float) + SHAPES[shape["type"]](shape, key, ordinal)


def draw(spec, first: int, second: int) -> float:
    spec = spec if isinstance(spec, dict) else {"mean": spec}
    return spec["mean"] + spec.get("spread", 0.0) * VALUE_LAWS[spec.get("law", "uniform")](first, second)


def velocity(spec, key, ordinal) -> np.ndarray:
    """Return a velocity uniform per solid angle in the cone."""
    words = random_words(key, ordinal, VELOCITY)
    first, second, a = across(spec.get("direction", (0, 1, 0)))
    cos = 1.0 - uniform(words[0]) * (1.0 - math.cos(math.radians(spec.get("cone", 0.0))))
    sin, turn = math.sqrt(1.0 - cos * cos), 2.0 * math.pi * uniform(words[1])
    return (cos * a + sin * math.cos(turn) * first + sin * math.sin(turn) * second) * draw(spec["speed"], *words[2:])


def lifetime(spec, key, ordinal) -> float:
    return max(draw(spec, *random_words(key, ordinal, LIFE)[:2]), 1e-6)


def mass(spec, key, ordinal) -> float:
    return max(draw(spec, *random_words(key, ordinal, LIFE)[2:]), 1e-12)


def radius(spec, key, ordinal) -> float:
    return max(draw(spec, *random_words(key, ordinal, SIZE)[:2]), 1e-12)


def jitter(key, ordinal) -> float:
    """Return where in its share of the interval a birth happens, in (0, 1]."""
    return uniform_positive(random_words(key, ordinal, POSITION)[3])
