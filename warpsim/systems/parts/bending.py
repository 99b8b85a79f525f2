"""Bending: the hinges of cloth, which resist curvature."""

from collections.abc import Iterator
from typing import final

import numpy as np
import warp as wp

from warpsim.kernels import bending, bending_loops
from warpsim.launch import Stage
from warpsim.networks import hinge_energy, hinge_numbers
from warpsim.systems.parts.base import Part


@final
class Bending(Part):
    """M = B κ on a sheet, as accelerations of its points; explicit with every solver."""

    @classmethod
    def wanted(cls, spec) -> bool:
        """Return whether the spec is a cloth with `bending`."""
        return spec.type == "cloth" and spec.bending is not None

    def __init__(self, system):
        super().__init__(system)
        device = system.population.device
        self.hinges = bending.Bending()
        self.hinges.nx, self.hinges.ny = system.spec.resolution
        self.hinges.inverse_mass, self.hinges.torn = system.inverse_mass, system.torn_springs
        for key, numbers in self._numbers().items():
            setattr(self.hinges, key, wp.array(numbers, dtype=float, device=device))

    def _numbers(self) -> dict[str, np.ndarray]:
        return dict(zip(("stiffness", "damping"), hinge_numbers(self.system.spec), strict=True))

    def forces(self, moment: int) -> Iterator[Stage]:
        """Yield the stage that adds what the hinges do."""
        system = self.system
        inputs = (self.hinges, system.particles, system.internal)
        yield Stage("bending", bending.accumulate_bending, system.population.capacity, inputs, bending_loops.accumulate_bending)

    def energy(self) -> float:
        """Return what the hinges hold [J]."""
        system = self.system
        return hinge_energy(system.spec, system.population.host("position").T.astype(float), system.torn() if system.torn else None)

    def change(self) -> None:
        """Take the numbers of the spec."""
        for key, numbers in self._numbers().items():
            getattr(self.hinges, key).assign(numbers.astype(np.float32))
