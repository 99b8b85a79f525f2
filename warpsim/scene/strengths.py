"""Strengths: numbers that may vary in time, as a constant, keyframes, a sine or an expression of t."""

from typing import Annotated, Any

from pydantic import AfterValidator, Field, field_validator
from pydantic_core import PydanticCustomError

from warpsim.scene.base import LARGEST_STRENGTH, Floor, Mistake, Number, Spec, form_by_key, is_number, mistakes, one_of_forms
from warpsim.scene.expressions import TIME, ExpressionError, compile_expression

Amount = Annotated[Number, Field(ge=-LARGEST_STRENGTH, le=LARGEST_STRENGTH)]
Moment = Annotated[Number, Field(ge=-1e7, le=1e7, description="Time [s].")]


def rising(keyframes: tuple) -> tuple:
    """Return pairs of a time and something; raises the error of a validator unless the times strictly rise."""
    found = [
        Mistake((k, 0), f"times must rise: {keyframes[k][0]:g} s does not come after {keyframes[k - 1][0]:g} s")
        for k in range(1, len(keyframes))
        if keyframes[k][0] <= keyframes[k - 1][0]
    ]
    if found:
        raise mistakes(found)
    return keyframes


class Keyframes(Spec):
    """Values at given times: linear between them, held constant before the first and after the last."""

    keyframes: tuple[tuple[Moment, Amount], ...] = Field(
        min_length=1, max_length=10_000, description="Pairs of time in seconds and value, times strictly rising."
    )

    @field_validator("keyframes")
    @classmethod
    def _times_rise(cls, value):
        return rising(value)


class SineWave(Spec):
    """The wave mean + amplitude * sin(2 pi t / period + phase)."""

    mean: Amount = Field(0.0, description="Value around which the wave swings.")
    amplitude: Amount = Field(description="Largest distance from the mean.")
    period: Number = Field(gt=0.0, le=1e7, description="Time of one full swing [s].")
    phase: Number = Field(0.0, ge=-1e3, le=1e3, description="Angle of the wave at t = 0 [rad].")


class Sine(Spec):
    """A value that swings."""

    sine: SineWave = Field(description="The wave: mean + amplitude * sin(2 pi t / period + phase).")


def parsed(text: str, variables: tuple[str, ...] = TIME) -> str:
    """Return the text of a formula of the variables. Raises the error of a validator, which points at the character."""
    try:
        compile_expression(text, variables)
    except ExpressionError as error:
        context = {"what": error.message, "offset": error.offset, "suggestion": error.suggestion or ""}
        raise PydanticCustomError("expression", "{what}", context) from None
    return text


class Formula(Spec):
    """A value written as an expression of the time t in seconds, e.g. "2 + sin(2*pi*t)"."""

    expression: str = Field(min_length=1, max_length=2000, description="Text in t, in seconds: numbers, + - * / ^, pi, e and functions.")

    @field_validator("expression")
    @classmethod
    def _parses(cls, value: str) -> str:
        return parsed(value)

    @property
    def program(self) -> tuple[tuple[str, float], ...]:
        """The expression as postfix instructions (operation name, operand); the operand counts for "constant" only."""
        return compile_expression(self.expression)


STRENGTH_KEYS = ("keyframes", "sine", "expression")


def _form(value: Any) -> str | None:
    return "number" if is_number(value) else form_by_key(value, STRENGTH_KEYS)


Strength = one_of_forms({"number": Amount, "keyframes": Keyframes, "sine": Sine, "expression": Formula}, _form)


def _not_negative(value: Any) -> Any:
    if isinstance(value, Keyframes):
        found = [Mistake(("keyframes", k, 1), "must not be negative") for k, (_, amount) in enumerate(value.keyframes) if amount < 0.0]
    else:
        found = [Mistake((), f"must not be negative, got {value:g}")] if is_number(value) and value < 0.0 else []
    if found:
        raise mistakes(found)
    return value


# Where a sine or an expression dips below zero, zero is what counts: a swing may well be used to switch something on and off.
PositiveStrength = Annotated[Strength, Floor(ge=0.0), AfterValidator(_not_negative)]
