"""What an entry of `systems` may be. A kind of system is known here by being imported."""

from warpsim.scene.base import one_of_types
from warpsim.scene.cloth import Cloth
from warpsim.scene.flocks import Flock
from warpsim.scene.particles import Particles, System
from warpsim.scene.springs import Springs

KINDS = (Particles, Springs, Cloth, Flock)
SystemUnion = one_of_types(System)
