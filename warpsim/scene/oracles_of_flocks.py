"""Oracles of flocks: how ordered their courses are, and how two of them share a place."""

from typing import Annotated, ClassVar, Literal

from pydantic import Field

from warpsim.scene.base import Mistake, Name, Number, WholeNumber
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
        return [found for k, name in enumerate(self.systems) for found in _no_flock(("systems", k), name, scene)]


class PresenceOracle(Span, Bounded, Oracle):
    """How many of a flock are within a radius of those of another, over how many are within it of one of their own, itself left out."""

    type: Literal["presence"] = Field("presence", description="Kind of oracle.")
    system: Name = Field(description="The flock that is counted.")
    around: Name = Field(description="The flock about whose boids it is counted.")
    radius: Annotated[Number, Field(gt=0.0, le=1e9)] = Field(description="Within which [m].")
    every: Annotated[WholeNumber, Field(ge=1, le=1_000_000)] = Field(10, description="Frames from one count to the next [1].")
    expect: Strength = Field(description="The ratio of the means over frames and boids: 1 mixed evenly, 0 apart [1].")

    def misfits(self, scene) -> list[Mistake]:
        return [found for key in ("system", "around") for found in _no_flock((key,), getattr(self, key), scene)]


def _no_flock(path: tuple, name: str, scene) -> list[Mistake]:
    """Return the mistake if the scene has no flock of that name."""
    flocks = [known for known, spec in scene.systems.items() if isinstance(spec, Flock)]
    words = f'there is no flock "{name}" (flocks: {listed(flocks) or "none"})'
    return [] if name in flocks else [Mistake(path, words, ("systems",), nearest(name, flocks))]
