"""Self-collision of cloth: layers are kept apart, rub, and never pass through each other."""

from collections.abc import Iterator
from typing import final

import numpy as np
import warp as wp

from warpsim.kernels import emission, layer_loops, layer_search, layers
from warpsim.launch import Stage
from warpsim.scene.layers import CORE, DRIFT, PUSH, SPEED, longest_list, reach_of
from warpsim.systems.neighbors import Neighbors
from warpsim.systems.parts.base import Part


@final
class SelfCollision(Part):
    """What the points of a sheet do to those that it folds onto, after every substep."""

    constrains = True

    @classmethod
    def wanted(cls, spec) -> bool:
        """Return whether it is cloth that asks for it."""
        return spec.type == "cloth" and spec.layers is not None

    def __init__(self, system):
        super().__init__(system)
        system.resolve_contacts()  # which notes where a substep finds the points
        capacity, device = system.population.capacity, system.device
        self._counters = wp.zeros(emission.COUNTER_COUNT, dtype=wp.int64, device=device)
        spec, h = system.spec, system.pace.dt
        rows = longest_list(spec.layers.distance, h, spec.edges, spec.resolution)
        self.layers = layers.Layers()
        self.layers.point_count, self.layers.rows = system.point_count, rows
        self.layers.opening, self.layers.inverse_mass, self.layers.start = system.opening, system.inverse_mass, system.start
        self.layers.numbers = wp.zeros(9, dtype=float, device=device)
        self.layers.rest = wp.zeros(1, dtype=wp.vec3, device=device)
        down, across = np.divmod(np.arange(capacity), spec.resolution[0])
        self.layers.place = wp.array(np.stack([across, down], axis=1), dtype=wp.vec2i, device=device)
        self.layers.reference = wp.zeros((3, capacity), dtype=float, device=device)
        self.layers.count = wp.zeros(capacity, dtype=int, device=device)
        self.layers.near = wp.zeros(capacity * rows, dtype=int, device=device)
        self.layers.touches = wp.zeros(capacity, dtype=int, device=device)
        self.layers.push = wp.zeros((6, capacity), dtype=float, device=device)
        self.layers.boxes = wp.zeros((13, -(-system.point_count // 64)), dtype=float, device=device)
        self.layers.middle = wp.zeros(3, dtype=float, device=device)
        self.layers.flags = wp.zeros(6, dtype=int, device=device)
        self._neighbors = Neighbors(system.population, 1.0, places=system.start[0:3], counters=self._counters)
        self.change()

    def change(self) -> None:
        """Take the numbers of `system.spec`, in place."""
        spec, h = self.system.spec, self.system.pace.dt
        along, down = (np.array(edge, float) / (n - 1) for edge, n in zip(spec.edges, spec.resolution, strict=True))
        d, reach = spec.layers.distance, reach_of(spec.layers.distance, h)
        numbers = np.zeros(9, np.float32)
        numbers[layers.DISTANCE], numbers[layers.CORE], numbers[layers.REACH] = d, d / CORE, reach
        numbers[layers.DRIFT], numbers[layers.STRIDE], numbers[layers.MOST_PUSH] = DRIFT * d, SPEED * h, PUSH * d
        numbers[layers.FRICTION], numbers[layers.STEP], numbers[layers.FOLLOWS] = spec.layers.friction, h, not spec.pins
        self.layers.numbers.assign(numbers)
        self.layers.rest.assign(np.array([[along @ along, along @ down, down @ down]], np.float32))
        flags = self.layers.flags.numpy()
        flags[layers.CROWDED] = 1  # whoever was too far away may be near enough now: the lists are made anew
        self.layers.flags.assign(flags)
        self._neighbors.change(reach)

    def constrain(self, s: int) -> Iterator[Stage]:
        """Yield the stages that find who touches whom, and push layers apart."""
        system, sheet, particles = self.system, self.layers, self.system.particles
        capacity, slices = system.population.capacity, sheet.boxes.shape[1]
        yield Stage("layers", layer_search.measure_motion, slices, (sheet, particles), layer_loops.measure_motion)
        yield Stage("layers", layer_search.decide_search, 1, (s, sheet, self._counters))
        yield Stage("layers", layer_search.mark_points, capacity, (self._counters, sheet, self._neighbors.grid))
        yield from self._neighbors.stages(system.native)
        inputs = (self._counters, self._neighbors.grid, self._neighbors.sorted, sheet)
        yield Stage("layers", layer_search.list_near, capacity, inputs, layer_loops.list_near)
        yield Stage("layers", layers.limit_strides, capacity, (sheet, particles))
        yield Stage("layers", layers.count_touches, capacity, (sheet, particles), layer_loops.count_touches)
        yield Stage("layers", layers.gather_pushes, capacity, (sheet, particles))
        yield Stage("layers", layers.advance_touched, capacity, (system.clock, sheet, particles))

    def after(self, s: int) -> Iterator[Stage]:
        """Yield the stages that brake a substep in which points would come too near, and lead who was braked past the colliders again."""
        capacity, inputs = self.system.population.capacity, (self.layers, self.system.particles)
        yield Stage("layers", layers.mark_alarm, capacity, inputs, layer_loops.mark_alarm)
        yield Stage("layers", layers.limit_ways, capacity, (self.system.clock, *inputs))
        yield from self.system.contacts(s, self.layers.flags[layers.ALARM : layers.ALARM + 1])  # the common motion leads into colliders

    def statistics(self) -> dict[str, float]:
        """Return how many pairs touch, and how many substeps of the frame were braked."""
        flags = self.layers.flags.numpy()
        touches = int(self.layers.touches.numpy()[: self.system.point_count].sum()) // 2
        return {"self_contacts": touches, "self_brakes": int(flags[layers.BRAKES] + flags[layers.ALARM])}
