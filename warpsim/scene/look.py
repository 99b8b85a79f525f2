"""How particles look: points or sprites, their size and color over life."""

import re
from typing import Annotated, Any, ClassVar, Literal

from pydantic import BeforeValidator, Field, PlainSerializer, WithJsonSchema, field_validator
from pydantic_core import PydanticCustomError

from warpsim.scene.base import Mistake, Number, ShortSpec, Spec, mistakes

Life = Annotated[Number, Field(ge=0.0, le=1.0, description="Age over lifetime [1].")]
Share = Annotated[Number, Field(ge=0.0, le=1.0)]
_HEX = re.compile(r"#(?:[0-9a-fA-F]{3}|[0-9a-fA-F]{6}|[0-9a-fA-F]{8})\Z")


def _color(value: Any) -> Any:
    if isinstance(value, str):
        if not _HEX.match(value):
            raise PydanticCustomError("color", 'expected a color "#rgb", "#rrggbb" or "#rrggbbaa" with digits 0-9 and a-f')
        digits = value[1:] if len(value) > 4 else "".join(digit * 2 for digit in value[1:])
        parts = [int(digits[k : k + 2], 16) / 255 for k in range(0, len(digits), 2)]
        return (*parts, 1.0)[:4]
    if isinstance(value, (list, tuple)) and len(value) == 3:
        return (*value, 1.0)
    return value


def _written(color: tuple[float, float, float, float]) -> Any:
    parts = [round(part * 255) for part in color]
    exact = all(part / 255 == given for part, given in zip(parts, color, strict=True))
    if not exact:
        return list(color)
    return "#" + "".join(f"{part:02x}" for part in (parts[:3] if parts[3] == 255 else parts))


Color = Annotated[
    tuple[Share, Share, Share, Share],
    BeforeValidator(_color),
    PlainSerializer(_written),
    WithJsonSchema(
        {
            "anyOf": [
                {"type": "string", "pattern": "^#([0-9a-fA-F]{3}|[0-9a-fA-F]{6}|[0-9a-fA-F]{8})$"},
                {"type": "array", "items": {"type": "number", "minimum": 0, "maximum": 1}, "minItems": 3, "maxItems": 4},
            ]
        }
    ),
]


def _rise(value: tuple) -> tuple:
    found = [
        Mistake((k, 0), f"stops must rise: {value[k][0]:g} does not come after {value[k - 1][0]:g}")
        for k in range(1, len(value))
        if value[k][0] <= value[k - 1][0]
    ]
    if found:
        raise mistakes(found)
    return value


class Ramp(ShortSpec):
    """A size over life, linear between the stops. A bare number holds for the whole life."""

    shorthand: ClassVar[str] = "over_life"
    stops: tuple[tuple[Life, Annotated[Number, Field(ge=0.0, le=1e6)]], ...] = Field(
        alias="over_life", min_length=1, max_length=64, description="Pairs of age/lifetime from 0 to 1, rising, and size [m]."
    )

    _stops_rise = field_validator("stops")(_rise)

    @classmethod
    def long_form(cls, value: Any) -> dict[str, Any]:
        """One stop that holds for the whole life."""
        return {"over_life": [(0.0, value)]}


class ColorRamp(ShortSpec):
    """A color over life, linear between the stops. A bare color holds for the whole life."""

    shorthand: ClassVar[str] = "over_life"
    stops: tuple[tuple[Life, Color], ...] = Field(
        alias="over_life",
        min_length=1,
        max_length=64,
        description='Pairs of age/lifetime from 0 to 1, rising, and color: "#rgb", "#rrggbb", "#rrggbbaa" or [r, g, b, a] from 0 to 1 [1].',
    )

    _stops_rise = field_validator("stops")(_rise)

    @classmethod
    def is_short(cls, value: Any) -> bool:
        """A bare color: text, or three or four numbers."""
        return isinstance(value, (str, list, tuple))

    @classmethod
    def long_form(cls, value: Any) -> dict[str, Any]:
        """One stop that holds for the whole life."""
        return {"over_life": [(0.0, value)]}


class Look(Spec):
    """How the particles of a system are drawn."""

    as_: Literal["points", "sprites"] = Field("sprites", alias="as", description="points: square dots; sprites: soft round ones.")
    blend: Literal["alpha", "additive"] = Field("alpha", description="alpha: over what lies behind (smoke); additive: added to it (fire).")
    size: Ramp = Field(Ramp(over_life=((0.0, 0.02),)), description="Diameter, a number or {over_life: [[s, size], …]} [m].")
    color: ColorRamp = Field(ColorRamp(over_life=((0.0, "#ffffff"),)), description="Color, or {over_life: [[s, color], …]} [1].")
