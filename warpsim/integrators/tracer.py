"""The first-order form dx/dt = u(x, t): particles without inertia, which follow the pathlines. Their velocity is the flow's."""

from typing import ClassVar, final

from warpsim.integrators.base import Integrator


@final
class TracerEuler(Integrator):
    """First order; in a vortex it spirals outward."""

    name: ClassVar[str] = "tracer_euler"
    order: ClassVar[int] = 1
    evaluations: ClassVar[int] = 1


@final
class TracerRungeKutta4(Integrator):
    """Fourth order; the default of tracers."""

    name: ClassVar[str] = "tracer_rk4"
    order: ClassVar[int] = 4
    evaluations: ClassVar[int] = 4
