"""What every solver of networks offers: the stages that take all points through a frame."""

import math
from abc import ABC, abstractmethod
from collections.abc import Iterator

import numpy as np
import warp as wp

from warpsim.launch import Stage
from warpsim.population import Field


class NetworkSolver(ABC):
    """How a network moves. It owns when forces are asked for; the system (a NetworkSystem) and its parts own what they are."""

    resolves = False
    """Whether its own stages lead points past colliders and note who left the world; else the system does so after each substep."""

    has_stages = False
    """Whether it asks for forces, and for pins that move, between the beginning and the end of a substep."""

    @classmethod
    def fields(cls, spec) -> dict[str, Field]:
        """Return the rows that the population keeps for it besides its own."""
        return {}

    takes_air = True
    """Whether it takes what air and water leave of a velocity in one go; else they are forces like others, for it to integrate."""

    def __init__(self, system):
        self.system = system

    def air_rows(self, k: float) -> np.ndarray:
        """Return how the air acts at each moment of a frame, where alone it lets velocities across a surface die away by e^(−k t).

        (moments, 2): the rate at which it does [1/s]; and the time for which the springs' pull has acted on the velocity that it meets [s].
        """
        h, moments = self.system.pace.dt, 2 * self.system.pace.substep_count + 1
        return np.tile([-math.expm1(-k * h) / h, 0.0], (moments, 1))

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
