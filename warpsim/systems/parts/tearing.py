"""Tearing: springs that break where they are strained beyond what they stand."""

from collections.abc import Iterator
from functools import cached_property
from typing import final

import warp as wp

from warpsim.kernels import tearing
from warpsim.launch import Stage
from warpsim.systems.parts.base import Part


@final
class Tearing(Part):
    """Breaks springs at the end of each substep, for good."""

    changes_springs = True

    @classmethod
    def wanted(cls, spec) -> bool:
        """Return whether the spec says what its springs stand."""
        return spec.tear is not None

    def __init__(self, system):
        super().__init__(system)
        self._tearing = tearing.Tearing()
        self._tearing.spring_count, self._tearing.opening = len(system.net.springs), system.opening
        self._tearing.torn = system.torn_springs
        self._tearing.stretch = wp.array([1.0 + system.spec.tear], dtype=float, device=system.device)

    @cached_property
    def _ready(self) -> tearing.Tearing:
        """The table, with the places of the springs in a network that is packed by now."""
        self._tearing.entry = wp.array(self.system.packed.places(), dtype=wp.vec2i, device=self.system.device)
        return self._tearing

    def after(self, s: int) -> Iterator[Stage]:
        """Yield the stage that breaks what is strained too far."""
        system = self.system
        count = len(system.net.springs)
        if count:
            inputs = (system.clock, self._ready, system.particles, system.table, system.network)
            yield Stage("tearing", tearing.mark_torn, count, inputs)

    def change(self) -> None:
        """Take the numbers of the spec."""
        self._tearing.stretch.assign([1.0 + self.system.spec.tear])

    @property
    def state(self) -> dict[str, wp.array]:
        """Which springs are torn."""
        return {"torn": self.system.torn_springs}

    def statistics(self) -> dict[str, float]:
        """Return how many springs are torn."""
        return {"torn": int(self.system.torn_springs.numpy().sum())}
