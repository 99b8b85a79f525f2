"""Generators: regular networks of points and springs, described by a few numbers; networks.py lays them out."""

from itertools import product
from typing import Annotated, ClassVar, Literal

from pydantic import Field

from warpsim.scene.assets import asset_path
from warpsim.scene.base import Direction, Number, Spec, Vec3, WholeNumber, one_of_types

Side = Annotated[WholeNumber, Field(ge=2, le=4096)]
Length = Annotated[Number, Field(gt=0.0, le=1e9)]


class Generator(Spec):
    """A network made by rule. A subclass registers itself by being defined in this file."""

    groups: ClassVar[tuple[str, ...]] = ()
    """Names of groups of its points, for `pins`."""

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
    """Points along a straight line, each joined to the next. Points are numbered from the start. Groups: start, end."""

    groups: ClassVar[tuple[str, ...]] = ("start", "end")
    type: Literal["chain"] = Field("chain", description="Kind of generator.")
    count: Annotated[WholeNumber, Field(ge=2, le=1_000_000)] = Field(description="Number of points, both ends included [1].")
    start: Vec3 = Field(description="Place of the first point [m].")
    end: Vec3 = Field(description="Place of the last point [m].")

    def group(self, name: str) -> list[int]:
        """Return one end."""
        return [{"start": 0, "end": self.count - 1}[name]]

    @property
    def point_count(self) -> int:
        """How many points it makes."""
        return self.count

    @property
    def spring_count(self) -> int:
        """One between each point and the next."""
        return self.count - 1


class Ring(Generator):
    """Points on a circle, each joined to the next and the last to the first."""

    type: Literal["ring"] = Field("ring", description="Kind of generator.")
    count: Annotated[WholeNumber, Field(ge=3, le=1_000_000)] = Field(description="Number of points [1].")
    center: Vec3 = Field((0.0, 0.0, 0.0), description="Its center [m].")
    normal: Direction = Field((0.0, 0.0, 1.0), description="Normal of its plane, of any length [1].")
    radius: Length = Field(description="Its radius [m].")

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
    type: Literal["grid"] = Field("grid", description="Kind of generator.")
    resolution: tuple[Side, Side] = Field(description="Number of points along the first edge and along the second [1].")
    corner: Vec3 = Field((0.0, 0.0, 0.0), description="Place of point (0, 0) [m].")
    edges: tuple[Direction, Direction] = Field(description="From the corner along i to the last point, and along j [m].")

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


class MeshEdges(Generator):
    """The vertices of a mesh joined along its edges. Equal places of the file are one point; points are in rising order of x, y, z."""

    type: Literal["mesh"] = Field("mesh", description="Kind of generator.")
    file: asset_path(".obj", ".stl", ".ply", ".glb") = Field(description="The mesh's file, beside the scene.")
    center: Vec3 = Field((0.0, 0.0, 0.0), description="Where the file's origin is put [m].")
    scale: Length = Field(1.0, description="Length of the file's unit [m].")


GeneratorUnion = one_of_types(Generator)
