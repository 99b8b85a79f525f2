"""Streamlines of the flow, as data."""

import numpy as np
import pytest

from tests.simulation.scenes import scene
from warpsim import Simulation


def test_streamlines_of_a_vortex_are_circles():
    sim = Simulation(scene(flow=[{"type": "vortex", "axis": [0, 0, 1], "circulation": 2.0}]), device="cpu")
    lines = sim.flow.streamlines([[1.0, 0.0, 0.5], [2.0, 0.0, 0.5]], length=2 * np.pi)
    assert lines.shape == (2, 101, 3) and lines.dtype == np.float32
    radius = np.hypot(lines[..., 0], lines[..., 1])
    assert np.abs(radius - [[1.0], [2.0]]).max() < 1e-5  # RK4 at 100 steps a turn: (2π/100)^5/120 per step
    assert lines[0, -1] == pytest.approx([1.0, 0.0, 0.5], abs=1e-4)  # once round
    assert lines[1, -1] == pytest.approx([-2.0, 0.0, 0.5], abs=1e-4)  # half round


def test_a_streamline_in_still_fluid_stays():
    lines = Simulation(scene(flow=[]), device="cpu").flow.streamlines([[1.0, 2.0, 3.0]], length=1.0, step_count=3)
    assert np.array_equal(lines[0], np.tile(np.float32([1, 2, 3]), (4, 1)))
