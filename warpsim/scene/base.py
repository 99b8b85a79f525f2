"""What every part of a scene is made of: the frozen base model, checked numbers, vectors, names, and unions told apart by their look.

A description ends in its SI unit in brackets, "Frames per second [1/s]."; a field without brackets takes the unit of the field around it.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Annotated, Any, ClassVar, NamedTuple, Union

from pydantic import AfterValidator, BaseModel, BeforeValidator, ConfigDict, Discriminator, Field, Strict, Tag, model_validator
from pydantic_core import PydanticCustomError

from warpsim.scene.nearest import nearest

# float32 on the device: squares of what a user types must not overflow.
LARGEST_COORDINATE = 1e9
LARGEST_STRENGTH = 1e12


class Spec(BaseModel):
    """A frozen group of scene fields; unknown keys are mistakes."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False, defer_build=True)


class ShortSpec(Spec):
    """A group that a bare value may stand for: `lifetime: 2` is `lifetime: {mean: 2}`."""

    shorthand: ClassVar[str]
    """The key that the bare value is spelled out to."""

    @classmethod
    def is_short(cls, value: Any) -> bool:
        """Tell whether a value from YAML or Python is the bare form."""
        return isinstance(value, (int, float)) and not isinstance(value, bool)

    @classmethod
    def long_form(cls, value: Any) -> dict[str, Any]:
        """Return the mapping that the bare value stands for."""
        return {cls.shorthand: value}

    @model_validator(mode="before")
    @classmethod
    def _spell_out(cls, value: Any) -> Any:
        return cls.long_form(value) if cls.is_short(value) else value


class Mistake(NamedTuple):
    """A broken rule between fields."""

    path: tuple[str | int, ...]
    """Below the model that holds the rule."""
    message: str
    depends: tuple[str | tuple[str | int, ...], ...] = ()
    """Keys the rule reads, or paths to them: where one of them is wrong itself, this message would only confuse and is left out."""
    suggestion: str | None = None


def mistakes(found: list[Mistake]) -> PydanticCustomError:
    """Build the error that a validator raises for broken rules."""
    summary = "; ".join(f"{'.'.join(map(str, one.path))}: {one.message}" if one.path else one.message for one in found)
    return PydanticCustomError("rule", "{summary}", {"summary": summary, "found": found})


def _whole(value: Any) -> Any:
    # 1e5 is a float in YAML, yet a whole number to whoever typed it.
    return int(value) if isinstance(value, float) and value.is_integer() else value


def _nonzero(value: tuple[float, float, float]) -> tuple[float, float, float]:
    if max(map(abs, value)) < 1e-9:
        raise PydanticCustomError("zero_direction", "must not be zero: it gives a direction")
    return value


@dataclass(frozen=True)
class Floor:
    """The least value of a quantity that is more than a number (a strength, a distribution); for its description, a validator holds it."""

    ge: float | None = None
    gt: float | None = None


Number = Annotated[float, Strict()]
WholeNumber = Annotated[int, Strict(), BeforeValidator(_whole)]
Truth = Annotated[bool, Strict()]
Component = Annotated[float, Strict(), Field(ge=-LARGEST_COORDINATE, le=LARGEST_COORDINATE)]
Vec3 = tuple[Component, Component, Component]
Direction = Annotated[Vec3, AfterValidator(_nonzero)]
Name = Annotated[str, Field(min_length=1, max_length=64, pattern=r"^[A-Za-z_][A-Za-z0-9_-]*$")]


def tag(word: str) -> str:
    """Return the mark that a union's member leaves in the path of a pydantic error (no key of a scene looks like it)."""
    return f"<{word}>"


def is_tag(part: str | int) -> bool:
    """Tell whether a part of a pydantic error's path marks a union's member."""
    return isinstance(part, str) and part.startswith("<") and part.endswith(">")


def _by_type(value: Any) -> str | None:
    kind = value.get("type") if isinstance(value, Mapping) else getattr(value, "type", None)
    return tag(kind) if isinstance(kind, str) else None


def type_name(spec: type[Spec]) -> str:
    """Return the word that `type:` takes for a spec class."""
    return spec.model_fields["type"].default


def kinds_of(base: type[Spec]) -> list[type[Spec]]:
    """Return a family's spec classes that have a `type`, those of a class in between included."""
    return [kind for spec in base.__subclasses__() for kind in ([spec] if "type" in spec.model_fields else kinds_of(spec))]


def one_of_types(base: type[Spec]) -> Any:
    """Build the union of a family's spec classes, told apart by `type`; defining a subclass is what registers it."""
    members = [Annotated[spec, Tag(tag(type_name(spec)))] for spec in kinds_of(base)]
    return Annotated[Union[tuple(members)], Discriminator(_by_type)]  # noqa: UP007 (built at run time)


def one_of_forms(forms: Mapping[str, Any], form: Callable[[Any], str | None]) -> Any:
    """Build the union of forms one value may take (a number, or one of several mappings); `form` names the form of a value."""

    def discriminate(value: Any) -> str | None:
        word = form(value)
        return None if word is None else tag(word)

    members = tuple(Annotated[kind, Tag(tag(word))] for word, kind in forms.items())
    return Annotated[Union[members], Discriminator(discriminate)]  # noqa: UP007 (built at run time)


def form_by_key(value: Any, keys: tuple[str, ...]) -> str | None:
    """Name the form of a mapping by the key it has or, misspelled, nearly has; a spec object by the field it has."""
    if isinstance(value, Mapping):
        words = [key for key in value if isinstance(key, str)]
        exact = [key for key in keys if key in words]
        close = [guess for word in words if (guess := nearest(word, keys))]
        return (exact or close or [None])[0]
    return next((key for key in keys if isinstance(value, Spec) and key in type(value).model_fields), None)


def is_number(value: Any) -> bool:
    """Tell whether a value is a number and not true or false."""
    return isinstance(value, (int, float)) and not isinstance(value, bool)
