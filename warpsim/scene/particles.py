"""Particle systems: mass points from emitters, with their solver, coupling to the flow, and look."""

from typing import Annotated, Any, Literal

from pydantic import Field, model_validator

from warpsim.scene.base import Mistake, Name, Number, Spec, Truth, WholeNumber, form_by_key, mistakes, one_of_forms
from warpsim.scene.emitters import Emitter
from warpsim.scene.look import Look
from warpsim.scene.pacing import Substeps

MULTISTEP_SOLVERS = {"adams_bashforth_2": 2, "adams_bashforth_3": 3, "adams_bashforth_4": 4, "abm_pece_2": 2, "abm_pece_4": 4}  # orders
Solver = Literal[
    *("euler", "drift_kick", "semi_implicit_euler", "verlet", "rk4", "heun"),
    *("adams_bashforth_2", "adams_bashforth_3", "adams_bashforth_4", "abm_pece_2", "abm_pece_4"),
]
TRACER_SOLVERS = ("euler", "rk4", "heun", *MULTISTEP_SOLVERS)


class Drag(Spec):
    """Simplified drag F = alpha (v_flow - v)."""

    alpha: Number = Field(ge=0.0, le=1e12, description="Drag coefficient [kg/s].")


class StokesDrag(Spec):
    """Stokes drag F = 6 pi viscosity radius (v_flow - v), with the radius of each particle."""

    viscosity: Number = Field(ge=0.0, le=1e12, description="Dynamic viscosity of the fluid, 1.8e-5 for air [Pa s].")


def _coupling_form(value: Any) -> str | None:
    if isinstance(value, str):
        return "tracer"
    return form_by_key(value, ("alpha", "viscosity"))


Coupling = one_of_forms({"tracer": Literal["tracer"], "alpha": Drag, "viscosity": StokesDrag}, _coupling_form)


def _selection_form(value: Any) -> str | None:
    if isinstance(value, bool):
        return "all"
    return "some" if isinstance(value, (list, tuple)) else None


def _entry_form(value: Any) -> str | None:
    if isinstance(value, str):
        return "name"
    return "index" if isinstance(value, int) and not isinstance(value, bool) else None


Entry = one_of_forms({"name": Name, "index": Annotated[WholeNumber, Field(ge=0)]}, _entry_form)
Selection = one_of_forms({"all": Truth, "some": tuple[Entry, ...]}, _selection_form)


class Feels(Spec):
    """Which parts of the environment act on a system: true, false, or the names (or numbers from 0) of those that do."""

    gravity: Truth = Field(True, description="Whether gravity acts.")
    flow: Selection = Field(
        True,
        description="Flow primitives, with their images at obstacles, that carry it: true, false, or a list of names or numbers. The name "
        "of an obstacle stands for its own circulation.",
    )
    forces: Selection = Field(True, description="Forces that act: true, false, or a list of names or numbers.")
    colliders: Selection = Field(True, description="Colliders in its way: true, false, or a list of names or numbers.")


class System(Spec):
    """One population of mass points. A subclass registers itself by being defined before the scene is."""

    substeps: Substeps | None = Field(None, description="Steps per frame, or auto; absent: the scene's [1].")
    feels: Feels = Field(Feels(), description="What acts on the system.")
    look: Look = Field(Look(), description="How it is drawn.")


class Particles(System):
    """Particles that are born at emitters, move independently of each other, and die."""

    type: Literal["particles"] = Field("particles", description="Kind of system.")
    capacity: WholeNumber = Field(
        100_000, ge=1, le=2**27, description="Most particles alive at once; births beyond it are refused and counted [1]."
    )
    solver: Solver | None = Field(
        None, description="Method of integration; absent: semi_implicit_euler, or rk4 for tracers (which take no symplectic one)."
    )
    coupling: Coupling | None = Field(
        None, description="How the flow carries it: {alpha: kg/s}, {viscosity: Pa s}, or tracer (moves with the flow); absent: no effect."
    )
    motion: Literal["dynamic", "ballistic"] = Field(
        "dynamic",
        description="dynamic: step by step; ballistic: in closed form under gravity alone, without forces, colliders, coupling and solver.",
    )
    tolerance: Annotated[Number, Field(ge=1e-9, le=1e6)] | None = Field(
        None,
        description="For substeps: auto, how far one substep's error may carry a particle by the end of a frame; absent: 1e-4 [m].",
    )
    max_substeps: Annotated[WholeNumber, Field(ge=1, le=1024)] | None = Field(
        None,
        description="For substeps: auto, the most steps per frame, a power of two; whom they do not suffice is counted; absent: 64 [1].",
    )
    emitters: tuple[Emitter, ...] = Field((), max_length=1024, description="Where particles are born.")

    @property
    def method(self) -> str:
        """The solver in effect."""
        return self.solver or ("rk4" if self.coupling == "tracer" else "semi_implicit_euler")

    @model_validator(mode="after")
    def _parts_fit(self):
        found = []
        if self.motion == "ballistic":
            for key in ("solver", "coupling"):
                if getattr(self, key) is not None:
                    message = f"motion: ballistic is computed in closed form and takes no {key} (leave it out, or take motion: dynamic)"
                    found.append(Mistake((key,), message, ("motion", key)))
        elif self.coupling == "tracer" and self.solver not in (None, *TRACER_SOLVERS):
            message = f"a tracer has no velocity of its own: its solver is one of {', '.join(TRACER_SOLVERS)}, not {self.solver}"
            found.append(Mistake(("solver",), message, ("solver", "coupling", "motion")))
        if self.max_substeps and self.max_substeps & (self.max_substeps - 1):
            lower = 1 << (self.max_substeps.bit_length() - 1)
            found.append(Mistake(("max_substeps",), f"must be a power of two, such as {lower} or {2 * lower}, got {self.max_substeps}"))
        found += repeated_names("emitters", self.emitters)
        if found:
            raise mistakes(found)
        return self


def repeated_names(key: str, entries: tuple[Any, ...]) -> list[Mistake]:
    """Return a mistake for each entry whose name an earlier entry of the list has."""
    first: dict[str, int] = {}
    found = []
    for k, entry in enumerate(entries):
        if entry.name is not None and first.setdefault(entry.name, k) != k:
            found.append(Mistake((key, k, "name"), f'the name "{entry.name}" is taken by {key}.{first[entry.name]}', (key,)))
    return found
