"""Adams–Bashforth–Moulton: predict, evaluate, correct, evaluate; the two values' distance estimates the error."""

from typing import ClassVar, final

from warpsim.integrators.base import Integrator


@final
class AbmPece2(Integrator):
    """Second order, with coupling too; keeps 1 past drive; Milne's estimate of its error."""

    name: ClassVar[str] = "abm_pece_2"
    order: ClassVar[int] = 2
    evaluations: ClassVar[int] = 2
    past: ClassVar[int] = 1


@final
class AbmPece4(Integrator):
    """Fourth order, with coupling too; keeps 3 past drives; Milne's estimate of its error."""

    name: ClassVar[str] = "abm_pece_4"
    order: ClassVar[int] = 4
    evaluations: ClassVar[int] = 2
    past: ClassVar[int] = 3


@final
class TracerAbmPece2(Integrator):
    """Second order: the textbook's method for x' = u, with Milne's estimate."""

    name: ClassVar[str] = "tracer_abm_pece_2"
    order: ClassVar[int] = 2
    evaluations: ClassVar[int] = 2
    past: ClassVar[int] = 1


@final
class TracerAbmPece4(Integrator):
    """Fourth order: the textbook's method for x' = u, with Milne's estimate."""

    name: ClassVar[str] = "tracer_abm_pece_4"
    order: ClassVar[int] = 4
    evaluations: ClassVar[int] = 2
    past: ClassVar[int] = 3
