"""Emitters: where, how many, how fast and how long-lived particles are born."""

from collections.abc import Mapping
from typing import Annotated, Any, ClassVar, Literal

from pydantic import AfterValidator, BeforeValidator, Field, model_validator

from warpsim.scene.assets import asset_path
from warpsim.scene.base import (
    LARGEST_COORDINATE,
    Direction,
    Floor,
    Mistake,
    Name,
    Number,
    ShortSpec,
    Spec,
    Vec3,
    WholeNumber,
    form_by_key,
    mistakes,
    one_of_types,
)
from warpsim.scene.events import On
from warpsim.scene.look import Color, is_color
from warpsim.scene.strengths import STRENGTH_KEYS, Formula, Keyframes, PositiveStrength, Sine, Strength

Length = Annotated[Number, Field(gt=0.0, le=LARGEST_COORDINATE)]


class EmitterShape(Spec):
    """Where particles are born. A subclass registers itself by being defined in this file."""


class Point(EmitterShape):
    """All at one place."""

    type: Literal["point"] = Field("point", description="Kind of shape.")
    center: Vec3 = Field((0.0, 0.0, 0.0), description="The place [m].")


class Segment(EmitterShape):
    """Evenly along a straight line."""

    type: Literal["segment"] = Field("segment", description="Kind of shape.")
    start: Vec3 = Field(description="One end [m].")
    end: Vec3 = Field(description="The other end [m].")


class Disc(EmitterShape):
    """Evenly over a flat disc, or along its rim."""

    type: Literal["disc"] = Field("disc", description="Kind of shape.")
    center: Vec3 = Field((0.0, 0.0, 0.0), description="Its center [m].")
    normal: Direction = Field((0.0, 1.0, 0.0), description="Direction it faces, of any length [1].")
    radius: Length = Field(description="Its radius [m].")
    fill: Literal["volume", "surface"] = Field("volume", description="volume: over the disc; surface: along its rim.")


class Sphere(EmitterShape):
    """Evenly in a ball, or on its surface."""

    type: Literal["sphere"] = Field("sphere", description="Kind of shape.")
    center: Vec3 = Field((0.0, 0.0, 0.0), description="Its center [m].")
    radius: Length = Field(description="Its radius [m].")
    fill: Literal["volume", "surface"] = Field("volume", description="volume: in the ball; surface: on it.")


class Box(EmitterShape):
    """Evenly in a box along the axes, or on its surface."""

    type: Literal["box"] = Field("box", description="Kind of shape.")
    center: Vec3 = Field((0.0, 0.0, 0.0), description="Its center [m].")
    size: tuple[Length, Length, Length] = Field(description="Full size along x, y and z [m].")
    fill: Literal["volume", "surface"] = Field("volume", description="volume: in the box; surface: on it.")


class Mesh(EmitterShape):
    """Evenly over the surface of a mesh, whatever the sizes of its triangles, or in what it encloses (if it is closed)."""

    type: Literal["mesh"] = Field("mesh", description="Kind of shape.")
    file: asset_path(".obj", ".stl", ".ply", ".glb") = Field(description="OBJ, STL, PLY or GLB file, from the scene's folder.")
    center: Vec3 = Field((0.0, 0.0, 0.0), description="Where the file's origin is [m].")
    scale: Length = Field(1.0, description="Meters per unit of the file [1].")
    rotation: Vec3 = Field((0.0, 0.0, 0.0), description="Rotation about x, then y, then z, after scaling [degrees].")
    fill: Literal["volume", "surface"] = Field("volume", description="volume: in it; surface: on it.")


ShapeUnion = one_of_types(EmitterShape)


class Distribution(ShortSpec):
    """An initial value drawn anew for each particle. A bare number means that number for every particle."""

    shorthand: ClassVar[str] = "mean"
    mean: Annotated[Number, Field(ge=-LARGEST_COORDINATE, le=LARGEST_COORDINATE)] = Field(description="Mean value.")
    spread: Number = Field(
        0.0, ge=0.0, le=LARGEST_COORDINATE, description="uniform: mean - spread to mean + spread; normal: standard deviation."
    )
    law: Literal["uniform", "normal"] = Field("uniform", description="Law it is drawn from.")


def _positive(value: Distribution) -> Distribution:
    if value.mean <= 0.0:
        raise mistakes([Mistake(("mean",), f"must be greater than 0, got {value.mean:g}")])
    return value


def _positive_throughout(value: Distribution) -> Distribution:
    _positive(value)
    if value.law == "uniform" and value.spread >= value.mean:
        raise mistakes([Mistake(("spread",), f"must be less than the mean {value.mean:g}, so that every value is greater than 0")])
    return value


PositiveMean = Annotated[Distribution, Floor(gt=0.0), AfterValidator(_positive)]
PositiveDistribution = Annotated[Distribution, Floor(gt=0.0), AfterValidator(_positive_throughout)]


class Rate(ShortSpec):
    """Births per second. Once per interval a random z is drawn and (mean + z spread) interval particles are born, evenly spread in time."""

    shorthand: ClassVar[str] = "mean"
    mean: PositiveStrength = Field(description="Mean births per second; below zero counts as zero [1/s].")
    spread: PositiveStrength = Field(0.0, description="How far births per second stray from the mean [1/s].")
    law: Literal["uniform", "scaled_uniform", "normal", "poisson"] = Field(
        "uniform",
        description="Law of z: uniform in [-1, 1] (the spread is the largest deviation); scaled_uniform and normal (the spread is the "
        "standard deviation); poisson ignores the spread.",
    )
    interval: Annotated[Number, Field(ge=1e-5, le=1e6)] | None = Field(
        None, description="Time for which one z holds; default one frame [s]."
    )

    @classmethod
    def is_short(cls, value: Any) -> bool:
        """A bare strength is the mean: a number, keyframes, a sine or an expression."""
        if isinstance(value, Mapping):
            return form_by_key(value, (*cls.model_fields, *STRENGTH_KEYS)) in STRENGTH_KEYS
        return isinstance(value, (Keyframes, Sine, Formula)) or super().is_short(value)


class Burst(Spec):
    """Many births at one moment."""

    count: WholeNumber = Field(ge=1, le=2**27, description="How many are born [1].")
    at: Number = Field(0.0, ge=-1e7, le=1e7, description="When; before 0 it takes prewarm [s].")


class Velocity(Spec):
    """Velocity at birth: a speed along a random direction in a cone, uniform per solid angle."""

    direction: Direction = Field((0.0, 1.0, 0.0), description="Middle of the cone, of any length [1].")
    cone: Number = Field(0.0, ge=0.0, le=180.0, description="Half-angle of the cone; 180 is every direction [degrees].")
    speed: Distribution = Field(description="Speed along that direction [m/s].")


def _as_list(value: Any) -> Any:
    return [value] if isinstance(value, (Mapping, Burst)) else value


def _as_colors(value: Any) -> Any:
    return [value] if is_color(value) else value


class Emitter(Spec):
    """One place where particles are born: by a rate, in bursts, or at each event of another system."""

    name: Name | None = Field(None, description="Name for `--set systems.SYSTEM.emitters.NAME.…`.")
    shape: ShapeUnion = Field(Point(), description="Where particles are born.")
    rate: Rate | None = Field(None, description="Births per second, a strength or {mean, spread, law, interval} [1/s].")
    burst: Annotated[tuple[Burst, ...], Field(max_length=10_000), BeforeValidator(_as_list)] = Field(
        (), description="Births at one moment: {count, at} or a list of them; with `on`, {count} at each event."
    )
    on: On | None = Field(
        None, description="Gives birth at each event of another system instead; shape and center are then relative to its place."
    )
    travel: tuple[Strength, Strength, Strength] | None = Field(
        None,
        description="How far the whole of it is from where it is written, along x, y and z, each a strength, at the moment of each birth; "
        "the particles do not take on its velocity; absent: it stays [m].",
    )
    velocity: Velocity | None = Field(None, description="Velocity at birth; absent: at rest.")
    lifetime: PositiveMean = Field(Distribution(mean=5.0), description="Time from birth to death; drawn values are clipped to above 0 [s].")
    mass: PositiveDistribution = Field(Distribution(mean=1e-3), description="Mass [kg].")
    radius: PositiveDistribution = Field(Distribution(mean=1e-3), description="Radius, for drag by viscosity [m].")
    color: Annotated[tuple[Color, ...], Field(max_length=256), BeforeValidator(_as_colors)] = Field(
        (), description="Color of its own, multiplied with the look's: one color, or a list from which each particle gets one [1]."
    )
    start: Annotated[Number, Field(ge=-1e7, le=1e7)] | None = Field(
        None, description="When the rate starts; absent: from the beginning [s]."
    )
    stop: Annotated[Number, Field(ge=-1e7, le=1e7)] | None = Field(None, description="When the rate stops; absent: never [s].")

    @model_validator(mode="after")
    def _emits(self):
        if self.on is not None:
            found = self._listens()
            if found:
                raise mistakes(found)
        elif self.rate is None and not self.burst:
            raise mistakes([Mistake((), "an emitter needs a rate or a burst, else nothing is ever born", ("rate", "burst"))])
        if self.start is not None and self.stop is not None and self.stop <= self.start:
            raise mistakes([Mistake(("stop",), f"must come after start, {self.start:g} s", ("start", "stop"))])
        return self

    def _listens(self) -> list[Mistake]:
        """Return a mistake for each key that does not go with `on`."""
        found = []
        for key in ("rate", "start", "stop"):
            if getattr(self, key) is not None:
                found.append(Mistake((key,), f"the events say when: an emitter that listens has no {key} (leave out {key} or on)", ("on",)))
        if self.travel is not None:
            found.append(
                Mistake(("travel",), "the events say where: an emitter that listens does not travel (leave out travel or on)", ("on",))
            )
        if not self.burst:
            found.append(Mistake((), "burst: {count: …} is missing: how many are born at each event", ("burst", "on")))
        elif len(self.burst) > 1:
            found.append(Mistake(("burst",), "an emitter that listens to events has one burst, {count: …} at each event", ("on",)))
        elif self.burst[0].at != 0.0:  # written out in full, it is 0
            found.append(Mistake(("burst", "at"), "the events say when: leave out at", ("on",)))
        return found
