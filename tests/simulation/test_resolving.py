"""Contacts as a stage of their own, for solvers and constraints that move points in their own ways: the particles' kernels' bits."""

import numpy as np
import pytest

from warpsim import Simulation, load_scene
from warpsim.simulation import UnstableError
from warpsim.systems.solvers.split import Split


@pytest.mark.parametrize("solver", ["semi_implicit_euler", "verlet", "drift_kick", "euler"])
@pytest.mark.parametrize("native", [True, False])
def test_a_drape_moves_the_same_way(solver, native, monkeypatch):
    changes = ["systems.tablecloth.resolution=[13, 13]", "systems.tablecloth.corner=[-1.0, 1.22, -1.0]", "time.substeps=16", "verify=[]"]
    scene = load_scene("scenes/drape.yaml", [*changes, f"systems.tablecloth.solver={solver}"])
    results = []
    for resolves in (True, False):
        monkeypatch.setattr(Split, "resolves", resolves)
        sim = Simulation(scene, device="cpu", native=native)
        for _ in range(30):
            sim.step_frame()
        results.append(sim.frame()["tablecloth"].position)
    assert (np.linalg.norm(results[0] - [0, 0.75, 0], axis=1) < 0.47).sum() > 5  # some lie on the ball
    assert (results[0] == results[1]).all()


def test_a_blow_up_is_noticed(monkeypatch):
    monkeypatch.setattr(Split, "resolves", False)
    sim = Simulation(load_scene("scenes/chain.yaml", ["time.substeps=1"]), device="cpu")
    with pytest.raises(UnstableError):
        sim.run(5.0)
