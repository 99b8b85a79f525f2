"""Integrators: one small file per method. A method owns when forces are evaluated; the forces own what they are."""

from warpsim.integrators.abm_pece import AbmPece2, AbmPece4, TracerAbmPece2, TracerAbmPece4
from warpsim.integrators.adams_bashforth import (
    AdamsBashforth2,
    AdamsBashforth3,
    AdamsBashforth4,
    TracerAdamsBashforth2,
    TracerAdamsBashforth3,
    TracerAdamsBashforth4,
)
from warpsim.integrators.ballistic import Ballistic
from warpsim.integrators.base import Integrator
from warpsim.integrators.drift_kick import DriftKick
from warpsim.integrators.euler import Euler
from warpsim.integrators.heun import Heun, TracerHeun
from warpsim.integrators.rk4 import RungeKutta4
from warpsim.integrators.semi_implicit_euler import SemiImplicitEuler
from warpsim.integrators.tracer import TracerEuler, TracerRungeKutta4
from warpsim.integrators.verlet import Verlet

ONE_STEP = (Euler, DriftKick, SemiImplicitEuler, Verlet, RungeKutta4, Heun)
MULTISTEP = (AdamsBashforth2, AdamsBashforth3, AdamsBashforth4, AbmPece2, AbmPece4)
TRACERS = (TracerEuler, TracerRungeKutta4, TracerHeun, TracerAdamsBashforth2, TracerAdamsBashforth3, TracerAdamsBashforth4)
TRACERS += (TracerAbmPece2, TracerAbmPece4)

SECOND_ORDER_FORM: dict[str, type[Integrator]] = {method.name: method for method in ONE_STEP + MULTISTEP}
FIRST_ORDER_FORM: dict[str, type[Integrator]] = {method.name.removeprefix("tracer_"): method for method in TRACERS}

__all__ = ["FIRST_ORDER_FORM", "SECOND_ORDER_FORM", "Ballistic", "Integrator"]
