"""Scenes for the oracles: the surroundings in which each law holds, and what is stated of them."""

import warpsim
from warpsim.verify import Finding, verify_scene

EXACT = {"relative": 1e-4}


def scene(
    *oracles: dict, fps=60, substeps=4, prewarm=0.0, gravity=(0, -9.81, 0), flow=(), forces=(), obstacles=(), colliders=(), **system
) -> warpsim.Scene:
    """A scene of one particle system `p` that states these oracles."""
    particles = {"type": "particles", "capacity": 10_000, **system}
    document = {"name": "stated", "seed": 1, "time": {"fps": fps, "substeps": substeps, "prewarm": prewarm}, "gravity": gravity}
    document |= {"obstacles": list(obstacles), "colliders": list(colliders)}
    document |= {"flow": list(flow), "forces": list(forces), "systems": {"p": particles}, "verify": list(oracles)}
    return warpsim.Scene.model_validate(document)


def found(*oracles: dict, **keys) -> list[Finding]:
    """What the oracles find in that scene."""
    return verify_scene(scene(*oracles, **keys), "cpu", threads=1)
