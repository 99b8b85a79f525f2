"""Symplectic Euler that moves first: x' = x + h v, v' = v + h a(x')."""

from typing import ClassVar, final

from warpsim.integrators.base import Integrator


@final
class DriftKick(Integrator):
    """First order, symplectic, stable iff ωh < 2; keeps v² + ω²x² + hω²xv; ballistic flight ends ½ g h t too high."""

    name: ClassVar[str] = "drift_kick"
    order: ClassVar[int] = 1
    evaluations: ClassVar[int] = 1
