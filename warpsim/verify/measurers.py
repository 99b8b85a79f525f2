"""What a measurer is: it looks at a story, the scene's own or one of a test particle, at its frames, and then has a reading."""

import math
from abc import ABC, abstractmethod
from collections.abc import Container, Hashable

from warpsim.verify.findings import Reading


class Measurer(ABC):
    """Measures what one oracle states. A subclass says which story it needs."""

    def __init__(self, oracle, scene):
        self.oracle, self.scene = oracle, scene

    @abstractmethod
    def reading(self) -> Reading:
        """Return what was measured."""


class FlowMeasurer(Measurer):
    """Needs the flow alone, at any time."""

    @abstractmethod
    def probe(self, flow) -> None:
        """Measure the flow (FlowProbe)."""


class StoryMeasurer(Measurer):
    """Needs a story that is played frame by frame; those with one `story` share a simulation."""

    story: Hashable

    def staged(self, scene):
        """Return the scene that is played for it."""
        return scene

    @property
    @abstractmethod
    def frames(self) -> "Frames":
        """Return the frames at which it looks."""

    @abstractmethod
    def look(self, simulation) -> None:
        """Measure the simulation at the present frame, one of `frames`."""

    @property
    def satisfied(self) -> bool:
        """Whether it has seen enough before its last frame."""
        return False

    def frame_at(self, time: float) -> int:
        """Return the frame nearest to a time [s]."""
        return round(time * self.scene.time.fps)


class Frames:
    """The frames a measurer looks at: single ones, or all from the first to the last."""

    def __init__(self, *single: int, throughout: tuple[int, int] | None = None):
        self._chosen: Container[int] = range(throughout[0], throughout[1] + 1) if throughout else frozenset(single)
        self.first, self.last = throughout or (min(single), max(single))

    def __contains__(self, index: int) -> bool:
        return index in self._chosen


def gone(what: str) -> Reading:
    """Return the reading where there is nothing to measure any more: it fails."""
    return Reading(math.nan, math.nan, remark=f"{what} is gone")
