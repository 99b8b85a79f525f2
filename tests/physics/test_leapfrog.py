"""The leapfrogging rings: their keyframes are the thin-ring equations', which are the flow's own at the rings' circles."""

import numpy as np
import pytest

from tests.reference import leapfrog
from warpsim import Simulation, load_scene


@pytest.fixture(scope="module")
def solved():
    times, states = leapfrog.paths()
    return times, states, leapfrog.mean_speed(times, states)


def rings(scene) -> list:
    return [primitive for primitive in scene.flow if primitive.type == "vortex_ring"]


def test_keyframes_are_those_of_the_equations(solved):
    """Written with four digits."""
    times, states, wind = solved
    for number, ring in enumerate(rings(load_scene("leapfrog"))):
        assert ring.circulation == leapfrog.CIRCULATION and ring.core.radius == leapfrog.CORE
        for curve, expected in ((ring.radius, states[:, number, 0]), (ring.travel[0], states[:, number, 1] - wind * times)):
            knots = np.array(curve.keyframes)
            np.testing.assert_allclose(knots[:, 0], times, atol=1e-9)
            np.testing.assert_allclose(knots[:, 1], expected, atol=0.6e-4)


def test_they_pass_each_other_again_and_again_and_keep_their_impulse(solved):
    """Σ Γ R² is an invariant of the equations; Runge–Kutta at h = 0.01 s, a hundredth of a passing, keeps it to 1e-8."""
    _, states, _ = solved
    ahead = states[:, 0, 1] - states[:, 1, 1]
    assert (np.diff(np.sign(ahead)) != 0).sum() >= 6
    impulse = (states[:, :, 0] ** 2).sum(axis=1)
    assert np.ptp(impulse) < 1e-8 * impulse[0]
    assert states[:, :, 0].min() < 0.55 and states[:, :, 0].max() > 0.85, "the one slips through the other"


def test_half_the_step_gives_the_same_paths(solved, monkeypatch):
    """Of fourth order: what is left is a sixteenth of the error, and the keyframes have four digits."""
    monkeypatch.setattr(leapfrog, "STEP", 0.5 * leapfrog.STEP)
    _, finer = leapfrog.paths()
    assert np.abs(finer - solved[1]).max() < 1e-6


def test_the_flow_at_the_circles_moves_the_rings(solved):
    """At knots, where the scene's rings are the equations': the core's gradient of 16 m/s per m makes 1e-3 of keyframes' four digits."""
    times, states, wind = solved
    flow = Simulation(load_scene("leapfrog"), device="cpu", threads=1).flow
    for k in (0, 17, 60, 111):
        rate = leapfrog.motion(states[k])
        for number in (0, 1):
            radius, place = states[k, number] - [0.0, wind * times[k]]
            along, across, around = flow.sample([[place, 0.0, radius]], time=float(times[k])).astype(float)[0][[0, 2, 1]]
            assert [across, along + wind] == pytest.approx(rate[number], abs=2.5e-3) and abs(around) < 1e-6
