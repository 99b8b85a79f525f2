"""Laws of collisions: restitution, friction, energy, no way through. One particle each, so that theory says where it is."""

import numpy as np
import pytest

from tests.physics.scenes import simulate, start, state

SECOND_ORDER = ("euler", "drift_kick", "semi_implicit_euler", "verlet", "rk4")
G = 9.81
GROUND = {"type": "plane", "restitution": 1.0, "friction": 0.0}


SKIN = 2e-5  # [m] by which a particle within a meter of the origin may stop short of a surface (kernels/clearance.py)


def path(sim, seconds: float) -> tuple[np.ndarray, np.ndarray]:
    """Places and velocities of the one particle at every frame, (n, 3) each."""
    states = [state(sim)] + [state(sim) for _ in sim.frames(round(60 * seconds))]
    return tuple(np.array([each[k][0] for each in states]) for k in range(2))


def tops(y: np.ndarray) -> np.ndarray:
    """The tops of a bouncing particle's arcs [m]: parabolas through three frames that lie within one arc."""
    a, b, c = y[:-2], y[1:-1], y[2:]
    bend = a - 2.0 * b + c
    whole = (b >= a) & (b > c) & (np.abs(bend + G / 3600) < 0.01 * G / 3600)
    return (b - (c - a) ** 2 / (8.0 * np.where(whole, bend, 1.0)))[whole]


@pytest.mark.parametrize("solver", SECOND_ORDER)
def test_a_ball_keeps_its_restitution(solver):
    """Heights fall by e² each bounce, ten times: a height's error is the skin, and v h of the solver at birth, of 1 m."""
    sim = simulate(start((0, 1, 0)), gravity=(0, -G, 0), colliders=[GROUND | {"restitution": 0.95}], solver=solver)
    y, _ = path(sim, 7.5)
    assert tops(y[:, 1])[:10] == pytest.approx(0.95 ** (2.0 * np.arange(1, 11)), rel=0.01)


@pytest.mark.parametrize("solver", SECOND_ORDER)
def test_an_elastic_ball_loses_nothing(solver):
    """Ten bounces; each errs in speed by a few roundings of the place, 2e-7 m, per substep: 1e-4 of the height."""
    sim = simulate(start((0, 1, 0)), gravity=(0, -G, 0), colliders=[GROUND], solver=solver)
    found = tops(path(sim, 10.0)[0][:, 1])
    assert len(found) >= 8 and found == pytest.approx(found[0], abs=2e-3) and found[0] == pytest.approx(1.0, abs=2e-3)


def slope(shape: str, friction: float, degrees: float = 30.0) -> dict:
    """A slope through the origin, as a plane or the top of a box."""
    n = [-np.sin(np.radians(degrees)), np.cos(np.radians(degrees)), 0.0]
    answer = {"type": shape, "friction": friction, "restitution": 0.0}
    if shape == "plane":
        return answer | {"normal": n}
    return answer | {"size": [20, 1, 20], "center": [-0.5 * n[0], -0.5 * n[1], 0], "rotation": [0, 0, degrees]}


@pytest.mark.parametrize("shape", ["plane", "box"])
@pytest.mark.parametrize("solver", SECOND_ORDER)
def test_a_block_slides_iff_the_slope_is_steeper_than_its_friction(solver, shape):
    """tan 30° = 0.577. From rest it comes ½ g (sin β − μ cos β) t² far; the Euler methods err by ½ a h t of that, 1/240 of it."""
    for friction in (0.0, 0.3, 0.57):
        sim = simulate(start((0, SKIN / 2, 0)), gravity=(0, -G, 0), colliders=[slope(shape, friction)], solver=solver)
        x, _ = path(sim, 1.0)
        way = 0.5 * G * (np.sin(np.pi / 6) - friction * np.cos(np.pi / 6))
        assert np.linalg.norm(x[-1] - x[0]) == pytest.approx(way, rel=0.01)
    for friction in (0.585, 1.0):
        sim = simulate(start((0, SKIN / 2, 0)), gravity=(0, -G, 0), colliders=[slope(shape, friction)], solver=solver)
        x, v = path(sim, 2.0)
        assert np.abs(x[1:] - x[1]).max() == 0.0, "it stays, to the bit"


def test_friction_stops_a_sliding_particle_where_theory_says():
    """v²/(2 μ g), exact for the parabola of each substep but the last, which errs by at most its length."""
    sim = simulate(start((0, 1e-7, 0), (3, 0, 0)), gravity=(0, -G, 0), colliders=[GROUND | {"friction": 0.4}], solver="verlet")
    x, v = path(sim, 2.0)
    assert x[-1, 0] == pytest.approx(9.0 / (2 * 0.4 * G), rel=0.005) and (v[-1] == 0.0).all()


def test_an_oblique_impact_obeys_coulomb():
    """Without gravity: the normal speed times −e; of the tangential speed μ (1 + e) times the normal one is lost, and no more than all."""
    for friction, kept in ((0.1, 3.0 - 0.1 * 1.5 * 4.0), (0.6, 0.0)):
        sim = simulate(start((0, 1, 0), (3, -4, 0)), colliders=[GROUND | {"friction": friction, "restitution": 0.5}])
        _, v = path(sim, 0.5)
        assert v[-1] == pytest.approx([kept, 2.0, 0.0], abs=2e-6)


HOLLOW = {
    "sphere": {"radius": 1.0},
    "box": {"size": [2.0, 1.6, 1.2], "rotation": [20, 30, 10]},
    "capsule": {"start": [-0.5, 0.1, 0], "end": [0.6, 0, 0.2], "radius": 0.7},
}


@pytest.mark.parametrize("solver", ["semi_implicit_euler", "verlet", "rk4"])
@pytest.mark.parametrize("shape", HOLLOW)
def test_energy_is_kept_in_a_container(shape, solver):
    """Some hundred elastic impacts in 20 s; each errs by rounding, a few 1e-6 of 9 J/kg, so that 1e-4 of it is a generous bound."""
    room = {"type": shape, "side": "inside", "restitution": 1.0, "friction": 0.0} | HOLLOW[shape]
    sim = simulate(start((0.1, 0.2, 0.05), (3, 1, 2)), gravity=(0, -G, 0), colliders=[room], solver=solver)
    x, v = path(sim, 20.0)
    late = 0.5 * G / 240 if solver == "semi_implicit_euler" else 0.0  # its velocity is that of half a substep earlier
    energy = 0.5 * ((v - [0.0, late, 0.0]) ** 2).sum(axis=1) + G * x[:, 1]
    assert energy[1:] == pytest.approx(energy[1], rel=1e-4)
    assert np.abs(np.diff(v, axis=0)).max(axis=1).astype(bool).sum() > 100 and sim.statistics()["p"]["live"] == 1


@pytest.mark.parametrize("restitution", [0.0, 0.5, 1.0])
@pytest.mark.parametrize("shape", HOLLOW)
def test_energy_never_grows(shape, restitution):
    """With friction, sliding and resting included; verlet's velocity belongs to its place. Rounding: 2e-6 of the energy per frame."""
    room = {"type": shape, "side": "inside", "restitution": restitution, "friction": 0.1} | HOLLOW[shape]
    sim = simulate(start((0.1, 0.2, 0.05), (3, 1, 2)), gravity=(0, -G, 0), colliders=[room], solver="verlet")
    x, v = path(sim, 10.0)
    energy = 0.5 * (v**2).sum(axis=1) + G * (x[:, 1] + 1.0)
    assert np.diff(energy).max() < 2e-5
    if restitution < 1.0:
        assert np.abs(v[-1]).max() == 0.0, "it has come to rest"


def test_a_pendulum_in_a_bowl_keeps_its_energy_without_friction():
    """It slides on the round wall for 10 s, and returns to its height within 1e-3 of it."""
    bowl = {"type": "sphere", "radius": 1.0, "side": "inside", "restitution": 0.0, "friction": 0.0}
    sim = simulate(start((0.9999 * np.sin(1), -0.9999 * np.cos(1), 0)), gravity=(0, -G, 0), colliders=[bowl], solver="verlet")
    x, v = path(sim, 10.0)
    energy = 0.5 * (v**2).sum(axis=1) + G * x[:, 1]
    assert energy.max() < energy[0] + 1e-5 and energy.min() > energy[0] - 5e-3
    assert np.linalg.norm(x, axis=1).min() > 0.9998


def test_a_particle_leaves_a_ball_with_the_speed_of_theory():
    """From the top it lets go at 2/3 of the height, with v² = 2/3 g R, of which 2/3 is horizontal and stays."""
    ball = {"type": "sphere", "radius": 1.0, "restitution": 0.0, "friction": 0.0}
    sim = simulate(start((0.02, 1.0, 0)), gravity=(0, -G, 0), colliders=[ball], solver="verlet")
    _, v = path(sim, 4.0)
    height = np.sqrt(1 - 0.02**2)
    assert v[-1, 0] == pytest.approx(np.sqrt(2 / 3 * G * height) * 2 / 3 * height, rel=0.005)


def test_a_valley_guides_and_a_corner_stops():
    """Two slopes without friction: it stays in the crease and runs along it; a wall across it ends that."""
    b = np.radians(30)
    sides = [{"type": "plane", "normal": [s * np.sin(b), np.cos(b), 0], "restitution": 0, "friction": 0} for s in (1, -1)]
    sim = simulate(start((0, 0.05, 0), (0.3, 0, 1)), gravity=(0, -G, 0), colliders=sides, solver="verlet")
    x, v = path(sim, 3.0)
    assert v[-1] == pytest.approx([0, 0, 1], abs=1e-6) and np.abs(x[-1, :2]).max() < 2 * SKIN
    end = {"type": "plane", "normal": [0, 0, -1], "center": [0, 0, 1], "restitution": 0, "friction": 0}
    sim = simulate(start((0, 0.05, 0), (0.3, 0, 1)), gravity=(0, -G, 0), colliders=[*sides, end])
    x, v = path(sim, 3.0)
    assert (v[-1] == 0.0).all() and x[-1] == pytest.approx([0, 0, 1], abs=2 * SKIN)
