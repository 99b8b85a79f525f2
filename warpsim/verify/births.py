"""Measurers of births: one emitter alone, each newborn looked at in the frame in which it is born, and then forgotten."""

import math
from abc import abstractmethod

import numpy as np

from warpsim.scene.base import is_number
from warpsim.verify.amounts import expected_at
from warpsim.verify.emission_laws import MOST_PIECES, count_moments, interval_of, value_moments
from warpsim.verify.evenness import cells_of_directions, cells_of_places
from warpsim.verify.findings import Reading
from warpsim.verify.measurers import Frames, StoryMeasurer
from warpsim.verify.stories import alone

FOURTH = {"uniform": 1.8, "scaled_uniform": 1.8, "normal": 3.0, "poisson": 3.0}  # fourth moment over the squared variance

MOST_INTERVALS = 1 << 22  # that are counted one by one


class BirthMeasurer(StoryMeasurer):
    """Looks at every newborn of one emitter within the oracle's window."""

    def __init__(self, oracle, scene):
        super().__init__(oracle, scene)
        self.emitter = oracle.emitter_in(scene)
        self.lives = getattr(oracle, "of", None) == "lifetime"
        self.story = ("births", oracle.system, oracle.emitter, self.lives)
        self._last_id = -1

    def staged(self, scene):
        """Alone; with lives of a frame and a half, so that few are there at a time, unless lives are what is measured."""
        return alone(scene, self.oracle.system, self.oracle.emitter, None if self.lives else 1.5 / scene.time.fps)

    @property
    def frames(self) -> Frames:
        fps = self.scene.time.fps
        return Frames(throughout=(math.floor(self.oracle.from_ * fps), math.ceil(self.oracle.to * fps - 1e-9)))

    def look(self, simulation) -> None:
        frame = simulation.frame()[self.oracle.system]
        if not frame.count:
            return
        ids = frame.id.astype(np.int64)
        moments = simulation.time - frame.age.astype(float)
        fresh = (ids > self._last_id) & (moments >= self.oracle.from_) & (moments <= self.oracle.to)
        self._last_id = int(ids[-1])
        if fresh.any():
            self.take(frame, fresh, moments)

    @abstractmethod
    def take(self, frame, fresh: np.ndarray, moments: np.ndarray) -> None:
        """Take the newborn, chosen by `fresh` (n,), born at `moments` (n,) [s]."""


class CountMeasurer(BirthMeasurer):
    """Births in each whole interval of the window."""

    def __init__(self, oracle, scene):
        super().__init__(oracle, scene)
        self.first, self.count, self.width, self.start = interval_of(self.emitter, scene, oracle.from_, oracle.to)
        self.missing = "the window holds no whole interval of the rate" if not self.count else ""
        if self.count > MOST_INTERVALS:
            self.missing, self.count = f"the window holds {self.count} intervals of the rate; at most {MOST_INTERVALS} are counted", 0
        self._births = np.zeros(self.count, np.int64)

    def take(self, frame, fresh, moments) -> None:
        # A birth happens after the beginning of its interval, at latest at its end; ages are float32, good to 1e-9 s.
        number = np.ceil((moments[fresh] - self.start) / self.width - 1e-7).astype(int) - 1 - self.first
        within = number[(number >= 0) & (number < self.count)]
        self._births += np.bincount(within, minlength=self.count)

    def moments(self) -> tuple[np.ndarray, np.ndarray]:
        """Return mean and variance that the law gives each interval."""
        rate, numbers = self.emitter.rate, np.arange(self.count)
        looked_at = numbers[:1] if is_number(rate.mean) and is_number(rate.spread) else numbers[:: -(-self.count // MOST_PIECES)]
        middles = self.start + (self.first + looked_at + 0.5) * self.width
        means, variances = zip(*(count_moments(rate, middle, self.width) for middle in middles), strict=True)
        return np.interp(numbers, looked_at, means), np.interp(numbers, looked_at, variances)


class MeanCountMeasurer(CountMeasurer):
    """Mean births per interval."""

    def reading(self) -> Reading:
        if not self.count:
            return Reading(math.nan, math.nan, remark=self.missing)
        means, variances = self.moments()
        expected = expected_at(self.oracle.expect, self.oracle.to)
        # The fraction of a birth that is carried over the ends of the window is uniform.
        error = math.sqrt((variances.sum() + 1.0 / 6.0) / self.count**2)
        return Reading(float(self._births.mean()), float(means.mean()) if expected is None else expected, error, self._remark())

    def _remark(self) -> str:
        return f"{self._births.sum()} births in {self.count} intervals"


class CountVarianceMeasurer(CountMeasurer):
    """Variance of the births per interval."""

    def reading(self) -> Reading:
        if self.count < 2:
            return Reading(math.nan, math.nan, remark=self.missing or "one interval has no variance")
        means, variances = self.moments()
        expected = expected_at(self.oracle.expect, self.oracle.to)
        law = float(variances.mean() + means.var()) + self._rounding(float(means.mean()), float(variances.mean()))
        error = math.sqrt((FOURTH[self.emitter.rate.law] - 1.0) * float((variances**2).mean()) / self.count + 1.0 / self.count**2)
        return Reading(float(self._births.var(ddof=1)), law if expected is None else expected, error, f"of {self.count} intervals")

    def _rounding(self, mean: float, variance: float) -> float:
        """Return what whole births add: the carried fraction before and after an interval, or without spread one birth more or less."""
        if self.emitter.rate.law == "poisson":
            return 0.0
        return 1.0 / 6.0 if variance > 1.0 else (mean % 1.0) * (1.0 - mean % 1.0)


class ValueMeasurer(BirthMeasurer):
    """Sums of an initial value and of its square, about the mean that the law gives."""

    def __init__(self, oracle, scene):
        super().__init__(oracle, scene)
        self.mean, self.variance, self.fourth = value_moments(self.emitter, oracle.of)
        self.number, self._sum, self._squares = 0, 0.0, 0.0

    def take(self, frame, fresh, moments) -> None:
        away = self._values(frame, fresh) - self.mean
        self.number += len(away)
        self._sum += float(away.sum())
        self._squares += float((away * away).sum())

    def _values(self, frame, fresh: np.ndarray) -> np.ndarray:
        if self.oracle.of not in ("speed", "cosine"):
            return getattr(frame, self.oracle.of)[fresh].astype(float)
        v = frame.velocity[fresh].astype(float)
        speed = np.linalg.norm(v, axis=1)
        if self.oracle.of == "speed":
            return speed
        axis = np.array(self.emitter.velocity.direction, float)
        return v @ (axis / np.linalg.norm(axis)) / speed

    def result(self, measured: float, law: float, error: float) -> Reading:
        """Return the reading of a number of births."""
        expected = expected_at(self.oracle.expect, self.oracle.to)
        return Reading(measured, law if expected is None else expected, error, f"of {self.number} births")


class MeanValueMeasurer(ValueMeasurer):
    """Mean of an initial value."""

    def reading(self) -> Reading:
        n = self.number
        return self.result(self.mean + self._sum / n if n else math.nan, self.mean, math.sqrt(self.variance / max(n, 1)))


class ValueVarianceMeasurer(ValueMeasurer):
    """Variance of an initial value."""

    def reading(self) -> Reading:
        n = self.number
        variance = (self._squares - self._sum**2 / n) / (n - 1) if n > 1 else math.nan
        return self.result(variance, self.variance, self.variance * math.sqrt((self.fourth - 1.0) / max(n, 1)))


class UniformityMeasurer(BirthMeasurer):
    """Pearson's χ² of the births over cells of equal or known shares; of several coordinates the sum, for they are independent."""

    def __init__(self, oracle, scene):
        super().__init__(oracle, scene)
        if oracle.of == "direction":
            self.cells = cells_of_directions(self.emitter.velocity, oracle.bins)
        else:
            self.cells = cells_of_places(self.emitter.shape, oracle.bins)
        self._observed = [np.zeros(len(shares), np.int64) for shares in self.cells.shares]
        self.number = self.outside = 0

    def take(self, frame, fresh, moments) -> None:
        vectors = frame.velocity if self.oracle.of == "direction" else self._places(frame)
        self.number += int(fresh.sum())
        numbers = self.cells.number(vectors[fresh].astype(float))
        self.outside += int(np.any([each < 0 for each in numbers], axis=0).sum())
        for observed, each in zip(self._observed, numbers, strict=True):
            observed += np.bincount(each[each >= 0], minlength=len(observed))

    def _places(self, frame) -> np.ndarray:
        return frame.position.astype(float) - frame.velocity.astype(float) * frame.age[:, None].astype(float)

    def reading(self) -> Reading:
        degrees = sum(len(shares) - 1 for shares in self.cells.shares)
        if self.outside:  # not a matter of chance
            return Reading(math.inf, float(degrees), remark=f"{self.outside} of {self.number} births lie outside")
        chi2 = sum(
            float(((observed - self.number * shares) ** 2 / (self.number * shares)).sum()) if self.number else math.nan
            for observed, shares in zip(self._observed, self.cells.shares, strict=True)
        )
        expected = expected_at(self.oracle.expect, self.oracle.to)
        remark = f"of {self.number} births" + (f"; {thin}" if (thin := self._thin()) else "")
        return Reading(chi2, float(degrees) if expected is None else expected, math.sqrt(2.0 * degrees), remark, samples=self.number)

    def _thin(self) -> str:
        least = self.number * min(float(shares.min()) for shares in self.cells.shares)
        return "" if least >= 5.0 else f"only {least:.1f} a bin: take fewer bins, or count longer"
