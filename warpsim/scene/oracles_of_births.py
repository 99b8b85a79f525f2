"""Oracles of births: one emitter's own births, with nothing acting on what is born. They are counted, and so are their initial values."""

from typing import Annotated, ClassVar, Literal

from pydantic import Field, model_validator

from warpsim.scene.base import Mistake, Name, Spec, WholeNumber, mistakes
from warpsim.scene.oracles import Bounded, Entry, FrameTime, Oracle, entry_misfits, entry_of, first_misfit, system_misfits
from warpsim.scene.strengths import Strength

OF = Literal["count", "speed", "cosine", "lifetime", "mass", "radius"]
OF_WORDS = (
    "births per interval of the rate; or of each birth: speed, cosine of the angle to the emitter's direction, lifetime, mass, radius."
)
NARROWEST = 1.0  # degree


class Births(Spec):
    """The births of one emitter within a window of time."""

    system: Name = Field(description="Particle system that the emitter belongs to.")
    emitter: Entry = Field(0, description="The emitter, by name or number [1].")
    from_: FrameTime = Field(0.0, alias="from", description="Beginning of the window in which births are counted [s].")
    to: FrameTime = Field(description="End of the window [s].")

    @model_validator(mode="after")
    def _window_has_a_length(self):
        if self.to <= self.from_:
            raise mistakes([Mistake(("to",), f"must come after from, {self.from_:g} s", ("from", "to"))])
        return self

    def emitter_in(self, scene):
        """Return the emitter's spec."""
        return entry_of(self.emitter, scene.systems[self.system].emitters)

    def births_misfits(self, scene) -> list[Mistake]:
        """Return the system or the emitter that the scene does not have."""
        return first_misfit(
            lambda: system_misfits(self.system, scene),
            lambda: entry_misfits("emitter", self.emitter, scene.systems[self.system].emitters, "emitter", ("systems",)),
        )

    def births_lawless(self, scene) -> str | None:
        """Return why the births of the emitter cannot be told beforehand."""
        return "the emitter listens to events: its births follow those of others" if self.emitter_in(scene).on else None


class Moments(Births):
    """What mean and variance are taken of."""

    of: OF = Field("count", description=OF_WORDS)

    def misfits(self, scene) -> list[Mistake]:
        """Return what the oracle names and the scene does not have."""
        return self.births_misfits(scene)

    def lawless(self, scene) -> str | None:
        """Return why no law says what to expect."""
        emitter = self.emitter_in(scene)
        if self.of == "count" and emitter.rate is None:
            return "the emitter has bursts only: there is nothing to count per interval"
        if self.of == "cosine" and (emitter.velocity is None or emitter.velocity.speed.mean <= emitter.velocity.speed.spread):
            return "the emitter throws nothing in its direction, or some against it"
        return self.births_lawless(scene)


class EmissionMeanOracle(Bounded, Moments, Oracle):
    """The mean of the births per interval, mean of the rate times the interval; or of an initial value."""

    statistical: ClassVar[bool] = True
    type: Literal["emission_mean"] = Field("emission_mean", description="Kind of oracle.")
    expect: Strength | None = Field(None, description="The mean; absent: by the emitter's law [unit of the quantity].")


class EmissionVarianceOracle(Bounded, Moments, Oracle):
    """The variance of the births per interval, spread^2/3 for a uniform z, spread^2 otherwise; or of an initial value."""

    statistical: ClassVar[bool] = True
    type: Literal["emission_variance"] = Field("emission_variance", description="Kind of oracle.")
    expect: Strength | None = Field(None, description="The variance; absent: by the emitter's law [unit of the quantity, squared].")


class UniformityOracle(Bounded, Births, Oracle):
    """How evenly births fill their shape, or directions their cone: chi^2 over bins, expected as great as its degrees of freedom."""

    statistical: ClassVar[bool] = True
    type: Literal["uniformity"] = Field("uniformity", description="Kind of oracle.")
    of: Literal["place", "direction"] = Field("place", description="Places over the shape, or directions over the cone per solid angle.")
    bins: Annotated[WholeNumber, Field(ge=2, le=10_000)] = Field(
        32, description="Bins along each coordinate in which even births are even [1]."
    )
    expect: Strength | None = Field(None, description="Chi^2; absent: its degrees of freedom [1].")

    def misfits(self, scene) -> list[Mistake]:
        return self.births_misfits(scene)

    def lawless(self, scene) -> str | None:
        emitter = self.emitter_in(scene)
        if self.of == "place" and emitter.shape.type == "point":
            return "all births of a point are in one place"
        if self.of == "place" and emitter.shape.type == "segment" and emitter.shape.start == emitter.shape.end:
            return "the segment has no length"
        if self.of == "direction" and (emitter.velocity is None or emitter.velocity.cone < NARROWEST):
            return f"the emitter throws in one direction, or into a cone below {NARROWEST:g} degree that float32 does not resolve"
        if self.of == "direction" and emitter.velocity.speed.mean <= emitter.velocity.speed.spread:
            return "the emitter throws some against its direction, or not at all"
        return self.births_lawless(scene)
