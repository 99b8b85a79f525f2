"""Grip: points with bristles know where the head of their body lies, so that their friction can depend on where they slide."""

from collections.abc import Iterator
from typing import final

import warp as wp

from warpsim.kernels import grip
from warpsim.launch import Stage
from warpsim.systems.parts.base import Part


@final
class Grip(Part):
    """Directions of friction for the points of some chains, from where those points are; contacts read them."""

    def __init__(self, system):
        super().__init__(system)
        particles, capacity, device = system.particles, system.population.capacity, system.device
        particles.heading = wp.zeros((3, capacity), dtype=float, device=device)
        particles.grip = wp.array([self._factors()], dtype=wp.vec3, device=device)
        self._links = wp.array(links_of(system.spec), dtype=wp.vec3i, device=device)

    @classmethod
    def wanted(cls, spec) -> bool:
        return spec.type == "springs" and spec.grip is not None

    def prepare(self, moment: int) -> Iterator[Stage]:
        """Yield the stage that looks along the chains."""
        particles = self.system.particles
        yield Stage("grip", grip.sample_headings, len(self._links), (self._links, particles.position, particles.heading))

    def change(self) -> None:
        """Take the numbers of `system.spec`, in place."""
        self.system.particles.grip.assign([self._factors()])

    @property
    def state(self) -> dict[str, wp.array]:
        """The headings: a solver may move points before it asks for forces."""
        return {"heading": self.system.particles.heading}

    def _factors(self) -> wp.vec3:
        spec = self.system.spec.grip
        return wp.vec3(spec.forward, spec.backward, spec.sideways)


def links_of(spec) -> list[tuple[int, int, int]]:
    """Return each point of the chains with bristles, with the one ahead of it and the one behind; at an end it is one of them itself."""
    links = {}
    for name in spec.grip.chains:
        line = spec.chain_points(name)
        for k, point in enumerate(line):
            links.setdefault(point, (point, line[max(k - 1, 0)], line[min(k + 1, len(line) - 1)]))
    return list(links.values())
