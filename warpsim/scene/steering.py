"""Steering: what the boids of a flock do besides its three rules."""

from typing import Annotated, Literal

from pydantic import Field

from warpsim.scene.base import Name, Number, Spec, Truth, Vec3, WholeNumber, one_of_types
from warpsim.scene.colliders import AnyCourse

Length = Annotated[Number, Field(ge=1e-6, le=1e9)]
Seconds = Annotated[Number, Field(ge=0.0, le=1e6)]
GOAL = "Where the goal is: three strengths (each a number, keyframes, a sine or an expression), or keyframes of all three [m]."


class Behavior(Spec):
    """Something that boids do: F = weight (desired velocity - v). A subclass registers itself by being defined in this file."""

    name: Name | None = Field(None, description="Name for `--set systems.FLOCK.steering.NAME.…`.")
    weight: Annotated[Number, Field(ge=0.0, le=1e9)] = Field(1.0, description="How strongly [kg/s].")
    speed: Annotated[Number, Field(ge=0.0, le=1e9)] | None = Field(
        None, description="The speed it wants; absent: the flock's greatest, else that at which it starts [m/s]."
    )


class Seek(Behavior):
    """Toward a goal, at full speed."""

    type: Literal["seek"] = Field("seek", description="Kind of behavior.")
    target: AnyCourse = Field(description=GOAL)
    radius: Length | None = Field(None, description="Within which the goal is noticed; absent: from anywhere [m].")


class Flee(Behavior):
    """Away from a goal, at full speed."""

    type: Literal["flee"] = Field("flee", description="Kind of behavior.")
    target: AnyCourse = Field(description=GOAL)
    radius: Length | None = Field(None, description="Within which it frightens; absent: from anywhere [m].")


class Arrive(Behavior):
    """Toward a goal, slower and slower within a radius of it, to rest there."""

    type: Literal["arrive"] = Field("arrive", description="Kind of behavior.")
    target: AnyCourse = Field(description=GOAL)
    radius: Length = Field(1.0, description="Within which it slows down [m].")


class Pursue(Behavior):
    """Toward where a moving goal will be when it is reached."""

    type: Literal["pursue"] = Field("pursue", description="Kind of behavior.")
    target: AnyCourse = Field(description=GOAL)
    horizon: Seconds = Field(2.0, description="How far ahead its way is guessed, at most [s].")


class Evade(Behavior):
    """Away from where a moving goal will be."""

    type: Literal["evade"] = Field("evade", description="Kind of behavior.")
    target: AnyCourse = Field(description=GOAL)
    radius: Length | None = Field(None, description="Within which it frightens; absent: from anywhere [m].")
    horizon: Seconds = Field(2.0, description="How far ahead its way is guessed, at most [s].")


class Wander(Behavior):
    """At random, but smoothly: toward a place that roams a sphere ahead."""

    type: Literal["wander"] = Field("wander", description="Kind of behavior.")
    radius: Length = Field(1.0, description="Radius of the sphere [m].")
    distance: Length = Field(1.5, description="How far ahead its center is [m].")
    period: Annotated[Number, Field(gt=0.0, le=1e6)] = Field(1.0, description="Time between one random place and the next [s].")


class FollowPath(Behavior):
    """Along a path, and back to it for who strays."""

    type: Literal["path"] = Field("path", description="Kind of behavior.")
    points: tuple[Vec3, ...] = Field(min_length=2, max_length=1024, description="Corners of the path [m].")
    closed: Truth = Field(False, description="Whether it leads from the last point back to the first.")
    radius: Length = Field(0.5, description="How far from it is near enough [m].")
    horizon: Seconds = Field(0.5, description="How far ahead the boid looks [s].")


class FollowLeader(Behavior):
    """Behind a leader, one of the flock or a moving goal; who is in its way makes room."""

    type: Literal["leader"] = Field("leader", description="Kind of behavior.")
    boid: Annotated[WholeNumber, Field(ge=0)] | None = Field(None, description="Number of the boid that leads; absent: the target [1].")
    target: AnyCourse | None = Field(None, description="Instead of a boid: where the leader is [m].")
    distance: Length = Field(1.0, description="How far behind it [m].")
    radius: Length = Field(1.0, description="Within which of that place they slow down [m].")


class Avoid(Behavior):
    """Past colliders that would be in the way."""

    type: Literal["avoid"] = Field("avoid", description="Kind of behavior.")
    radius: Length = Field(0.5, description="How far from colliders it keeps [m].")
    horizon: Seconds = Field(1.0, description="How far ahead it looks [s].")


class Contain(Behavior):
    """Away from the walls of the domain, before they throw it back."""

    type: Literal["contain"] = Field("contain", description="Kind of behavior.")
    radius: Length = Field(1.0, description="From how far off walls turn it away [m].")
    horizon: Seconds = Field(0.5, description="How far ahead it looks [s].")


BehaviorUnion = one_of_types(Behavior)
