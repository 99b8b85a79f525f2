"""Counter-based random numbers: functions of (key, ordinal, channel) and of nothing else.

A key is 64 bits for one emitter of one system of one scene seed, worked out on the host; the ordinal counts the emitter's
births; a channel is what the words are for. So a particle is born the same at any frame rate, capacity, device or split.
"""

import warp as wp

from warpsim.kernels.elementary import cos_turns, log_positive

POSITION, VELOCITY, LIFE, SIZE, BULK, INTERVAL, COUNT, LINEAGE = range(8)  # channels; INTERVAL and COUNT are keyed by the interval's number

FACTOR, INCREMENT = wp.uint32(1664525), wp.uint32(1013904223)


@wp.func(inline=True)
def stir(v: wp.vec4ui) -> wp.vec4ui:
    """One round of pcg4d's cross-multiplication; invertible."""
    x = v[0] + v[1] * v[3]
    y = v[1] + v[2] * x
    z = v[2] + x * y
    w = v[3] + y * z
    return wp.vec4ui(x, y, z, w)


@wp.func(inline=True)
def random_words(key: wp.vec2ui, ordinal: wp.int64, channel: int) -> wp.vec4ui:
    """Return four words of 32 random bits.  Source: pcg4d, Jarzynski & Olano 2020, JCGT 9(3); a bijection, so no two inputs meet."""
    sixteen = wp.uint32(16)
    a = key[0] * FACTOR + INCREMENT
    b = key[1] * FACTOR + INCREMENT
    c = wp.uint32(ordinal) * FACTOR + INCREMENT
    d = (wp.uint32(channel) + (wp.uint32(ordinal >> wp.int64(32)) << wp.uint32(4))) * FACTOR + INCREMENT
    v = stir(wp.vec4ui(a, b, c, d))
    return stir(wp.vec4ui(v[0] ^ (v[0] >> sixteen), v[1] ^ (v[1] >> sixteen), v[2] ^ (v[2] >> sixteen), v[3] ^ (v[3] >> sixteen)))


@wp.func(inline=True)
def uniform(word: wp.uint32) -> float:
    """Return a number uniform on [0, 1), a multiple of 2^-24."""
    return float(int(word >> wp.uint32(8))) * 5.9604645e-08


@wp.func(inline=True)
def uniform_positive(word: wp.uint32) -> float:
    """Return a number uniform on (0, 1], a multiple of 2^-24."""
    return float(int(word >> wp.uint32(8)) + 1) * 5.9604645e-08


@wp.func(inline=True)
def uniform_signed(word: wp.uint32) -> float:
    """Return a number uniform on [-1, 1), a multiple of 2^-23."""
    return float(int(word >> wp.uint32(8))) * 1.1920929e-07 - 1.0


@wp.func
def uniform64(high: wp.uint32, low: wp.uint32) -> wp.float64:
    """Return a number uniform on [0, 1), a multiple of 2^-52, from two words."""
    return (wp.float64(high >> wp.uint32(6)) * wp.float64(67108864.0) + wp.float64(low >> wp.uint32(6))) * wp.float64(2.220446049250313e-16)


@wp.func(inline=True)
def normal(first: wp.uint32, second: wp.uint32) -> float:
    """Return a standard normal number from two words, within ±5.8.  Source: Box & Muller 1958."""
    return wp.sqrt(-2.0 * log_positive(uniform_positive(first))) * cos_turns(uniform(second))
