"""Springs: a network whose springs are gathered by each point in a fixed order."""

from collections.abc import Iterator, Mapping

import numpy as np
import warp as wp

from warpsim.environment import Environment
from warpsim.kernels import spring_loops, springs
from warpsim.launch import Stage
from warpsim.networks import SPRING_NUMBERS, network_of, packed, spring_numbers
from warpsim.scene import Scene
from warpsim.systems.networks import NetworkSystem
from warpsim.systems.water import Water


class Springs(NetworkSystem):
    """One network of springs; `earlier` are the systems that move before it, of which it needs none."""

    def __init__(self, name: str, spec, scene: Scene, environment: Environment, clock: wp.array, earlier: Mapping):
        super().__init__(name, spec, scene, environment, clock, network_of(spec, f"systems.{name}"))
        device = environment.device
        self.packed = packed(len(self.net.points), self.net.springs)
        self.network = springs.Network()
        self.network.point_count = len(self.net.points)
        self.network.begin = wp.array(self.packed.begin, dtype=int, device=device)
        self.network.neighbor = wp.array(self.packed.neighbor.reshape(-1), dtype=int, device=device)
        self.network.inverse_mass = self.inverse_mass
        for key, array in self._numbers(spec).items():
            setattr(self.network, key, wp.array(array, dtype=float, device=device))
        self._water = Water(self, environment) if Water.wanted(spec) else None

    def _numbers(self, spec) -> dict[str, np.ndarray]:
        """Return the network's arrays of numbers by their names."""
        values = zip(SPRING_NUMBERS, spring_numbers(spec, self.net), strict=True)
        return {key: self.packed.values(value) for key, value in values}

    def pull(self, moment: int) -> Iterator[Stage]:
        """Yield the stages that sum the springs of every point, and add what the flow does to the surface."""
        inputs = (self.network, self.particles, self.internal)
        yield Stage("springs", springs.accumulate_springs, self.population.capacity, inputs, spring_loops.accumulate_springs)
        yield from self._facets(moment)

    def wind(self, moment: int) -> Iterator[Stage]:
        """Yield the stages that store what the flow alone does to the surface."""
        yield from super().wind(moment)
        yield from self._facets(moment)

    def _facets(self, moment: int) -> Iterator[Stage]:
        if self._water:
            yield from self._water.forces(moment)

    def stages(self, native: bool) -> Iterator[Stage]:
        """Yield the frame's stages; nothing here waits for the device."""
        if self._water:
            yield from self._water.stages()
        yield from super().stages(native)

    def change(self, spec, scene: Scene, environment: Environment) -> None:
        """Take the numbers of another spec of the same structure, in place."""
        super().change(spec, scene, environment)
        for key, array in self._numbers(spec).items():
            getattr(self.network, key).assign(array)
        if self._water:
            self._water.change(environment)
