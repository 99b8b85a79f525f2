"""The past of a particle under a multistep method: its own from its birth on, whoever dies before it and whatever it meets."""

import numpy as np
import pytest

from tests.physics.scenes import emitter, simulate, start, state

MULTISTEP = ("adams_bashforth_2", "adams_bashforth_3", "adams_bashforth_4", "abm_pece_2", "abm_pece_4")
STEADY = {
    "flow": ({"type": "vortex", "axis": [0, 0, 1], "circulation": 3.0, "core": {"model": "scully", "radius": 0.3}},),
    "forces": ({"type": "attractor", "center": [0.2, 0, 0], "strength": 3.0},),
    "gravity": (0, -1, 0),
}
COUPLINGS = {"inertial": {"alpha": 0.7}, "tracer": "tracer"}


def story(solver, coupling, later: float, native=True, substeps=2):
    """One particle at t = 0, the same again at `later`, and before and after each many that die on the way and leave gaps."""
    one = {"shape": {"type": "point", "center": [0.8, 0.1, 0]}, "velocity": {"direction": [0, 1, 0], "speed": 1.0}}
    brief = {**one, "rate": 2400.0, "lifetime": {"mean": 0.1, "spread": 0.09}}
    emitters = [brief, emitter(1, 0.0, **one), emitter(1, later, **one)]
    return simulate(*emitters, **STEADY, solver=solver, coupling=COUPLINGS[coupling], native=native, substeps=substeps)


def lasting(sim) -> np.ndarray:
    """Return positions and velocities of those that live for ever, in order of birth: (n, 6)."""
    kept = sim.frame()["p"].lifetime > 1.0
    return np.hstack(state(sim))[kept]


@pytest.mark.parametrize("native", [True, False])
@pytest.mark.parametrize("coupling", COUPLINGS)
@pytest.mark.parametrize("solver", MULTISTEP)
def test_who_is_born_in_mid_run_takes_the_path_of_who_was_there_first(solver, coupling, native):
    """A steady field, born on a step: the same steps half a second later, but for the rounding of its age, which is 1e-7 s at most."""
    sim = story(solver, coupling, 0.5, native)
    first = []
    for frame in sim.frames(90):
        place = lasting(sim)
        first.append(place[0])
        if frame.index > 30:
            assert np.abs(place[1] - first[frame.index - 31]).max() < 1e-5, frame.index
    assert np.ptp(np.array(first)[:, 0]) > 0.3, "it went somewhere"


@pytest.mark.parametrize("coupling", COUPLINGS)
def test_who_is_born_within_a_step_is_on_the_path_too(coupling):
    """A third of a substep late: not the same steps, but the same path, to the error of fourth order (ωh < 0.06) and rounding."""
    at = 0.5 + 1 / 3 / 480
    sim, exact = story("adams_bashforth_4", coupling, at, substeps=8), story("rk4", coupling, at, substeps=32)
    sim.run(1.5)
    exact.run(1.5)
    assert np.abs(lasting(sim)[1] - lasting(exact)[1]).max() < 2e-5


def test_a_dead_neighbors_past_is_not_inherited():
    """Slots are used again: whoever is born into one begins to count at nothing."""
    sim = story("adams_bashforth_4", "inertial", 0.5)
    for frame in sim.frames(20):
        counts, newest = sim.systems["p"].population.host("history_count"), frame["p"].age < 1 / 60
        assert newest.any() and (counts[newest] <= 1).all() and (frame.index < 3 or (counts == 3).any())


@pytest.mark.parametrize("solver", MULTISTEP)
def test_a_bounce_begins_a_new_past(solver):
    """A ball on the ground under gravity alone: every arc is a parabola, which a past of both sides of a bounce would bend."""
    ground = {"type": "plane", "center": [0, 0, 0], "normal": [0, 1, 0], "restitution": 1.0, "friction": 0.0}
    sim = simulate(start((0, 1, 0), (0.5, 0, 0)), gravity=(0, -9.81, 0), colliders=(ground,), solver=solver, substeps=2)
    heights = []
    for _ in sim.frames(240):
        x, v = state(sim)
        heights.append(x[0, 1] + v[0, 1] ** 2 / (2 * 9.81))
    assert np.abs(np.array(heights) - 1.0).max() < 1e-3


@pytest.mark.parametrize("solver", ["heun", *MULTISTEP])
def test_strong_drag_takes_a_particle_along_the_tracers_path_of_the_same_method(solver):
    """τ = 1e-6 s, ωh = 0.05: the same method then, up to τ, rounding, and three first steps, (ωh)⁴/24 each."""
    flow = ({"type": "rotation", "axis": [0, 0, 1], "angular_velocity": 6.0},)
    tracer = simulate(start((1, 0, 0)), flow=flow, coupling="tracer", solver=solver, substeps=2)
    heavy = simulate(start((1, 0, 0), (0, 6, 0)), flow=flow, coupling={"alpha": 1e6}, solver=solver, substeps=2)
    tracer.run(1.0)
    heavy.run(1.0)
    assert np.abs(state(tracer)[0] - state(heavy)[0]).max() < 5e-5


def test_heun_swings_at_its_own_amplitude():
    """Energy of the linear-acceleration method: the determinant of its step is 1 − (ωh)⁴/12, for 1.6 s at ωh = 0.4."""
    omega = 24.0
    sim = simulate(
        start((1, 0, 0)),
        forces=({"type": "attractor", "center": [0, 0, 0], "strength": omega**2, "law": "spring"},),
        solver="heun",
        substeps=1,
    )
    sweep = []
    for _ in sim.frames(96):
        x, v = state(sim)
        sweep.append(np.hypot(x[0, 0], v[0, 0] / omega))
    assert sweep[-1] == pytest.approx((1.0 - (omega / 60) ** 4 / 12) ** 48, rel=0.03)
