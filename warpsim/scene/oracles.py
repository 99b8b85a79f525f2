"""Oracles: what a scene states about itself, with a tolerance and its reason. `verify` measures them; docs/verify.md says how.

The kinds are in oracles_of_flow.py, oracles_of_motion.py and oracles_of_births.py; verification.py makes the union.
"""

from collections.abc import Callable
from typing import Annotated, Any, ClassVar

from pydantic import Field, model_validator

from warpsim.scene.base import Mistake, Name, Number, ShortSpec, Spec, mistakes
from warpsim.scene.nearest import listed, nearest
from warpsim.scene.particles import Entry as Entry
from warpsim.scene.particles import Particles

AT = "When it is measured [s]."
POINT = "Where it is measured [m]."
FrameTime = Annotated[Number, Field(ge=0.0, le=1e7)]
"""When particles are looked at: from frame 0 on, at the frame nearest to it."""


class Oracle(Spec):
    """A statement about the scene that can be measured. A subclass of its own registers itself by being defined."""

    name: Name | None = Field(None, description="Name in the table of results and for `--set verify.NAME.…`.")

    def misfits(self, scene) -> list[Mistake]:
        """Return what the oracle names and the scene does not have, at paths below the oracle."""
        return []

    def lawless(self, scene) -> str | None:
        """Return why no law says what to expect, None if one does. This is no mistake in a scene: a run may set gravity to zero."""
        return None


class Tolerance(ShortSpec):
    """How far the measured value may lie from the expected one. A bare number is absolute."""

    shorthand: ClassVar[str] = "absolute"
    absolute: Number | None = Field(None, ge=0.0, description="In the unit of the quantity itself.")
    relative: Number | None = Field(None, ge=0.0, description="As a part of the expected value [1].")
    sigma: Number | None = Field(None, gt=0.0, description="In standard errors, for oracles that count random numbers [1].")

    @model_validator(mode="after")
    def _is_one(self):
        given = [key for key in ("absolute", "relative", "sigma") if getattr(self, key) is not None]
        if len(given) != 1:
            raise mistakes(
                [
                    Mistake(
                        (), f"say one of absolute, relative and sigma, not {' and '.join(given) or 'none'}", tuple(type(self).model_fields)
                    )
                ]
            )
        return self


class Bounded(Spec):
    """What an oracle that compares numbers has besides."""

    statistical: ClassVar[bool] = False
    """Whether it counts random numbers, so that a tolerance may be in standard errors."""

    tolerance: Tolerance = Field(
        description="How far the measured value may be off: a number (absolute), {relative: …}, or {sigma: …} [unit of the quantity]."
    )
    reason: str = Field("", max_length=2000, description="Why this tolerance: what error the method, or rounding, must be allowed.")

    @model_validator(mode="after")
    def _tolerance_fits(self):
        if self.tolerance.sigma is not None and not self.statistical:
            message = "standard errors are for oracles that count random numbers; say absolute or relative"
            raise mistakes([Mistake(("tolerance", "sigma"), message, ("tolerance",))])
        return self


def system_misfits(system: str, scene) -> list[Mistake]:
    """Return the mistake if the scene has no particle system of that name."""
    if isinstance(scene.systems.get(system), Particles):
        return []
    names = [name for name, spec in scene.systems.items() if isinstance(spec, Particles)]
    message = f'there is no particle system "{system}" (systems: {listed(names) or "none"})'
    return [Mistake(("system",), message, ("systems",), nearest(system, names))]


def entry_misfits(key: str, wanted: Any, entries: tuple[Any, ...], what: str, depends: tuple[str, ...]) -> list[Mistake]:
    """Return the mistake if a list has no entry of that name or number."""
    if entry_of(wanted, entries) is not None:
        return []
    names = [entry.name for entry in entries if entry.name]
    known = f"names: {listed(names)}" if names else f"{len(entries)}, without names, counted from 0"
    guess = nearest(wanted, names) if isinstance(wanted, str) else None
    return [Mistake((key,), f'there is no {what} "{wanted}" ({known})', depends, guess)]


def entry_of(wanted: str | int, entries: tuple[Any, ...]) -> Any:
    """Return the entry of a list with that name or number, None if there is none."""
    if isinstance(wanted, int):
        return entries[wanted] if wanted < len(entries) else None
    return next((entry for entry in entries if entry.name == wanted), None)


def felt(selection: bool | tuple[str | int, ...], entries: tuple[Any, ...]) -> list[Any]:
    """Return the entries that a selection of `feels` stands for."""
    if isinstance(selection, bool):
        return list(entries) if selection else []
    return [entry for k, entry in enumerate(entries) if k in selection or entry.name in selection]


def first_misfit(*checks: Callable[[], list[Mistake]]) -> list[Mistake]:
    """Return the mistakes of the first check that finds any: later ones would stumble over the same."""
    return next((found for check in checks if (found := check())), [])
