"""Oracles of the flow: probes of the whole field at a moment, without any particle."""

from typing import Annotated, Literal

from pydantic import Field

from warpsim.scene.base import LARGEST_COORDINATE, Direction, Number, Vec3, WholeNumber
from warpsim.scene.oracles import AT, POINT, Bounded, Oracle
from warpsim.scene.strengths import Moment, Strength

Length = Annotated[Number, Field(gt=0.0, le=LARGEST_COORDINATE)]
_SPACING = "Distance of the points that the derivative is taken from [m]."


class VelocityOracle(Bounded, Oracle):
    """The flow's velocity at a point."""

    type: Literal["velocity"] = Field("velocity", description="Kind of oracle.")
    point: Vec3 = Field(description=POINT)
    at: Moment = Field(0.0, description=AT)
    expect: tuple[Strength, Strength, Strength] = Field(description="The velocity [m/s].")


class CurlOracle(Bounded, Oracle):
    """The flow's curl at a point: twice the angular velocity of a small vane there."""

    type: Literal["curl"] = Field("curl", description="Kind of oracle.")
    point: Vec3 = Field(description=POINT)
    at: Moment = Field(0.0, description=AT)
    spacing: Length = Field(0.015625, description=_SPACING)
    expect: tuple[Strength, Strength, Strength] = Field(description="The curl [1/s].")


class DivergenceOracle(Bounded, Oracle):
    """The flow's divergence at a point: 0 away from sources."""

    type: Literal["divergence"] = Field("divergence", description="Kind of oracle.")
    point: Vec3 = Field(description=POINT)
    at: Moment = Field(0.0, description=AT)
    spacing: Length = Field(0.015625, description=_SPACING)
    expect: Strength = Field(0.0, description="The divergence [1/s].")


class CirculationOracle(Bounded, Oracle):
    """The circulation round a circle, the integral of v ds counterclockwise about the axis: the strength of the vortices in it."""

    type: Literal["circulation"] = Field("circulation", description="Kind of oracle.")
    center: Vec3 = Field((0.0, 0.0, 0.0), description="Center of the circle [m].")
    axis: Direction = Field((0.0, 1.0, 0.0), description="Axis of the circle, of any length [1].")
    radius: Length = Field(description="Radius of the circle [m].")
    at: Moment = Field(0.0, description=AT)
    expect: Strength = Field(description="The circulation [m^2/s].")


class FluxOracle(Bounded, Oracle):
    """The flux out of a cylinder of unit length round an axis, or without an axis out of a sphere: the strength of the sources in it."""

    type: Literal["flux"] = Field("flux", description="Kind of oracle.")
    center: Vec3 = Field((0.0, 0.0, 0.0), description="Center of the cylinder or the sphere [m].")
    axis: Direction | None = Field(None, description="Axis of a cylinder of unit length, of any length; absent: a sphere [1].")
    radius: Length = Field(description="Radius [m].")
    at: Moment = Field(0.0, description=AT)
    expect: Strength = Field(description="The flux, m^2/s with an axis, m^3/s without [m^2/s or m^3/s].")


class DischargeOracle(Bounded, Oracle):
    """The discharge through a disc, the integral of v dA along its axis."""

    type: Literal["discharge"] = Field("discharge", description="Kind of oracle.")
    center: Vec3 = Field((0.0, 0.0, 0.0), description="Center of the disc [m].")
    axis: Direction = Field((0.0, 1.0, 0.0), description="Normal of the disc, of any length [1].")
    radius: Length = Field(description="Radius of the disc [m].")
    at: Moment = Field(0.0, description=AT)
    expect: Strength = Field(description="The discharge [m^3/s].")


class PressureForceOracle(Bounded, Oracle):
    """The force of the pressure on a cylinder in a steady flow, per length of it: for a turning one in a stream, density U circulation."""

    type: Literal["pressure_force"] = Field("pressure_force", description="Kind of oracle.")
    center: Vec3 = Field((0.0, 0.0, 0.0), description="Center of the circle that is its surface [m].")
    axis: Direction = Field((0.0, 1.0, 0.0), description="Axis of the cylinder, of any length [1].")
    radius: Length = Field(description="Radius of the cylinder [m].")
    density: Number = Field(gt=0.0, le=1e12, description="Density of the fluid, 1.2 for air [kg/m^3].")
    at: Moment = Field(0.0, description=AT)
    expect: tuple[Strength, Strength, Strength] = Field(description="The force per length [N/m].")


class StreamlineOracle(Bounded, Oracle):
    """Where a streamline of the flow, frozen at a moment, ends: after a length, or where it first crosses a plane."""

    type: Literal["streamline"] = Field("streamline", description="Kind of oracle.")
    start: Vec3 = Field(description="Where the streamline begins [m].")
    length: Length = Field(description="How far it is followed, downstream [m].")
    steps: WholeNumber = Field(200, ge=1, le=100_000, description="Steps of the Runge-Kutta method along it [1].")
    plane: Vec3 | None = Field(None, description="A point of the plane that ends it; absent: it ends after its length [m].")
    normal: Direction = Field((1.0, 0.0, 0.0), description="Normal of that plane, of any length [1].")
    at: Moment = Field(0.0, description=AT)
    expect: tuple[Strength, Strength, Strength] = Field(description="Where it ends [m].")
