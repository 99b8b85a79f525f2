"""Scenes for the laws, built in Python as a user would: one system `p`, one thread, no more than a law needs."""

import numpy as np

import warpsim

POINT = {"type": "point"}


def emitter(count: int | None = None, at: float = 0.0, **keys) -> dict:
    """An emitter of long-lived particles at the origin; with a count, a single burst."""
    burst = {} if count is None else {"burst": {"count": count, "at": at}}
    return {"shape": POINT, "lifetime": 1e6, "mass": 1.0, **burst, **keys}


LISTS = ("flow", "obstacles", "forces", "colliders")


def scene(*emitters, fps=60, substeps=4, seed=1, prewarm=0.0, gravity=(0, 0, 0), limits=None, **keys) -> warpsim.Scene:
    """A scene of one particle system; keys are the scene's lists, the rest is the system's."""
    lists = {key: list(keys.pop(key, ())) for key in LISTS}
    particles = {"type": "particles", "capacity": 10_000, "emitters": list(emitters), **keys}
    document = {"name": "law", "seed": seed, "time": {"fps": fps, "substeps": substeps, "prewarm": prewarm}}
    document |= {"gravity": gravity, "limits": limits or {}, "systems": {"p": particles}} | lists
    return warpsim.Scene.model_validate(document)


def simulate(*emitters, device="cpu", native=True, **keys) -> warpsim.Simulation:
    """A simulation at its frame 0."""
    return warpsim.Simulation(scene(*emitters, **keys), device=device, threads=1, native=native)


def start(position=(0.0, 0.0, 0.0), velocity=(0.0, 0.0, 0.0), **keys) -> dict:
    """An emitter of one particle at t = 0 with that position and velocity."""
    speed = float(np.linalg.norm(velocity))
    moving = {"velocity": {"direction": list(velocity), "speed": speed}} if speed else {}
    return emitter(1, shape={"type": "point", "center": list(position)}, **moving, **keys)


def state(sim) -> tuple[np.ndarray, np.ndarray]:
    """Return position and velocity of the present frame in float64, (n, 3) each."""
    p = sim.frame()["p"]
    return p.position.astype(float), p.velocity.astype(float)
