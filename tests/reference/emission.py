"""Twin of kernels/emission.py: who is born when, from the definition and not by keeping account of progress."""

import hashlib
import math

from tests.reference.birth import jitter
from tests.reference.random import COUNT, INTERVAL, normal, random_words, uniform64
from tests.reference.signals import sample


def random_key(seed: int, system: str, emitter: int) -> tuple[int, int]:
    digest = hashlib.blake2b(f"{seed}/{system}/{emitter}".encode(), digest_size=8).digest()
    return int.from_bytes(digest[:4], "little"), int.from_bytes(digest[4:], "little")


def poisson(key, interval: int, expected: float) -> int:
    """Invert the distribution in equal chunks of at most 16; round a normal number above 1e6."""
    if expected > 1e6:
        words = random_words(key, interval, COUNT)
        return math.floor(expected + math.sqrt(expected) * normal(*words[:2]) + 0.5)
    chunks, total = math.ceil(expected / 16.0), 0
    for k in range(chunks):
        chunk = expected / chunks
        u = uniform64(*random_words((key[0], (key[1] + k) & 0xFFFFFFFF), interval, COUNT)[:2])
        n, p = 0, math.exp(-chunk)
        while u >= p and n < 200:
            u, n = u - p, n + 1
            p *= chunk / n
        total += n
    return total


COUNT_LAWS = {
    "uniform": lambda words: 2.0 * uniform64(*words[:2]) - 1.0,
    "scaled_uniform": lambda words: math.sqrt(3.0) * (2.0 * uniform64(*words[:2]) - 1.0),
    "normal": lambda words: normal(*words[:2]),
    "poisson": None,
}


class Planner:
    """Births of one emitter of one system. `emitter` is the scene's document."""

    def __init__(self, emitter: dict, key: tuple[int, int], fps: float, beginning: float = 0.0):
        rate = emitter.get("rate")
        self.key, self.rate = key, rate if rate is None or "mean" in (rate if isinstance(rate, dict) else ()) else {"mean": rate}
        self.start = max(beginning, emitter.get("start", beginning))
        self.stop = emitter.get("stop", math.inf)
        self.interval = (self.rate or {}).get("interval", 1.0 / fps)
        bursts = emitter.get("burst", [])
        self.bursts = [bursts] if isinstance(bursts, dict) else bursts
        self.beginning = beginning

    def count(self, number: int, begin: float, end: float, carry: float) -> tuple[int, float]:
        """Return an interval's births and the fraction left over."""
        middle, law = 0.5 * (begin + end), self.rate.get("law", "uniform")
        mean = max(sample(self.rate["mean"], middle), 0.0)
        if law == "poisson":
            return poisson(self.key, number, mean * (end - begin)), carry
        z = COUNT_LAWS[law](random_words(self.key, number, INTERVAL))
        due = carry + max(mean + z * sample(self.rate.get("spread", 0.0), middle), 0.0) * (end - begin)
        count = math.floor(due + 1e-9)
        return count, due - count

    def births(self, until: float) -> list[tuple[float, int]]:
        """Return (moment [s], ordinal) of all births up to a time, those of the rate first, then burst by burst."""
        result, ordinal, carry, number = [], 0, 0.0, 0
        while self.rate is not None:
            begin = self.start + number * self.interval
            if begin >= min(until, self.stop):
                break
            end = min(begin + self.interval, self.stop)
            count, carry = self.count(number, begin, end, carry)
            for j in range(count):
                result.append((begin + (j + jitter(self.key, ordinal + j)) * (end - begin) / count, ordinal + j))
            ordinal, number = ordinal + count, number + 1
        for place, burst in enumerate(self.bursts):
            first = (place + 1) << 40
            if burst.get("at", 0.0) >= self.beginning:
                result += [(burst.get("at", 0.0), first + j) for j in range(burst["count"])]
        return [birth for birth in result if birth[0] <= until]
