"""Oracles of networks and flocks: where a point is, in what time it swings, how far all of it reaches, and what is like what."""

from typing import Annotated, Literal

from pydantic import Field, model_validator

from warpsim.scene.base import Direction, Mistake, Name, Vec3, WholeNumber, mistakes
from warpsim.scene.flocks import Flock
from warpsim.scene.nearest import listed, nearest
from warpsim.scene.oracles import AT, Bounded, FrameTime, Oracle, Spec
from warpsim.scene.oracles_of_motion import Expected3
from warpsim.scene.springs import Network
from warpsim.scene.strengths import Strength

LASTING = (Network, Flock)  # their points keep their numbers
FROM = "Beginning of what is looked at [s]."


def network_misfits(key: str, name: str, scene) -> list[Mistake]:
    """Return the mistake if the scene has no network or flock of that name."""
    if isinstance(scene.systems.get(name), LASTING):
        return []
    names = [name for name, spec in scene.systems.items() if isinstance(spec, LASTING)]
    words = f'there is no network or flock "{name}" (there are: {listed(names) or "none"})'
    return [Mistake((key,), words, ("systems",), nearest(name, names))]


class OfNetwork(Bounded):
    """A network, or a flock."""

    system: Name = Field(description="The network or flock.")

    def misfits(self, scene) -> list[Mistake]:
        return network_misfits("system", self.system, scene)


class OfPoint(OfNetwork):
    """A point of a network, or a boid."""

    point: Annotated[WholeNumber, Field(ge=0)] = Field(description="Number of the point or boid, from 0 [1].")

    def misfits(self, scene) -> list[Mistake]:
        if found := super().misfits(scene):
            return found
        count = scene.systems[self.system].point_count
        if count is not None and self.point >= count:
            return [Mistake(("point",), f"there is no point {self.point}: {self.system} has {count}, counted from 0", ("systems",))]
        return []


class Span(Spec):
    """A span of time."""

    from_: FrameTime = Field(0.0, alias="from", description=FROM)
    to: FrameTime = Field(description="End of what is looked at [s].")

    @model_validator(mode="after")
    def _is_a_span(self):
        if self.to <= self.from_:
            raise mistakes([Mistake(("to",), f"must come after from, {self.from_:g} s", ("from", "to"))])
        return self


class PlaceOracle(OfPoint, Oracle):
    """Where a point of a network, or a boid, is."""

    type: Literal["place"] = Field("place", description="Kind of oracle.")
    at: FrameTime = Field(description=AT)
    expect: Expected3 = Field(description="The place [m].")


class PeriodOracle(OfPoint, Span, Oracle):
    """The mean time of a whole swing of a point along a direction, from the first rise through the middle to the last."""

    type: Literal["period"] = Field("period", description="Kind of oracle.")
    direction: Vec3 = Field(description="Along what the swing is measured, of any length [1].")
    to: FrameTime = Field(description="End of what is looked at; long enough for two swings [s].")
    expect: Strength = Field(description="The period [s].")


class AmplitudeOracle(OfPoint, Span, Oracle):
    """How far a point swings along a direction to either side: half of what lies between its extremes in the frames of a span."""

    type: Literal["amplitude"] = Field("amplitude", description="Kind of oracle.")
    direction: Direction = Field(description="Along what the swing is measured, of any length [1].")
    expect: Strength = Field(description="The amplitude [m].")


class ReachOracle(OfNetwork, Oracle):
    """How far a network or flock reaches along a direction n: the largest x·n of its points. Downward: minus the lowest height."""

    type: Literal["reach"] = Field("reach", description="Kind of oracle.")
    direction: Direction = Field(description="n, of any length [1].")
    at: FrameTime = Field(description=AT)
    expect: Strength = Field(description="The largest x·n [m].")


class RmsSpeedOracle(OfNetwork, Span, Oracle):
    """How lively a network is: the root of the mean square of its points' speeds over a span of frames. At rest it is zero."""

    type: Literal["rms_speed"] = Field("rms_speed", description="Kind of oracle.")
    expect: Strength = Field(description="The speed [m/s].")


class AgreementOracle(OfNetwork, Oracle):
    """How far two networks of one layout are apart, but for an offset: the largest distance of points with the same number."""

    type: Literal["agreement"] = Field("agreement", description="Kind of oracle.")
    with_: Name = Field(alias="with", description="The other network.")
    offset: Vec3 = Field((0.0, 0.0, 0.0), description="From a point of the network to the same point of the other, if they agree [m].")
    at: FrameTime = Field(description=AT)
    expect: Strength = Field(0.0, description="The distance [m].")

    def misfits(self, scene) -> list[Mistake]:
        if found := super().misfits(scene) or network_misfits("with", self.with_, scene):
            return found
        here, there = (scene.systems[name].point_count for name in (self.system, self.with_))
        if None not in (here, there) and here != there:
            message = f"{self.with_} has {there} points, and {self.system} {here}: only networks of one layout can be compared"
            return [Mistake(("with",), message, ("systems",))]
        return []
