"""Symplectic Euler that kicks first, the lecture's: v' = v + h a(x), x' = x + h v'."""

from typing import ClassVar, final

from warpsim.integrators.base import Integrator


@final
class SemiImplicitEuler(Integrator):
    """First order, symplectic, stable iff ωh < 2; keeps v² + ω²x² − hω²xv; ballistic flight ends ½ g h t too low. The default."""

    name: ClassVar[str] = "semi_implicit_euler"
    order: ClassVar[int] = 1
    evaluations: ClassVar[int] = 1
