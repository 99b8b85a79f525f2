"""Memory is estimated before it is taken."""

import pytest

from tests.simulation.scenes import scene
from warpsim import SceneError, Simulation, footprint, memory
from warpsim.kernels.forces import ForceField
from warpsim.kernels.primitive import FlowPrimitive
from warpsim.population import FIELDS


def test_the_estimate_knows_the_sizes_of_the_real_tables():
    assert footprint.BYTES_PER_PARTICLE == 4 * (sum(field.rows for field in FIELDS.values()) + 1)  # and the flag of the living
    assert max(FlowPrimitive.numpy_dtype()["itemsize"], ForceField.numpy_dtype()["itemsize"]) <= footprint.BYTES_PER_PRIMITIVE


def test_a_scene_beyond_its_own_limit_is_refused_before_allocation():
    greedy = scene({"capacity": 2**27}, limits={"memory": 1.0})
    with pytest.raises(SceneError, match=r"needs about 12\.\d+ GiB, but 1.00 GiB its limits.memory allows"):
        Simulation(greedy, device="cpu")


def test_a_scene_beyond_the_machine_is_refused(monkeypatch):
    monkeypatch.setattr("warpsim.simulation.free_memory", lambda: 1 << 20)
    with pytest.raises(memory.MemoryLimitError, match="is free"):
        Simulation(scene(), device="cpu")


def test_intervals_far_shorter_than_a_frame_are_counted():
    tiny = scene(emitter={"rate": {"mean": 1.0, "interval": 1e-5}}, time={"fps": 1e-6})
    with pytest.raises(memory.MemoryLimitError):
        Simulation(tiny, device="cpu")


def test_the_machine_says_how_much_is_free():
    assert 1 << 24 < memory.free_memory() <= 1 << 62
