"""All oracles that `verify:` may hold, and their mistakes."""

from typing import Annotated

from pydantic import Field

from warpsim.scene import (  # noqa: F401  (being defined registers them)
    oracles_of_births,
    oracles_of_contact,
    oracles_of_flocks,
    oracles_of_flow,
    oracles_of_motion,
    oracles_of_networks,
    oracles_of_systems,
)
from warpsim.scene.base import Mistake, one_of_types
from warpsim.scene.oracles import Oracle

MOST_ORACLES = 256
OracleUnion = one_of_types(Oracle)
Oracles = Annotated[tuple[OracleUnion, ...], Field(max_length=MOST_ORACLES)]


def misfit_oracles(scene) -> list[Mistake]:
    """Return a mistake for each oracle that names what the scene does not have, or states a law that does not hold in it."""
    return [found._replace(path=("verify", k, *found.path)) for k, oracle in enumerate(scene.verify) for found in oracle.misfits(scene)]
