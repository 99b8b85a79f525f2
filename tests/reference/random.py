"""Twin of kernels/random.py: pcg4d in Python's integers, bit for bit."""

import math

POSITION, VELOCITY, LIFE, SIZE, BULK, INTERVAL, COUNT, LINEAGE = range(8)
MASK = 0xFFFFFFFF


def stir(x: int, y: int, z: int, w: int) -> tuple[int, int, int, int]:
    """Cross-multiply; Jarzynski & Olano 2020, listing of pcg4d."""
    x = (x + y * w) & MASK
    y = (y + z * x) & MASK
    z = (z + x * y) & MASK
    w = (w + y * z) & MASK
    return x, y, z, w


def random_words(key: tuple[int, int], ordinal: int, channel: int) -> tuple[int, int, int, int]:
    """Return four words of 32 bits."""
    inputs = key[0], key[1], ordinal & MASK, (channel + ((ordinal >> 32) << 4)) & MASK
    state = stir(*((v * 1664525 + 1013904223) & MASK for v in inputs))
    return stir(*(v ^ (v >> 16) for v in state))


def uniform(word: int) -> float:
    return (word >> 8) * 2.0**-24


def uniform_positive(word: int) -> float:
    return ((word >> 8) + 1) * 2.0**-24


def uniform_signed(word: int) -> float:
    return (word >> 8) * 2.0**-23 - 1.0


def uniform64(high: int, low: int) -> float:
    return ((high >> 6) * 2**26 + (low >> 6)) * 2.0**-52


def normal(first: int, second: int) -> float:
    """Box & Muller 1958."""
    return math.sqrt(-2.0 * math.log(uniform_positive(first))) * math.cos(2.0 * math.pi * uniform(second))
