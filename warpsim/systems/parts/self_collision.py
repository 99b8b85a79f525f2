"""Self-collision of cloth: layers are kept apart, rub, and never pass through each other."""

from collections.abc import Iterator
from typing import final

import numpy as np
import warp as wp

from warpsim.kernels import emission, layer_loops, layer_search, layers
from warpsim.launch import Stage
from warpsim.scene.layers import CORE
from warpsim.systems.neighbors import Neighbors
from warpsim.systems.parts.base import Part

DRIFT = 0.2  # of the distance: how far points may drift apart before the lists are made anew
PUSH = 0.05  # of the distance: how far a pair is pushed out of each other in a substep
SPEED = 8.0  # [m/s]: how fast a point may go beside the common motion


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
        rows = self._rows()
        self.layers = layers.Layers()
        self.layers.point_count, self.layers.rows = system.point_count, rows
        self.layers.opening, self.layers.inverse_mass, self.layers.start = system.opening, system.inverse_mass, system.start
        self.layers.numbers = wp.zeros(9, dtype=float, device=device)
        self.layers.rest = wp.zeros(1, dtype=wp.vec3, device=device)
        down, across = np.divmod(np.arange(capacity), system.spec.resolution[0])
        self.layers.place = wp.array(np.stack([across, down], axis=1), dtype=wp.vec2i, device=device)
        self.layers.reference = wp.zeros((3, capacity), dtype=float, device=device)
        self.layers.count = wp.zeros(capacity, dtype=int, device=device)
        self.layers.near = wp.zeros(capacity * rows, dtype=int, device=device)
        self.layers.touches = wp.zeros(capacity, dtype=int, device=device)
        self.layers.push = wp.zeros((6, capacity), dtype=float, device=device)
        self.layers.boxes = wp.zeros((12, -(-system.point_count // 64)), dtype=float, device=device)
        self.layers.middle = wp.zeros(3, dtype=float, device=device)
        self.layers.flags = wp.zeros(6, dtype=int, device=device)
        self._neighbors = Neighbors(system.population, 1.0, system.start[0:3], self._counters)
        self.change()

    def _lengths(self) -> dict[str, float]:
        """Return distance, stride and reach [m]."""
        d = self.system.spec.layers.distance
        stride = SPEED * self.system.pace.dt
        return {"distance": d, "stride": stride, "reach": d + 2.0 * (DRIFT * d + stride + PUSH * d)}

    def _rows(self) -> int:
        """Return how many one list may hold: five layers of points at rest within the reach."""
        area = np.linalg.norm(np.cross(*self._cell()))
        return 32 + 16 * int(np.ceil(5.0 * np.pi * self._lengths()["reach"] ** 2 / area / 16.0))

    def _cell(self) -> list[np.ndarray]:
        """Return the edges of a cell at rest, (3,) each [m]."""
        spec = self.system.spec
        return [np.array(edge, float) / (n - 1) for edge, n in zip(spec.edges, spec.resolution, strict=True)]

    def change(self) -> None:
        """Take the numbers of `system.spec`, in place."""
        spec, along, down = self.system.spec, *self._cell()
        lengths = self._lengths()
        numbers = np.zeros(9, np.float32)
        numbers[layers.DISTANCE], numbers[layers.STRIDE], numbers[layers.REACH] = lengths["distance"], lengths["stride"], lengths["reach"]
        numbers[layers.CORE], numbers[layers.DRIFT] = lengths["distance"] / CORE, DRIFT * lengths["distance"]
        numbers[layers.MOST_PUSH], numbers[layers.FRICTION] = PUSH * lengths["distance"], spec.layers.friction
        numbers[layers.STEP], numbers[layers.FOLLOWS] = self.system.pace.dt, not spec.pins
        self.layers.numbers.assign(numbers)
        self.layers.rest.assign(np.array([[along @ along, along @ down, down @ down]], np.float32))
        flags = self.layers.flags.numpy()
        flags[layers.CROWDED] = 1  # whoever was too far away may be near enough now: the lists are made anew
        self.layers.flags.assign(flags)
        self._neighbors.change(lengths["reach"])

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
        """Yield the stages that brake a substep in which points would come too near."""
        capacity, inputs = self.system.population.capacity, (self.layers, self.system.particles)
        yield Stage("layers", layers.mark_alarm, capacity, inputs, layer_loops.mark_alarm)
        yield Stage("layers", layers.limit_ways, capacity, (self.system.clock, *inputs))

    def statistics(self) -> dict[str, float]:
        """Return how many pairs touch, and how many substeps of the frame were braked."""
        flags = self.layers.flags.numpy()
        touches = int(self.layers.touches.numpy()[: self.system.point_count].sum()) // 2
        return {"self_contacts": touches, "self_brakes": int(flags[layers.BRAKES] + flags[layers.ALARM])}
