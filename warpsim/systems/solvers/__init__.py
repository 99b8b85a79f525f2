"""Solvers of networks: how coupled points move through a frame, one file each."""

from warpsim.systems.solvers.base import NetworkSolver
from warpsim.systems.solvers.implicit_euler import ImplicitEuler
from warpsim.systems.solvers.split import WHEN, Split
from warpsim.systems.solvers.staged import STAGED, Staged
from warpsim.systems.solvers.xpbd import Xpbd

SOLVERS: dict[str, type[NetworkSolver]] = {
    **dict.fromkeys(WHEN, Split),
    **dict.fromkeys(STAGED, Staged),
    "implicit_euler": ImplicitEuler,
    "xpbd": Xpbd,
}

__all__ = ["SOLVERS", "NetworkSolver"]
