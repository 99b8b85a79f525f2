"""Measurers of flocks."""

import math

import numpy as np

from warpsim.verify.amounts import expected_at
from warpsim.verify.findings import Reading
from warpsim.verify.networks import SpanMeasurer


class OrderMeasurer(SpanMeasurer):
    """φ, the mean over frames and flocks; flocks that differ by chance alone say how sure it is."""

    def __init__(self, oracle, scene):
        super().__init__(oracle, scene)
        self._orders: list[list[float]] = []

    def look(self, simulation) -> None:
        self._times.append(simulation.time)
        self._orders.append([order_of(simulation.frame()[name].velocity) for name in self.oracle.systems])

    def reading(self) -> Reading:
        means = np.mean(self._orders, axis=0)
        error = float(means.std(ddof=1) / np.sqrt(len(means))) if len(means) > 1 else None
        remark = f"over {len(self._times)} frames of {len(means)} flock{'s' if len(means) > 1 else ''}"
        return Reading(float(means.mean()), expected_at(self.oracle.expect, self._times[-1]), error, remark)


class PresenceMeasurer(SpanMeasurer):
    """Boids of a flock about those of another, over those about their own; both in means over frames and boids."""

    CENTERS = 256  # of its own at most, evenly by number: among them the mean is as good, and a frame takes no second

    def look(self, simulation) -> None:
        if (self.frame_at(self.oracle.to) - simulation.index) % self.oracle.every:
            return
        frame, radius = simulation.frame(), self.oracle.radius
        x, centers = (frame[name].position.astype(float) for name in (self.oracle.system, self.oracle.around))
        period = period_of(self.scene.systems[self.oracle.system])
        own = x[:: max(1, math.ceil(len(x) / self.CENTERS))]
        self._times.append(simulation.time)
        self._values.append((company(x, centers, radius, period), company(x, own, radius, period) - 1.0))

    def reading(self) -> Reading:
        theirs, own = np.mean(self._values, axis=0)
        remark = f"{theirs:.3g} over {own:.3g} in the mean of {len(self._times)} frames"
        return Reading(float(theirs / own) if own > 0.0 else math.nan, expected_at(self.oracle.expect, self._times[-1]), remark=remark)


def company(x: np.ndarray, centers: np.ndarray, radius: float, period: np.ndarray) -> float:
    """Return how many of the places x, (n, 3), are within a radius of each center, (m, 3), in the mean; period: edges, inf for none [m]."""
    if not len(centers):
        return math.nan
    d = x[None] - centers[:, None]
    d -= np.where(np.isfinite(period), np.round(d / period) * np.where(np.isfinite(period), period, 0.0), 0.0)
    return float(((d * d).sum(axis=2) <= radius * radius).sum(axis=1).mean())


def period_of(spec) -> np.ndarray:
    """Return the edges of a flock's periodic domain, inf along an axis that does not close (3,) [m]."""
    closed = spec.domain is not None and spec.domain.boundary == "periodic"
    return np.array([edge if closed and edge > 0.0 else math.inf for edge in (spec.domain.size if closed else (0.0, 0.0, 0.0))])


def order_of(velocity: np.ndarray) -> float:
    """Return φ = |Σ v/|v||/n of velocities (n, 3) [m/s]; who stands still has no course. Source: Vicsek et al. 1995."""
    v = velocity.astype(float)
    speed = np.linalg.norm(v, axis=1)
    return float(np.linalg.norm((v[speed > 0.0] / speed[speed > 0.0, None]).mean(axis=0))) if (speed > 0.0).any() else 0.0
