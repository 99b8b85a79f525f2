"""Substeps: so many per frame, or `auto`: each particle as many as its tolerance asks for, a network as many as its springs do."""

from typing import Annotated, Any, Literal

from pydantic import Field

from warpsim.scene.base import Mistake, WholeNumber, one_of_forms
from warpsim.scene.forces import felt_pairs

ADAPTIVE_SOLVERS = ("abm_pece_2", "abm_pece_4")
MOST_SUBSTEPS = 10_000  # per frame
MAX_SUBSTEPS = 64  # of particles that choose, where their system does not say
TOLERANCE = 1e-4  # [m]


def _form(value: Any) -> str:
    return "auto" if isinstance(value, str) else "number"


Substeps = one_of_forms({"number": Annotated[WholeNumber, Field(ge=1, le=MOST_SUBSTEPS)], "auto": Literal["auto"]}, _form)


def is_adaptive(spec, time) -> bool:
    """Return whether the particles of a system choose their own substeps."""
    return (spec.substeps or time.substeps) == "auto" and spec.type == "particles" and spec.motion != "ballistic"


def substep_count(spec, time) -> int:
    """Return a system's substeps per frame; of particles that choose, the most that they take; of a network that chooses, 1."""
    if is_adaptive(spec, time):
        return spec.max_substeps or MAX_SUBSTEPS
    return 1 if (spec.substeps or time.substeps) == "auto" else spec.substeps or time.substeps


def is_damped(spec) -> bool:
    """Return whether anything takes energy from a network: damping of its springs, or drag."""
    if spec.type == "cloth":
        found = [spec.drag, *(kind.damping for kind in (spec.structural, spec.shear, spec.bend))]
    else:
        damping = getattr(spec, "damping", 0.0)
        found = damping if isinstance(damping, tuple) else [damping]
    return spec.coupling is not None or any(found)


def pacing_mistakes(scene) -> list[Mistake]:
    """Return a mistake for each system whose substeps, solver, tolerance and surroundings do not go together."""
    found = []
    for name, spec in scene.systems.items():
        place = ("systems", name)
        if spec.type == "flock":
            if (spec.substeps or scene.time.substeps) == "auto":
                where = (*place, "substeps") if spec.substeps else ("time", "substeps")
                words = "auto asks what springs stand or what a solver's error is, and a flock has neither: give a number"
                found.append(Mistake(where, words if spec.substeps else f"{words} (systems.{name}.substeps)", ("substeps",)))
            continue
        if spec.type != "particles":
            if (spec.substeps or scene.time.substeps) == "auto" and spec.method == "euler" and not is_damped(spec):
                where = (*place, "substeps") if spec.substeps else ("time", "substeps")
                words = f"no number of substeps is enough for {name}: with euler whatever swings grows (take another solver, or damping)"
                found.append(Mistake(where, words, ("solver", "substeps")))
            continue
        if not is_adaptive(spec, scene.time):
            for key in ("tolerance", "max_substeps"):
                if getattr(spec, key) is not None:
                    found.append(Mistake((*place, key), f"{key} counts with substeps: auto only", ("substeps", "solver")))
            continue
        where = place if spec.substeps else ("time",)
        if spec.method not in ADAPTIVE_SOLVERS:
            words = f"substeps: auto needs a solver that estimates its error: {' or '.join(ADAPTIVE_SOLVERS)}, not {spec.method}"
            also = "" if spec.substeps else f" (solver of {name}; or give systems.{name}.substeps)"
            found.append(Mistake((*where, "substeps"), words + also, ("solver", "substeps")))
        if felt_pairs(scene.forces, spec.feels.forces) and spec.coupling != "tracer":
            found.append(Mistake((*where, "substeps"), f"substeps: auto is for particles that move alone, but those of {name} feel pairs"))
        if scene.colliders and spec.feels.colliders not in (False, ()):
            words = f"substeps: auto meets no colliders, but {name} feels them (add feels: {{colliders: false}}, or give a number)"
            found.append(Mistake((*where, "substeps"), words, ("colliders",)))
    return found
