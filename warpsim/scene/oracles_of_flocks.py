"""Oracles of flocks: how ordered their courses are."""

from typing import Annotated, ClassVar, Literal

from pydantic import Field

from warpsim.scene.base import Mistake, Name
from warpsim.scene.flocks import Flock
from warpsim.scene.nearest import listed, nearest
from warpsim.scene.oracles import Bounded, Oracle
from warpsim.scene.oracles_of_networks import Span
from warpsim.scene.strengths import Strength


class OrderOracle(Span, Bounded, Oracle):
    """The order phi = |sum v/|v||/N of flocks that differ by chance alone: its mean over a span of frames and over the flocks."""

    statistical: ClassVar[bool] = True
    type: Literal["order"] = Field("order", description="Kind of oracle.")
    systems: Annotated[tuple[Name, ...], Field(min_length=1, max_length=64)] = Field(description="The flocks.")
    expect: Strength = Field(description="The mean order [1].")

    def misfits(self, scene) -> list[Mistake]:
        flocks = [name for name, spec in scene.systems.items() if isinstance(spec, Flock)]
        return [
            Mistake(("systems", k), f'there is no flock "{name}" (flocks: {listed(flocks) or "none"})', ("systems",), nearest(name, flocks))
            for k, name in enumerate(self.systems)
            if name not in flocks
        ]
