"""Flows written as formulas: what they say is what is felt, in 64 bits; and what is not a number is answered like any instability."""

import math

import numpy as np
import pytest

from tests.physics.scenes import emitter, scene, simulate, start, state
from warpsim import Simulation, UnstableError
from warpsim.changes import FixedField

POINTS = np.random.default_rng(1).uniform(0.2, 2.0, (200, 3))


def expression(*velocity, **keys) -> dict:
    return {"type": "expression", "velocity": list(velocity), **keys}


def test_a_vortex_written_out_is_the_vortex():
    written = expression("-0.7*y/(2*pi*(x^2 + y^2))", "0.7*x/(2*pi*(x^2 + y^2))", 0)
    vortex = {"type": "vortex", "axis": [0, 0, 1], "circulation": 0.7}
    one, other = (simulate(flow=[flow]).flow.sample(POINTS).astype(float) for flow in (written, vortex))
    np.testing.assert_allclose(one, other, rtol=1e-6)  # the vortex is rounded some ten times, the formula once


def test_place_and_time_are_those_of_the_particle():
    """Worked out in float64 and rounded once, 2^-24 = 6e-8."""
    flow = simulate(flow=[expression("x + 10*y", "z*t", "t")]).flow
    at = flow.sample(POINTS, time=3.0).astype(float)
    x, y, z = np.float32(POINTS).astype(float).T
    np.testing.assert_allclose(at, np.stack([x + 10.0 * y, 3.0 * z, 3.0 + 0.0 * z], axis=1), rtol=1e-7)


def test_its_origin_may_travel():
    """In float64 but for the displacement and the last rounding, which are float32."""
    flow = simulate(flow=[expression("x", "y", "z", travel=[{"expression": "2*t"}, 1.0, 0.0])]).flow
    np.testing.assert_allclose(flow.sample(POINTS, time=3.0), np.float32(POINTS) - [6.0, 1.0, 0.0], rtol=1e-6)


def test_it_is_worked_out_in_64_bits():
    """The flow of x/1e9 beside 1e9: in 32 bits the small part would be gone."""
    flow = simulate(flow=[expression("(1e9 + x/1e3) - 1e9", "0", "0")]).flow
    got = flow.sample(POINTS)[:, 0].astype(float)
    np.testing.assert_allclose(got, np.float32(POINTS[:, 0]) / 1e3, atol=2.0**-23)  # of 1e9 a double keeps 1.2e-7


def test_a_tracer_follows_the_formula():
    """x' = x, y' = −y, z' = cos t: exponentials and a sine; rk4 at h = 1/240 errs by 1e-11, rounding by 480 · 6e-8."""
    sim = simulate(start((0.1, 2.0, 0.5)), flow=[expression("x", "-y", "cos(t)")], coupling="tracer")
    sim.run(2.0)
    np.testing.assert_allclose(state(sim)[0][0], [0.1 * math.exp(2.0), 2.0 * math.exp(-2.0), 0.5 + math.sin(2.0)], rtol=3e-5)


def test_the_double_gyre_keeps_its_box():
    """No flow crosses the border: after 60 s of folding, no tracer is further out than rk4's error."""
    sim = Simulation(gyre(), device="cpu", threads=1)
    sim.run(60.0)
    x, y, _ = sim.frame()["p"].position.T
    assert x.min() > -1e-4 and x.max() < 2.0001 and y.min() > -1e-4 and y.max() < 1.0001
    assert np.abs(sim.flow.divergence(POINTS, time=1.3)).max() < 1e-4


def gyre():
    bend = "(0.25*sin(pi*t/2)*x*(x - 2) + x)"
    flow = expression(
        f"-0.4*pi*sin(pi*{bend})*cos(pi*y)", f"0.4*pi*cos(pi*{bend})*sin(pi*y)*(0.5*sin(pi*t/2)*(x - 1) + 1)", "0", name="gyre"
    )
    shape = {"type": "box", "center": [1, 0.5, 0], "size": [2, 1, 1e-3]}
    wind = {"name": "wind", "type": "uniform", "velocity": [0, 0, 0]}
    return scene(emitter(300, shape=shape), flow=[wind, flow], coupling="tracer", substeps=1)


def test_a_change_of_another_number_leaves_the_formulas_alone():
    """The tables are written anew; what the rows point at must stay."""
    plain, changed = (Simulation(gyre(), device="cpu", threads=1) for _ in range(2))
    for sim in (plain, changed):
        sim.run(0.2)
    changed.change("flow.wind.velocity.2", 0.5)
    for sim in (plain, changed):
        sim.run(0.5)
    one, other = plain.frame()["p"].position, changed.frame()["p"].position
    assert (one[:, :2] == other[:, :2]).all() and other[:, 2] - one[:, 2] == pytest.approx(0.25, rel=1e-5)
    with pytest.raises(FixedField):
        changed.change("flow.gyre.velocity.2", "1")


BAD = {
    "a pole": expression("1/(x - 0.5)^0", "0", "1/0"),
    "an infinity": expression("exp(700)*exp(700)", "0", "0"),
    "beyond 32 bits": expression("1e60", "0", "0"),
    "not a number": expression("sqrt(-1 - x^2)", "0", "0"),
    "not always": expression("0", "log(0.05 - t)", "0"),
}


@pytest.mark.parametrize("native", [True, False])
@pytest.mark.parametrize("coupling", ["tracer", {"alpha": 0.5}], ids=["tracer", "drag"])
@pytest.mark.parametrize("kind", BAD)
def test_what_is_not_finite_is_answered_by_the_runs_policy(kind, coupling, native):
    keys = {"flow": [BAD[kind]], "coupling": coupling, "native": native}
    with pytest.raises(UnstableError, match="not finite"):
        simulate(start(), **keys).run(0.2)
    killed = simulate(start(), limits={"unstable": "kill"}, **keys)
    killed.run(0.2)
    assert killed.frame()["p"].count == 0 and killed.statistics()["p"]["killed"] == 1
    reset = simulate(start(), limits={"unstable": "reset"}, **keys)
    reset.run(0.2)
    assert np.isfinite(reset.frame()["p"].position).all()


def test_a_pole_that_nobody_meets_harms_nobody():
    """120 roundings of 6e-8 on a way of half a meter, at worst all one way."""
    keys = {"flow": [expression("0", "1/x", "0")], "coupling": "tracer", "limits": {"unstable": "kill"}}
    sim = simulate(start((1.0, 0.0, 0.0)), start((0.0, 0.0, 0.0)), **keys)
    sim.run(0.5)
    assert sim.frame()["p"].position == pytest.approx(np.array([[1.0, 0.5, 0.0]]), rel=1e-5)


def test_probes_say_what_they_meet_and_streamlines_stop_there():
    """A streamline of unit speed goes a meter in ten steps; each is right to a few roundings."""
    flow = simulate(flow=[expression("1/x", "0", "0")]).flow
    got = flow.sample([[0.0, 0.0, 0.0], [2.0, 0.0, 0.0]])
    assert np.isinf(got[0, 0]) and got[1, 0] == 0.5
    lines = flow.streamlines([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0]], 1.0, 10)
    assert np.isfinite(lines).all() and (lines[0] == 0.0).all() and lines[1, -1, 0] == pytest.approx(2.0, rel=1e-5)
