"""XPBD: points are moved as if no spring held them, and then by the springs, color by color, each as far as it gives way."""

from collections.abc import Iterator
from typing import final

import numpy as np
import warp as wp

from warpsim.coloring import greedy, of_sheet, pieces, runs
from warpsim.integrators import SECOND_ORDER_FORM
from warpsim.kernels import cloth, points, xpbd, xpbd_loops
from warpsim.launch import Stage
from warpsim.networks import spring_numbers
from warpsim.systems.pairs import substep_of
from warpsim.systems.solvers.base import NetworkSolver

WORTH_A_LAUNCH = {True: 4096, False: 16}  # springs of a color, natively or not; a run of smaller colors is left to one core or thread


@final
class Xpbd(NetworkSolver):
    """Extended position-based dynamics in small steps: stable for any stiffness and damping; one pass over the springs by default."""

    def __init__(self, system):
        super().__init__(system)
        self._turns, self._projection = system.spec.iterations or 1, xpbd.Projection()
        self._projection.h, self._projection.turns, self._projection.opening = system.pace.dt, self._turns, system.opening
        self._projection.inverse_mass = system.inverse_mass
        self._projection.response = wp.zeros_like(system.inverse_mass)
        self._projection.damped = wp.zeros(1, dtype=int, device=system.device)
        self.change()

    def change(self) -> None:
        """Note whether there is damping to work out."""
        self._projection.damped.fill_(int(spring_numbers(self.system.spec, self.system.net)[1].any()))

    def stages(self) -> Iterator[Stage]:
        """Yield the stages of all substeps: move, pin, pull, damp, settle."""
        system, within = self.system, self._outer_forces()
        sweeps, damping = self._sheet_stages() if self._in_rows else self._listed_stages()
        row, count = system.surroundings.row, system.point_count
        inputs = (count, system.pace.dt, row, system.particles, system.inverse_mass, self._projection.response)
        yield Stage("springs", xpbd.sample_responses, system.population.capacity, inputs)
        for s in range(system.pace.substep_count):
            if within:
                yield from system.outer_forces(2 * s)
            if system.surroundings.has_colliders or any(part.constrains for part in system.parts):
                yield from system.begin()
            yield self._advance(s)
            yield from system.hold(s)
            yield from system.prepare(2 * s + 2)
            yield from sweeps
            yield from damping
            yield from system.settle(s)

    def _outer_forces(self) -> bool:
        """Return whether something besides springs acts within the network, and let the points feel it."""
        acts = any(stage.kernel is not points.clear_internal for stage in self.system.outer_forces(0))
        if acts:
            self.system.particles.internal = self.system.internal
        return acts

    def _advance(self, s: int) -> Stage:
        """Return the stage that moves every point through substep s but for the springs, by the particles' own formulas."""
        system = self.system
        plain, loop = self._move.kernels(False, system.surroundings.long_flows)
        inputs = (substep_of(system.pace, s), system.clock, system.surroundings.row, system.particles, system.population.counters)
        return Stage("advance", plain, system.population.capacity, inputs, loop)

    @property
    def _move(self):
        return SECOND_ORDER_FORM["semi_implicit_euler"]

    @property
    def _in_rows(self) -> bool:
        """Whether the springs are those of a sheet, all of a kind alike for good."""
        return hasattr(self.system, "sheet") and not any(part.changes_springs for part in self.system.parts)

    def _multipliers(self, count: int) -> wp.array:
        """Return room for what each of so many springs pulls, if it must be remembered from pass to pass."""
        return wp.zeros(count if self._turns > 1 else 0, dtype=float, device=self.system.device)

    def _listed_stages(self) -> tuple[list[Stage], list[Stage]]:
        """Return the stages of all passes over listed springs, and those of their damping."""
        system, projection, table = self.system, self._projection, self.system.table
        sheet = getattr(system, "sheet", None)
        coloring = of_sheet(system.net.springs, (sheet.nx, sheet.ny)) if sheet is not None else greedy(system.net.springs)
        projection.order = wp.array(coloring.order, dtype=int, device=system.device)
        projection.begin = wp.array(coloring.begin, dtype=int, device=system.device)
        piece, first = pieces(coloring, system.net.springs)
        projection.piece = wp.array(piece, dtype=wp.vec2i, device=system.device)
        projection.first_piece = wp.array(first, dtype=int, device=system.device)
        memory, sizes = self._multipliers(len(coloring.order)), np.diff(coloring.begin).tolist()
        moved, sweep, damping = (system.clock, memory, system.particles), [[] for _ in range(self._turns)], []
        for color, end in runs(sizes, WORTH_A_LAUNCH[system.native]):
            if end - color > 1 or sizes[color] < WORTH_A_LAUNCH[system.native]:
                loops = xpbd_loops if system.native else xpbd
                for turn, stages in enumerate(sweep):
                    inputs = (color, end, turn, projection, table, *moved)
                    stages.append(Stage("springs", loops.project_colors, 1, inputs))
                damping.append(Stage("damping", loops.damp_colors, 1, (color, end, projection, table, system.clock, system.particles)))
                continue
            for turn, stages in enumerate(sweep):
                inputs = (color, turn, projection, table, *moved)
                stages.append(Stage("springs", xpbd.project_springs, sizes[color], inputs, xpbd_loops.project_springs))
            inputs = (color, projection, table, system.clock, system.particles)
            damping.append(Stage("damping", xpbd.damp_springs, sizes[color], inputs, xpbd_loops.damp_springs))
        return [stage for stages in sweep for stage in stages], damping

    def _sheet_stages(self) -> tuple[list[Stage], list[Stage]]:
        """Return the stages of all passes over the springs of a sheet, and those of their damping: natively several colors in one."""
        system, projection, sheet = self.system, self._projection, self.system.sheet
        memory = self._multipliers(len(cloth.STEPS) * sheet.nx * sheet.ny)
        if system.native:
            colors, count, loops = [(0,), (1,)], (sheet.ny + 3) // 4, xpbd_loops
        else:
            colors = [(step, direction, sum(1 << r for r in remainders)) for step, direction, remainders in xpbd.SHEET_COLORS]
            count, loops = sheet.nx * sheet.ny, xpbd
        moved = (system.clock, memory, system.particles)
        sweeps = [
            _stage("springs", loops.project_sheet, count, (*color, turn, projection, sheet, *moved), system.native)
            for turn in range(self._turns)
            for color in colors
        ]
        inputs = [(*color, projection, sheet, system.clock, system.particles) for color in colors]
        return sweeps, [_stage("damping", loops.damp_sheet, count, one, system.native) for one in inputs]


def _stage(name: str, kernel: wp.Kernel, count: int, inputs: tuple, native: bool) -> Stage:
    """Return the stage of a kernel that is either a native loop or a plain kernel."""
    return Stage(name, kernel, max(count, 2), inputs, kernel if native else None)
