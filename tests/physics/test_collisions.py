"""Laws of collisions: restitution, friction, energy, no way through. One particle each, so that theory says where it is."""

import numpy as np
import pytest

from tests.physics.scenes import simulate, start, state

SECOND_ORDER = ("euler", "drift_kick", "semi_implicit_euler", "verlet", "rk4")
G = 9.81
GROUND = {"type": "plane", "restitution": 1.0, "friction": 0.0}


def heights(sim, seconds: float) -> np.ndarray:
    """The tops of a bouncing particle's arcs [m], between frames by the parabola through three of them."""
    y = np.array([state(sim)[0][0, 1], *(frame["p"].position[0, 1] for frame in sim.frames(round(60 * seconds)))], float)
    a, b, c = y[:-2], y[1:-1], y[2:]
    top = (b >= a) & (b > c) & (a > 0.02) & (c > 0.02)
    bend = a - 2.0 * b + c
    return (b - (c - a) ** 2 / (8.0 * np.where(bend == 0.0, 1.0, bend)))[top]


@pytest.mark.parametrize("restitution", [0.95, 0.9])
@pytest.mark.parametrize("solver", SECOND_ORDER)
def test_a_ball_keeps_its_restitution(solver, restitution):
    """Heights fall by e² each bounce. A frame that holds a bounce fits no parabola: tops between frames are left to those that do."""
    ground = {"type": "plane", "restitution": restitution}
    sim = simulate(start((0, 1, 0)), gravity=(0, -G, 0), colliders=[ground], solver=solver)
    found = heights(sim, 8.0)[:10]
    assert len(found) == 10
    expected = restitution ** (2.0 * np.arange(1, 11))
    assert found == pytest.approx(expected, rel=0.01)
