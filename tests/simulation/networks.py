"""Scenes of networks for tests, built in Python as a user would: one system `s`."""

import numpy as np

import warpsim
from tests.simulation.stages import carry_out


def network(type="springs", gravity=(0, 0, 0), fps=60, substeps=4, prewarm=0.0, more=None, **system) -> warpsim.Scene:
    """A scene of one network; keys are those of the system."""
    document = {"name": "network", "time": {"fps": fps, "substeps": substeps, "prewarm": prewarm}, "gravity": list(gravity)}
    return warpsim.Scene.model_validate({**document, **(more or {}), "systems": {"s": {"type": type, **system}}})


def simulate(device="cpu", threads=1, native=True, **keys) -> warpsim.Simulation:
    """A simulation of one network at its frame 0."""
    return warpsim.Simulation(network(**keys), device=device, threads=threads, native=native)


def tangle(count=70, springs=200, seed=3) -> dict:
    """Keys of a random network: points in a box, every point on some spring, springs of all strengths."""
    rng = np.random.default_rng(seed)
    points = rng.uniform(-1, 1, (count, 3)).round(4)
    pairs = {tuple(sorted(pair)) for pair in rng.integers(0, count, (springs, 2)).tolist() if pair[0] != pair[1]}
    pairs = sorted(pairs | {(i, i + 1) for i in range(count - 1)}, key=lambda pair: hash(pair))
    values = {"stiffness": rng.uniform(5, 50, len(pairs)), "damping": rng.uniform(0, 0.5, len(pairs)), "mass": rng.uniform(0.5, 2, count)}
    values["rest_length"] = rng.uniform(0, 1, len(pairs))
    return {"points": points.tolist(), "springs": [list(pair) for pair in pairs]} | {key: list(map(float, v)) for key, v in values.items()}


def state(sim, name="s") -> tuple[np.ndarray, np.ndarray]:
    """Return position and velocity of the present frame in float64, (n, 3) each."""
    s = sim.frame()[name]
    return s.position.astype(float), s.velocity.astype(float)


def accelerations(sim) -> np.ndarray:
    """What acts within the network `s` at the present moment, asked of its own stages, float64 (n, 3) [m/s²]."""
    system = sim.systems["s"]
    carry_out(system.forces(0), sim.device)
    return system.internal.numpy()[:, : len(system.net.points)].T.astype(float)
