"""Closed form x₀ + v₀ t + ½ g t²: exact at any frame, without steps; the only state is the birth."""

from typing import ClassVar, final

import warp as wp

from warpsim.integrators.base import Integrator
from warpsim.kernels import advance, loops


@final
class Ballistic(Integrator):
    """Exact under gravity alone."""

    name: ClassVar[str] = "ballistic"
    order: ClassVar[int] = 0
    evaluations: ClassVar[int] = 0

    @classmethod
    def kernels(cls, among_colliders: bool, long_flows: tuple[str, ...]) -> tuple[wp.Kernel, wp.Kernel]:
        """Return the plain kernel and the native loop."""
        return advance.advance_ballistic, loops.advance_ballistic
