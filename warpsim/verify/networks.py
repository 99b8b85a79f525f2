"""Measurers of networks: a point's place, and the time of its swing."""

import math

import numpy as np

from warpsim.verify.amounts import expected_at
from warpsim.verify.findings import Reading
from warpsim.verify.measurers import Frames
from warpsim.verify.systems import SceneMeasurer


class PlaceMeasurer(SceneMeasurer):
    """Where a point is."""

    def look(self, simulation) -> None:
        self._place, self._time = point_of(simulation, self.oracle), simulation.time

    def reading(self) -> Reading:
        return Reading(self._place, expected_at(self.oracle.expect, self._time))


class PeriodMeasurer(SceneMeasurer):
    """The mean time between rises of a point through the middle of its way."""

    def __init__(self, oracle, scene):
        super().__init__(oracle, scene)
        self._times: list[float] = []
        self._values: list[float] = []

    @property
    def frames(self) -> Frames:
        return Frames(throughout=(self.frame_at(self.oracle.from_), self.frame_at(self.oracle.to)))

    def look(self, simulation) -> None:
        self._times.append(simulation.time)
        self._values.append(float(point_of(simulation, self.oracle) @ np.array(self.oracle.direction)))

    def reading(self) -> Reading:
        expected, rises = expected_at(self.oracle.expect, self._times[-1]), rises_of(np.array(self._values), np.array(self._times))
        if len(rises) < 2:
            return Reading(math.nan, expected, remark="it does not swing twice")
        return Reading((rises[-1] - rises[0]) / (len(rises) - 1), expected, remark=f"of {len(rises) - 1} swings")


def point_of(simulation, oracle) -> np.ndarray:
    """Return the place of the oracle's point, float64 (3,) [m]."""
    return simulation.frame()[oracle.system].position[oracle.point].astype(float)


def rises_of(values: np.ndarray, times: np.ndarray) -> np.ndarray:
    """Return when a series rises through the middle between its extremes; between samples the rise is a straight line."""
    z = values - 0.5 * (values.max() + values.min())
    k = np.flatnonzero((z[:-1] < 0.0) & (z[1:] >= 0.0))
    return times[k] - z[k] * (times[k + 1] - times[k]) / (z[k + 1] - z[k])
