"""Split: the particles' kernels move the points, and the springs act within their substep or as kicks before and after it."""

import math
from collections.abc import Iterator
from typing import final

import numpy as np

from warpsim.integrators import SECOND_ORDER_FORM
from warpsim.kernels import spring_loops, springs
from warpsim.launch import Stage
from warpsim.systems.pairs import substep_of
from warpsim.systems.solvers.base import NetworkSolver

WITHIN, AFTER, HALVES = range(3)
WHEN = {  # when the springs act: with the other forces, as a kick after the substep, or as half a kick before and after
    "euler": WITHIN,
    "semi_implicit_euler": WITHIN,
    "drift_kick": AFTER,
    "verlet": HALVES,
}


@final
class Split(NetworkSolver):
    """euler, semi_implicit_euler, drift_kick and verlet: one evaluation of the springs per substep."""

    resolves = True

    def __init__(self, system):
        super().__init__(system)
        self._when, self._method = WHEN[system.spec.solver], SECOND_ORDER_FORM[system.spec.solver]
        if self._when == WITHIN:
            system.particles.internal = system.internal

    def air_rows(self, k: float) -> np.ndarray:
        """Return, for verlet, the air between two half kicks of the springs, half a decay where a frame begins or ends (Strang)."""
        rows = super().air_rows(k)
        if self._when == HALVES:
            h = 0.5 * self.system.pace.dt
            rows[1:, 1] = h  # of the springs' kick that ends and begins here, half has come before
            rows[[0, -1], 0] = -math.expm1(-k * h) / h
        return rows

    def stages(self) -> Iterator[Stage]:
        """Yield the stages of all substeps; the two half kicks that meet between substeps are one."""
        when, count, dt = self._when, self.system.pace.substep_count, self.system.pace.dt
        for s in range(count):
            if stride := self.system.stride(s):
                yield from stride
                continue
            if when == WITHIN or (when == HALVES and s == 0):
                yield from self.system.forces(2 * s)
            if when == HALVES and s == 0:
                yield self._kick(0.5 * dt)
            if when == AFTER and s == 0:
                yield from self.system.prepare(0)  # parts that constrain come before anybody asks for forces
            yield from self.system.begin()
            yield self._advance(s)
            yield from self.system.settle(s)
            if when != WITHIN:
                yield from self.system.forces(2 * s + 2)
                yield self._kick(0.5 * dt if when == HALVES and s == count - 1 else dt)

    def _advance(self, s: int) -> Stage:
        """Return the stage that moves every point through substep s; who is constrained afterwards meets colliders after that."""
        system = self.system
        felt = system.surroundings
        plain, loop = self._method.kernels(felt.has_colliders and not system.resolves, felt.long_flows)
        inputs = (substep_of(system.pace, s), system.clock, system.surroundings.row, system.particles, system.population.counters)
        return Stage("advance", plain, system.population.capacity, inputs, loop, own=True)

    def _kick(self, h: float) -> Stage:
        """Return the stage in which the springs act for a time h."""
        system = self.system
        inputs = (h, len(system.net.points), system.opening, system.clock, system.internal, system.particles.velocity)
        return Stage("springs", springs.kick_points, system.population.capacity, inputs, spring_loops.kick_points, own=True)
