"""Flow primitives: velocity fields that superpose. Each states its strength; lines run along an axis without end."""

from typing import Annotated, ClassVar, Literal

from pydantic import Field, model_validator

from warpsim.scene.base import Direction, Mistake, Name, Number, Spec, Vec3, mistakes, one_of_types
from warpsim.scene.strengths import Strength


class FlowPrimitive(Spec):
    """A velocity field v(P, t). A subclass registers itself by being defined in this file."""

    name: Name | None = Field(None, description="Name for `feels` and `--set flow.NAME.…`.")

    strength_field: ClassVar[str]
    """Name of the field that is the strength (not `strength`: the doublet's own field is called that)."""


class Core(Spec):
    """How a vortex is regularized near its axis, r being the distance from it."""

    model: Literal["ideal", "rankine", "lamb_oseen", "scully"] = Field(
        "ideal",
        description="ideal: C/(2 pi r), singular on the axis; rankine: solid rotation inside the radius; lamb_oseen: C/(2 pi r)(1 - "
        "exp(-r^2/radius^2)); scully: C r/(2 pi (radius^2 + r^2)).",
    )
    radius: Annotated[Number, Field(gt=0.0, le=1e9)] | None = Field(
        None, description="Radius of the core; every model but ideal needs it [m]."
    )

    @model_validator(mode="after")
    def _radius_fits_model(self):
        if self.model == "ideal" and self.radius is not None:
            message = 'the core "ideal" has no radius (take model rankine, lamb_oseen or scully, or leave radius out)'
            raise mistakes([Mistake(("radius",), message, ("model",))])
        if self.model != "ideal" and self.radius is None:
            raise mistakes([Mistake((), f'the core "{self.model}" needs a radius [m]', ("model", "radius"))])
        return self


class Uniform(FlowPrimitive):
    """The same velocity everywhere: wind."""

    strength_field: ClassVar[str] = "velocity"
    type: Literal["uniform"] = Field("uniform", description="Kind of flow.")
    velocity: tuple[Strength, Strength, Strength] = Field(description="Velocity along x, y and z, each a strength [m/s].")


class Source(FlowPrimitive):
    """A line that emits (or, with a negative rate, swallows) fluid: v = rate/(2 pi r), away from the axis."""

    strength_field: ClassVar[str] = "rate"
    type: Literal["source"] = Field("source", description="Kind of flow.")
    center: Vec3 = Field((0.0, 0.0, 0.0), description="A point on the line [m].")
    axis: Direction = Field((0.0, 1.0, 0.0), description="Direction of the line, of any length [1].")
    rate: Strength = Field(description="Volume per second and meter of line; negative is a sink [m^2/s].")


class PointSource(FlowPrimitive):
    """A point that emits (or, with a negative rate, swallows) fluid: v = rate/(4 pi r^2), away from the center."""

    strength_field: ClassVar[str] = "rate"
    type: Literal["point_source"] = Field("point_source", description="Kind of flow.")
    center: Vec3 = Field((0.0, 0.0, 0.0), description="Where it is [m].")
    rate: Strength = Field(description="Volume per second; negative is a sink [m^3/s].")


class Vortex(FlowPrimitive):
    """A line round which the fluid circles: v = circulation/(2 pi r) outside the core, right-handed about the axis."""

    strength_field: ClassVar[str] = "circulation"
    type: Literal["vortex"] = Field("vortex", description="Kind of flow.")
    center: Vec3 = Field((0.0, 0.0, 0.0), description="A point on the line [m].")
    axis: Direction = Field((0.0, 1.0, 0.0), description="Direction of the line, of any length [1].")
    circulation: Strength = Field(description="Integral of v along a loop round the line [m^2/s].")
    core: Core = Field(Core(), description="How the center is regularized.")


class Doublet(FlowPrimitive):
    """A source and a sink at one line: in a uniform flow U along the direction, strength U R^2 makes a cylinder of radius R."""

    strength_field: ClassVar[str] = "strength"
    type: Literal["doublet"] = Field("doublet", description="Kind of flow.")
    center: Vec3 = Field((0.0, 0.0, 0.0), description="A point on the line [m].")
    axis: Direction = Field((0.0, 1.0, 0.0), description="Direction of the line, of any length [1].")
    direction: Direction = Field(
        (1.0, 0.0, 0.0), description="Upstream to downstream, across the axis; its part along the axis is dropped [1]."
    )
    strength: Strength = Field(description="Strength U R^2 [m^3/s].")

    @model_validator(mode="after")
    def _direction_crosses_axis(self):
        (ax, ay, az), (dx, dy, dz) = self.axis, self.direction
        cross = (ay * dz - az * dy, az * dx - ax * dz, ax * dy - ay * dx)
        square = sum(c * c for c in cross)
        if square <= 1e-12 * (ax * ax + ay * ay + az * az) * (dx * dx + dy * dy + dz * dz):
            raise mistakes([Mistake(("direction",), "is parallel to the axis; it must lie across it", ("axis", "direction"))])
        return self


class Rotation(FlowPrimitive):
    """Solid-body rotation: v = angular_velocity x r, right-handed about the axis."""

    strength_field: ClassVar[str] = "angular_velocity"
    type: Literal["rotation"] = Field("rotation", description="Kind of flow.")
    center: Vec3 = Field((0.0, 0.0, 0.0), description="A point on the axis [m].")
    axis: Direction = Field((0.0, 1.0, 0.0), description="Axis of the rotation, of any length [1].")
    angular_velocity: Strength = Field(description="Angle per second [rad/s].")


FlowUnion = one_of_types(FlowPrimitive)
