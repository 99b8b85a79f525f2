"""Force fields that particles feel besides gravity."""

from typing import Literal

from pydantic import Field

from warpsim.scene.base import Name, Number, Spec, Vec3, one_of_types
from warpsim.scene.strengths import Strength


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


ForceUnion = one_of_types(Force)
