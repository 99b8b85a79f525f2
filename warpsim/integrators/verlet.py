"""Velocity Verlet: half a kick, a drift, half a kick; the second force serves the next substep too."""

from typing import ClassVar, final

from warpsim.integrators.base import Integrator


@final
class Verlet(Integrator):
    """Second order, symplectic, stable iff ωh < 2; exact in ballistic flight; frequency (2/h) asin(ωh/2)."""

    name: ClassVar[str] = "verlet"
    order: ClassVar[int] = 2
    evaluations: ClassVar[int] = 1
    splits_pairs: ClassVar[bool] = True
