"""Parts: what acts on the points of a network besides its springs, one file each, in the order in which they act."""

from warpsim.systems.parts.base import Part
from warpsim.systems.parts.bending import Bending
from warpsim.systems.parts.grip import Grip
from warpsim.systems.parts.muscles import Muscles
from warpsim.systems.parts.self_collision import SelfCollision
from warpsim.systems.parts.strain import StrainLimit
from warpsim.systems.parts.tearing import Tearing

PARTS: tuple[type[Part], ...] = (Muscles, Grip, Bending, StrainLimit, SelfCollision, Tearing)

__all__ = ["PARTS", "Part", "SelfCollision"]
