"""Generators: regular networks of points and springs, described by a few numbers; networks.py lays them out."""

from itertools import accumulate, pairwise, product
from typing import Annotated, ClassVar, Literal

from pydantic import Field, model_validator

from warpsim.scene.assets import asset_path
from warpsim.scene.base import Direction, Mistake, Number, Spec, Vec3, WholeNumber, mistakes, one_of_types

Side = Annotated[WholeNumber, Field(ge=2, le=4096)]
Length = Annotated[Number, Field(gt=0.0, le=1e9)]


def parallel_mistakes(edges: tuple[Vec3, Vec3]) -> list[Mistake]:
    """Return the mistake if the two edges of a sheet are parallel."""
    first, second = edges
    across = [first[k - 2] * second[k - 1] - first[k - 1] * second[k - 2] for k in range(3)]
    if sum(x * x for x in across) > 1e-12 * sum(x * x for x in first) * sum(x * x for x in second):
        return []
    return [Mistake(("edges",), "the edges are parallel: the sheet has no area", ("edges",))]


class Generator(Spec):
    """A network made by rule. A subclass registers itself by being defined in this file."""

    groups: ClassVar[tuple[str, ...]] = ()
    """Names of groups of its points, for `pins`."""
    chains: ClassVar[tuple[str, ...]] = ()
    """Names of rows of its points, each joined to the next, for `muscles` and `grip`."""
    spring_groups: ClassVar[tuple[str, ...]] = ()
    """Names of groups of its springs, for `muscles`."""
    has_surface: ClassVar[bool] = False
    """Whether it makes triangles."""

    def spring_group(self, name: str) -> list[int]:
        """Return the springs of a group, rising."""
        raise KeyError(name)

    def chain(self, name: str) -> list[int]:
        """Return the points of a chain, in their order."""
        raise KeyError(name)

    def group(self, name: str) -> list[int]:
        """Return the points of a group, rising."""
        raise KeyError(name)

    @property
    def point_count(self) -> int | None:
        """How many points it makes; None where a file says so."""
        return None

    @property
    def spring_count(self) -> int | None:
        """How many springs it makes; None where a file says so."""
        return None


class Chain(Generator):
    """Points along a straight line, each joined to the next. Points are numbered from the start. Groups: start, end. Chain: line."""

    groups: ClassVar[tuple[str, ...]] = ("start", "end")
    chains: ClassVar[tuple[str, ...]] = ("line",)
    type: Literal["chain"] = Field("chain", description="Kind of generator.")
    count: Annotated[WholeNumber, Field(ge=2, le=1_000_000)] = Field(description="Number of points, both ends included [1].")
    start: Vec3 = Field(description="Place of the first point [m].")
    end: Vec3 = Field(description="Place of the last point [m].")

    @model_validator(mode="after")
    def _has_a_length(self):
        if self.start == self.end:
            raise mistakes([Mistake(("end",), "start and end are the same place: the chain has no length", ("start", "end"))])
        return self

    def group(self, name: str) -> list[int]:
        """Return one end."""
        return [{"start": 0, "end": self.count - 1}[name]]

    def chain(self, name: str) -> list[int]:
        """Return all points, from the start."""
        return list(range(self.count))

    @property
    def point_count(self) -> int:
        """How many points it makes."""
        return self.count

    @property
    def spring_count(self) -> int:
        """One between each point and the next."""
        return self.count - 1


class Ring(Generator):
    """Points on a circle, each joined to the next and the last to the first. Chain: round, which ends where it begins."""

    chains: ClassVar[tuple[str, ...]] = ("round",)
    type: Literal["ring"] = Field("ring", description="Kind of generator.")
    count: Annotated[WholeNumber, Field(ge=3, le=1_000_000)] = Field(description="Number of points [1].")
    center: Vec3 = Field((0.0, 0.0, 0.0), description="Its center [m].")
    normal: Direction = Field((0.0, 0.0, 1.0), description="Normal of its plane, of any length [1].")
    radius: Length = Field(description="Its radius [m].")

    def chain(self, name: str) -> list[int]:
        """Return all points, and the first once more."""
        return [*range(self.count), 0]

    @property
    def point_count(self) -> int:
        """How many points it makes."""
        return self.count

    @property
    def spring_count(self) -> int:
        """As many as points."""
        return self.count


class GridOfPoints(Generator):
    """A sheet: points (i, j), number j nx + i, joined to their neighbors along both edges and across both diagonals.

    Groups: left (i = 0), right, top (j = 0), bottom, corners.
    """

    groups: ClassVar[tuple[str, ...]] = ("left", "right", "top", "bottom", "corners")
    has_surface: ClassVar[bool] = True
    type: Literal["grid"] = Field("grid", description="Kind of generator.")
    resolution: tuple[Side, Side] = Field(description="Number of points along the first edge and along the second [1].")
    corner: Vec3 = Field((0.0, 0.0, 0.0), description="Place of point (0, 0) [m].")
    edges: tuple[Direction, Direction] = Field(description="From the corner along i to the last point, and along j [m].")

    @model_validator(mode="after")
    def _has_an_area(self):
        if found := parallel_mistakes(self.edges):
            raise mistakes(found)
        return self

    def group(self, name: str) -> list[int]:
        """Return the points of a border, or the four corners."""
        nx, ny = self.resolution
        rows = {"left": (range(1), range(ny)), "right": (range(nx - 1, nx), range(ny)), "top": (range(nx), range(1))}
        rows |= {"bottom": (range(nx), range(ny - 1, ny)), "corners": ((0, nx - 1), (0, ny - 1))}
        across, down = rows[name]
        return [j * nx + i for j in down for i in across]

    @property
    def point_count(self) -> int:
        """How many points it makes."""
        return self.resolution[0] * self.resolution[1]

    @property
    def spring_count(self) -> int:
        """Along, down, and two diagonals in every cell."""
        nx, ny = self.resolution
        return (nx - 1) * ny + nx * (ny - 1) + 2 * (nx - 1) * (ny - 1)


class Block(Generator):
    """A solid: points (i, j, k), number (k ny + j) nx + i along x, y, z, each joined to all its neighbors, diagonals included.

    Groups: left (i = 0), right, bottom (j = 0), top, back (k = 0), front, corners.
    """

    groups: ClassVar[tuple[str, ...]] = ("left", "right", "bottom", "top", "back", "front", "corners")
    has_surface: ClassVar[bool] = True
    type: Literal["block"] = Field("block", description="Kind of generator.")
    resolution: tuple[Side, Side, Side] = Field(description="Number of points along x, y and z [1].")
    center: Vec3 = Field((0.0, 0.0, 0.0), description="Its center [m].")
    size: tuple[Length, Length, Length] = Field(description="Edges along x, y and z [m].")

    def group(self, name: str) -> list[int]:
        """Return the points of a face, or the eight corners."""
        nx, ny, nz = self.resolution
        ends = [(0, n - 1) for n in self.resolution]
        if name == "corners":
            return [(k * ny + j) * nx + i for k, j, i in product(*reversed(ends))]
        axis, side = divmod(self.groups.index(name), 2)
        spans = [range(n) for n in self.resolution]
        spans[axis] = range(ends[axis][side], ends[axis][side] + 1)
        return [(k * ny + j) * nx + i for k, j, i in product(*reversed(spans))]

    @property
    def point_count(self) -> int:
        """How many points it makes."""
        nx, ny, nz = self.resolution
        return nx * ny * nz

    @property
    def spring_count(self) -> int:
        """Along thirteen directions, half of a point's 26 neighbors."""
        a, b, c = self.resolution
        return sum((a - x) * (b - y) * (c - z) * 2 ** max(0, x + y + z - 1) for x, y, z in product((0, 1), repeat=3) if x + y + z)


class Section(Spec):
    """A cross-section of a body: a rectangle, an edge where one side is 0, a point where both are."""

    at: Annotated[Number, Field(ge=0.0, le=1.0)] = Field(description="Its place between head 0 and tail 1 [1].")
    width: Annotated[Number, Field(ge=0.0, le=1e9)] = Field(0.0, description="From right to left [m].")
    height: Annotated[Number, Field(ge=0.0, le=1e9)] = Field(0.0, description="From bottom to top [m].")

    @property
    def point_count(self) -> int:
        """Four corners, the two ends of an edge, or one point."""
        return (2 if self.width else 1) * (2 if self.height else 1)


class Body(Generator):
    """A body from head to tail: rectangular cross-sections braced within and joined to the next, with a closed surface.

    Of a section the points are right top, left top, left bottom, right bottom, as the body sees itself; an edge has two of them. Groups:
    head, tail (the first and last section). Chains from head to tail along the rectangles: right_top, left_top, left_bottom, right_bottom.
    Group of springs: rings, those within sections.
    """

    groups: ClassVar[tuple[str, ...]] = ("head", "tail")
    chains: ClassVar[tuple[str, ...]] = ("right_top", "left_top", "left_bottom", "right_bottom")
    spring_groups: ClassVar[tuple[str, ...]] = ("rings",)
    has_surface: ClassVar[bool] = True
    type: Literal["body"] = Field("body", description="Kind of generator.")
    head: Vec3 = Field(description="Where the first section has its middle, at 0 [m].")
    tail: Vec3 = Field(description="Where the last has it, at 1 [m].")
    up: Direction = Field((0.0, 1.0, 0.0), description="Where its back is, of any length; its part along the body is dropped [1].")
    sections: Annotated[tuple[Section, ...], Field(min_length=2, max_length=10_000)] = Field(
        description="Its cross-sections, from head to tail."
    )

    @model_validator(mode="after")
    def _is_a_body(self):
        found = []
        for k in range(1, len(self.sections)):
            if self.sections[k].at <= self.sections[k - 1].at:
                message = f"sections must follow each other: {self.sections[k].at:g} does not come after {self.sections[k - 1].at:g}"
                found.append(Mistake(("sections", k, "at"), message, ("sections",)))
        flat = [k for k, one in enumerate(self.sections[1:-1], 1) if one.point_count < 4]
        if flat:
            message = "between head and tail a section has a width and a height: only the ends may be an edge or a point"
            found.append(Mistake(("sections", flat[0]), message, ("sections",)))
        if len(self.sections) == 2 and min(one.point_count for one in self.sections) < 4:
            found.append(Mistake(("sections",), "two sections make a body only if both are rectangles", ("sections",)))
        way = [b - a for a, b in zip(self.head, self.tail, strict=True)]
        across = [way[k - 2] * self.up[k - 1] - way[k - 1] * self.up[k - 2] for k in range(3)]
        if sum(x * x for x in across) <= 1e-12 * sum(x * x for x in way) * sum(x * x for x in self.up):
            message = "the body has no length" if not any(way) else "up must lead away from the line from head to tail"
            found.append(Mistake(("up" if any(way) else "tail",), message, ("head", "tail", "up")))
        if found:
            raise mistakes(found)
        return self

    @property
    def numbers(self) -> list[list[int]]:
        """The points of each section."""
        ends = list(accumulate(one.point_count for one in self.sections))
        return [list(range(end - one.point_count, end)) for end, one in zip(ends, self.sections, strict=True)]

    def group(self, name: str) -> list[int]:
        """Return the points of the first or the last section."""
        return self.numbers[{"head": 0, "tail": -1}[name]]

    def chain(self, name: str) -> list[int]:
        """Return one corner of all rectangles."""
        corner = self.chains.index(name)
        return [section[corner] for section in self.numbers if len(section) == 4]

    def spring_group(self, name: str) -> list[int]:
        """Return the springs within sections; they come before those to the next section."""
        begins = [0, *accumulate(within + between for within, between in zip(self._within, self._between, strict=False))]
        return [begin + n for begin, within in zip(begins, self._within, strict=True) for n in range(within)]

    @property
    def _within(self) -> list[int]:
        return [one.point_count * (one.point_count - 1) // 2 for one in self.sections]

    @property
    def _between(self) -> list[int]:
        return [a * b - 4 * (a == b == 4) for a, b in pairwise(one.point_count for one in self.sections)]

    @property
    def point_count(self) -> int:
        """How many points its sections have."""
        return sum(one.point_count for one in self.sections)

    @property
    def spring_count(self) -> int:
        """All within a section, and between neighbors all but the four that would cross the body from corner to corner."""
        return sum(self._within) + sum(self._between)


class MeshEdges(Generator):
    """The vertices of a mesh joined along its edges. Equal places of the file are one point; points are in rising order of x, y, z."""

    has_surface: ClassVar[bool] = True
    type: Literal["mesh"] = Field("mesh", description="Kind of generator.")
    file: asset_path(".obj", ".stl", ".ply", ".glb") = Field(description="The mesh's file, beside the scene.")
    center: Vec3 = Field((0.0, 0.0, 0.0), description="Where the file's origin is put [m].")
    scale: Length = Field(1.0, description="Length of the file's unit [m].")


GeneratorUnion = one_of_types(Generator)
