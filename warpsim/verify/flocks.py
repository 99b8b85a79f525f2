"""Measurers of flocks."""

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


def order_of(velocity: np.ndarray) -> float:
    """Return φ = |Σ v/|v||/n of velocities (n, 3) [m/s]; who stands still has no course. Source: Vicsek et al. 1995."""
    v = velocity.astype(float)
    speed = np.linalg.norm(v, axis=1)
    return float(np.linalg.norm((v[speed > 0.0] / speed[speed > 0.0, None]).mean(axis=0))) if (speed > 0.0).any() else 0.0
