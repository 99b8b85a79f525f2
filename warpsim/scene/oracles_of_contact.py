"""Oracles of contact: how near a network comes to colliders, and how often a surface goes through itself."""

from typing import Annotated, Literal

from pydantic import Field

from warpsim.scene.base import Mistake, Name, WholeNumber
from warpsim.scene.nearest import listed
from warpsim.scene.oracles import Oracle, entry_misfits, felt, first_misfit
from warpsim.scene.oracles_of_networks import OfNetwork, Span
from warpsim.scene.strengths import Strength

_SURFACES = ("grid", "block", "mesh")


class ClearanceOracle(OfNetwork, Span, Oracle):
    """The least distance of a network's points from the surface of a collider, over a span of frames; negative inside what is solid."""

    type: Literal["clearance"] = Field("clearance", description="Kind of oracle.")
    collider: Name | Annotated[WholeNumber, Field(ge=0)] | None = Field(
        None, description="Name or number of the collider; absent: all that the network feels and that do not kill, but meshes [1]."
    )
    expect: Strength | None = Field(None, description="The distance; absent: the network's thickness [m].")

    def misfits(self, scene) -> list[Mistake]:
        return first_misfit(lambda: super(ClearanceOracle, self).misfits(scene), lambda: self._collider_misfits(scene))

    def _collider_misfits(self, scene) -> list[Mistake]:
        if self.collider is not None and (found := entry_misfits("collider", self.collider, scene.colliders, "collider", ("colliders",))):
            return found
        if self.of(scene):
            return []
        what = "there is no collider that it feels and can be measured from: plane, sphere, box or capsule"
        return [Mistake(("collider",) if self.collider is not None else (), what, ("colliders", "systems"))]

    def of(self, scene) -> list:
        """Return the colliders from which it is measured."""
        chosen = felt(scene.systems[self.system].feels.colliders, scene.colliders)
        named = felt((self.collider,), scene.colliders) if self.collider is not None else chosen
        return [one for one in named if one in chosen and one.type != "mesh" and one.action == "bounce"]


class CrossingsOracle(OfNetwork, Span, Oracle):
    """How often an edge of a surface goes through one of its own triangles, in all the frames of a span that are looked at."""

    type: Literal["crossings"] = Field("crossings", description="Kind of oracle.")
    every: Annotated[WholeNumber, Field(ge=1, le=1_000_000)] = Field(10, description="Frames from one count to the next [1].")
    expect: Strength = Field(0.0, description="The number [1].")

    def misfits(self, scene) -> list[Mistake]:
        return first_misfit(lambda: super(CrossingsOracle, self).misfits(scene), lambda: self._surface_misfits(scene))

    def _surface_misfits(self, scene) -> list[Mistake]:
        generator = getattr(scene.systems[self.system], "generator", None)
        if getattr(generator, "type", None) in _SURFACES:
            return []
        message = f"{self.system} has no surface: cloth has one, and springs by one of the generators {listed(_SURFACES)}"
        return [Mistake(("system",), message, ("systems",))]
