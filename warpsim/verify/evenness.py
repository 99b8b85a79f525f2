"""Coordinates in which births that are spread evenly are even, cut into cells of known shares."""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from warpsim.directions import perpendiculars
from warpsim.verify.mesh_evenness import MeshLayers

BESIDE = 1e-4  # of a coordinate's range, and what float32 makes of it: a birth further out is outside, and no rounding


class Cells(NamedTuple):
    """Independent divisions: the share of each of their cells, and the cell numbers of vectors (n, 3), an array (n,) for each division.

    A number is -1 where a vector lies outside of the shape or the cone.
    """

    shares: list[np.ndarray]
    number: Callable[[np.ndarray], list[np.ndarray]]


def binned(u: np.ndarray, bins: int, beside: float) -> np.ndarray:
    """Return bins 0 … bins - 1 of coordinates in [0, 1], and -1 outside."""
    return np.where((u < -beside) | (u > 1.0 + beside), -1, np.clip((u * bins).astype(int), 0, bins - 1))


def turn(along: np.ndarray, across: np.ndarray) -> np.ndarray:
    """Return an angle as a part of a turn, in [0, 1]."""
    return np.arctan2(across, along) / (2.0 * np.pi) % 1.0


def even(coordinates: Callable[[np.ndarray], list[np.ndarray]], count: int, bins: int, beside: float) -> Cells:
    """Return equal bins along each of `count` coordinates in [0, 1]."""

    def number(vectors: np.ndarray) -> list[np.ndarray]:
        return [binned(u, bins, beside) for u in coordinates(vectors)]

    return Cells([np.full(bins, 1.0 / bins)] * count, number)


def cells_of_directions(velocity, bins: int) -> Cells:
    """Return bins of the cosine to the cone's axis, from the cone's edge to the axis, and of the angle round it."""
    axis = np.array(velocity.direction, float) / np.linalg.norm(velocity.direction)
    first, second = perpendiculars(axis)
    width = 2.0 * np.sin(np.radians(velocity.cone) / 2.0) ** 2  # 1 − cos

    def coordinates(v: np.ndarray) -> list[np.ndarray]:
        away = v / np.linalg.norm(v, axis=1, keepdims=True) - axis  # of length 2 sin θ/2: exact for narrow cones, too
        return [1.0 - (away * away).sum(axis=1) / (2.0 * width), turn(v @ first, v @ second)]

    return even(coordinates, 2, bins, BESIDE + 2.0**-22 / width)


def cells_of_places(shape, bins: int) -> Cells | None:
    """Return the cells of a shape; None for one without such coordinates."""
    make = {"segment": _segment, "disc": _disc, "sphere": _sphere, "box": _box, "mesh": _mesh}.get(shape.type)
    return make(shape, bins) if make else None


def _beside(places, sizes) -> float:
    """Return how far out roundings may lead: of places far from the origin they are a larger part of a small shape."""
    return BESIDE + 2.0**-20 * float(np.max(np.abs(places))) / float(np.min(sizes))


def _segment(shape, bins: int) -> Cells:
    start, along = np.array(shape.start), np.subtract(shape.end, shape.start)
    beside = _beside([shape.start, shape.end], np.linalg.norm(along))
    return even(lambda x: [(x - start) @ along / (along @ along)], 1, bins, beside)


def _disc(shape, bins: int) -> Cells:
    """Its area grows as r²."""
    first, second = perpendiculars(np.array(shape.normal, float) / np.linalg.norm(shape.normal))

    def coordinates(x: np.ndarray) -> list[np.ndarray]:
        d = (x - np.array(shape.center)) / shape.radius
        return [turn(d @ first, d @ second)] + ([(d * d).sum(axis=1)] if shape.fill == "volume" else [])

    return even(coordinates, 2 if shape.fill == "volume" else 1, bins, _beside(shape.center, shape.radius))


def _sphere(shape, bins: int) -> Cells:
    """Its volume grows as r³; a coordinate of the direction is uniform (Archimedes)."""

    def coordinates(x: np.ndarray) -> list[np.ndarray]:
        d = (x - np.array(shape.center)) / shape.radius
        r = np.linalg.norm(d, axis=1)
        surface = [0.5 + 0.5 * d[:, 2] / np.maximum(r, 1e-30), turn(d[:, 0], d[:, 1])]
        return surface + ([r**3] if shape.fill == "volume" else [])

    return even(coordinates, 3 if shape.fill == "volume" else 2, bins, _beside(shape.center, shape.radius))


def _box(shape, bins: int) -> Cells:
    """Filled, each coordinate is uniform; on its surface a face has its share by area, and is cut into squares."""
    size = np.array(shape.size, float)
    beside = _beside(shape.center, size)

    def coordinates(x: np.ndarray) -> list[np.ndarray]:
        return list(((x - np.array(shape.center)) / size + 0.5).T)

    if shape.fill == "volume":
        return even(coordinates, 3, bins, beside)
    side = max(1, int(np.sqrt(bins)))
    areas = np.array([size[1] * size[2], size[2] * size[0], size[0] * size[1]])
    shares = np.repeat(np.repeat(areas / areas.sum() / 2.0, 2), side * side) / side**2

    def number(x: np.ndarray) -> list[np.ndarray]:
        u = np.stack(coordinates(x), axis=1)
        axis = np.argmax(np.abs(u - 0.5), axis=1)
        face = 2 * axis + (u[np.arange(len(u)), axis] > 0.5)
        others = np.take_along_axis(u, np.stack([(axis + 1) % 3, (axis + 2) % 3], axis=1), axis=1)
        first, second = binned(others[:, 0], side, beside), binned(others[:, 1], side, beside)
        inside = (first >= 0) & (second >= 0) & (np.abs(u - 0.5).max(axis=1) <= 0.5 + beside)
        return [np.where(inside, face * side * side + first * side + second, -1)]

    return Cells([shares], number)


def _mesh(shape, bins: int) -> Cells:
    """Layers between parallel planes, each with the same part of the surface or of what it encloses."""
    layers = MeshLayers(shape, bins)
    beside = _beside([layers.low, layers.high], layers.high - layers.low)
    return Cells([layers.shares], lambda x: [layers.number(x, beside)])
