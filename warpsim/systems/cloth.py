"""Cloth: a network on a grid, whose springs need no lists, and whose points feel the wind across the sheet."""

from collections.abc import Iterator, Mapping

import numpy as np
import warp as wp

from warpsim.environment import Environment, Surroundings
from warpsim.kernels import cloth, cloth_loops, cloth_strides, tearing
from warpsim.kernels.cloth_loops import MOST_COLUMNS
from warpsim.launch import Stage
from warpsim.networks import network_of
from warpsim.scene import Scene
from warpsim.scene.particles import Drag
from warpsim.systems.networks import NetworkSystem
from warpsim.systems.pairs import substep_of


class Cloth(NetworkSystem):
    """One sheet; `earlier` are the systems that move before it, of which it needs none."""

    def __init__(self, name: str, spec, scene: Scene, environment: Environment, clock: wp.array, earlier: Mapping):
        super().__init__(name, spec, scene, environment, clock, network_of(spec, f"systems.{name}"))
        device, count = environment.device, self.pace.substep_count
        self._wind = Surroundings(environment, self._wind_felt(spec, environment), 2 * count + 1, 0.5 / (self._fps * count))
        self.sheet = cloth.Sheet()
        self.sheet.nx, self.sheet.ny = spec.resolution
        self.sheet.step = wp.array(list(cloth.STEPS), dtype=wp.vec2i, device=device)
        self.sheet.flow = self._wind.flow
        self.sheet.inverse_mass = self.inverse_mass
        for key, array in self._numbers(spec).items():
            setattr(self.sheet, key, wp.array(array, dtype=float, device=device))
        if spec.tear is not None:
            self.pack()  # where some springs are torn and some are not, lists tell which

    def _felt(self, spec, environment: Environment) -> tuple:
        """Return what every point feels: with `drag` that of still air, and no flow."""
        row, flow, forces, colliders = super()._felt(spec, environment)
        if spec.drag:
            row.alpha = spec.drag
        return row, flow, forces, colliders

    def _wind_felt(self, spec, environment: Environment) -> tuple:
        """Return the flow across the sheet, which needs no coupling."""
        row, flow, _, _ = environment.felt(spec.feels, Drag(alpha=0.0))
        return row, flow, [], []

    def _numbers(self, spec) -> dict[str, np.ndarray]:
        """Return the sheet's arrays of numbers by their names."""
        along, down = (np.array(edge, float) / (n - 1) for edge, n in zip(spec.edges, spec.resolution, strict=True))
        rest = [np.linalg.norm(i * along + j * down) for i, j in cloth.STEPS]
        kinds = [spec.bend if 2 in map(abs, step) else spec.structural if 0 in step else spec.shear for step in cloth.STEPS]
        numbers = {"rest": rest, "stiffness": [kind.stiffness for kind in kinds], "damping": [kind.damping for kind in kinds]}
        numbers["air"] = self.solver.air_rows(spec.air / spec.density)
        return {key: np.array(values, np.float32) for key, values in numbers.items()}

    def stages(self, native: bool) -> Iterator[Stage]:
        """Yield the frame's stages; nothing here waits for the device."""
        yield from self._wind.stages()
        yield from super().stages(native)

    def pull(self, moment: int) -> Iterator[Stage]:
        """Yield the stages that sum springs and wind of every point."""
        if self.network is not None:
            yield self.pull_packed()
            yield self._torn_air(moment)
            return
        inputs = (moment, self.sheet, self.particles, self.internal)
        yield Stage("springs", cloth.accumulate_cloth, self.population.capacity, inputs, cloth_loops.accumulate_cloth)

    def wind(self, moment: int) -> Iterator[Stage]:
        """Yield the stages that store the wind alone."""
        if self.network is not None:
            yield from super().wind(moment)
            yield self._torn_air(moment)
            return
        inputs = (moment, self.sheet, self.particles, self.internal)
        yield Stage("air", cloth.accumulate_air, self.population.capacity, inputs, cloth_loops.accumulate_air)

    def stride(self, s: int) -> list[Stage]:
        """Return a substep of semi_implicit_euler in one pass over the rows, where nothing comes between springs and motion."""
        felt = self.surroundings
        alone = not (self.parts or self.resolves or felt.has_colliders or felt.flow.shape[1] or felt.forces.shape[1])
        apart = self.network is not None or self.spec.resolution[0] > MOST_COLUMNS
        if not self.native or self.spec.solver != "semi_implicit_euler" or not alone or apart:
            return []
        pace, counters, count = substep_of(self.pace, s), self.population.counters, self.population.capacity
        inputs = (pace, self.clock, felt.row, self.sheet, self.particles, self.internal, counters)
        held = (pace, self.clock, self._pins, felt.row, self.sheet, self.internal, self.particles, counters)
        move, hold = cloth_strides.advance_cloth, cloth_strides.project_cloth
        return [Stage("cloth", move, count, inputs, move), Stage("pins", hold, count, held, hold)]

    def _torn_air(self, moment: int) -> Stage:
        """Return the stage that adds what the wind does to a sheet that may be torn."""
        inputs = (moment, self.torn_springs, self.sheet, self.particles, self.internal)
        return Stage("air", tearing.accumulate_torn_air, self.population.capacity, inputs)

    def change(self, spec, scene: Scene, environment: Environment) -> None:
        """Take the numbers of another spec of the same structure, in place."""
        super().change(spec, scene, environment)
        self._wind.change(*self._wind_felt(spec, environment))

    def renew(self) -> None:
        """Write the springs' numbers, and the air's."""
        super().renew()
        for key, array in self._numbers(self.spec).items():
            getattr(self.sheet, key).assign(array)
