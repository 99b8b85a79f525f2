"""Implicit Euler: the springs act as they will at the substep's end, by one linear system per substep; no substep is too long for them."""

from collections.abc import Iterator
from typing import final

import numpy as np
import warp as wp

from warpsim.integrators import SECOND_ORDER_FORM
from warpsim.kernels import conjugate_gradients as gradients
from warpsim.kernels import implicit, implicit_loops, rigid_groups
from warpsim.kernels.springs import SLICE
from warpsim.launch import Stage
from warpsim.systems.pairs import substep_of
from warpsim.systems.solvers.base import NetworkSolver
from warpsim.weaves import Weave, grouped, woven

ITERATIONS = 100  # at most, where a network does not say
TOLERANCE = 1e-4
MOST_GROUPS, FEWEST_POINTS = 8, 32  # of the coarse level: more cost more than they spare, fewer points need none
NUMBERS = {  # of a search, one of each
    wp.float64: "tolerance goal whole square frame_residual",
    float: "along turn",
    int: "going iteration frame_iterations",
    wp.int64: "unconverged",
    wp.vec3: "drift",
}


@final
class ImplicitEuler(NetworkSolver):
    """Backward Euler of the springs, linear in the substep; gravity, drag, wind and parts act before, by the particles' own formulas."""

    def __init__(self, system):
        super().__init__(system)
        device, capacity = system.population.device, system.population.capacity
        system.particles.internal = system.internal
        layout = woven(len(system.net.points), system.net.springs)
        self._weave = implicit.Weave()
        self._weave.point_count, self._weave.reach, self._weave.free = len(system.net.points), layout.reach, system.inverse_mass
        for name in ("begin", "step", "neighbor", "spring"):
            setattr(self._weave, name, wp.array(getattr(layout, name).reshape(-1), dtype=int, device=device))
        self._weave.inertia = wp.zeros(capacity, dtype=float, device=device)
        self._weave.weight = wp.zeros((len(layout.step), 4 * SLICE), dtype=float, device=device)
        self._linear = implicit.System()
        self._linear.h = system.pace.dt
        sizes = {"image": 3, "residual": 3, "scaled": 3, "change": 3, "factor": 6}
        for name, rows in sizes.items():
            setattr(self._linear, name, wp.zeros((rows, capacity), dtype=float, device=device))
        self._linear.direction = wp.zeros((3, capacity + 2 * layout.reach), dtype=float, device=device)
        self._groups = self._grouped(layout)
        self._search = gradients.Search()
        self._search.most = system.spec.iterations or ITERATIONS
        self._search.partial = wp.zeros((4, capacity // SLICE), dtype=wp.float64, device=device)
        for dtype, names in NUMBERS.items():
            for name in names.split():
                setattr(self._search, name, wp.zeros(1, dtype=dtype, device=device))

        self.change()

    def _grouped(self, layout: Weave) -> rigid_groups.RigidGroups:
        """Return the coarse level of the search."""
        net, device, groups = self.system.net, self.system.population.device, rigid_groups.RigidGroups()
        held = self._weave.free.numpy()[: len(net.points)] == 0.0
        parts = grouped(net.points, layout, held, MOST_GROUPS, FEWEST_POINTS)
        group = np.zeros(self.system.population.capacity, np.int32)
        group[: len(parts.group)] = parts.group
        groups.group = wp.array(group, dtype=int, device=device)
        for name in ("center", "order", "chunk_begin", "pair_begin"):
            setattr(groups, name, wp.array(getattr(parts, name).reshape(-1), dtype=int, device=device))
        groups.pair = wp.array(parts.pair, dtype=wp.vec2i, device=device)
        groups.crossing = wp.array(parts.crossing, dtype=wp.vec3i, device=device)
        count, chunks, pairs = len(parts.center), len(parts.order), len(parts.pair)
        groups.offset = wp.zeros((3, len(group)), dtype=float, device=device)
        groups.lift = wp.zeros((6, count), dtype=float, device=device)
        shapes = {"moment": (10, chunks), "joint": (pairs, 3, 36), "matrix": (6 * count, 6 * count), "load": (6, chunks)}
        for name, shape in (shapes | {"solution": 6 * count}).items():
            setattr(groups, name, wp.zeros(shape, dtype=wp.float64, device=device))
        return groups

    def change(self) -> None:
        """Take another tolerance."""
        self._search.tolerance.fill_(self.system.spec.tolerance or TOLERANCE)

    def stages(self) -> Iterator[Stage]:
        """Yield the stages of all substeps: what acts besides the springs, the linear system, its solution, contacts and pins."""
        system = self.system
        self._linear.start = system.start
        plain, loop = SECOND_ORDER_FORM["semi_implicit_euler"].kernels(False, system.surroundings.long_flows)
        inputs = (system.pace.dt, system.surroundings.row, system.particles, self._weave.inertia)
        yield Stage("springs", implicit.sample_inertia, system.population.capacity, inputs)
        for s in range(system.pace.substep_count):
            yield from system.outer_forces(2 * s)
            yield from system.begin()
            inputs = (substep_of(system.pace, s), system.clock, system.surroundings.row, system.particles, system.population.counters)
            yield Stage("advance", plain, system.population.capacity, inputs, loop)
            yield from system.hold(s)  # the springs must know how fast the pins move
            yield from system.prepare(2 * s + 2)
            yield from self._solve(s)
            yield from system.settle(s)

    def _solve(self, s: int) -> Iterator[Stage]:
        system, linear, search = self.system, self._linear, self._search
        capacity, moving = system.population.capacity, (system.opening, system.clock)
        inputs = (self._weave, system.table, system.particles, linear)
        yield Stage("assemble", implicit.assemble_system, capacity, inputs, implicit_loops.assemble_system)
        inputs = (self._weave, self._weave.inertia, linear, self._groups)
        yield Stage("groups", rigid_groups.measure_chunks, self._groups.load.shape[1], inputs)
        if self._groups.pair.shape[0]:
            yield Stage("groups", rigid_groups.join_groups, self._groups.pair.shape[0], (self._weave, self._groups))
        yield Stage("groups", rigid_groups.factor_matrix, 1, (self._groups,))
        yield from self._measure()
        yield self._dot(gradients.GUESS, linear.direction, linear.residual)
        yield from self._multiply()
        yield Stage("search", gradients.begin_search, 1, (s, system.clock, system.opening, self._groups, search))
        yield from self._turn()
        body = (*self._multiply(), Stage("search", gradients.choose_length, 1, (search,)), *self._turn())
        yield Stage("solve", body=body, condition=search.going, most=search.most)
        if not system.spec.pinned(system.spec.pins):
            points = (self._weave.inertia, len(system.net.points), linear, search.partial)
            yield Stage("search", gradients.accumulate_momentum, search.partial.shape[1], points)
            yield Stage("search", gradients.resolve_drift, 1, (search,))
        inputs = (self._weave, linear, search.drift, *moving, system.particles)
        yield Stage("advance", implicit.apply_change, capacity, inputs)

    def _dot(self, row: int, a: wp.array, c: wp.array) -> Stage:
        """Return the stage that sums a·c by blocks; only the direction has columns before the first point."""
        shift = self._weave.reach if a is self._linear.direction else 0
        inputs = (int(row), a, shift, c, self._search.partial)
        return Stage(
            "search", gradients.accumulate_blocks, self._search.partial.shape[1], inputs, implicit_loops.accumulate_blocks, own=True
        )

    def _multiply(self) -> Iterator[Stage]:
        """Yield the stages that multiply the direction by the matrix, and say how much that bends."""
        linear = self._linear
        inputs = (self._weave, self._weave.inertia, linear.direction, linear.image)
        yield Stage("multiply", implicit.multiply_direction, linear.image.shape[1], inputs, implicit_loops.multiply_direction, own=True)
        yield self._dot(gradients.CURVATURE, linear.direction, linear.image)

    def _turn(self) -> Iterator[Stage]:
        """Yield the stages that go along the direction, decide what is left to do, and turn."""
        linear, capacity = self._linear, self._linear.image.shape[1]
        inputs = (self._search, self._weave.reach, linear)
        yield Stage("search", gradients.step_along, capacity, inputs, implicit_loops.step_along, own=True)
        yield from self._measure()
        yield Stage("search", gradients.choose_turn, 1, (self._groups, self._search))
        inputs = (self._search, self._weave, self._groups, linear)
        yield Stage("search", gradients.turn_direction, capacity, inputs, implicit_loops.turn_direction)

    def _measure(self) -> Iterator[Stage]:
        """Yield the stages that measure the residual: by points, and by groups."""
        linear, groups = self._linear, self._groups
        yield self._dot(gradients.SQUARE, linear.scaled, linear.scaled)
        inputs = (self._weave.free, linear.residual, groups)
        yield Stage("groups", rigid_groups.load_groups, groups.load.shape[1], inputs, implicit_loops.load_groups)

    @property
    def state(self) -> dict[str, wp.array]:
        """What statistics tell of the frame and of the run so far."""
        search = self._search
        return {"iterations": search.frame_iterations, "residual": search.frame_residual, "unconverged": search.unconverged}

    def statistics(self) -> dict[str, float]:
        """Return the frame's iterations per substep and largest relative residual, and how many substeps of the run ended short of it."""
        iterations, residual, unconverged = (array.numpy()[0].item() for array in self.state.values())
        per_substep = iterations / self.system.pace.substep_count
        return {"cg_iterations": per_substep, "cg_residual": residual, "cg_unconverged": unconverged}
