"""What the viewer shows besides the particles, and the numbers that a person may move while it runs."""

from typing import Annotated, Any, ClassVar, Literal, NamedTuple

from pydantic import Field, model_validator

from warpsim.scene.base import Mistake, Number, ShortSpec, Spec, Truth, WholeNumber, is_number, mistakes
from warpsim.scene.fields import keys_of, number_bounds_of
from warpsim.scene.nearest import nearest

MOST_SLIDERS = 64


class Viewing(Spec):
    """How the viewer shows the scene."""

    max_points: WholeNumber = Field(
        250_000, ge=1, le=10_000_000, description="Most particles of a system that are drawn while it plays; all of them when paused [1]."
    )
    sky: Literal["auto", "night", "dusk", "day"] = Field("auto", description="What is behind; auto goes by the particles' looks.")
    ground: Truth = Field(True, description="Whether a faint grid shows the ground.")
    colliders: Truth = Field(True, description="Whether colliders are drawn.")
    streamlines: WholeNumber = Field(0, ge=0, le=2000, description="Number of streamlines of the flow that are drawn [1].")
    show: tuple[Literal["emitters", "flow", "obstacles", "forces"], ...] = Field(
        (), max_length=4, description="What of the scene is drawn faintly."
    )


class Control(ShortSpec):
    """A number of the scene that gets a slider; a bare text is its path. A path to a vector gives one slider per component."""

    shorthand: ClassVar[str] = "path"

    path: str = Field(min_length=1, max_length=300, description="Where the number is, by keys, names or places: flow.swirl.circulation.")
    min: Number | None = Field(None, description="Left end of the slider; absent: from the value and its bounds [unit of the number].")
    max: Number | None = Field(None, description="Right end of the slider; absent: from the value and its bounds [unit of the number].")
    label: str | None = Field(None, min_length=1, max_length=40, description="What is written at the slider; absent: the path.")

    @classmethod
    def is_short(cls, value: Any) -> bool:
        """A bare text is the path."""
        return isinstance(value, str)

    @model_validator(mode="after")
    def _range_rises(self):
        if self.min is not None and self.max is not None and self.max <= self.min:
            raise mistakes([Mistake(("max",), f"must be greater than min, {self.min:g}", ("min", "max"))])
        return self


Controls = Annotated[tuple[Control, ...], Field(max_length=MOST_SLIDERS)]


class Slider(NamedTuple):
    """A control as the viewer shows it."""

    path: str
    label: str
    min: float
    max: float
    value: float | None
    """None: it varies in time until it is moved."""


class NoSuchNumber(Exception):
    """A control's path leads nowhere, or to something that is no number."""

    def __init__(self, message: str, suggestion: str | None = None):
        super().__init__(message)
        self.suggestion = suggestion


def sliders_of(scene: Spec, control: Control) -> list[Slider]:
    """Return a control's sliders, one per component. Raises NoSuchNumber."""
    value, bounds = _follow(scene, control.path)
    components = {f".{k}": component for k, component in enumerate(value)} if isinstance(value, tuple) else {"": value}
    if len(components) > 3 or not all(is_number(each) or _varies(each) for each in components.values()):
        raise NoSuchNumber(f"{control.path} is not a number, nor a vector of numbers")
    sliders = []
    for ending, each in components.items():
        number = float(each) if is_number(each) else None
        low, high = _range(number or 0.0, bounds)
        low = low if control.min is None else control.min
        high = high if control.max is None else control.max
        sliders.append(Slider(control.path + ending, (control.label or control.path) + ending, low, max(high, low + 1e-6), number))
    return sliders


def _varies(value: Any) -> bool:
    return isinstance(value, Spec) and any(key in type(value).model_fields for key in ("keyframes", "sine", "expression"))


def _range(value: float, bounds: dict[str, float]) -> tuple[float, float]:
    """Return a range round a value: twice its size to either side, not beyond the field's bounds."""
    reach = 2.0 * abs(value) or 1.0
    low, high = max(value - reach, bounds.get("ge", value - reach)), min(value + reach, bounds.get("le", value + reach))
    if "gt" in bounds and low <= bounds["gt"]:
        low = bounds["gt"] + 1e-3 * reach
    if "lt" in bounds and high >= bounds["lt"]:
        high = bounds["lt"] - 1e-3 * reach
    return low, high


def _follow(scene: Spec, path: str) -> tuple[Any, dict[str, float]]:
    """Return the value at a path and the bounds of its field."""
    value, bounds, walked = scene, {}, []
    for part in path.split("."):
        if isinstance(value, ShortSpec) and part not in keys_of(type(value)):
            value = getattr(value, value.shorthand)
        known = _below(value)
        if part not in known:
            raise NoSuchNumber(f'{".".join(walked) or "a scene"} has nothing called "{part}"', nearest(part, list(known)))
        bounds = number_bounds_of(keys_of(type(value))[part]) if isinstance(value, Spec) else bounds
        value = known[part]
        walked.append(part)
    if isinstance(value, ShortSpec) and is_number(getattr(value, value.shorthand, None)):
        bounds = number_bounds_of(keys_of(type(value))[value.shorthand])
        value = getattr(value, value.shorthand)
    return value, bounds


def _below(value: Any) -> dict[str, Any]:
    """Return what a value holds, by the words that a path may take."""
    if isinstance(value, Spec):
        return {field.alias or name: getattr(value, name) for name, field in type(value).model_fields.items()}
    if isinstance(value, dict):
        return value
    if isinstance(value, tuple):
        return {str(k): item for k, item in enumerate(value)} | {item.name: item for item in value if getattr(item, "name", None)}
    return {}
