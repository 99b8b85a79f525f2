"""A run that leaves the finite world: caught at once, undone, and answered by the scene's policy."""

import numpy as np
import pytest

from tests.simulation.scenes import burst, scene
from warpsim import Simulation, UnstableError

EXPLODING = [{"type": "attractor", "center": [0, 0, 0], "strength": 1.0, "law": "spring"}]  # omega h = 31.6/60/4: fine with 4 substeps


def exploding(policy: str, **limits):
    """One particle in 50 is so light that its spring is far too stiff for the step: omega h = 13 > 2."""
    heavy = burst(98, shape={"type": "sphere", "radius": 1.0}, mass=1e-3)
    light = burst(2, shape={"type": "sphere", "radius": 1.0}, mass=1e-7)
    document = {"forces": EXPLODING, "flow": [], "limits": {"unstable": policy, **limits}}
    return scene({"coupling": None, "emitters": [heavy, light]}, **document)


@pytest.mark.parametrize("native", [True, False])
def test_stop_names_the_culprits_and_stands_at_the_last_good_frame(native):
    sim = Simulation(exploding("stop"), device="cpu", threads=2, native=native)
    with pytest.raises(UnstableError) as caught:
        sim.run(5.0)
    error = caught.value
    assert error.system == "p" and set(error.ids) <= {98, 99} and error.ids and "substeps: 8" in str(error)
    assert sim.index == error.index - 1 and error.last_good.index == sim.index
    assert np.isfinite(error.last_good["p"].position).all() and np.abs(error.last_good["p"].position).max() <= 1e6
    again = Simulation(exploding("stop"), device="cpu", threads=1)
    for _ in range(error.index - 1):
        again.step_frame()
    assert again.state_hash() == sim.state_hash()
    with pytest.raises(UnstableError):
        again.step_frame()


def test_a_late_blow_up_is_undone_from_a_snapshot():
    """Past several snapshots: a wind that rises without bound."""
    wind = [{"type": "uniform", "velocity": [{"expression": "exp(t)"}, 0, 0]}]
    sim = Simulation(scene({"coupling": "tracer"}, burst(3), flow=wind, limits={"extent": 100.0}), device="cpu", threads=1)
    with pytest.raises(UnstableError) as caught:
        sim.run(20.0)
    assert caught.value.index == np.ceil(np.log(101.0) * 60)  # x(t) = e^t − 1 passes 100 m
    assert sim.frame()["p"].position[:, 0].max() == pytest.approx(np.exp(sim.time) - 1.0, rel=1e-4)


@pytest.mark.parametrize("native", [True, False])
def test_kill_removes_only_the_culprits(native):
    sim = Simulation(exploding("kill"), device="cpu", threads=2, native=native)
    sim.run(2.0)
    assert sim.statistics()["p"]["killed"] == 2
    assert sim.frame()["p"].id.tolist() == list(range(98)) and np.isfinite(sim.frame()["p"].position).all()


def test_reset_clears_the_system_and_its_emitters_go_on():
    rate = {"rate": 600.0, "shape": {"type": "point", "center": [1, 0, 0]}, "mass": 3.6e-6, "lifetime": 9.0}  # omega h = 2.2
    sim = Simulation(scene({"coupling": None}, rate, forces=EXPLODING, limits={"unstable": "reset"}), device="cpu", threads=1)
    counts = []
    for frame in sim.frames(120):
        assert np.isfinite(frame["p"].position).all()
        counts.append(frame["p"].count)
    assert counts.count(0) >= 2 and max(counts) > 10 and counts[-1] != counts[-2]


def test_a_prewarm_that_blows_up_says_so():
    with pytest.raises(UnstableError) as caught:
        early = burst(1, mass=1e-7, shape={"type": "point", "center": [1, 0, 0]}, burst={"count": 1, "at": -2.5})
        Simulation(scene({"coupling": None}, early, forces=EXPLODING, time={"prewarm": 3.0}), device="cpu")
    assert caught.value.time < 0.0
