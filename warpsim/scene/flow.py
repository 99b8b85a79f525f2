"""Flow primitives: velocity fields that superpose. Each states its strength; lines run along an axis without end."""

import math
from typing import Annotated, Any, ClassVar, Literal

from pydantic import AfterValidator, BeforeValidator, Field, WithJsonSchema, model_validator

from warpsim.scene.assets import asset_path
from warpsim.scene.base import (
    LARGEST_COORDINATE,
    Direction,
    Mistake,
    Name,
    Number,
    Spec,
    Vec3,
    WholeNumber,
    is_number,
    mistakes,
    one_of_types,
)
from warpsim.scene.expressions import PLACE, compile_expression
from warpsim.scene.strengths import PositiveStrength, Strength, parsed

Travel = tuple[Strength, Strength, Strength]


def travel_field() -> Any:
    """Make the field by which a primitive that has a place moves."""
    return Field((0.0, 0.0, 0.0), description="How far the whole of it is from where it is written, along x, y and z, each a strength [m].")


class FlowPrimitive(Spec):
    """A velocity field v(P, t). A subclass registers itself by being defined in this file."""

    name: Name | None = Field(None, description="Name for `feels` and `--set flow.NAME.…`.")

    strength_field: ClassVar[str | None]
    """Name of the field that is the strength (not `strength`: the doublet's own field is called that); None where formulas say it all."""


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
    travel: Travel = travel_field()


class PointSource(FlowPrimitive):
    """A point that emits (or, with a negative rate, swallows) fluid: v = rate/(4 pi r^2), away from the center."""

    strength_field: ClassVar[str] = "rate"
    type: Literal["point_source"] = Field("point_source", description="Kind of flow.")
    center: Vec3 = Field((0.0, 0.0, 0.0), description="Where it is [m].")
    rate: Strength = Field(description="Volume per second; negative is a sink [m^3/s].")
    travel: Travel = travel_field()


class Vortex(FlowPrimitive):
    """A line round which the fluid circles: v = circulation/(2 pi r) outside the core, right-handed about the axis."""

    strength_field: ClassVar[str] = "circulation"
    type: Literal["vortex"] = Field("vortex", description="Kind of flow.")
    center: Vec3 = Field((0.0, 0.0, 0.0), description="A point on the line [m].")
    axis: Direction = Field((0.0, 1.0, 0.0), description="Direction of the line, of any length [1].")
    circulation: Strength = Field(description="Integral of v along a loop round the line [m^2/s].")
    core: Core = Field(Core(), description="How the center is regularized.")
    travel: Travel = travel_field()


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
    travel: Travel = travel_field()

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
    travel: Travel = travel_field()


class VortexSegment(FlowPrimitive):
    """A straight vortex line of finite length, by Biot and Savart's law: several make a polygon; a long one is like `vortex`."""

    strength_field: ClassVar[str] = "circulation"
    type: Literal["vortex_segment"] = Field("vortex_segment", description="Kind of flow.")
    start: Vec3 = Field(description="One end [m].")
    end: Vec3 = Field(description="The other end; the fluid circles right-handed about the way from start to end [m].")
    circulation: Strength = Field(description="Integral of v along a loop close round the segment [m^2/s].")
    core: Core = Field(Core(), description="How the line is regularized; r is the distance from the segment.")
    travel: Travel = travel_field()

    @model_validator(mode="after")
    def _has_a_length(self):
        length = math.dist(self.start, self.end)
        if length <= 1e-6 * max(1.0, *map(abs, self.start), *map(abs, self.end)):
            message = f"a segment needs a length: its start and end are {length:g} m apart (move one of them)"
            raise mistakes([Mistake(("end",), message, ("start", "end"))])
        return self


class VortexRing(FlowPrimitive):
    """A circular vortex line, by Biot and Savart's law: on its axis v = circulation radius^2/(2 (radius^2 + z^2)^(3/2))."""

    strength_field: ClassVar[str] = "circulation"
    type: Literal["vortex_ring"] = Field("vortex_ring", description="Kind of flow.")
    center: Vec3 = Field((0.0, 0.0, 0.0), description="Center of the circle [m].")
    normal: Direction = Field((0.0, 1.0, 0.0), description="Where the fluid goes inside the ring, of any length [1].")
    radius: PositiveStrength = Field(description="Radius of the circle; a strength, so that a ring may widen and shrink [m].")
    circulation: Strength = Field(description="Integral of v along a loop through the ring [m^2/s].")
    core: Core = Field(Core(), description="How the line is regularized; r is the distance from the circle.")
    travel: Travel = travel_field()

    @model_validator(mode="after")
    def _has_a_size(self):
        if is_number(self.radius) and self.radius < 1e-6:
            raise mistakes([Mistake(("radius",), f"must be at least 1e-06 m, got {self.radius:g}", ("radius",))])
        return self


class CurlNoise(FlowPrimitive):
    """Turbulence: a random velocity without divergence, smooth in place and time, the curl of a vector potential."""

    strength_field: ClassVar[str] = "amplitude"
    type: Literal["curl_noise"] = Field("curl_noise", description="Kind of flow.")
    amplitude: Strength = Field(description="Root mean square of the speed, over place and time, of all octaves together [m/s].")
    length: Number = Field(ge=1e-3, le=1e9, description="Size of the largest eddies: edge of the lattice's cells [m].")
    frequency: Number = Field(
        0.0, ge=0.0, le=1e3, description="How often the largest eddies come and go; 0 is a noise that stands still [1/s]."
    )
    octaves: WholeNumber = Field(
        1,
        ge=1,
        le=8,
        description="How many sizes of eddies: each half as long as the one before, with 2^(-1/3) of its speed and 2^(2/3) of its "
        "frequency, as in Kolmogorov's turbulence [1].",
    )
    seed: WholeNumber = Field(0, ge=0, le=2**32 - 1, description="Which noise of all: equal seeds give equal noises [1].")
    travel: Travel = travel_field()


Edge = Annotated[Number, Field(ge=1e-6, le=LARGEST_COORDINATE)]


class Grid(FlowPrimitive):
    """Velocities from a file, measured or computed elsewhere: given at the nodes of a box, and trilinear between them."""

    strength_field: ClassVar[str] = "scale"
    type: Literal["grid"] = Field("grid", description="Kind of flow.")
    file: asset_path(".npz", ".nvdb") = Field(
        description="npz: an array of shape (nx, ny, nz, 3), x first, of velocities in m/s; nvdb: a grid of type Vec3f, likewise."
    )
    array: str = Field("velocity", min_length=1, max_length=200, description="Name of the array in an npz file.")
    center: Vec3 | None = Field(None, description="Middle of the box; absent: the origin, or where an nvdb file has it [m].")
    size: tuple[Edge, Edge, Edge] | None = Field(
        None,
        description="Edges of the box, from the first node to the last (how thick it is, where there is one node only); absent: as an nvdb "
        "file has it, while an npz file needs it [m].",
    )
    outside: Literal["zero", "clamp"] = Field(
        "zero", description="Outside the box: zero: still; clamp: as at the nearest point of the box."
    )
    scale: Strength = Field(1.0, description="What the file's velocities are multiplied by [1].")
    travel: Travel = travel_field()

    @model_validator(mode="after")
    def _box_is_known(self):
        if self.size is None and self.file.lower().endswith(".npz"):
            raise mistakes([Mistake((), "an npz file does not say how large the grid is: give its size [m]", ("file", "size"))])
        return self


def _as_text(value: Any) -> Any:
    return f"{value:.17g}" if is_number(value) else value


def _of_place(text: str) -> str:
    return parsed(text, PLACE)


PlaceFormula = Annotated[
    str,
    Field(min_length=1, max_length=2000),
    BeforeValidator(_as_text),  # 0 is a formula, too
    AfterValidator(_of_place),
    WithJsonSchema({"anyOf": [{"type": "string", "minLength": 1, "maxLength": 2000}, {"type": "number"}]}),
]


class Expression(FlowPrimitive):
    """Any velocity that three formulas of the place x, y, z in meters and the time t in seconds can say: `velocity: ["-y", "x", "0"]`."""

    strength_field: ClassVar[None] = None
    type: Literal["expression"] = Field("expression", description="Kind of flow.")
    velocity: tuple[PlaceFormula, PlaceFormula, PlaceFormula] = Field(
        description="Velocity along x, y and z, each a formula of x, y, z and t, worked out in 64 bits; where it is not finite, "
        "`limits.unstable` says what happens [m/s]."
    )
    travel: Travel = Field((0.0, 0.0, 0.0), description="Where x, y and z are measured from, each a strength [m].")

    @property
    def programs(self) -> tuple[tuple[tuple[str, float], ...], ...]:
        """The three formulas as postfix instructions (operation name, operand)."""
        return tuple(compile_expression(text, PLACE) for text in self.velocity)


FlowUnion = one_of_types(FlowPrimitive)
