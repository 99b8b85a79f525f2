"""Explicit Euler: x' = x + h v, v' = v + h a(x), both from the old state."""

from typing import ClassVar, final

from warpsim.integrators.base import Integrator


@final
class Euler(Integrator):
    """First order. On an oscillator the amplitude grows by √(1 + ω²h²) per step; ballistic flight ends ½ g h t too high."""

    name: ClassVar[str] = "euler"
    order: ClassVar[int] = 1
    evaluations: ClassVar[int] = 1
