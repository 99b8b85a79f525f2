"""Solvers agree: cloth that comes to rest lies where every solver says it lies.

The sheets are hung and draped so that there is one place to come to rest: over a bar, not over a ball, where folds are a matter of chance.
"""

import numpy as np
import pytest

from tests.simulation.networks import simulate, state

SIZE = 1.0  # of a sheet [m]
SOLVERS = {"implicit_euler": 4, "xpbd": 16, "verlet": "auto", "semi_implicit_euler": "auto"}
KINDS = {"structural": (200.0, 0.04), "shear": (100.0, 0.02), "bend": (10.0, 0.002)}
SHEET = {"type": "cloth", "corner": [-0.5, 0.52, -0.5], "edges": [[SIZE, 0, 0], [0, 0, SIZE]], "density": 0.3, "drag": 1e-3}
SHEET |= {kind: {"stiffness": k, "damping": c} for kind, (k, c) in KINDS.items()} | {"gravity": (0, -9.81, 0)}
BAR = {"type": "capsule", "start": [0, 0.3, -1], "end": [0, 0.3, 1], "radius": 0.2, "friction": 0.5, "restitution": 0}
INWARD = [{"pins": [side], "keyframes": [[0, [0, 0, 0]], [1, [way, 0, 0]]]} for side, way in (("left", 0.15), ("right", -0.15))]
DRAPES = {
    "over a bar": {"resolution": [25, 25], "thickness": 0.01, "more": {"colliders": [BAR]}},
    "hammock": {"resolution": [25, 25], "pins": ["left", "right"], "pin_motion": INWARD},
    "by two corners": {"resolution": [13, 13], "pins": [[0, 0], [12, 0]], "drag": 8e-3},
}


@pytest.mark.parametrize("drape", DRAPES)
def test_a_drape_is_the_same_by_every_solver(drape):
    """Asked for: 2 % of its size. Held to 0.5 %: XPBD in one pass stretches by 3e-3 more, at contacts implicit Euler by 2e-3."""
    places = {}
    for solver, substeps in SOLVERS.items():
        sim = simulate(**(SHEET | DRAPES[drape]), solver=solver, substeps=substeps)
        home, _ = state(sim)
        sim.run(5.0)
        places[solver], velocity = state(sim)
        assert np.sqrt((velocity**2).sum(axis=1).mean()) < 0.01, solver
    assert np.linalg.norm(places["verlet"] - home, axis=1).max() > 0.2
    for solver, place in places.items():
        assert np.linalg.norm(place - places["verlet"], axis=1).max() < 0.005 * SIZE, solver
