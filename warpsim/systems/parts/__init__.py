"""Parts: what acts on the points of a network besides its springs, one file each, in the order in which they act."""

from warpsim.systems.parts.base import Part

PARTS: tuple[type[Part], ...] = ()

__all__ = ["PARTS", "Part"]
