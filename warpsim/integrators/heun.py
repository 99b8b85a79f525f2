"""Heun's method: predicted under the present drive, corrected by its mean with that at the predicted place."""

from typing import ClassVar, final

from warpsim.integrators.base import Integrator


@final
class Heun(Integrator):
    """Second order, with coupling too: v' = v + h (φ₁ g + φ₂ (N₁ − N₀)), and the position its integral; k = 0: linear acceleration."""

    name: ClassVar[str] = "heun"
    order: ClassVar[int] = 2
    evaluations: ClassVar[int] = 2


@final
class TracerHeun(Integrator):
    """Second order: x' = x + h (u₀ + u₁)/2."""

    name: ClassVar[str] = "tracer_heun"
    order: ClassVar[int] = 2
    evaluations: ClassVar[int] = 2
