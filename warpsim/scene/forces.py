"""Force fields that particles feel besides gravity."""

from collections.abc import Mapping
from typing import Any, Literal

from pydantic import Field, model_validator

from warpsim.scene.base import Mistake, Name, Number, Spec, Vec3, mistakes, one_of_types
from warpsim.scene.strengths import Strength

PAIR_SOLVERS = ("semi_implicit_euler", "verlet", "euler")  # they ask for forces at the ends of a substep, where neighbors are known


class Force(Spec):
    """A force field F(P, t). A subclass registers itself by being defined in this file."""

    name: Name | None = Field(None, description="Name for `feels` and `--set forces.NAME.…`.")


class Attractor(Force):
    """A point that pulls (or, with a negative strength, pushes): F toward the center, d being the distance from it."""

    type: Literal["attractor"] = Field("attractor", description="Kind of force.")
    center: Vec3 = Field((0.0, 0.0, 0.0), description="Where it pulls to [m].")
    strength: Strength = Field(
        description="k, in N for law constant, N m^2 for inverse_square, N/m for spring; negative pushes [N, N m^2 or N/m]."
    )
    law: Literal["constant", "inverse_square", "spring"] = Field(
        "constant", description="How it falls off: constant F = k; inverse_square F = k/d^2; spring F = k d."
    )
    softening: Number = Field(1e-3, ge=0.0, le=1e9, description="Distance below which the pull is softened, so that it stays finite [m].")


class Pairwise(Force):
    """What every two particles of a system do to each other: F(s) toward each other, s = sqrt(d^2 + softening^2), d their distance."""

    type: Literal["pairwise"] = Field("pairwise", description="Kind of force.")
    strength: Strength = Field(
        description="k; positive pulls together, negative pushes apart; N, N m^2 for inverse_square, N/m for spring [N, N m^2 or N/m]."
    )
    radius: Number = Field(ge=1e-6, le=1e9, description="R, the s at which it ends: particles farther apart do not feel each other [m].")
    law: Literal["constant", "inverse_square", "spring", "linear", "cosine"] = Field(
        "inverse_square",
        description="How it falls off: constant F = k; inverse_square k/s^2; spring k s (no rest length); without a step at R: linear "
        "k (1 - s/R), cosine k (1 + cos(pi s/R))/2.",
    )
    softening: Number = Field(
        1e-3, ge=0.0, le=1e9, description="Distance below which it is softened, so that it stays finite; less than the radius [m]."
    )

    @model_validator(mode="after")
    def _softening_is_short(self):
        if self.softening >= self.radius:
            message = f"must be less than the radius of {self.radius:g} m: softened distances are never shorter, so nothing would be felt"
            raise mistakes([Mistake(("softening",), message, ("softening", "radius"))])
        return self


ForceUnion = one_of_types(Force)


def felt_pairs(forces: tuple[Force, ...], chosen: Any) -> list[int]:
    """Return the places of the forces between particles that `feels.forces` chooses."""
    places = [k for k, force in enumerate(forces) if force.type == "pairwise"]
    return places if chosen is True else [k for k in places if chosen and (k in chosen or forces[k].name in chosen)]


def pair_mistakes(forces: tuple[Force, ...], systems: Mapping[str, Any]) -> list[Mistake]:
    """Return a mistake for each particle system whose solver asks for forces at places where the others are not."""
    found = []
    for name, system in systems.items():
        if system.type != "particles":
            continue
        places = felt_pairs(forces, system.feels.forces)
        if places and system.motion == "dynamic" and system.coupling != "tracer" and system.method not in PAIR_SOLVERS:
            message = (
                f"{system.method} asks for forces within a step, where those between particles (forces.{places[0]}) are not known: "
                f"take {PAIR_SOLVERS[0]}, {PAIR_SOLVERS[1]} or {PAIR_SOLVERS[2]}, or choose among the forces by feels"
            )
            found.append(Mistake(("systems", name, "solver"), message, ("forces",)))
    return found
