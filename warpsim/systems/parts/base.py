"""What every part offers to a network: hooks that yield stages, all of them empty unless the part has something to do there."""

from abc import ABC, abstractmethod
from collections.abc import Iterator

import numpy as np
import warp as wp

from warpsim.launch import Stage


class Part(ABC):
    """Something that acts on the points of a network besides its springs. Moments count half substeps of a frame from 0.

    `system` is the NetworkSystem, whose arrays exist already but for those of its subclass.
    """

    @classmethod
    @abstractmethod
    def wanted(cls, spec) -> bool:
        """Return whether a network's spec asks for it; this may not change while it runs."""

    def __init__(self, system):
        self.system = system

    def prepare(self, moment: int) -> Iterator[Stage]:
        """Yield what must be done before forces at a moment are asked for."""
        yield from ()

    def forces(self, moment: int) -> Iterator[Stage]:
        """Yield the stages that add accelerations to `system.internal` [m/s²], at the points' present places."""
        yield from ()

    constrains = False
    """Whether it moves points in constrain(): contacts are then worked out after it."""

    changes_springs = False
    """Whether it gives single springs other numbers in time, in `system.table`."""

    def constrain(self, s: int) -> Iterator[Stage]:
        """Yield the stages that move points once substep s has moved them; contacts with colliders come afterwards."""
        yield from ()

    def after(self, s: int) -> Iterator[Stage]:
        """Yield what comes at the end of substep s, when all points are where it leaves them."""
        yield from ()

    def energy(self) -> float:
        """Return what it holds at the present frame [J]; it is part of the network's elastic energy."""
        return 0.0

    def rest_lengths(self, time: float, rest: np.ndarray) -> np.ndarray:
        """Return the rest length of every spring at a time [s], float64 (m,) [m], from those that the spec says; for what a run tells."""
        return rest

    def change(self) -> None:  # noqa: B027 — most have no numbers of their own
        """Take the numbers of `system.spec`, in place."""

    def reset(self) -> None:  # noqa: B027 — most remember nothing
        """Forget what has happened: the network starts anew. Arrays of `state` are put back without it."""

    @property
    def state(self) -> dict[str, wp.array]:
        """Arrays that the next frame depends on; they are part of the simulation's state and hash."""
        return {}

    def statistics(self) -> dict[str, float]:
        """Return what there is to tell of it."""
        return {}
