"""Laws of motion: drag, flight, oscillators, orbits, tracers. One particle each, so that theory says where it is.

float32: a position near 1 m is rounded to 6e-8 m each substep; n substeps wander by about 6e-8 √n, and at worst drift by 6e-8 n.
"""

import numpy as np
import pytest

from tests.physics.scenes import simulate, start, state
from warpsim import UnstableError

EXPONENTIAL = ("heun", "adams_bashforth_2", "adams_bashforth_3", "adams_bashforth_4", "abm_pece_2", "abm_pece_4")
SECOND_ORDER = ("euler", "drift_kick", "semi_implicit_euler", "verlet", "rk4", *EXPONENTIAL)
WIND = ({"type": "uniform", "velocity": [3.0, 0.0, 0.0]},)
G = 9.81


def spring(k=1.0):
    return ({"type": "attractor", "center": [0, 0, 0], "strength": k, "law": "spring"},)


def stall(speed: float, k: float, kick: float) -> float:
    """How far from its limit a relaxing speed stops: where the kick k·kick·distance is less than half an ulp of the speed."""
    return 1.1 * float(np.spacing(np.float32(speed))) / 2 / (k * kick)


# ---- drag


@pytest.mark.parametrize("solver", SECOND_ORDER)
@pytest.mark.parametrize("substeps", [1, 4])
def test_terminal_speed_is_weight_over_drag(solver, substeps):
    """v = m g/α at any step for the kick, which is exact for constant u and a; rk4 splits the drag off, (h/τ)²/24 relative."""
    alpha, h = 2.0, 1 / 60 / substeps
    sim = simulate(start(), gravity=(0, -G, 0), coupling={"alpha": alpha}, solver=solver, substeps=substeps)
    sim.run(15.0)  # 30 relaxation times
    tolerance = stall(G / alpha, alpha, 0.5 * h if solver in ("verlet", "rk4") else h)
    tolerance += (alpha * h) ** 2 / 24 * G / alpha if solver == "rk4" else 0.0
    assert state(sim)[1][0, 1] == pytest.approx(-G / alpha, abs=tolerance)


def test_stokes_drag_grows_with_radius_and_viscosity():
    sim = simulate(start(radius=0.02), gravity=(0, -G, 0), coupling={"viscosity": 1.5})
    sim.run(30.0)
    k = 6 * np.pi * 0.02 * 1.5
    assert state(sim)[1][0, 1] == pytest.approx(-G / k, abs=stall(G / k, k, 1 / 240) + G / k * np.exp(-k * 30))


@pytest.mark.parametrize("alpha", [0.1, 3.0, 200.0, 1e9])
@pytest.mark.parametrize("solver", SECOND_ORDER)
def test_relaxation_is_exact_for_any_step(solver, alpha):
    """v(t) = u + (v0 − u) e^{−t/τ}, from h ≪ τ to h ≫ τ, where explicit drag would explode."""
    sim = simulate(start(velocity=(0, 4.0, 0)), flow=WIND, coupling={"alpha": alpha}, solver=solver, substeps=1)
    for frame in sim.frames(20):
        decay = np.exp(-alpha * frame.time)
        expected = np.array([3.0, 0, 0]) * (1 - decay) + np.array([0, 4.0, 0]) * decay
        # e^{−z} to 2e-7 and two roundings of numbers below 4 in each of up to 20 steps, forgotten as they relax
        assert np.abs(state(sim)[1][0] - expected).max() < 20 * 5e-7


@pytest.mark.parametrize("solver", ["semi_implicit_euler", "verlet"])
def test_strong_coupling_follows_the_tracer(solver):
    """Error O(τ): halving τ halves the distance to the pathline."""
    flow = ({"type": "rotation", "axis": [0, 0, 1], "angular_velocity": 1.0},)
    keys = {"flow": flow, "substeps": 64}
    tracer = simulate(start((1, 0, 0)), coupling="tracer", **keys)
    tracer.run(1.0)
    distance = []
    for tau in (0.04, 0.02):
        sim = simulate(start((1, 0, 0), (0, 1, 0)), coupling={"alpha": 1 / tau}, solver=solver, **keys)
        sim.run(1.0)
        distance.append(np.linalg.norm(state(sim)[0] - state(tracer)[0]))
    assert 0.01 < distance[1] < 0.05 and distance[0] / distance[1] == pytest.approx(2.0, abs=0.15)


# ---- flight


@pytest.mark.parametrize(
    ("solver", "error"),
    [("euler", 0.5), ("drift_kick", 0.5), ("semi_implicit_euler", -0.5)] + [(solver, 0.0) for solver in ("verlet", "rk4", *EXPONENTIAL)],
)
def test_arcs_have_each_methods_known_error(solver, error):
    """Explicit and drift–kick end ½ g h t too high, kick–drift ½ g h t too low, the others are exact."""
    sim = simulate(start((0, 1, 0), (2, 6, 0)), gravity=(0, -G, 0), solver=solver)
    for frame in sim.frames(60):
        t, h = frame.time, 1 / 240
        x, v = state(sim)
        steps = 240 * t
        rounding = 1e-6 + 2 * 2.4e-7 * steps  # half an ulp of numbers below 8, twice per substep, at worst all one way
        assert v[0] == pytest.approx([2, 6 - G * t, 0], abs=rounding)
        assert x[0] == pytest.approx([2 * t, 1 + 6 * t - 0.5 * G * t * t + error * G * h * t, 0], abs=rounding * (1 + t))


def test_ballistic_flight_is_exact_at_any_time():
    sim = simulate(start((0, 1, 0), (2, 60, 0)), gravity=(0, -G, 0), motion="ballistic", substeps=1)
    for frame in sim.frames(300):
        t = frame.time
        assert state(sim)[0][0] == pytest.approx([2 * t, 1 + 60 * t - 0.5 * G * t * t, 0], abs=4e-5)  # roundings of 180 m


# ---- the oscillator: ω = 2π rad/s by the spring, h = 1/(60 substeps)

OMEGA = 2 * np.pi


def oscillate(solver, seconds, substeps=1, k=OMEGA**2):
    sim = simulate(start((1, 0, 0)), forces=spring(k), solver=solver, substeps=substeps)
    orbit = [state(sim)]
    for _ in sim.frames(round(60 * seconds)):
        orbit.append(state(sim))
    return np.array([(x[0, 0], v[0, 0]) for x, v in orbit]).T


def test_explicit_euler_gains_amplitude_by_its_factor():
    x, v = oscillate("euler", 2.0)
    h = 1 / 60
    energy = v**2 + OMEGA**2 * x**2
    growth = energy[1:] / energy[:-1]
    assert growth == pytest.approx(1 + (OMEGA * h) ** 2, rel=1e-5)


@pytest.mark.parametrize(("solver", "sign"), [("drift_kick", 1), ("semi_implicit_euler", -1)])
def test_symplectic_methods_keep_their_invariant(solver, sign):
    x, v = oscillate(solver, 20.0)
    invariant = v**2 + OMEGA**2 * x**2 + sign * OMEGA**2 * x * v / 60
    assert invariant == pytest.approx(OMEGA**2, rel=2e-5)  # 1200 steps of roundings of 1e-7


@pytest.mark.parametrize("solver", ["drift_kick", "semi_implicit_euler", "verlet"])
def test_symplectic_methods_are_stable_up_to_omega_h_of_two(solver):
    stable, _ = oscillate(solver, 5.0, k=(1.98 * 60) ** 2)
    assert np.abs(stable).max() < 12
    with pytest.raises(UnstableError):
        oscillate(solver, 2.0, k=(2.02 * 60) ** 2)


def test_verlet_swings_at_its_own_frequency():
    x, _ = oscillate("verlet", 20.0)
    h = 1 / 60
    slow = 2 / h * np.arcsin(OMEGA * h / 2)
    assert x == pytest.approx(np.cos(slow * np.arange(len(x)) * h), abs=5e-4)  # 1200 steps of roundings, amplified by the phase
    assert np.abs(x - np.cos(OMEGA * np.arange(len(x)) * h)).max() > 0.02  # and not at the exact one


@pytest.mark.parametrize(("solver", "order"), [("euler", 1), ("drift_kick", 1), ("semi_implicit_euler", 1), ("verlet", 2), ("rk4", 4)])
def test_errors_fall_with_the_order_of_the_method(solver, order):
    """Steps so long that rounding does not show: ωh from 0.1 to 0.03; for rk4 from 0.4 to 0.1."""
    k, steps = (OMEGA**2, (1, 2)) if order < 4 else ((4 * OMEGA) ** 2, (1, 2))
    omega, errors = np.sqrt(k), []
    for substeps in steps:
        x, v = oscillate(solver, 0.5, substeps, k)
        t = np.arange(len(x)) / 60
        errors.append(np.abs(x - np.cos(omega * t)).max() + np.abs(v + omega * np.sin(omega * t)).max() / omega)
    assert np.log2(errors[0] / errors[1]) == pytest.approx(order, abs=0.15)


# ---- the lecture's attractor of constant magnitude, and Kepler's


def attractor(strength, law="constant"):
    return ({"type": "attractor", "center": [0, 0, 0], "strength": strength, "law": law, "softening": 1e-4},)


@pytest.mark.parametrize("solver", ["verlet", "rk4"])
def test_a_circular_orbit_round_the_attractor(solver):
    """v = √(k r/m): after one turn it is back; ½ m v² + k r is kept."""
    k, r = 2.0, 1.5
    speed = np.sqrt(k * r)
    sim = simulate(start((r, 0, 0), (0, speed, 0)), forces=attractor(k), solver=solver, substeps=8)
    turn = 2 * np.pi * r / speed
    sim.run(round(turn * 60) / 60)
    angle = sim.time / turn * 2 * np.pi
    x, v = state(sim)
    assert x[0] == pytest.approx([r * np.cos(angle), r * np.sin(angle), 0], abs=2e-4)
    assert 0.5 * (v[0] @ v[0]) + k * np.linalg.norm(x) == pytest.approx(0.5 * speed**2 + k * r, rel=1e-5)


def test_the_fall_into_the_attractor_takes_its_time():
    """From rest at d: √(2 d m/k) seconds, arriving with √(2 k d/m)."""
    k, d = 2.0, 1.0
    sim = simulate(start((d, 0, 0)), forces=attractor(k), solver="verlet", substeps=16)
    fall = np.sqrt(2 * d / k)
    before = int(fall * 60) - 2
    sim.seek(before)
    x, v = state(sim)
    left = fall - sim.time
    assert x[0, 0] == pytest.approx(d - 0.5 * k * sim.time**2, abs=1e-4) and 0 < left < 4 / 60
    assert v[0, 0] == pytest.approx(-np.sqrt(2 * k * d) + k * left, abs=2e-4)


def test_keplers_orbit_closes_after_its_period():
    """Inverse square, eccentricity ½: T = 2π √(a³ m/k)."""
    k, a, e = 4.0, 1.0, 0.5
    start_speed = np.sqrt(k / a * (1 - e) / (1 + e))
    period = 2 * np.pi * np.sqrt(a**3 / k)
    fps = 100 / period  # so that the period is a whole number of frames
    sim = simulate(
        start((a * (1 + e), 0, 0), (0, start_speed, 0)), forces=attractor(k, "inverse_square"), solver="rk4", fps=fps, substeps=8
    )
    sim.seek(100)
    assert state(sim)[0][0] == pytest.approx([a * (1 + e), 0, 0], abs=2e-3)
    sim.seek(150)
    assert state(sim)[0][0] == pytest.approx([-a * (1 - e), 0, 0], abs=2e-3)


# ---- tracers


def test_a_tracer_circles_the_vortex_in_its_period():
    """4π² r²/C; Runge–Kutta at 240 steps a second keeps the radius to rounding, Euler gains (C h/2πr)² of r² a step."""
    c, r = 3.0, 0.8
    flow = ({"type": "vortex", "axis": [0, 0, 1], "circulation": c},)
    period = 4 * np.pi**2 * r**2 / c
    sim = simulate(start((r, 0, 0)), flow=flow, coupling="tracer", fps=64 / period)
    sim.seek(64)
    assert state(sim)[0][0] == pytest.approx([r, 0, 0], abs=2e-5)
    sim = simulate(start((r, 0, 0)), flow=flow, coupling="tracer", solver="euler", fps=64 / period)
    sim.seek(64)
    radius = np.linalg.norm(state(sim)[0][0])
    assert radius**4 == pytest.approx(r**4 + 2 * (c * period / 256 / (2 * np.pi)) ** 2 * 256, rel=2e-3)


@pytest.mark.parametrize("rate", [2.0, -1.0])
def test_a_source_drives_tracers_as_the_root_of_time(rate):
    sim = simulate(start((0.9, 0, 0)), flow=({"type": "source", "axis": [0, 0, 1], "rate": rate},), coupling="tracer")
    for frame in sim.frames(60):
        assert state(sim)[0][0, 0] ** 2 == pytest.approx(0.81 + rate * frame.time / np.pi, rel=1e-4)


def test_a_sink_swallows_a_tracer_in_its_time():
    """After π r0²/|V′|; until then r² falls on a straight line."""
    swallowed = np.pi * 0.5**2 / 1.0
    sim = simulate(start((0.5, 0, 0)), flow=({"type": "source", "axis": [0, 0, 1], "rate": -1.0},), coupling="tracer", substeps=16)
    sim.seek(int(0.99 * swallowed * 60))
    assert state(sim)[0][0, 0] ** 2 == pytest.approx(0.25 - sim.time / np.pi, abs=1e-4)


def test_a_source_in_a_vortex_draws_a_logarithmic_spiral():
    """r = r0 exp((V′/C)(θ − θ0))."""
    v, c = 0.8, 3.0
    both = ({"type": "source", "axis": [0, 0, 1], "rate": v}, {"type": "vortex", "axis": [0, 0, 1], "circulation": c})
    sim = simulate(start((0.5, 0, 0)), flow=both, coupling="tracer")
    theta = 0.0
    before = np.array([0.5, 0.0])
    for _ in sim.frames(240):
        now = state(sim)[0][0, :2]
        theta += np.arctan2(before[0] * now[1] - before[1] * now[0], before @ now)
        before = now
        assert np.linalg.norm(now) == pytest.approx(0.5 * np.exp(v / c * theta), rel=2e-4)
    assert theta > 3.0


def test_a_tracer_goes_where_the_integral_of_the_wind_says():
    wind = [
        {"keyframes": [[0.0, 0.0], [1.0, 2.0]]},
        {"sine": {"amplitude": 1.5, "period": 0.8}},
        {"expression": "t^2 - smoothstep(0, 2, t)"},
    ]
    sim = simulate(start(), flow=({"type": "uniform", "velocity": wind},), coupling="tracer")
    sim.run(1.5)
    t = 1.5
    smooth = t * ((t / 2) ** 2 - (t / 2) ** 3 / 2)
    expected = [1.0 + 2.0 * 0.5, 1.5 * 0.8 / (2 * np.pi) * (1 - np.cos(2 * np.pi * t / 0.8)), t**3 / 3 - smooth]
    assert state(sim)[0][0] == pytest.approx(expected, abs=2e-5)  # Runge–Kutta in t alone is Simpson's rule: h^4 below rounding


def test_a_tracer_ignores_gravity_and_forces():
    sim = simulate(start((1, 0, 0)), gravity=(0, -G, 0), forces=attractor(5.0), coupling="tracer", flow=WIND)
    sim.run(1.0)
    x, v = state(sim)
    assert x[0] == pytest.approx([4.0, 0, 0], abs=1e-4) and v[0] == pytest.approx([3.0, 0, 0])
