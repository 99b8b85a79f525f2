"""Measurers of the scene's own particles."""

import math
from abc import abstractmethod
from collections.abc import Hashable

import numpy as np

from warpsim.scene.oracles import entry_of
from warpsim.verify import laws
from warpsim.verify.amounts import expected_at
from warpsim.verify.emission_laws import live_count
from warpsim.verify.findings import Reading
from warpsim.verify.measurers import Frames, StoryMeasurer
from warpsim.verify.stories import alone


class SceneMeasurer(StoryMeasurer):
    """Measures the scene as it is, at one frame."""

    story: Hashable = "the scene"

    @property
    def frames(self) -> Frames:
        return Frames(self.frame_at(self.oracle.at))


class HashMeasurer(SceneMeasurer):
    """The state's hash."""

    def look(self, simulation) -> None:
        self._hash = simulation.state_hash()

    def reading(self) -> Reading:
        return Reading(self._hash, self.oracle.expect)


class LiveCountMeasurer(SceneMeasurer):
    """How many live, against the sum over intervals and bursts of births times survival."""

    def __init__(self, oracle, scene):
        super().__init__(oracle, scene)
        if oracle.emitter is not None:
            self.story = ("alone", oracle.system, oracle.emitter)

    def staged(self, scene):
        return scene if self.oracle.emitter is None else alone(scene, self.oracle.system, self.oracle.emitter)

    def look(self, simulation) -> None:
        self._count, self._time = simulation.frame()[self.oracle.system].count, simulation.time

    def reading(self) -> Reading:
        spec = self.scene.systems[self.oracle.system]
        emitters = spec.emitters if self.oracle.emitter is None else (entry_of(self.oracle.emitter, spec.emitters),)
        mean, variance = live_count(emitters, self.scene, self._time)
        expected = expected_at(self.oracle.expect, self._time)
        remark = "the system is full" if self._count >= spec.capacity else ""
        return Reading(float(self._count), mean if expected is None else expected, math.sqrt(variance), remark)


class SizeMeasurer(SceneMeasurer):
    """√⟨|x − ⟨x⟩|²⟩ over all that live; what to expect is always said."""

    def look(self, simulation) -> None:
        x = simulation.frame()[self.oracle.system].position.astype(float)
        self._count, self._time = len(x), simulation.time
        self._size = math.sqrt(((x - x.mean(axis=0)) ** 2).sum(axis=1).mean()) if len(x) else math.nan

    def reading(self) -> Reading:
        return Reading(self._size, expected_at(self.oracle.expect, self._time), remark=f"of {self._count} particles")


class TogetherMeasurer(SceneMeasurer):
    """Measures particles that live from `release` to `at`, together."""

    def __init__(self, oracle, scene):
        super().__init__(oracle, scene)
        self._states: list[tuple[float, dict[str, np.ndarray]]] = []

    @property
    def frames(self) -> Frames:
        return Frames(self.frame_at(self.oracle.release), self.frame_at(self.oracle.at))

    def look(self, simulation) -> None:
        frame = simulation.frame()[self.oracle.system]
        state = {name: np.array(getattr(frame, name), float) for name in ("position", "velocity", "mass")}
        self._states.append((simulation.time, {**state, "id": np.array(frame.id)}))

    def reading(self) -> Reading:
        (early, before), (late, after) = self._states
        common = np.intersect1d(before["id"], after["id"])
        if not len(common):
            return Reading(math.nan, math.nan, remark=f"no particle of {self.oracle.system} lives from {early:g} s to {late:g} s")
        before, after = ({key: array[np.isin(state["id"], common)] for key, array in state.items()} for state in (before, after))
        expected = expected_at(self.oracle.expect, late)
        expected = self.theory(before, early, late) if expected is None else expected
        return Reading(self.measure(after, late), expected, remark=f"of {len(common)} particles")

    @abstractmethod
    def measure(self, state: dict[str, np.ndarray], time: float) -> float | np.ndarray:
        """Return the quantity of particles."""

    def theory(self, state: dict[str, np.ndarray], early: float, late: float) -> float | np.ndarray:
        """Return what the law makes of the particles' state at the release."""
        return self.measure(state, early)


class CentroidMeasurer(TogetherMeasurer):
    """The mean place."""

    def measure(self, state, time) -> np.ndarray:
        return state["position"].mean(axis=0)


class TotalEnergyMeasurer(TogetherMeasurer):
    """Σ ½ m v² − m g·x, what attractors hold, and what pairs do."""

    def measure(self, state, time) -> float:
        return laws.energy(self.oracle, self.scene, state["position"], state["velocity"], state["mass"], time)


class TotalMomentumMeasurer(TogetherMeasurer):
    """Σ m v, to which gravity adds Σ m g Δt."""

    def measure(self, state, time) -> np.ndarray:
        return (state["mass"][:, None] * state["velocity"]).sum(axis=0)

    def theory(self, state, early, late) -> np.ndarray:
        g = np.array(self.scene.gravity if self.oracle.feels_in(self.scene).gravity else (0.0, 0.0, 0.0))
        return self.measure(state, early) + state["mass"].sum() * g * (late - early)
