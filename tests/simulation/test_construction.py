"""Building a simulation: devices, threads, probes, and what they refuse."""

import numpy as np
import pytest

from tests.simulation.scenes import scene
from warpsim import Simulation


def test_an_unknown_device_names_those_there_are():
    with pytest.raises(ValueError, match="this machine has cpu"):
        Simulation(scene(), device="cuda:99")


def test_threads_are_counted_from_one():
    with pytest.raises(ValueError, match="at least 1"):
        Simulation(scene(), device="cpu", threads=0)


@pytest.mark.parametrize("points", [[1.0, 2.0, 3.0], [[1.0, 2.0]], [[np.nan, 0.0, 0.0]]])
def test_probes_refuse_points_that_are_none(points):
    with pytest.raises(ValueError, match="points must"):
        Simulation(scene(), device="cpu").flow.sample(points)


def test_probes_refuse_an_axis_without_direction():
    with pytest.raises(ValueError, match="axis"):
        Simulation(scene(), device="cpu").flow.circulation([0, 0, 0], [0, 0, 0], 1.0)


def test_probing_does_not_change_the_run():
    sim, other = Simulation(scene(), device="cpu", threads=1), Simulation(scene(), device="cpu", threads=1)
    for _ in range(5):
        sim.step_frame()
        sim.flow.sample([[0.1, 0.2, 0.3]], time=9.0)
        other.step_frame()
    assert sim.state_hash() == other.state_hash()


def test_a_probe_knows_the_present():
    sim = Simulation(scene(flow=[{"type": "uniform", "velocity": [{"expression": "2*t"}, 0, 0]}]), device="cpu", threads=1)
    sim.run(0.5)
    assert sim.flow.sample([[0.0, 0.0, 0.0]])[0, 0] == pytest.approx(1.0, rel=1e-6)
    assert sim.flow.sample([[0.0, 0.0, 0.0]], time=3.0)[0, 0] == pytest.approx(6.0, rel=1e-6)
