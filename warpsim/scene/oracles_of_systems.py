"""Oracles of the scene's own particles: how many live, how far they reach, the state to the bit, and the order of their solver."""

import re
from typing import Annotated, Any, ClassVar, Literal

from pydantic import BeforeValidator, Field
from pydantic_core import PydanticCustomError

from warpsim.scene.base import Mistake, Name
from warpsim.scene.oracles import AT, Bounded, Entry, FrameTime, Oracle, entry_misfits, entry_of, first_misfit, system_misfits
from warpsim.scene.particles import Solver
from warpsim.scene.strengths import Strength

_DIGEST = r"^[0-9a-f]{32}$"


def _digest(value: Any) -> Any:
    if isinstance(value, str) and not re.match(_DIGEST, value):
        raise PydanticCustomError("digest", "expected the hash that `run` prints, 32 digits 0-9 and a-f")
    return value


Digest = Annotated[str, BeforeValidator(_digest), Field(min_length=32, max_length=32, pattern=_DIGEST)]


class LiveCountOracle(Bounded, Oracle):
    """How many particles of a system, or of one of its emitters, live: births so far, times the part that lives on."""

    statistical: ClassVar[bool] = True
    type: Literal["live_count"] = Field("live_count", description="Kind of oracle.")
    system: Name = Field(description="Particle system that is counted.")
    emitter: Entry | None = Field(None, description="Emitter, by name or number, whose particles are counted; absent: all [1].")
    at: FrameTime = Field(description=AT)
    expect: Strength | None = Field(None, description="How many; absent: by the emitters' rates, bursts and lifetimes [1].")

    def misfits(self, scene) -> list[Mistake]:
        def lost() -> list[Mistake]:
            emitters = scene.systems[self.system].emitters
            return [] if self.emitter is None else entry_misfits("emitter", self.emitter, emitters, "emitter", ("systems",))

        return first_misfit(lambda: system_misfits(self.system, scene), lost)

    def lawless(self, scene) -> str | None:
        emitters = scene.systems[self.system].emitters
        counted = emitters if self.emitter is None else (entry_of(self.emitter, emitters),)
        if self.expect is None and any(emitter.on for emitter in counted):
            return f"no law says how many children of events {self.system} has: say what to expect"
        return None


class SizeOracle(Bounded, Oracle):
    """How far a system's particles lie from their mean place: the root of the mean square of the distance."""

    type: Literal["size"] = Field("size", description="Kind of oracle.")
    system: Name = Field(description="Particle system that is measured.")
    at: FrameTime = Field(description=AT)
    expect: Strength = Field(description="The distance [m].")

    def misfits(self, scene) -> list[Mistake]:
        return system_misfits(self.system, scene)


class HashOracle(Oracle):
    """The hash of the full state, as `run` prints it: equal for the same scene, seed, version and kind of device."""

    type: Literal["hash"] = Field("hash", description="Kind of oracle.")
    at: FrameTime = Field(description=AT)
    device: Literal["cpu", "cuda"] = Field("cpu", description="Kind of device it was taken on; on another it is skipped, and said to be.")
    expect: Digest = Field(description="The hash, 32 hexadecimal digits.")
    reason: str = Field("", max_length=2000, description="What it guards.")


class ConvergenceOrderOracle(Bounded, Oracle):
    """The order at which a solver's error falls with its step, fitted to errors in float64, as `converge` shows them."""

    type: Literal["convergence_order"] = Field("convergence_order", description="Kind of oracle.")
    system: Name = Field(description="Particle system whose motion is followed over the scene's duration.")
    solver: Solver | None = Field(None, description="Method of integration; absent: the system's.")
    expect: Strength | None = Field(None, description="The order; absent: the method's in theory [1].")

    def misfits(self, scene) -> list[Mistake]:
        return system_misfits(self.system, scene)
