"""Obstacles of the flow: bodies that turn it aside by images of its primitives (potential theory), and what has no such image."""

import math
from abc import abstractmethod
from typing import Any, ClassVar, Literal

from pydantic import Field

from warpsim.scene.base import Direction, Mistake, Name, Number, Spec, Vec3, is_number, one_of_types
from warpsim.scene.particles import Selection
from warpsim.scene.strengths import Strength

_MOST_TOLD = 300
PARALLEL = 1e-6  # sine of the largest angle between two lines that count as parallel; float32 tells no finer


class Obstacle(Spec):
    """A body that no flow enters. A subclass registers itself by being defined in this file."""

    name: Name | None = Field(None, description="Name for `--set obstacles.NAME.…`.")
    answers: Selection = Field(
        True,
        description="Flow primitives that it turns aside: true, false, or a list of names or numbers; the rest passes through it.",
    )

    answerable: ClassVar[frozenset[str]]
    """Types of the flow primitives that have an exact image."""

    @abstractmethod
    def misfit(self, primitive: Any) -> tuple[str, str] | None:
        """Return the field of a primitive of an answerable type that keeps it from having an image, and why; None if it has one."""

    @abstractmethod
    def encloses(self, place: Vec3) -> bool:
        """Tell whether a place is inside, where nothing flows."""


class Cylinder(Obstacle):
    """A cylinder without end, answered by Milne-Thomson's circle theorem; with a circulation of its own it turns."""

    answerable: ClassVar[frozenset[str]] = frozenset({"uniform", "source", "vortex", "doublet"})
    type: Literal["cylinder"] = Field("cylinder", description="Kind of obstacle.")
    center: Vec3 = Field((0.0, 0.0, 0.0), description="A point on its axis [m].")
    axis: Direction = Field((0.0, 1.0, 0.0), description="Direction of its axis, of any length [1].")
    radius: Number = Field(gt=0.0, le=1e9, description="Radius [m].")
    circulation: Strength = Field(
        0.0, description="Circulation round it, right-handed about the axis: that of a turning cylinder, which lifts it [m^2/s]."
    )

    def misfit(self, primitive: Any) -> tuple[str, str] | None:
        """A line must be parallel to the axis, outside, and stay where it is."""
        if primitive.type == "uniform":
            return None
        if any(component != 0.0 for component in primitive.travel):
            return "travel", "must be left out where a cylinder answers: an image would not travel like what it answers"
        if _sine(primitive.axis, self.axis) > PARALLEL:
            return "axis", "must be parallel to the cylinder's: the circle theorem is about a plane flow"
        distance = math.hypot(*_across(self.axis, _minus(primitive.center, self.center)))
        if distance <= self.radius:
            return "center", f"is {distance:g} m from the cylinder's axis and must be outside, beyond its radius of {self.radius:g} m"
        return None

    def encloses(self, place: Vec3) -> bool:
        return math.hypot(*_across(self.axis, _minus(place, self.center))) < self.radius


class Wall(Obstacle):
    """A plane without end; the flow is on the side to which its normal points, and answered by mirror images."""

    answerable: ClassVar[frozenset[str]] = frozenset(
        {"uniform", "source", "point_source", "vortex", "doublet", "vortex_segment", "vortex_ring"}
    )
    type: Literal["wall"] = Field("wall", description="Kind of obstacle.")
    center: Vec3 = Field((0.0, 0.0, 0.0), description="A point on it [m].")
    normal: Direction = Field((0.0, 1.0, 0.0), description="Direction into the flow, of any length [1].")

    def misfit(self, primitive: Any) -> tuple[str, str] | None:
        """What has a place must be in front; a line must be parallel to the wall or stand on it, a segment may begin on it."""
        if primitive.type == "uniform":
            return None
        if hasattr(primitive, "axis"):
            if _sine(primitive.axis, self.normal) <= PARALLEL:
                return None  # nothing of its flow crosses the wall
            if abs(_dot(_unit(primitive.axis), _unit(self.normal))) > PARALLEL:
                return "axis", "must be parallel or perpendicular to the wall: else the line passes through it"
        travel = _dot(_unit(self.normal), primitive.travel) if all(map(is_number, primitive.travel)) else 0.0
        if hasattr(primitive, "start"):
            start, end = self._height(primitive.start) + travel, self._height(primitive.end) + travel
            key, height = ("start", start) if start < end else ("end", end)
            return (key, self._behind(height)) if height < 0.0 or start == end == 0.0 else None
        height = self._height(primitive.center) + travel
        if is_number(reach := getattr(primitive, "radius", 0.0)):
            height -= reach * _sine(primitive.normal, self.normal) if reach else 0.0  # the lowest point of a ring
        return ("center", self._behind(height)) if height <= 0.0 else None

    def encloses(self, place: Vec3) -> bool:
        return self._height(place) < 0.0

    def _height(self, place: Vec3) -> float:
        return _dot(_minus(place, self.center), _unit(self.normal))

    def _behind(self, height: float) -> str:
        where = f"comes {-height:g} m behind the wall" if height < 0.0 else "is on the wall"
        return f"{where} and must be in front, where the normal points"


ObstacleUnion = one_of_types(Obstacle)


def answers(obstacle: Obstacle, place: int, primitive: Any) -> bool:
    """Tell whether an obstacle is meant to answer a primitive, which stands at `place` in the flow."""
    chosen = obstacle.answers
    return chosen if isinstance(chosen, bool) else place in chosen or primitive.name in chosen


def unanswerable(obstacles: tuple[Any, ...], flow: tuple[Any, ...]) -> list[Mistake]:
    """Return a mistake for each primitive that an obstacle is meant to answer and cannot, or that several cannot answer together."""
    found: list[Mistake] = []
    for k, primitive in enumerate(flow):
        if len(found) >= _MOST_TOLD:
            break
        meant = [(n, obstacle) for n, obstacle in enumerate(obstacles) if answers(obstacle, k, primitive)]
        for n, obstacle in meant:
            if wrong := _misfit(obstacle, primitive):
                key, why = wrong
                hint = f"or let obstacles.{n} leave it alone: answers: {_others(obstacle, flow, k)}"
                found.append(Mistake(("flow", k, key), f"{why} ({hint})", ("flow", "obstacles", ("flow", k), ("obstacles", n))))
        found += [clash for clash in _clashes(meant, k) if clash.path not in {mistake.path for mistake in found}]
    return found


def _misfit(obstacle: Any, primitive: Any) -> tuple[str, str] | None:
    if primitive.type not in obstacle.answerable:
        known = ", ".join(sorted(obstacle.answerable))
        return "type", f'"{primitive.type}" has no exact image at a {obstacle.type}, which answers {known}'
    return obstacle.misfit(primitive)


def _others(obstacle: Any, flow: tuple[Any, ...], left_out: int) -> str:
    """Return the value of `answers` that has every primitive that is meant now but one."""
    rest = [primitive.name or str(k) for k, primitive in enumerate(flow) if k != left_out and answers(obstacle, k, primitive)]
    return f"[{', '.join(rest[:8])}{', …' if len(rest) > 8 else ''}]" if rest else "false"


def _clashes(meant: list[tuple[int, Any]], place: int) -> list[Mistake]:
    """Return a mistake for the first two obstacles that both answer a primitive and would each spoil the other's images."""
    for j, (n, other) in enumerate(meant):
        for m, one in meant[:j]:
            both = f"obstacles.{m} and obstacles.{n} both answer flow.{place}"
            depends = ("flow", "obstacles", ("flow", place), ("obstacles", m), ("obstacles", n))
            if one.type == other.type == "wall":
                if abs(_dot(_unit(one.normal), _unit(other.normal))) > PARALLEL:
                    message = f"must be perpendicular to that of obstacles.{m}: the images of other walls never end ({both})"
                    return [Mistake(("obstacles", n, "normal"), message, depends)]
            else:
                message = f"a cylinder has exact images where it is alone: {both} (leave one to it with answers: [names])"
                return [Mistake(("obstacles", n, "type"), message, depends)]
    return []


def _dot(a, b) -> float:
    return sum(x * y for x, y in zip(a, b, strict=True))


def _minus(a, b) -> tuple[float, ...]:
    return tuple(x - y for x, y in zip(a, b, strict=True))


def _unit(a) -> tuple[float, ...]:
    length = math.hypot(*a)
    return tuple(x / length for x in a)


def _across(axis, vector) -> tuple[float, ...]:
    """Return the part of a vector across an axis."""
    a = _unit(axis)
    along = _dot(a, vector)
    return tuple(x - along * y for x, y in zip(vector, a, strict=True))


def _sine(a, b) -> float:
    """Return the sine of the angle between two lines."""
    return math.hypot(*_across(a, _unit(b)))
