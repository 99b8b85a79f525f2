"""Adams–Bashforth: the drive is extrapolated through its past values; one evaluation per substep."""

from typing import ClassVar, final

from warpsim.integrators.base import Integrator


@final
class AdamsBashforth2(Integrator):
    """Second order, with coupling too; keeps 1 past drive."""

    name: ClassVar[str] = "adams_bashforth_2"
    order: ClassVar[int] = 2
    evaluations: ClassVar[int] = 1
    past: ClassVar[int] = 1


@final
class AdamsBashforth3(Integrator):
    """Third order, with coupling too; keeps 2 past drives."""

    name: ClassVar[str] = "adams_bashforth_3"
    order: ClassVar[int] = 3
    evaluations: ClassVar[int] = 1
    past: ClassVar[int] = 2


@final
class AdamsBashforth4(Integrator):
    """Fourth order, with coupling too; keeps 3 past drives."""

    name: ClassVar[str] = "adams_bashforth_4"
    order: ClassVar[int] = 4
    evaluations: ClassVar[int] = 1
    past: ClassVar[int] = 3


@final
class TracerAdamsBashforth2(Integrator):
    """Second order: the textbook's method for x' = u."""

    name: ClassVar[str] = "tracer_adams_bashforth_2"
    order: ClassVar[int] = 2
    evaluations: ClassVar[int] = 1
    past: ClassVar[int] = 1


@final
class TracerAdamsBashforth3(Integrator):
    """Third order: the textbook's method for x' = u."""

    name: ClassVar[str] = "tracer_adams_bashforth_3"
    order: ClassVar[int] = 3
    evaluations: ClassVar[int] = 1
    past: ClassVar[int] = 2


@final
class TracerAdamsBashforth4(Integrator):
    """Fourth order: the textbook's method for x' = u."""

    name: ClassVar[str] = "tracer_adams_bashforth_4"
    order: ClassVar[int] = 4
    evaluations: ClassVar[int] = 1
    past: ClassVar[int] = 3
