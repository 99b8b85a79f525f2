"""The scene: everything a user writes, validated and frozen."""

from typing import Annotated, Literal

from pydantic import Field, model_validator

from warpsim.scene.base import Mistake, Name, Number, Spec, Vec3, WholeNumber, mistakes
from warpsim.scene.camera import Camera
from warpsim.scene.colliders import ColliderUnion
from warpsim.scene.events import event_mistakes
from warpsim.scene.flocks import attention_mistakes, outlying_mistakes
from warpsim.scene.flow import FlowUnion
from warpsim.scene.forces import ForceUnion, pair_mistakes
from warpsim.scene.nearest import listed, nearest
from warpsim.scene.obstacles import ObstacleUnion, unanswerable
from warpsim.scene.pacing import pacing_mistakes
from warpsim.scene.particles import Particles, System, repeated_names
from warpsim.scene.systems import SystemUnion
from warpsim.scene.timing import Time
from warpsim.scene.verification import Oracles, misfit_oracles
from warpsim.scene.viewing import Controls, NoSuchNumber, Slider, Viewing, sliders_of

_MOST_GUESSES = 20
_MOST_TOLD = 300


class Limits(Spec):
    """What a run may use, and what happens when it blows up."""

    memory: Annotated[Number, Field(gt=0.0, le=1e6)] | None = Field(
        None, description="Most memory a run may take; absent: what is free [GiB]."
    )
    extent: Number = Field(1e6, gt=0.0, le=1e9, description="Distance from the origin beyond which a run counts as unstable [m].")
    unstable: Literal["stop", "reset", "kill"] = Field(
        "stop",
        description="When unstable: stop with the last good state; reset: empty the system, its emitters go on; kill: remove the culprits.",
    )


class Scene(Spec):
    """A scene: SI units throughout, y is up."""

    name: str = Field(min_length=1, max_length=200, description="Title of the scene.")
    description: str = Field("", max_length=10_000, description="What it shows.")
    seed: WholeNumber = Field(0, ge=0, le=2**32 - 1, description="Start of all random numbers: same seed, same run [1].")
    time: Time = Field(Time(), description="Frames, steps and duration.")
    gravity: Vec3 = Field((0.0, -9.81, 0.0), description="Acceleration of gravity [m/s^2].")
    flow: tuple[FlowUnion, ...] = Field((), max_length=4096, description="Flow primitives; their velocities add up.")
    obstacles: tuple[ObstacleUnion, ...] = Field((), max_length=16, description="Bodies that the flow goes round.")
    forces: tuple[ForceUnion, ...] = Field((), max_length=4096, description="Force fields; they add up.")
    colliders: tuple[ColliderUnion, ...] = Field((), max_length=256, description="What is in the way of particles.")
    systems: dict[Name, SystemUnion] = Field({}, description="Systems by name; may be empty (a flow to look at and probe).")
    camera: Camera | None = Field(None, description="Where the viewer looks from; absent: chosen to see everything.")
    viewer: Viewing = Field(Viewing(), description="How the viewer shows it.")
    controls: Controls = Field((), description="Numbers that get a slider in the viewer: a path, or {path, min, max, label}.")
    verify: Oracles = Field((), description="Oracles: what the scene states about itself, for the verb `verify` to measure.")
    limits: Limits = Field(Limits(), description="What a run may use, and what happens when it blows up.")

    @model_validator(mode="after")
    def _names_agree(self):
        lists = ("flow", "obstacles", "forces", "colliders", "verify")
        found = [mistake for key in lists for mistake in repeated_names(key, getattr(self, key))]
        found += _shared_names(self)
        for k, obstacle in enumerate(self.obstacles):
            found += _unknown_entries(("obstacles", k, "answers"), "flow", obstacle.answers, self.flow)
        found += unanswerable(self.obstacles, self.flow)
        for name, system in self.systems.items():
            for key, also in (("flow", self.obstacles), ("forces", ()), ("colliders", ())):
                found += _unknown_entries(("systems", name, "feels", key), key, getattr(system.feels, key), getattr(self, key), also)
            for key in ("forces", "colliders") if isinstance(system, Particles) and system.motion == "ballistic" else ():
                if getattr(self, key) and getattr(system.feels, key) not in (False, ()):
                    words = f"knows gravity only, but the scene has {key} (add feels: {{{key}: false}} to ignore them)"
                    found.append(Mistake(("systems", name, "motion"), f"motion: ballistic {words}", (key,)))
        found += event_mistakes(self)
        found += pair_mistakes(self.forces, self.systems) + pacing_mistakes(self) + attention_mistakes(self) + outlying_mistakes(self)
        found += _lost_controls(self) + misfit_oracles(self)
        if found:
            raise mistakes(found)
        return self

    def sticky_to(self, system: System) -> bool:
        """Whether a system's particles may stick to a collider."""
        feels = system.feels.colliders
        felt = [one for k, one in enumerate(self.colliders) if (feels if isinstance(feels, bool) else k in feels or one.name in feels)]
        return any(one.action == "stick" for one in felt)

    @property
    def sliders(self) -> list[Slider]:
        """The controls as the viewer shows them, one slider per number."""
        return [slider for control in self.controls for slider in sliders_of(self, control)]


def _shared_names(scene: Scene) -> list[Mistake]:
    """Return a mistake for each obstacle that has the name of a flow primitive: `feels.flow` names both."""
    places = {primitive.name: k for k, primitive in enumerate(scene.flow) if primitive.name}
    return [
        Mistake(("obstacles", n, "name"), f'the name "{obstacle.name}" is taken by flow.{places[obstacle.name]}', ("flow", "obstacles"))
        for n, obstacle in enumerate(scene.obstacles)
        if obstacle.name in places
    ]


def _lost_controls(scene: Scene) -> list[Mistake]:
    """Return a mistake for each control that moves no number."""
    found = []
    for k, control in enumerate(scene.controls):
        try:
            sliders_of(scene, control)
        except NoSuchNumber as error:
            found.append(
                Mistake(("controls", k, "path"), str(error), ("flow", "obstacles", "forces", "colliders", "systems"), error.suggestion)
            )
    return found


def _unknown_entries(path: tuple[str, ...], key: str, selection, entries, also=()) -> list[Mistake]:
    """Return a mistake for each selected name or number that the list does not have; those in `also` have names only."""
    found = []
    names = [entry.name for entry in (*entries, *also) if entry.name]
    present = set(names)
    known = f"names in {key}: {listed(names)}" if names else f"no entry of {key} has a name"
    for k, wanted in enumerate(selection if isinstance(selection, tuple) else ()):
        if isinstance(wanted, int) and wanted >= len(entries):
            found.append(Mistake((*path, k), f"there is no {key}.{wanted}: the scene has {len(entries)}, counted from 0", (key,)))
        elif isinstance(wanted, str) and wanted not in present:
            guess = nearest(wanted, names) if len(found) < _MOST_GUESSES else None
            found.append(Mistake((*path, k), f'there is no "{wanted}" in {key}; {known}', (key,), guess))
    return found[:_MOST_TOLD]
