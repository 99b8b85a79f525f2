"""Streamlines for the viewer: where they start, and how long they are."""

import math
from collections.abc import Iterator

import numpy as np

STEP_COUNT = 60
PRIMES = (2, 3, 5)


def streamlines(simulation) -> np.ndarray:
    """Return the scene's `viewer.streamlines` streamlines of the present flow, float32 (n, k, 3) [m], through where the scene plays."""
    scene = simulation.scene
    center, half = region(scene)
    places = 2.0 * np.array([[radical_inverse(k + 1, prime) for prime in PRIMES] for k in range(scene.viewer.streamlines)]) - 1.0
    # In the plane of the picture perspective shows every line at one scale; without a camera there is no such plane.
    seeds = center + half * (places if scene.camera is None else places[:, :2] @ picture_plane(scene.camera))
    upstream, downstream = (simulation.flow.streamlines(seeds, sign * 0.5 * half, STEP_COUNT // 2) for sign in (-1.0, 1.0))
    return np.concatenate([upstream[:, :0:-1], downstream], axis=1)


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
