"""Colliders: solid shapes, or containers, that particles bounce off, slide on, stick to or die at."""

from typing import Annotated, Any, Literal

from pydantic import Field, field_validator, model_validator

from warpsim.scene.assets import asset_path
from warpsim.scene.base import Direction, Mistake, Name, Number, Spec, Vec3, form_by_key, mistakes, one_of_forms, one_of_types
from warpsim.scene.strengths import Moment, Strength, rising

Size = Annotated[Number, Field(gt=0.0, le=1e6)]
Side = Literal["outside", "inside"]


class Course(Spec):
    """Places (or angles) at given times: straight between them, held before the first and after the last."""

    keyframes: tuple[tuple[Moment, Vec3], ...] = Field(
        min_length=1, max_length=10_000, description="Pairs of time in seconds and three numbers, times strictly rising."
    )

    @field_validator("keyframes")
    @classmethod
    def _times_rise(cls, value):
        return rising(value)


def _course_form(value: Any) -> str | None:
    return "components" if isinstance(value, (list, tuple)) else form_by_key(value, ("keyframes",))


AnyCourse = one_of_forms({"components": tuple[Strength, Strength, Strength], "keyframes": Course}, _course_form)


class Motion(Spec):
    """Where a collider is in time: three strengths (each a number, keyframes, a sine or an expression), or keyframes of all three."""

    center: AnyCourse | None = Field(None, description="Its center in time, in place of the one at rest; of a capsule, its middle [m].")
    rotation: AnyCourse | None = Field(None, description="Its angles about x, y and z in time, in place of its rotation [degrees].")

    @model_validator(mode="after")
    def _something_moves(self):
        if self.center is None and self.rotation is None:
            raise mistakes([Mistake((), "says nothing: give center, rotation or both (or leave motion out)", ("center", "rotation"))])
        return self


class Collider(Spec):
    """Something in the way of particles. A subclass registers itself by being defined in this file."""

    name: Name | None = Field(None, description="Name for `feels` and `--set colliders.NAME.…`.")
    action: Literal["bounce", "kill", "stick"] = Field(
        "bounce",
        description="What becomes of who touches it: bounce (and slide); kill: dies there; stick: stays on it, also when it moves.",
    )
    restitution: Number = Field(
        0.5, ge=0.0, le=1.0, description="Share of the normal speed that a bounce gives back: 0 none, 1 all of it, without loss [1]."
    )
    friction: Number = Field(
        0.3, ge=0.0, le=1e6, description="Coulomb coefficient: on a slope steeper than atan(friction) particles slide [1]."
    )
    rotation: Vec3 = Field((0.0, 0.0, 0.0), description="Angles about x, y and z, turned about in that order, round its center [degrees].")
    motion: Motion | None = Field(None, description="How it moves; absent: it stands still.")


class Plane(Collider):
    """A plane without end; what is behind it is solid."""

    type: Literal["plane"] = Field("plane", description="Kind of collider.")
    center: Vec3 = Field((0.0, 0.0, 0.0), description="A point on it [m].")
    normal: Direction = Field((0.0, 1.0, 0.0), description="Toward the free side, of any length [1].")


class Sphere(Collider):
    """A ball, or a hollow one that keeps particles inside."""

    type: Literal["sphere"] = Field("sphere", description="Kind of collider.")
    center: Vec3 = Field((0.0, 0.0, 0.0), description="Its center [m].")
    radius: Size = Field(description="Its radius [m].")
    side: Side = Field("outside", description="Where particles are: outside, or inside it as in a container.")


class Box(Collider):
    """A box, or a room that keeps particles inside."""

    type: Literal["box"] = Field("box", description="Kind of collider.")
    center: Vec3 = Field((0.0, 0.0, 0.0), description="Its center [m].")
    size: tuple[Size, Size, Size] = Field(description="Its edges along x, y and z before it is rotated [m].")
    side: Side = Field("outside", description="Where particles are: outside, or inside it as in a container.")


class Capsule(Collider):
    """All points within a radius of a segment: a rod with round ends, or a tube that keeps particles inside."""

    type: Literal["capsule"] = Field("capsule", description="Kind of collider.")
    start: Vec3 = Field(description="One end of its segment [m].")
    end: Vec3 = Field(description="Its other end [m].")
    radius: Size = Field(description="Its radius [m].")
    side: Side = Field("outside", description="Where particles are: outside, or inside it as in a container.")

    @property
    def center(self) -> tuple[float, float, float]:
        """Its middle, about which it turns [m]."""
        return tuple(0.5 * (a + b) for a, b in zip(self.start, self.end, strict=True))


class Mesh(Collider):
    """A closed surface of triangles from a file (OBJ, STL, PLY, GLB), or with a thickness an open sheet."""

    type: Literal["mesh"] = Field("mesh", description="Kind of collider.")
    file: asset_path(".obj", ".stl", ".ply", ".glb") = Field(description="The file, beside the scene or in a folder below it.")
    center: Vec3 = Field((0.0, 0.0, 0.0), description="Where the origin of the file's coordinates is [m].")
    scale: Size = Field(1.0, description="Factor from the file's coordinates to meters [1].")
    thickness: Size | None = Field(
        None, description="Makes it a sheet with two sides: particles stop half of it before the triangles. An open surface needs one [m]."
    )
    side: Side = Field("outside", description="Where particles are: outside of a closed surface, or inside it as in a container.")


ColliderUnion = one_of_types(Collider)
