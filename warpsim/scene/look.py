"""How particles look: points or sprites, their size and color over life."""

import re
from typing import Annotated, Any, ClassVar, Literal

from pydantic import BeforeValidator, Field, PlainSerializer, WithJsonSchema, field_validator
from pydantic_core import PydanticCustomError

from warpsim.scene.base import Mistake, Number, ShortSpec, Spec, WholeNumber, form_by_key, is_number, mistakes, one_of_forms

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


def is_color(value: Any) -> bool:
    """Tell whether a value is one color and not a list of colors: text, or three or four numbers."""
    return isinstance(value, str) or (isinstance(value, (list, tuple)) and len(value) > 0 and all(map(is_number, value)))


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


MAPS = {  # color maps, as the colors at equal steps; matplotlib's (CC0), turbo (Mikhailov 2019), coolwarm (Moreland 2009)
    "viridis": "440154 482878 3e4989 31688e 26828e 1f9e89 35b779 6ece58 b5de2b fde725",
    "plasma": "0d0887 46039f 7201a8 9c179e bd3786 d8576b ed7953 fb9f3a fdca26 f0f921",
    "inferno": "000004 1b0c41 4a0c6b 781c6d a52c60 cf4446 ed6925 fb9b06 f7d13d fcffa4",
    "turbo": "30123b 4145ab 4675ed 39a2fc 1bcfd4 24eca6 61fc6c a4fc3b d1e834 f3c63a fe9b2d f36315 d93806 b11901 7a0402",
    "coolwarm": "3b4cc0 6788ee 9abbff c9d7f0 edd1c2 f7a889 e26952 b40426",
}


class ColorBy(Spec):
    """A color that shows a quantity of the particle through a color map."""

    by: Literal["speed", "age", "height", "mass", "radius"] = Field(
        description="The quantity: speed (m/s), age (s), height y (m), mass (kg) or radius (m)."
    )
    range: tuple[Number, Number] = Field(description="Values of the quantity at the two ends of the map [unit of the quantity].")
    map: Literal["viridis", "plasma", "inferno", "turbo", "coolwarm"] = Field("viridis", description="The color map.")

    @field_validator("range")
    @classmethod
    def _range_rises(cls, value):
        if value[1] <= value[0]:
            raise mistakes([Mistake((1,), f"the range must rise: {value[1]:g} does not come after {value[0]:g}")])
        return value

    @property
    def stops(self) -> tuple[tuple[float, tuple[float, float, float, float]], ...]:
        """Pairs of place in the range, from 0 to 1, and color."""
        colors = [_color(f"#{digits}") for digits in MAPS[self.map].split()]
        return tuple((k / (len(colors) - 1), color) for k, color in enumerate(colors))


def color_form(value: Any) -> str | None:
    """Name the form of a color: one, or a ramp over life, or by a quantity."""
    if ColorRamp.is_short(value) or isinstance(value, ColorRamp):
        return "over_life"
    return form_by_key(value, ("over_life", "by"))


class Trail(Spec):
    """A line through the last places of each particle."""

    duration: Number = Field(gt=0.0, le=1e4, description="How far back it reaches [s].")
    points: WholeNumber = Field(12, ge=2, le=32, description="Places it keeps [1].")


class Look(Spec):
    """How the particles of a system are drawn."""

    as_: Literal["points", "sprites"] = Field("sprites", alias="as", description="points: square dots; sprites: soft round ones.")
    blend: Literal["alpha", "additive"] = Field("alpha", description="alpha: over what lies behind (smoke); additive: added to it (fire).")
    size: Ramp = Field(Ramp(over_life=((0.0, 0.02),)), description="Diameter, a number or {over_life: [[s, size], …]} [m].")
    color: one_of_forms({"over_life": ColorRamp, "by": ColorBy}, color_form) = Field(
        ColorRamp(over_life=((0.0, "#ffffff"),)), description="Color, {over_life: [[s, color], …]}, or {by: quantity, range, map}."
    )
    trail: Trail | None = Field(None, description="A line through each particle's last places; absent: none.")
