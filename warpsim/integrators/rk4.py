"""Classical Runge–Kutta under the forces, between two halves of the drag."""

from typing import ClassVar, final

from warpsim.integrators.base import Integrator


@final
class RungeKutta4(Integrator):
    """Fourth order; with coupling second, since the drag is split off (Strang) to stay stable for any step."""

    name: ClassVar[str] = "rk4"
    order: ClassVar[int] = 4
    damped_order: ClassVar[int] = 2
    evaluations: ClassVar[int] = 5
