"""Springs: a network whose springs are gathered by each point in a fixed order."""

from collections.abc import Iterator, Mapping

import warp as wp

from warpsim.environment import Environment
from warpsim.launch import Stage
from warpsim.networks import network_of
from warpsim.scene import Scene
from warpsim.systems.networks import NetworkSystem
from warpsim.systems.water import Water


class Springs(NetworkSystem):
    """One network of springs; `earlier` are the systems that move before it, of which it needs none."""

    def __init__(self, name: str, spec, scene: Scene, environment: Environment, clock: wp.array, earlier: Mapping):
        super().__init__(name, spec, scene, environment, clock, network_of(spec, f"systems.{name}"))
        self.pack()
        self._water = Water(self, environment) if Water.wanted(spec) else None

    def pull(self, moment: int) -> Iterator[Stage]:
        """Yield the stages that sum the springs of every point, and add what the flow does to the surface."""
        yield self.pull_packed()
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
        if self._water:
            self._water.change(environment)
