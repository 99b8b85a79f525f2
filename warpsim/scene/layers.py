"""Layers: how a sheet meets itself where it folds, and at which distance its points must be kept for that."""

import math
from collections.abc import Mapping, Sequence
from typing import Annotated, Any

from pydantic import Field

from warpsim.scene.base import Mistake, Number, Spec, Truth, one_of_forms

CORE = 1.1  # how many times nearer than the distance two points of different layers never come
SPARE = 1.15  # of the least core, the distance that is taken where none is given: edges may be stretched by 1.15/1.1
DRIFT = 0.2  # of the distance: how far points may drift apart before it is looked anew who is near whom
PUSH = 0.05  # of the distance: how far a pair is pushed out of each other in a substep
SPEED = 8.0  # [m/s]: how fast a point may go beside the sheet as a whole
_FARTHEST = 4.0  # of the least core, the largest distance


class SelfCollision(Spec):
    """How the layers of a sheet that folds onto itself meet: they are kept apart, rub, and never pass through each other."""

    distance: Annotated[Number, Field(gt=0.0, le=1e6)] | None = Field(
        None, description="At which the points of layers are kept; absent: 1.15 times a cell's longest diagonal over sqrt(2) [m]."
    )
    friction: Annotated[Number, Field(ge=0.0, le=1e6)] = Field(0.3, description="Coulomb's, between layers [1].")


def _form(value: Any) -> str | None:
    return "switch" if isinstance(value, bool) else "numbers" if isinstance(value, (Mapping, SelfCollision)) else None


SelfCollisionForm = one_of_forms({"switch": Truth, "numbers": SelfCollision}, _form)


def layers_of(asked: bool | SelfCollision, edges: Sequence, resolution: Sequence[int]) -> SelfCollision | None:
    """Return how the layers of a sheet meet, the distance filled in; None where they do not."""
    if asked is False:
        return None
    layers = SelfCollision() if asked is True else asked
    return layers if layers.distance else layers.model_copy(update={"distance": SPARE * least_core(edges, resolution)})


def least_core(edges: Sequence, resolution: Sequence[int]) -> float:
    """Return c, so that no edge of a layer at rest reaches through a triangle of another while all their points are farther apart [m].

    An edge of length l that goes through a triangle has an end within l/2 of it, beside a corner at most R away: c² = (l/2)² + R².
    """
    a, b = ([x / (n - 1) for x in edge] for edge, n in zip(edges, resolution, strict=True))
    diagonals = [math.hypot(*(x + y for x, y in zip(a, b, strict=True))), math.hypot(*(x - y for x, y in zip(a, b, strict=True)))]
    sides = math.hypot(*a), math.hypot(*b)
    return math.hypot(0.5 * max(diagonals), max(_farthest_within(*sides, one) for one in diagonals))


def _farthest_within(*sides: float) -> float:
    """Return R, how far from its nearest corner a point of a triangle with these sides can be [m]: the radius round it, if it is acute."""
    a, b, c = sorted(sides)
    if a * a + b * b <= c * c * (1.0 + 1e-9):
        return 0.5 * c
    return a * b * c / math.sqrt((a + b + c) * (b + c - a) * (a + c - b) * (a + b - c))


def reach_of(distance: float, h: float) -> float:
    """Return how far apart two points may be that can touch before it is looked anew, with substeps of h [s] [m]."""
    return distance + 2.0 * (DRIFT * distance + SPEED * h + PUSH * distance)


def longest_list(distance: float, h: float, edges: Sequence, resolution: Sequence[int]) -> int:
    """Return how many neighbors a point's list has room for: those of five layers at rest within the reach, and some."""
    a, b = ([x / (n - 1) for x in edge] for edge, n in zip(edges, resolution, strict=True))
    cell = math.hypot(*(a[k - 2] * b[k - 1] - a[k - 1] * b[k - 2] for k in range(3)))
    return 32 + 16 * math.ceil(5.0 * math.pi * reach_of(distance, h) ** 2 / cell / 16.0)


def layer_mistakes(asked: bool | SelfCollision, edges: Sequence, resolution: Sequence[int]) -> list[Mistake]:
    """Return the mistake where layers are asked to be so near that points slip through, or so far apart that they could not lie."""
    distance, least = getattr(asked, "distance", None), least_core(edges, resolution)
    if distance is None or CORE * least <= distance <= _FARTHEST * least:
        return []
    why = "edges of one layer would slip between the points of another" if distance < least * CORE else "no fold would be so wide"
    allowed = f"allowed: {_rounded(CORE * least):g} to {_rounded(_FARTHEST * least, math.floor):g} m; with more points less"
    message = f"{distance:g} m does not suit cells of this size: {why} ({allowed})"
    return [Mistake(("self_collision", "distance"), message, ("self_collision", "edges", "resolution"))]


def _rounded(x: float, to=math.ceil) -> float:
    """Return a length rounded to three digits, so that it may be typed."""
    step = 10.0 ** (math.floor(math.log10(x)) - 2)
    return to(x / step) * step
