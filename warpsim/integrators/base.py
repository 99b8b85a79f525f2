"""What every integrator offers to a system."""

from abc import ABC
from functools import cache
from typing import ClassVar

import warp as wp

from warpsim.kernels import advance, loops

advance_loops = cache(loops.advance_loops)  # made when a scene first asks for them


class Integrator(ABC):
    """A method that advances particles through all substeps of a frame in one pass over memory.

    The one-step methods of the second-order form but heun apply drag through the exponential kick v + h φ(kh)(a + k(u − v)), which is
    exact for constant u and a and stable for any h (docs/adr/0002-exponential-coupling.md). heun and the multistep ones move exactly
    under a drive that is a polynomial in time, and are of full order with drag too (docs/adr/0011-multistep.md).
    """

    name: ClassVar[str]
    """Name in the scene and of the kernels."""
    order: ClassVar[int]
    """Order of convergence without coupling."""
    damped_order: ClassVar[int]
    """Order with coupling; absent: the same."""
    evaluations: ClassVar[int]
    """Evaluations of the forces per substep."""
    past: ClassVar[int] = 0
    """Drives at earlier substeps that it keeps of each particle."""
    splits_pairs: ClassVar[bool] = False
    """Whether forces between particles act as half kicks before and after a substep, and not within it."""

    def __init_subclass__(cls):
        """Let the order with coupling be that without, where a method says nothing else."""
        cls.damped_order = cls.__dict__.get("damped_order", cls.order)

    @classmethod
    def kernels(cls, among_colliders: bool, long_flows: tuple[str, ...]) -> tuple[wp.Kernel, wp.Kernel]:
        """Return the plain kernel and the native loop for who moves freely, or among colliders. `long_flows` are felt."""
        name = cls.name + (advance.AMONG_COLLIDERS if among_colliders else "")
        return advance.ADVANCE[name], advance_loops(name, long_flows)[0]

    @classmethod
    def removing_loop(cls, among_colliders: bool, long_flows: tuple[str, ...]) -> wp.Kernel:
        """Return the native loop that removes the expired as well."""
        return advance_loops(cls.name + (advance.AMONG_COLLIDERS if among_colliders else ""), long_flows)[1]
