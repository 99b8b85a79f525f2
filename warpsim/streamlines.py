"""Streamlines: where they start, how long they are, and as files of data."""

import csv
import io
import json
import math
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import numpy as np

from warpsim.files import whole_file, write_text

STEP_COUNT = 60
PRIMES = (2, 3, 5)
KINDS = (".npz", ".csv", ".json")  # of files


class Lines(NamedTuple):
    """Streamlines of the flow at one moment, each from upstream to downstream."""

    position: np.ndarray
    """float32 (lines, points, 3) [m]."""
    velocity: np.ndarray
    """float32 (lines, points, 3) [m/s]."""
    time: float
    """[s]."""


def streamlines(simulation) -> np.ndarray:
    """Return the scene's `viewer.streamlines` streamlines of the present flow, float32 (n, k, 3) [m], through where the scene plays."""
    scene = simulation.scene
    return through(simulation.flow, seeds(scene, scene.viewer.streamlines), region(scene)[1], STEP_COUNT)


def through(flow, points: np.ndarray, length: float, step_count: int, time: float | None = None) -> np.ndarray:
    """Return streamlines of the flow of a length [m] with their middle at points (n, 3): float32 (n, step_count + 1, 3) [m]."""
    half = (step_count + 1) // 2
    ways = [(-1.0, half), (1.0, step_count - half)]
    upstream, downstream = (flow.streamlines(points, sign * length * count / step_count, count, time) for sign, count in ways if count)
    return np.concatenate([upstream[:, :0:-1], downstream], axis=1)


def lines_of(flow, points: np.ndarray, length: float, step_count: int, time: float) -> Lines:
    """Return streamlines through points with the velocity along them."""
    position = through(flow, points, length, step_count, time)
    return Lines(position, flow.sample(position.reshape(-1, 3), time).reshape(position.shape), time)


def seeds(scene, count: int) -> np.ndarray:
    """Return that many places, float64 (count, 3) [m], evenly spread over where the scene plays and not inside its obstacles."""
    center, half = region(scene)
    found: list[np.ndarray] = []
    for number in range(1, 20 * count + 1):
        place = 2.0 * np.array([radical_inverse(number, prime) for prime in PRIMES]) - 1.0
        # In the plane of the picture perspective shows every line at one scale; without a camera there is no such plane.
        place = center + half * (place if scene.camera is None else place[:2] @ picture_plane(scene.camera))
        if not any(obstacle.encloses(tuple(place)) for obstacle in scene.obstacles):
            found.append(place)
        if len(found) == count:
            break
    return np.array(found).reshape(-1, 3)


def write_lines(path: Path, lines: Lines) -> None:
    """Write streamlines as a whole file of the kind that its name ends in. Raises OSError, ValueError for another kind.

    npz: position, velocity float32 (lines, points, 3), time. csv: line, point, x, y, z, u, v, w. json: time and, per line, lists of both.
    """
    match path.suffix.lower():
        case ".npz":
            with whole_file(path) as file:
                np.savez(file, position=lines.position, velocity=lines.velocity, time=np.float64(lines.time))
        case ".csv":
            text = io.StringIO()
            table = csv.writer(text, lineterminator="\n")
            table.writerow(("line", "point", "x", "y", "z", "u", "v", "w"))
            for (line, point), x in np.ndenumerate(lines.position[..., 0]):
                rest = (*lines.position[line, point, 1:], *lines.velocity[line, point])
                table.writerow((line, point, *(f"{value:.9g}" for value in (x, *rest))))
            write_text(path, text.getvalue())
        case ".json":
            pairs = zip(_plain(lines.position), _plain(lines.velocity), strict=True)
            document = {"time": lines.time, "lines": [{"position": x, "velocity": v} for x, v in pairs]}
            write_text(path, json.dumps(document) + "\n")
        case kind:
            raise ValueError(f"{kind or 'a file without a suffix'} is not a kind of file that is written; those are {', '.join(KINDS)}")


def _plain(array: np.ndarray) -> list:
    return [[[float(f"{value:.9g}") for value in point] for point in line] for line in array]


def picture_plane(camera) -> np.ndarray:
    """Return two vectors across the line of sight, right and up, as far as a picture of 16 to 10 reaches; (2, 3), in half heights."""
    sight = np.subtract(camera.target, camera.eye).astype(float)
    right = np.cross(sight, [0.0, 1.0, 0.0] if abs(sight[1]) < 0.999 * np.linalg.norm(sight) else [0.0, 0.0, -1.0])
    up = np.cross(right, sight)
    return np.stack([1.6 * right / np.linalg.norm(right), up / np.linalg.norm(up)])


def region(scene) -> tuple[np.ndarray, float]:
    """Return center and half edge of a cube where the scene plays [m]: what the camera sees, else round the places in the scene."""
    if scene.camera is not None:
        distance = math.dist(scene.camera.eye, scene.camera.target)
        return np.asarray(scene.camera.target, float), distance * math.tan(math.radians(scene.camera.field_of_view) / 2.0)
    places = np.array([*_places(scene)] or [(0.0, 0.0, 0.0)], float)
    low, high = places.min(axis=0), places.max(axis=0)
    return (low + high) / 2.0, max(1.0, float((high - low).max()))


def _places(scene) -> Iterator[tuple[float, float, float]]:
    shapes = [emitter.shape for system in scene.systems.values() for emitter in getattr(system, "emitters", ())]
    for thing in (*shapes, *scene.flow, *scene.obstacles, *scene.forces):
        for name in ("center", "start", "end"):
            if isinstance(place := getattr(thing, name, None), tuple):
                yield place


def radical_inverse(number: int, base: int) -> float:
    """Return the digits of `number` in `base`, mirrored at the point: Halton's sequence, which fills a box evenly. Source: Halton 1960."""
    inverse, scale = 0.0, 1.0
    while number:
        number, digit = divmod(number, base)
        scale /= base
        inverse += digit * scale
    return inverse
