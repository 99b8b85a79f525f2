"""The scenes that are played so that oracles can measure: the scene itself, test particles in its surroundings, one emitter alone."""

import numpy as np

from warpsim.scene.emitters import Burst, Distribution
from warpsim.scene.oracles import entry_of
from warpsim.scene.particles import Feels

LONG_AGO = -1e7  # [s]: a burst that lies before every beginning
NOTHING = Feels(**dict.fromkeys(Feels.model_fields, False))


def with_test_particles(scene, measurers):
    """Return the scene with a system for each test particle in place of its own, beginning when the first is released."""
    systems = {}
    for k, measurer in enumerate(measurers):
        measurer.system = f"test particle {k}"  # no name of a scene's system has a blank
        systems[measurer.system] = measurer.particle_spec()
    first = min(measurer.oracle.release for measurer in measurers)
    time = scene.time.model_copy(update={"prewarm": max(0.0, -first)})
    return scene.model_copy(update={"systems": systems, "controls": (), "time": time})


def alone(scene, system: str, emitter: int | str, lifetime: float | None = None):
    """Return the scene with one emitter of one system only, whose particles nothing acts on: births, lives and deaths as they are.

    The other emitters keep their places and fall silent, so that the random numbers are the scene's own. One that listens to events keeps
    the other systems, too, as they are. With a `lifetime` [s] all live so long.
    """
    spec = scene.systems[system]
    chosen = entry_of(emitter, spec.emitters)
    heard = chosen if lifetime is None else chosen.model_copy(update={"lifetime": Distribution(mean=lifetime)})
    emitters = tuple(heard if each is chosen else silent(each) for each in spec.emitters)
    if chosen.on is not None:
        return scene.model_copy(update={"systems": {**scene.systems, system: spec.model_copy(update={"emitters": emitters})}})
    plain = {"coupling": None, "solver": None, "motion": "dynamic", "feels": NOTHING, "substeps": 1, "emitters": emitters}
    return scene.model_copy(update={"systems": {system: spec.model_copy(update=plain)}, "controls": ()})


def silent(emitter):
    """Return an emitter of which nothing is ever born."""
    return emitter.model_copy(update={"rate": None, "on": None, "burst": (Burst(count=1, at=LONG_AGO),)})


def play(simulation, measurers) -> None:
    """Play a story from its first frame to the last that a measurer wants, each looking at its own frames."""
    waiting = [(measurer, measurer.frames) for measurer in measurers]
    while waiting:
        for measurer, frames in waiting:
            if simulation.index in frames:
                with np.errstate(all="ignore"):
                    measurer.look(simulation)
        waiting = [(each, frames) for each, frames in waiting if frames.last > simulation.index and not each.satisfied]
        if waiting:
            simulation.step_frame()
