"""Twin of kernels/trails.py: the last places of one particle, from all its places frame by frame."""

import math


def trail(places: dict[int, list[float]], frame: int, every: int, length: int) -> list[list[float]]:
    """Return the places noted: the present one, and before it those of the last frame of each span; before birth, that of birth."""
    born = min(places)
    span = math.floor(frame / every)
    ends = [*((span - back) * every + every - 1 for back in range(length - 1, 0, -1)), frame]
    return [places[max(end, born)] for end in ends]
