"""Scenes for the tests of the simulation, built in Python as a user would."""

import warpsim

EMITTER = {
    "shape": {"type": "sphere", "radius": 1.0},
    "rate": {"mean": 20_000.0, "spread": 5_000.0},
    "velocity": {"cone": 60, "speed": {"mean": 1.0, "spread": 0.5}},
    "lifetime": {"mean": 0.2, "spread": 0.1},
}
FLOW = [
    {"type": "uniform", "velocity": [0.4, {"sine": {"amplitude": 0.2, "period": 0.3}}, 0]},
    {"type": "vortex", "circulation": 1.0, "core": {"model": "lamb_oseen", "radius": 0.2}},
]


def scene(system=None, emitter=None, **more) -> warpsim.Scene:
    """One system `p` of particles with a flow; keys given override."""
    particles = {"type": "particles", "capacity": 10_000, "coupling": {"alpha": 1e-3}, "emitters": [EMITTER | (emitter or {})]}
    document = {"name": "test", "seed": 3, "flow": FLOW, "systems": {"p": particles | (system or {})}, **more}
    return warpsim.Scene.model_validate(document)


def burst(count=1, **emitter) -> dict:
    """An emitter's keys for a single burst at t = 0 of particles at rest that live long."""
    still = {"rate": None, "shape": {"type": "point"}, "velocity": None, "lifetime": 100.0, "burst": {"count": count, "at": 0.0}}
    return still | emitter
