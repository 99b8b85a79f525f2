"""Oracles of motion: a test particle is released, moves by the laws of a system, and is compared with theory.

It has the system's solver, coupling, substeps and surroundings, and touches nothing: a scene is not changed by being verified.
"""

from typing import Annotated, Any, Literal

from pydantic import Field, model_validator

from warpsim.scene.base import LARGEST_COORDINATE, Mistake, Name, Number, Spec, Vec3, WholeNumber, is_number, mistakes
from warpsim.scene.oracles import AT, Bounded, Entry, FrameTime, Oracle, entry_misfits, entry_of, felt, first_misfit, system_misfits
from warpsim.scene.particles import Drag, Feels, StokesDrag
from warpsim.scene.springs import Network
from warpsim.scene.strengths import Moment, Strength

Bulk = Annotated[Number, Field(gt=0.0, le=LARGEST_COORDINATE)]
Expected3 = tuple[Strength, Strength, Strength]
_OWN = ("start", "velocity", "mass", "radius", "feels")
HOLDING = ("pins", "drag", "air", "water")
GIVING_OR_TAKING = ("damping", "pin_motion", "drag", "air", "water", "muscles", "tear", "strain_limit", "self_collision")


class Released(Spec):
    """A test particle. What is not said of it is as an emitter of the system has it on average."""

    system: Name = Field(description="Particle system by whose laws it moves.")
    emitter: Entry = Field(0, description="Emitter of the system, by name or number, that says what is not said here [1].")
    start: Vec3 | None = Field(None, description="Where it is released; absent: in the middle of the emitter [m].")
    velocity: Vec3 | None = Field(None, description="Velocity it is released with; absent: the emitter's mean along its direction [m/s].")
    mass: Bulk | None = Field(None, description="Its mass; absent: the emitter's mean [kg].")
    radius: Bulk | None = Field(None, description="Its radius, for drag by viscosity; absent: the emitter's mean [m].")
    release: Moment = Field(0.0, description="When it is released [s].")
    feels: Feels | None = Field(None, description="What acts on it; absent: what acts on the system.")

    @model_validator(mode="after")
    def _is_released_before(self):
        if getattr(self, "at", self.release + 1.0) <= self.release:
            raise mistakes([Mistake(("at",), f"must come after the release, {self.release:g} s", ("at", "release"))])
        return self

    def spec_in(self, scene) -> Any:
        """Return the system's spec."""
        return scene.systems[self.system]

    def feels_in(self, scene) -> Feels:
        """Return what acts on the particle."""
        return self.feels or self.spec_in(scene).feels

    def emitter_in(self, scene) -> Any:
        """Return the emitter, None where the system has none at all."""
        return entry_of(self.emitter, self.spec_in(scene).emitters)

    def release_misfits(self, scene) -> list[Mistake]:
        """Return what the particle names and the scene does not have."""
        emitters = scene.systems[self.system].emitters if not system_misfits(self.system, scene) else ()
        return first_misfit(
            lambda: system_misfits(self.system, scene),
            lambda: entry_misfits("emitter", self.emitter, emitters, "emitter", ("systems",)) if emitters else [],
            lambda: [found for key in ("flow", "forces", "colliders") for found in self._unfelt(key, scene)],
        )

    def _unfelt(self, key: str, scene) -> list[Mistake]:
        entries = getattr(scene, key)
        names = (*entries, *scene.obstacles) if key == "flow" else entries  # an obstacle's own flow goes by its name
        chosen = getattr(self.feels, key) if self.feels else True
        wrong = [
            (k, found)
            for k, wanted in enumerate(chosen if isinstance(chosen, tuple) else ())
            for found in entry_misfits(key, wanted, entries if isinstance(wanted, int) else names, f"entry of {key}", (key,))
        ]
        return [found._replace(path=("feels", key, k)) for k, found in wrong]


def unsteady(oracle: Released, scene) -> str | None:
    """Return what is against the laws of a constant wind: a flow that is not the same everywhere and always, or forces."""
    feels, spec = oracle.feels_in(scene), oracle.spec_in(scene)
    moves = spec.coupling is not None and feels.flow not in (False, ())
    winds = felt(feels.flow, scene.flow) if moves else []
    steady = all(wind.type == "uniform" and all(map(is_number, wind.velocity)) for wind in winds) and not (moves and scene.obstacles)
    if steady and (not felt(feels.forces, scene.forces) or spec.coupling == "tracer"):
        return None
    what = "forces" if steady else "a flow that is not a constant wind"
    return f"the law holds without {what}: say what to expect, or what the particle feels (feels: {{flow: [], forces: []}})"


class TerminalSpeedOracle(Bounded, Released, Oracle):
    """The speed against a constant wind at which drag carries the weight: m g/alpha, or with viscosity m g/(6 pi viscosity radius)."""

    type: Literal["terminal_speed"] = Field("terminal_speed", description="Kind of oracle.")
    at: FrameTime = Field(description="When it is measured; late enough to have settled [s].")
    expect: Strength | None = Field(None, description="The speed against the wind; absent: by the law [m/s].")

    def misfits(self, scene) -> list[Mistake]:
        return self.release_misfits(scene)

    def lawless(self, scene) -> str | None:
        coupling = self.spec_in(scene).coupling
        falls = self.feels_in(scene).gravity and any(scene.gravity)
        drags = isinstance(coupling, Drag) and coupling.alpha or isinstance(coupling, StokesDrag) and coupling.viscosity
        if self.expect is not None or (falls and drags):
            return unsteady(self, scene)
        return f"{self.system} has no terminal speed: it has no {'drag (coupling)' if falls else 'gravity'}"


class RelaxationOracle(Bounded, Released, Oracle):
    """The velocity on the way to the flow's: w + (v0 - w) exp(-t/tau), tau = m/alpha, w = flow + gravity tau; in a constant wind."""

    type: Literal["relaxation"] = Field("relaxation", description="Kind of oracle.")
    at: FrameTime = Field(description=AT)
    expect: Expected3 | None = Field(None, description="The velocity; absent: by the law [m/s].")

    def misfits(self, scene) -> list[Mistake]:
        return self.release_misfits(scene)

    def lawless(self, scene) -> str | None:
        if self.expect is not None or isinstance(self.spec_in(scene).coupling, (Drag, StokesDrag)):
            return None if self.expect is not None else unsteady(self, scene)
        return f"{self.system} does not relax: it has no drag (coupling: {{alpha: …}} or {{viscosity: …}})"


class ArcOracle(Bounded, Released, Oracle):
    """The place on the arc of a throw: x0 + v0 t + g t^2/2; with drag in a constant wind x0 + w t + (v0 - w) tau (1 - exp(-t/tau))."""

    type: Literal["arc"] = Field("arc", description="Kind of oracle.")
    at: FrameTime = Field(description=AT)
    expect: Expected3 | None = Field(None, description="The place; absent: by the law [m].")

    def misfits(self, scene) -> list[Mistake]:
        return self.release_misfits(scene)

    def lawless(self, scene) -> str | None:
        return None if self.expect is not None else unsteady(self, scene)


class OrbitOracle(Bounded, Released, Oracle):
    """The time of one turn about an attractor, a vortex or a rotation, the mean of several: 2 pi sqrt(m/k), 4 pi^2 r^2/C and the like."""

    type: Literal["orbit"] = Field("orbit", description="Kind of oracle.")
    force: Entry | None = Field(None, description="Attractor it goes round, by name or number [1].")
    flow: Entry | None = Field(None, description="Vortex or rotation that a tracer goes round, by name or number [1].")
    turns: WholeNumber = Field(1, ge=1, le=1000, description="Turns that are timed [1].")
    expect: Strength | None = Field(None, description="The time of one turn; absent: by the law of what it goes round [s].")

    def center_in(self, scene) -> Any:
        """Return the attractor or the flow primitive that it goes round, None if the scene has no such entry."""
        return entry_of(self.force, scene.forces) if self.flow is None else entry_of(self.flow, scene.flow)

    @model_validator(mode="after")
    def _goes_round_one_thing(self):
        if (self.force is None) == (self.flow is None):
            raise mistakes([Mistake((), "an orbit goes round one thing: say either force or flow", ("force", "flow"))])
        return self

    def misfits(self, scene) -> list[Mistake]:
        return first_misfit(lambda: self.release_misfits(scene), lambda: self._lost(scene))

    def _lost(self, scene) -> list[Mistake]:
        if self.flow is None:
            return entry_misfits("force", self.force, scene.forces, "force", ("forces",))
        return entry_misfits("flow", self.flow, scene.flow, "flow primitive", ("flow",))

    def lawless(self, scene) -> str | None:
        center = self.center_in(scene)
        strength = getattr(center, "strength_field", "strength")
        if center.type not in ("attractor", "vortex", "rotation"):
            return f"nothing goes round a {center.type}, but round an attractor, a vortex or a rotation"
        if self.expect is None and not is_number(getattr(center, strength)):
            return f"the strength of this {center.type} varies in time: say what to expect"
        return None


class BounceHeightOracle(Bounded, Released, Oracle):
    """The height to which a particle rises after its bounces on a plane, e^2 of the last one's each time, e being the restitution."""

    type: Literal["bounce_height"] = Field("bounce_height", description="Kind of oracle.")
    collider: Entry = Field(0, description="The plane it bounces on, by name or number [1].")
    at: FrameTime = Field(description="When it is measured, between two bounces [s].")
    expect: Strength | None = Field(None, description="The height above the plane; absent: by the law [m].")

    def misfits(self, scene) -> list[Mistake]:
        return first_misfit(
            lambda: self.release_misfits(scene),
            lambda: entry_misfits("collider", self.collider, scene.colliders, "collider", ("colliders",)),
        )

    def lawless(self, scene) -> str | None:
        plane = entry_of(self.collider, scene.colliders)
        if plane.type != "plane" or plane.motion is not None or plane.action != "bounce":
            return f"heights are above a plane at rest that is bounced on, and {self.collider} is none"
        along = [a * b for a, b in zip(plane.normal, scene.gravity, strict=True)]
        size = sum(a * a for a in plane.normal) * sum(b * b for b in scene.gravity)
        if not self.feels_in(scene).gravity or sum(along) >= 0.0 or sum(along) ** 2 < size * (1.0 - 1e-9):
            return "nothing falls onto this plane: gravity must point straight against it"
        if self.spec_in(scene).coupling is not None or felt(self.feels_in(scene).forces, scene.forces):
            return "the law of bouncing is for a free fall, without drag and forces"
        return None


class Subject(Released):
    """A test particle, or the living particles of the system itself."""

    of: Literal["particle", "system"] = Field("particle", description="Of a test particle, or of the system's living particles together.")

    @model_validator(mode="after")
    def _has_what_its_subject_has(self):
        wrong = [key for key in _OWN if self.of == "system" and getattr(self, key) is not None]
        if wrong:
            raise mistakes([Mistake((key,), f"{key} is for a test particle (of: particle)", ("of", key)) for key in wrong])
        if self.of == "system" and self.release < 0.0:
            raise mistakes([Mistake(("release",), "of a system's particles it is a frame's time: 0 or later", ("of", "release"))])
        return self

    def release_misfits(self, scene) -> list[Mistake]:
        if not isinstance(scene.systems.get(self.system), Network):
            return super().release_misfits(scene)
        message = f"{self.system} is a network, whose points do not move alone: say of: system"
        return [] if self.of == "system" else [Mistake(("of",), message, ("of", "system"))]

    def unkept(self, scene, keys: tuple[str, ...]) -> str | None:
        """Return what of the keys of a network is not zero or empty, so that its law does not hold; None of particles."""
        spec = scene.systems[self.system]
        return next((key for key in keys if isinstance(spec, Network) and spec.acts(key)), None)


class PositionOracle(Bounded, Subject, Oracle):
    """The place of a test particle, the mean place of a system's particles, or the center of mass of a network."""

    type: Literal["position"] = Field("position", description="Kind of oracle.")
    at: FrameTime = Field(description=AT)
    expect: Expected3 = Field(description="The place [m].")

    def misfits(self, scene) -> list[Mistake]:
        return self.release_misfits(scene)


class EnergyOracle(Bounded, Subject, Oracle):
    """Kinetic energy and that in gravity and forces, of a test particle, or of the particles that live from `release` to `at`.

    Of a network also what its springs hold.
    """

    type: Literal["energy"] = Field("energy", description="Kind of oracle.")
    at: FrameTime = Field(description=AT)
    expect: Strength | None = Field(None, description="The energy; absent: as much as at `release`, for it is kept [J].")

    def misfits(self, scene) -> list[Mistake]:
        return self.release_misfits(scene)

    def lawless(self, scene) -> str | None:
        if self.spec_in(scene).coupling is not None and self.expect is None:
            return f"the flow gives energy to {self.system} and takes it (coupling): say what to expect"
        if self.expect is None and (key := self.unkept(scene, GIVING_OR_TAKING)):
            return f"the energy of {self.system} does not stay ({key}): say what to expect"
        forces = felt(self.feels_in(scene).forces, scene.forces)
        odd = next((force for force in forces if force.type not in ("attractor", "pairwise")), None)
        odd = odd or next((force for force in forces if self.expect is None and not is_number(force.strength)), None)
        return odd and f"{self.system} feels a force without a potential that stays: {odd.type}"


class MomentumOracle(Bounded, Subject, Oracle):
    """The momentum of the particles that live from `release` to `at`, or of a test particle: kept but for gravity."""

    type: Literal["momentum"] = Field("momentum", description="Kind of oracle.")
    of: Literal["particle", "system"] = Field("system", description="Of a test particle, or of the system's living particles together.")
    at: FrameTime = Field(description=AT)
    expect: Expected3 | None = Field(None, description="The momentum; absent: that at `release`, and what gravity adds [kg m/s].")

    def misfits(self, scene) -> list[Mistake]:
        return self.release_misfits(scene)

    def lawless(self, scene) -> str | None:
        if self.expect is None and (key := self.unkept(scene, HOLDING)):
            return f"something outside acts on {self.system} ({key}): say what to expect"
        outer = [force for force in felt(self.feels_in(scene).forces, scene.forces) if force.type != "pairwise"]  # pairs cancel
        if self.expect is not None or (self.spec_in(scene).coupling is None and not outer):
            return None
        return f"forces or the flow change the momentum of {self.system}: say what to expect"
