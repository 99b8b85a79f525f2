"""What every solver of networks offers: the stages that take all points through a frame."""

import math
from abc import ABC, abstractmethod
from collections.abc import Iterator

import warp as wp

from warpsim.launch import Stage
from warpsim.population import Field


class NetworkSolver(ABC):
    """How a network moves. It owns when forces are asked for; the system (a NetworkSystem) and its parts own what they are."""

    resolves = False
    """Whether its own stages lead points past colliders and note who left the world; else the system does so after each substep."""

    @classmethod
    def fields(cls, spec) -> dict[str, Field]:
        """Return the rows that the population keeps for it besides its own."""
        return {}

    def __init__(self, system):
        self.system = system

    def air_rate(self, k: float) -> float:
        """Return the rate at which velocities across a surface fall within a substep, where alone they would die away by e^(−k t) [1/s]."""
        h = self.system.pace.dt
        return -math.expm1(-k * h) / h

    @abstractmethod
    def stages(self) -> Iterator[Stage]:
        """Yield the stages of all substeps of a frame; each substep ends with those of `system.settle(s)`."""

    def change(self) -> None:  # noqa: B027 — most have no numbers of their own
        """Take the numbers of `system.spec`, in place."""

    @property
    def state(self) -> dict[str, wp.array]:
        """Arrays that the next frame depends on besides the points; they are part of the simulation's state and hash."""
        return {}

    def statistics(self) -> dict[str, float]:
        """Return what there is to tell of it."""
        return {}
