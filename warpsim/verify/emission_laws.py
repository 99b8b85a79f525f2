"""The laws of emission in float64 from the scene's own numbers: how many are born, and how many of them live.

N = (mean + z spread)·interval births per interval, never below zero; a particle lives while its age is below its lifetime.
"""

import math
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from warpsim.verify.amounts import value_at

MOST_PIECES = 20_000  # intervals that are summed one by one; more of them are taken in groups
_Z = (np.arange(4000) + 0.5) / 4000  # midpoints for what clamping at zero does to the moments
_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(8)


class Intervals(NamedTuple):
    """A run of equal intervals of one emitter: from begin to end, `count` of them, each with so many births."""

    begin: float
    end: float
    count: int
    mean: float
    variance: float


def count_moments(rate, middle: float, interval: float) -> tuple[float, float]:
    """Return mean and variance of the births of one interval round a time [s].  Source: Reeves 1983 for the law."""
    mean, spread = max(value_at(rate.mean, middle), 0.0), value_at(rate.spread, middle)
    if rate.law == "poisson":
        return mean * interval, mean * interval
    if rate.law == "normal":
        z, weight = 16.0 * _Z - 8.0, np.exp(-0.5 * (16.0 * _Z - 8.0) ** 2)
    else:
        z, weight = (2.0 * _Z - 1.0) * (math.sqrt(3.0) if rate.law == "scaled_uniform" else 1.0), np.ones_like(_Z)
    births = np.maximum(mean + z * spread, 0.0) * interval
    average = float(np.average(births, weights=weight))
    return average, float(np.average((births - average) ** 2, weights=weight))


def intervals_of(emitter, scene, until: float) -> Iterator[Intervals]:
    """Yield the intervals of an emitter's rate up to a time [s]; the one under way is cut there."""
    beginning, frame_time = -scene.time.prewarm, 1.0 / scene.time.fps
    start = beginning if emitter.start is None else max(beginning, emitter.start)
    until = until if emitter.stop is None else min(until, emitter.stop)
    if emitter.rate is None or until <= start:
        return
    width = emitter.rate.interval or frame_time
    count = math.ceil((until - start) / width - 1e-9)
    group = math.ceil(count / MOST_PIECES)
    for first in range(0, count, group):
        begin, number = start + first * width, min(group, count - first)
        end = min(begin + number * width, until)
        mean, variance = count_moments(emitter.rate, 0.5 * (begin + begin + number * width), width)
        share = (end - begin) / width  # of the intervals
        yield Intervals(begin, end, number, mean * share, variance * share)


def survival(lifetime, ages: np.ndarray) -> np.ndarray:
    """Return the part of the particles whose lifetime is above an age [s]."""
    if lifetime.spread == 0.0:
        return (ages < lifetime.mean).astype(float)
    if lifetime.law == "uniform":
        return np.clip((lifetime.mean + lifetime.spread - ages) / (2.0 * lifetime.spread), 0.0, 1.0)
    return np.array([0.5 * math.erfc((age - lifetime.mean) / (lifetime.spread * math.sqrt(2.0))) for age in ages])


def live_count(emitters, scene, time: float) -> tuple[float, float]:
    """Return mean and variance of the number of living particles of emitters at a time [s]: ∫ births · survival, and bursts."""
    mean = variance = 0.0
    for emitter in emitters:
        for piece in intervals_of(emitter, scene, time):
            lives = _lives(emitter.lifetime, piece, time)
            alive = float(lives.mean())
            mean += piece.mean * alive
            variance += piece.variance * alive**2 + piece.mean * float((lives * (1.0 - lives)).mean())
        for burst in emitter.burst if emitter.on is None else ():
            if -scene.time.prewarm <= burst.at <= time:
                alive = float(survival(emitter.lifetime, np.array([time - burst.at]))[0])
                mean += burst.count * alive
                variance += burst.count * alive * (1.0 - alive)
        variance += 0.25 if emitter.rate is not None else 0.0  # births are whole, and fall somewhere in their interval
    return mean, variance


def _lives(lifetime, piece: Intervals, time: float) -> np.ndarray:
    """Return the part that lives on of births evenly spread over an interval; a sharp end of life is cut where it is."""
    if lifetime.spread == 0.0:
        early = min(max(time - lifetime.mean - piece.begin, 0.0), piece.end - piece.begin)
        return np.repeat(
            [0.0, 1.0], [round(4096 * early / (piece.end - piece.begin)), 4096 - round(4096 * early / (piece.end - piece.begin))]
        )
    births = 0.5 * (piece.begin + piece.end) + 0.5 * (piece.end - piece.begin) * _NODES
    return survival(lifetime, time - births)


def interval_of(emitter, scene, begin: float, end: float) -> tuple[int, int, float, float]:
    """Return of the intervals that lie wholly within a window [s]: the number of the first, how many, their width [s], their origin [s]."""
    beginning = -scene.time.prewarm
    start = beginning if emitter.start is None else max(beginning, emitter.start)
    width = emitter.rate.interval or 1.0 / scene.time.fps
    first = max(0, math.ceil((begin - start) / width - 1e-6))
    last = math.floor((min(end, emitter.stop or math.inf) - start) / width + 1e-6)
    return first, max(0, last - first), width, start


def value_moments(emitter, of: str) -> tuple[float, float, float]:
    """Return mean, variance and fourth moment over the squared variance of an initial value of an emitter."""
    if of == "cosine":  # uniform from the cone's edge to its axis
        least = math.cos(math.radians(emitter.velocity.cone))
        return 0.5 * (1.0 + least), (1.0 - least) ** 2 / 12.0, 1.8
    if of == "speed" and emitter.velocity is None:
        return 0.0, 0.0, 1.8
    drawn = emitter.velocity.speed if of == "speed" else getattr(emitter, of)
    uniform = drawn.law == "uniform"
    z, weight = (2.0 * _Z - 1.0, np.ones_like(_Z)) if uniform else (16.0 * _Z - 8.0, np.exp(-0.5 * (16.0 * _Z - 8.0) ** 2))
    # A speed below zero is one backward; what must be above zero is clipped there.
    values = np.abs(drawn.mean + drawn.spread * z) if of == "speed" else np.maximum(drawn.mean + drawn.spread * z, 0.0)
    mean = float(np.average(values, weights=weight))
    variance = float(np.average((values - mean) ** 2, weights=weight))
    return mean, variance, float(np.average((values - mean) ** 4, weights=weight)) / variance**2 if variance else 1.8
