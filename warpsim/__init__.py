"""warpsim: procedural animation as text.

    scene = warpsim.load_scene("campfire")
    simulation = warpsim.Simulation(scene, device="cpu")
    for frame in simulation.frames(240):
        frame["fire"].position  # float32 (n, 3) [m]

The names below are loaded on first use, so that `import warpsim` costs nothing and the scene alone needs no Warp.
"""

from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from warpsim.frame import Frame
    from warpsim.scene import Scene, SceneError, load_scene
    from warpsim.simulation import Simulation, UnstableError

__version__ = "0.1.0"
__all__ = ["Frame", "Scene", "SceneError", "Simulation", "UnstableError", "load_scene"]

if not (Path(__file__).parent / "kernels").is_dir():  # a checkout: the device code is its top-level folder kernels/
    __path__.append(str(Path(__file__).parents[1]))

_HOMES = {
    "load_scene": "warpsim.scene",
    "Scene": "warpsim.scene",
    "SceneError": "warpsim.scene",
    "Simulation": "warpsim.simulation",
    "UnstableError": "warpsim.simulation",
    "Frame": "warpsim.frame",
}


def __getattr__(name: str):
    """Import a public name from its room on first use."""
    if name not in _HOMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    globals()[name] = value = getattr(import_module(_HOMES[name]), name)
    return value


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
