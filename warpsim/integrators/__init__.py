"""Integrators: one small file per method. A method owns when forces are evaluated; the forces own what they are."""

from warpsim.integrators.ballistic import Ballistic
from warpsim.integrators.base import Integrator
from warpsim.integrators.drift_kick import DriftKick
from warpsim.integrators.euler import Euler
from warpsim.integrators.rk4 import RungeKutta4
from warpsim.integrators.semi_implicit_euler import SemiImplicitEuler
from warpsim.integrators.tracer import TracerEuler, TracerRungeKutta4
from warpsim.integrators.verlet import Verlet

SECOND_ORDER_FORM: dict[str, type[Integrator]] = {
    method.name: method for method in (Euler, DriftKick, SemiImplicitEuler, Verlet, RungeKutta4)
}
FIRST_ORDER_FORM: dict[str, type[Integrator]] = {"euler": TracerEuler, "rk4": TracerRungeKutta4}

__all__ = ["FIRST_ORDER_FORM", "SECOND_ORDER_FORM", "Ballistic", "Integrator"]
