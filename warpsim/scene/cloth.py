"""Cloth: a sheet of points with structural, shear and bend springs, in the wind."""

import math
from typing import Annotated, Literal

from pydantic import Field, model_validator

from warpsim.scene.base import Direction, Mistake, Number, Spec, Vec3, mistakes
from warpsim.scene.generators import GridOfPoints, Side, parallel_mistakes
from warpsim.scene.layers import SelfCollision, SelfCollisionForm, layer_mistakes, layers_of
from warpsim.scene.springs import Network, Pin, motion_mistakes, pin_mistakes, solver_mistakes, strain_mistakes

_RIGHT = 1e-3  # cosine up to which an angle is right: coordinates are typed with few digits
_Coefficient = Annotated[Number, Field(ge=0.0, le=1e12)]


class SpringKind(Spec):
    """The springs of one kind."""

    stiffness: _Coefficient = Field(description="Force per length of stretching [N/m].")
    damping: _Coefficient = Field(0.0, description="Force per speed of stretching, along the spring only [N s/m].")


class Bending(Spec):
    """What a sheet does against being curved: a moment M = B kappa per width, the same whatever the direction and the cells."""

    stiffness: Annotated[Number, Field(ge=0.0, le=1e9)] = Field(description="B, moment per width and curvature [N m].")
    damping: Annotated[Number, Field(ge=0.0, le=1e9)] = Field(0.0, description="Moment per width and rate of curvature [N m s].")


class Cloth(Network):
    """A sheet of points (i, j), number j nx + i. Mass and area are those of the cells round a point, a quarter of each."""

    type: Literal["cloth"] = Field("cloth", description="Kind of system.")
    resolution: tuple[Side, Side] = Field(description="Number of points along the first edge and along the second [1].")
    corner: Vec3 = Field((0.0, 0.0, 0.0), description="Place of point (0, 0), left and top [m].")
    edges: tuple[Direction, Direction] = Field(description="From the corner along i to the last point, and along j [m].")
    density: Annotated[Number, Field(ge=1e-9, le=1e9)] = Field(0.2, description="Mass per area [kg/m^2].")
    structural: SpringKind = Field(description="Springs to the neighbors (i ± 1, j) and (i, j ± 1).")
    shear: SpringKind = Field(SpringKind(stiffness=0.0), description="Springs to the neighbors (i ± 1, j ± 1).")
    bend: SpringKind = Field(SpringKind(stiffness=0.0), description="Springs to (i ± 2, j) and (i, j ± 2).")
    bending: Bending | None = Field(
        None, description="Stiffness against being curved, linear and independent of the resolution, unlike bend springs; absent: none."
    )
    drag: _Coefficient = Field(0.0, description="Drag of still air on every point, F = -drag v; with coupling absent [kg/s].")
    air: _Coefficient = Field(
        0.0,
        description="Drag of the flow across the sheet, F = air A ((u - v) n) n with the area A and the normal n of a point [kg/(m^2 s)].",
    )
    self_collision: SelfCollisionForm = Field(
        False, description="Whether it meets itself where it folds: true or false, or a mapping with distance and friction."
    )
    pins: tuple[Pin, ...] = Field(
        (), max_length=200_000, description="Points that are held: left, right, top, bottom, corners, [i, j], or numbers."
    )

    @property
    def generator(self) -> GridOfPoints:
        """The grid of its points."""
        return GridOfPoints.model_construct(resolution=self.resolution, corner=self.corner, edges=self.edges)

    @property
    def layers(self) -> SelfCollision | None:
        """How its layers meet, the distance filled in; None where they do not."""
        return layers_of(self.self_collision, self.edges, self.resolution)

    @property
    def point_count(self) -> int:
        """How many points there are."""
        return self.generator.point_count

    @property
    def spring_count(self) -> int:
        """How many springs there are: those of a grid, and two from every point to the next but one."""
        nx, ny = self.resolution
        return self.generator.spring_count + max(nx - 2, 0) * ny + nx * max(ny - 2, 0)

    @property
    def damping(self) -> tuple[float, ...]:
        """Of its three kinds of springs [N·s/m], and of its bending [N·m·s]."""
        return self.structural.damping, self.shear.damping, self.bend.damping, self.bending.damping if self.bending else 0.0

    @model_validator(mode="after")
    def _parts_fit(self):
        found = solver_mistakes(self)
        if self.drag and self.coupling is not None:
            found.append(Mistake(("drag",), "drag is that of still air: give either drag or coupling", ("drag", "coupling")))
        if parallel := parallel_mistakes(self.edges):
            found += parallel
        elif self.bending and abs(_cosine(*self.edges)) > _RIGHT:
            found.append(Mistake(("edges",), "with bending the edges must be at right angles to each other", ("edges", "bending")))
        found += layer_mistakes(self.self_collision, self.edges, self.resolution)
        found += strain_mistakes(self)
        where = [(("pins",), self.pins)] + [(("pin_motion", k, "pins"), motion.pins) for k, motion in enumerate(self.pin_motion)]
        strange = [mistake for path, pins in where for mistake in pin_mistakes(path, pins, self.generator)]
        found += strange or motion_mistakes(self)
        if found:
            raise mistakes(found)
        return self


def _cosine(first: Vec3, second: Vec3) -> float:
    """Return the cosine of the angle between two directions."""
    product = math.hypot(*first) * math.hypot(*second)
    return sum(x * y for x, y in zip(first, second, strict=True)) / product
