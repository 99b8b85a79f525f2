"""Oracles of networks: where a point of springs or cloth is, and in what time it swings."""

from typing import Annotated, Literal

from pydantic import Field, model_validator

from warpsim.scene.base import Mistake, Name, Vec3, WholeNumber, mistakes
from warpsim.scene.nearest import listed, nearest
from warpsim.scene.oracles import AT, Bounded, FrameTime, Oracle
from warpsim.scene.oracles_of_motion import Expected3
from warpsim.scene.springs import Network
from warpsim.scene.strengths import Strength


class OfNetwork(Bounded):
    """A point of a network."""

    system: Name = Field(description="The network.")
    point: Annotated[WholeNumber, Field(ge=0)] = Field(description="Number of the point, from 0 [1].")

    def misfits(self, scene) -> list[Mistake]:
        spec = scene.systems.get(self.system)
        if not isinstance(spec, Network):
            names = [name for name, spec in scene.systems.items() if isinstance(spec, Network)]
            message = f'there is no network "{self.system}" (networks: {listed(names) or "none"})'
            return [Mistake(("system",), message, ("systems",), nearest(self.system, names))]
        count = spec.point_count
        if count is not None and self.point >= count:
            return [Mistake(("point",), f"there is no point {self.point}: {self.system} has {count}, counted from 0", ("systems",))]
        return []


class PlaceOracle(OfNetwork, Oracle):
    """Where a point of a network is."""

    type: Literal["place"] = Field("place", description="Kind of oracle.")
    at: FrameTime = Field(description=AT)
    expect: Expected3 = Field(description="The place [m].")


class PeriodOracle(OfNetwork, Oracle):
    """The mean time of a whole swing of a point along a direction, from the first rise through the middle to the last."""

    type: Literal["period"] = Field("period", description="Kind of oracle.")
    direction: Vec3 = Field(description="Along what the swing is measured, of any length [1].")
    from_: FrameTime = Field(0.0, alias="from", description="Beginning of what is looked at [s].")
    to: FrameTime = Field(description="End of what is looked at; long enough for two swings [s].")
    expect: Strength = Field(description="The period [s].")

    @model_validator(mode="after")
    def _is_a_span(self):
        if self.to <= self.from_:
            raise mistakes([Mistake(("to",), f"must come after from, {self.from_:g} s", ("from", "to"))])
        return self
