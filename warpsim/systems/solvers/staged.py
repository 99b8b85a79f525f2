"""Staged: all that acts is asked for anew at every stage, which gives Runge and Kutta's, Heun's and Adams' methods their orders."""

from collections.abc import Iterator
from typing import final

import numpy as np
import warp as wp

from warpsim.integrators import SECOND_ORDER_FORM
from warpsim.kernels import staged, staged_loops
from warpsim.launch import Stage
from warpsim.population import Field, history_fields
from warpsim.systems.solvers.base import NetworkSolver

STAGED = ("rk4", *staged.METHODS)
MOMENTS = (0, 1, 1, 2)  # of Runge and Kutta's stages, in half substeps


@final
class Staged(NetworkSolver):
    """rk4, heun, adams_bashforth_2/3/4 and abm_pece_2/4: springs, drag, flow, air and pins are taken as they are at each stage's moment.

    Those that look back keep their past with each point. Where one has none, at the start and after a collision, a frame's first substep
    is one by Runge and Kutta, whose drives make a past of full order; until then it takes what there is.
    """

    has_stages = True

    @classmethod
    def fields(cls, spec) -> dict[str, Field]:
        """Return the rows that the population keeps for it."""
        return history_fields(SECOND_ORDER_FORM[spec.solver].past)

    def __init__(self, system):
        super().__init__(system)
        self._order, self._corrects = staged.METHODS.get(system.spec.solver, (0, False))
        capacity, device, work = system.population.capacity, system.device, staged.Staging()
        work.count, work.opening, work.h = system.point_count, system.opening, system.pace.dt
        work.clock, work.environment, work.free, work.drive = system.clock, system.surroundings.row, system.inverse_mass, system.internal
        for name in ("now", "middle", "slide"):
            setattr(work, name, wp.zeros((3, capacity), dtype=float, device=device))
        self._work = work

    takes_air = False

    def air_rows(self, k: float) -> np.ndarray:
        """Return k itself for every moment: the air is one more force, for a method of any order to integrate."""
        return np.tile([k, 0.0], (2 * self.system.pace.substep_count + 1, 1))

    def stages(self) -> Iterator[Stage]:
        """Yield the stages of all substeps."""
        self._work.start = self.system.start
        for s in range(self.system.pace.substep_count):
            yield from self.system.place_pins(2 * s)
            yield from self.system.begin()
            yield from self._adams(s) if self._order else self._runge_kutta(s, "stage_3")
            yield from self.system.settle(s)

    def _runge_kutta(self, s: int, last: str) -> Iterator[Stage]:
        """Yield the four stages of substep s by Runge and Kutta."""
        for place, name in enumerate(("stage_0", "stage_1", "stage_2", last)):
            yield from self._drive(2 * s + MOMENTS[place])
            yield self._stage(name, self._work)
            if place < 3:
                yield from self.system.place_pins(2 * s + MOMENTS[place + 1])

    def _adams(self, s: int) -> Iterator[Stage]:
        """Yield what predicts the end of substep s and, where the method does so, corrects it; at a frame's beginning first a start."""
        order, work = self._order, self._work
        if s == 0 and order > 2:
            yield from self._runge_kutta(s, f"start_{order}")
            work = self._from_the_beginning()
        else:
            yield from self._drive(2 * s)
        yield self._stage(f"{'foresee' if self._corrects else 'predict'}_{order}", work)
        if self._corrects:
            yield from self.system.place_pins(2 * s + 2)
            yield from self._drive(2 * s + 2)
            yield self._stage(f"correct_{order}", self._work)

    def _from_the_beginning(self) -> staged.Staging:
        """Return the arrays of a stage that takes the drive at the substep's beginning for the present one."""
        work = staged.Staging()
        for name in staged.Staging.vars:
            setattr(work, name, getattr(self._work, name))
        work.drive = work.now
        return work

    def _drive(self, moment: int) -> Iterator[Stage]:
        """Yield the stages that store in `internal` all that accelerates the points at a moment but their drag [m/s²]."""
        yield from self.system.forces(moment)
        inputs = (moment, self._work, self.system.particles, self.system.internal)
        yield Stage("advance", staged.accumulate_outer, self.system.population.capacity, inputs, staged_loops.accumulate_outer)

    def _stage(self, name: str, work: staged.Staging) -> Stage:
        inputs = (work, self.system.particles)
        return Stage("advance", staged.STAGES[name], self.system.population.capacity, inputs, staged_loops.STAGES[name])
