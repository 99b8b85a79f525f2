"""Twin of kernels/events.py and of the births of events: who is born of what, from the definition, in float64."""

import numpy as np

from tests.reference import birth
from tests.reference.random import LINEAGE, SIZE, random_words, uniform

WRAP = 1 << 64


def lineage(key: tuple[int, int], ordinal: int) -> int:
    """Return the random name of a particle: 64 bits of its emitter's key and its ordinal."""
    words = random_words(key, ordinal, LINEAGE)
    return words[0] | (words[1] << 32)


def child_ordinal(name: int, number: int, count: int, j: int) -> int:
    """Return the ordinal of child j of the event with that number of the particle with that name, as a signed number of 64 bits."""
    ordinal = (name + number * count + j) % WRAP
    return ordinal - WRAP if ordinal >= WRAP // 2 else ordinal


def child(emitter: dict, key: tuple[int, int], ordinal: int, place: np.ndarray, velocity: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return position and velocity at birth of one child of an event there."""
    own = birth.velocity(emitter["velocity"], key, ordinal) if "velocity" in emitter else np.zeros(3)
    share = emitter["on"].get("inherit", {}).get("velocity", 1.0)
    return place + birth.position(emitter.get("shape", {"type": "point"}), key, ordinal), own + share * velocity


def tint(colors: list, key: tuple[int, int], ordinal: int):
    """Return one of the colors, as likely as the others."""
    return colors[min(int(uniform(random_words(key, ordinal, SIZE)[2]) * len(colors)), len(colors) - 1)]


def multiply(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Return the product of colors in bytes, 255 being 1, rounded."""
    return np.rint(a.astype(float) * b.astype(float) / 255.0).astype(np.uint8)


def turn_up_to(n: np.ndarray, x: np.ndarray) -> np.ndarray:
    """Return x turned by the smallest rotation that takes +y to the unit vector n, by its axis and angle."""
    axis = np.cross([0.0, 1.0, 0.0], n)
    sine, cosine = np.linalg.norm(axis), n[1]
    k = axis / sine if sine > 0.0 else np.array([1.0, 0.0, 0.0])
    return x * cosine + np.cross(k, x) * sine + k * (k @ x) * (1.0 - cosine)
