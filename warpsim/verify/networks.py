"""Measurers of networks: a point's place, the time of its swing, reach, speed, likeness, and what all points have together."""

import math

import numpy as np

from warpsim.scene.oracles import felt
from warpsim.verify import laws
from warpsim.verify.amounts import expected_at
from warpsim.verify.findings import Reading
from warpsim.verify.measurers import Frames
from warpsim.verify.systems import SceneMeasurer, TogetherMeasurer


class PlaceMeasurer(SceneMeasurer):
    """Where a point is."""

    def look(self, simulation) -> None:
        self._place, self._time = point_of(simulation, self.oracle), simulation.time

    def reading(self) -> Reading:
        return Reading(self._place, expected_at(self.oracle.expect, self._time), remark=missing(self._place))


class SpanMeasurer(SceneMeasurer):
    """Looks at all frames of a span."""

    def __init__(self, oracle, scene):
        super().__init__(oracle, scene)
        self._times: list[float] = []
        self._values: list[float] = []

    @property
    def frames(self) -> Frames:
        return Frames(throughout=(self.frame_at(self.oracle.from_), self.frame_at(self.oracle.to)))


class PeriodMeasurer(SpanMeasurer):
    """The mean time between rises of a point through the middle of its way."""

    def look(self, simulation) -> None:
        self._times.append(simulation.time)
        self._values.append(float(point_of(simulation, self.oracle) @ np.array(self.oracle.direction)))

    def reading(self) -> Reading:
        expected, rises = expected_at(self.oracle.expect, self._times[-1]), rises_of(np.array(self._values), np.array(self._times))
        if len(rises) < 2:
            return Reading(math.nan, expected, remark=missing(self._values) or "it does not swing twice")
        return Reading((rises[-1] - rises[0]) / (len(rises) - 1), expected, remark=f"of {len(rises) - 1} swings")


class AmplitudeMeasurer(SpanMeasurer):
    """Half of the way between the extremes of a point's swing."""

    def look(self, simulation) -> None:
        n = np.array(self.oracle.direction, float)
        self._times.append(simulation.time)
        self._values.append(float(point_of(simulation, self.oracle) @ (n / np.linalg.norm(n))))

    def reading(self) -> Reading:
        expected = expected_at(self.oracle.expect, self._times[-1])
        return Reading(0.5 * float(np.ptp(self._values)), expected, remark=missing(self._values))


class ReachMeasurer(SceneMeasurer):
    """The largest x·n."""

    def look(self, simulation) -> None:
        n = np.array(self.oracle.direction, float)
        self._reach = float((places(simulation, self.oracle.system) @ (n / np.linalg.norm(n))).max())
        self._time = simulation.time

    def reading(self) -> Reading:
        return Reading(self._reach, expected_at(self.oracle.expect, self._time))


class RmsSpeedMeasurer(SpanMeasurer):
    """√⟨v²⟩ over points and frames."""

    def look(self, simulation) -> None:
        v = simulation.frame()[self.oracle.system].velocity.astype(float)
        self._times.append(simulation.time)
        self._values.append(float((v * v).sum(axis=1).mean()))

    def reading(self) -> Reading:
        remark = f"over {len(self._times)} frames"
        return Reading(math.sqrt(np.mean(self._values)), expected_at(self.oracle.expect, self._times[-1]), remark=remark)


class AgreementMeasurer(SceneMeasurer):
    """The largest distance of points with the same number."""

    def look(self, simulation) -> None:
        here, there = (places(simulation, name) for name in (self.oracle.system, self.oracle.with_))
        self._time, self._distance, self._remark = simulation.time, math.nan, f"{len(here)} points here, {len(there)} there"
        if len(here) == len(there):
            apart = np.linalg.norm(there - here - np.array(self.oracle.offset), axis=1)
            self._distance, self._remark = float(apart.max()), f"at point {apart.argmax()}; {apart.mean():.3g} in the mean"

    def reading(self) -> Reading:
        return Reading(self._distance, expected_at(self.oracle.expect, self._time), remark=self._remark)


class CenterMeasurer(TogetherMeasurer):
    """The center of mass."""

    def measure(self, state, time) -> np.ndarray:
        return np.average(state["position"], axis=0, weights=state["mass"])


class NetworkEnergyMeasurer(TogetherMeasurer):
    """Σ ½ m v² − m g·x, what attractors hold, and what springs do."""

    def __init__(self, oracle, scene):
        super().__init__(oracle, scene)
        self._elastic: dict[float, float] = {}

    def look(self, simulation) -> None:
        super().look(simulation)
        self._elastic[simulation.time] = simulation.systems[self.oracle.system].energy()

    def measure(self, state, time) -> float:
        x, v, m, feels = state["position"], state["velocity"], state["mass"], self.oracle.feels_in(self.scene)
        g = np.array(self.scene.gravity if feels.gravity else (0.0, 0.0, 0.0))
        fields = [force for force in felt(feels.forces, self.scene.forces) if force.type != "pairwise"]
        return float((0.5 * m * (v * v).sum(axis=1) + laws.potential_energy(x, m, g, fields, time)).sum()) + self._elastic[time]


def places(simulation, name: str) -> np.ndarray:
    """Return the places of a network's points, float64 (n, 3) [m]."""
    return simulation.frame()[name].position.astype(float)


def point_of(simulation, oracle) -> np.ndarray:
    """Return the place of the oracle's point, float64 (3,) [m]; nan where a mesh made fewer points."""
    x = places(simulation, oracle.system)
    return x[oracle.point] if oracle.point < len(x) else np.full(3, np.nan)


def missing(values) -> str:
    """Return the remark on places that are not numbers."""
    return "" if np.isfinite(values).all() else "there is no such point: the mesh makes fewer"


def rises_of(values: np.ndarray, times: np.ndarray) -> np.ndarray:
    """Return when a series rises through the middle between its extremes; between samples the rise is a straight line."""
    z = values - 0.5 * (values.max() + values.min())
    k = np.flatnonzero((z[:-1] < 0.0) & (z[1:] >= 0.0))
    return times[k] - z[k] * (times[k + 1] - times[k]) / (z[k + 1] - z[k])
