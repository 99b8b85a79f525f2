"""The measurer of a solver's order: the study that `converge` shows, of one system and one method."""

import math

from warpsim.convergence import Experiment, convergence_order
from warpsim.scene import SceneError
from warpsim.verify.amounts import expected_at
from warpsim.verify.findings import Reading
from warpsim.verify.measurers import Measurer


class ConvergenceOrderMeasurer(Measurer):
    """The slope of log error over log step, in float64 on the CPU, whatever the device of the rest."""

    def reading(self) -> Reading:
        oracle = self.oracle
        solver = oracle.solver or self.scene.systems[oracle.system].method
        try:
            experiment = Experiment(self.scene, oracle.system)
            if solver not in experiment.methods:
                return Reading(math.nan, math.nan, remark=f"{solver} is no solver of this system")
            order = convergence_order(self.scene, oracle.system, solver)
        except SceneError as error:
            return Reading(math.nan, math.nan, remark="; ".join(problem.message for problem in error.problems))
        expected = expected_at(oracle.expect, 0.0)
        remark = "" if order is not None else "rounding or instability hides the order"
        return Reading(
            math.nan if order is None else order, experiment.theory(solver) * 1.0 if expected is None else expected, remark=remark
        )
