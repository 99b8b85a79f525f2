"""Laws of XPBD: where masses hang, how that improves with the substep, what is conserved, what damping may touch, what it survives.

float32: a position near 2 m is rounded to 1.2e-7 m whenever it changes, three times a substep.
"""

import math

import numpy as np
import pytest

from tests.physics.test_spring_laws import crossings
from tests.simulation.networks import simulate, state, tangle

G = 9.81


def put(sim, position=None, velocity=None) -> None:
    """Set the state of the present frame, (n, 3) each."""
    for key, value in (("position", position), ("velocity", velocity)):
        if value is not None:
            field = sim.systems["s"].population.field(key)
            array = field.numpy()
            array[:, : len(value)] = np.asarray(value, np.float32).T
            field.assign(array)


def chain(count: int, k: float, mass: float, substeps: int, spacing=0.05, seconds=20.0, **keys) -> np.ndarray:
    """Heights of a chain that hangs from (0, 2, 0), after so long that it is at rest: drag takes what the springs do not."""
    layout = {"type": "chain", "count": count, "start": [0, 2, 0], "end": [0, 2 - spacing * (count - 1), 0]}
    keys = {"gravity": (0, -G, 0), "solver": "xpbd", "coupling": {"alpha": mass}, **keys}
    sim = simulate(generator=layout, mass=mass, stiffness=k, pins=["start"], substeps=substeps, **keys)
    sim.run(seconds)
    return state(sim)[0][:, 1]


def tensions(count: int, mass: float) -> np.ndarray:
    """What each spring of a hanging chain carries, from the top: the weight below it [N]."""
    return mass * G * np.arange(count - 1, 0, -1)


@pytest.mark.parametrize("iterations", [1, 2, 10])
@pytest.mark.parametrize(("k", "substeps"), [(100.0, 1), (100.0, 16), (1e6, 1), (1e6, 16)])
def test_a_mass_hangs_at_mg_over_k_whatever_the_iterations(k, substeps, iterations):
    """One spring is solved exactly in each pass: no error but rounding, soft or stiff, at a long substep and a short one."""
    y = chain(2, k, 0.5, substeps, spacing=1.0, iterations=iterations, damping=0.3)
    assert y[1] == pytest.approx(1.0 - 0.5 * G / k, abs=4e-7)


@pytest.mark.parametrize("substeps", [4, 8, 16, 32])
def test_a_chain_hangs_lower_by_h2_over_m_and_the_pull_of_half_its_springs(substeps):
    """One pass: springs of the second color are right; each of the first has T h² (1/m + 1/m) more, the pinned one T h²/m − g h².

    That is k h²/m more than Hooke's law, and a quarter of it with twice the substeps. The roundings of 20 points add up to 1e-5 m.
    """
    count, k, m, spacing, h = 20, 5000.0, 0.02, 0.05, 1 / (60 * substeps)
    pulls = tensions(count, m)
    stretch = pulls / k
    stretch[0:1] += pulls[0] * h * h / m - G * h * h
    stretch[2::2] += 2 * pulls[2::2] * h * h / m
    below = np.cumsum(stretch + spacing)
    assert 2 - chain(count, k, m, substeps)[1:] == pytest.approx(below, abs=1e-5 + 5e-3 * (below[-1] - 0.95))


@pytest.mark.parametrize(("k", "substeps"), [(500.0, 8), (5000.0, 8), (5000.0, 32)])
def test_advice_tells_how_far_springs_give_way(k, substeps):
    """Measured on a chain: within 6 % of what is told (19 springs of which 10 are of the first color), and said where it is 5 % or more."""
    layout = {"type": "chain", "count": 20, "start": [0, 2, 0], "end": [0, 1.05, 0]}
    scene = simulate(generator=layout, mass=0.02, stiffness=k, pins=["start"], substeps=substeps, solver="xpbd")
    advice, exact = scene.systems["s"].advice, tensions(20, 0.02).sum() / k
    measured = (1.05 - chain(20, k, 0.02, substeps)[-1]) / exact - 1.0
    assert advice.excess == pytest.approx(measured, rel=0.06, abs=1e-4)
    assert ("give way" in str(advice)) == (advice.excess >= 0.05)


def test_more_iterations_bring_a_chain_to_hookes_law():
    """At k h²/m = 0.27: 0.2 mm of 7.5 mm are missing after two passes, rounding after six."""
    exact = 2 - np.cumsum(tensions(20, 0.02) / 5000.0 + 0.05)
    errors = [np.abs(chain(20, 5000.0, 0.02, 16, iterations=n)[1:] - exact).max() for n in (1, 2, 6)]
    assert errors[0] > 1.5e-3 and errors[1] < 0.15 * errors[0] and errors[2] < 1e-5


def test_damping_does_not_shift_where_a_chain_rests():
    """Damping inside the constraint moves 20 masses by 11 % of their stretch; apart from it by less than 1 %, here by rounding alone."""
    ends = [chain(20, 5000.0, 0.02, 16, damping=c)[-1] for c in (0.0, 0.5, 1e6)]
    stretch = tensions(20, 0.02).sum() / 5000.0
    assert ends == pytest.approx([ends[0]] * 3, abs=0.001 * stretch)


@pytest.mark.parametrize("h_omega", [0.05, 0.5])
def test_a_pair_swings_and_dies_away_as_by_backward_euler(h_omega):
    """Eigenvalue 1/(1 − iωh): angle atan(ωh) and factor 1/√(1 + ω²h²) a substep, to 1e-3: ten swings between crossings."""
    m, k, fps = 0.5, 100.0, 20.0 / h_omega  # ω = 20/s, one substep a frame
    net = {"points": [[0, 0, 0], [1.05, 0, 0]], "springs": [[0, 1]], "rest_length": 1.0, "mass": m, "stiffness": k}
    sim = simulate(**net, solver="xpbd", substeps=1, fps=fps)
    step = math.atan(h_omega)
    count = math.ceil(20 * math.pi / step) if h_omega < 0.1 else math.ceil(6 * math.pi / step)
    lengths = np.array([np.ptp(frame["s"].position[:, 0].astype(float)) for frame in sim.frames(count)])
    n = np.arange(1, count + 1)
    # The first substep starts with the length and at rest: x_n = Re((1 − i tan θ) e^{inθ}) cosⁿθ, with cos θ = 1/√(1 + ω²h²).
    expected = 1.0 + 0.05 * np.cos(step) ** n * np.cos(n * step)
    assert lengths == pytest.approx(expected, abs=1e-3 * 0.05 + n.max() * 2**-24)


def test_the_period_of_a_pair_comes_right_with_the_substep():
    """ω̃ = atan(ωh)/h: (ωh)²/3 too slow, 9e-6 at ωh = 1/192, below what the crossings of 30 samples a swing tell (1e-4)."""
    net = {"points": [[0, 0, 0], [1.05, 0, 0]], "springs": [[0, 1]], "rest_length": 1.0, "mass": 0.5, "stiffness": 100.0}
    sim = simulate(**net, solver="xpbd", substeps=16, fps=240)
    lengths = np.array([np.ptp(frame["s"].position[:, 0].astype(float)) for frame in sim.frames(480)])
    times = np.arange(1, 481) / 240
    rises = crossings((lengths - 1.0) * np.exp(0.5 * 400 / 3840 * times), times)
    assert 2 * math.pi * (len(rises) - 1) / (rises[-1] - rises[0]) == pytest.approx(20.0, rel=5e-4)


@pytest.mark.parametrize("iterations", [1, 3])
def test_momentum_stays_over_ten_thousand_steps(iterations):
    """Both ends of a spring get the same impulse but for rounding: 1e-4 of Σ m|v|, though the network swings through all its springs."""
    net = tangle() | {"damping": 0.1}
    sim = simulate(**net, solver="xpbd", substeps=10, fps=100, iterations=iterations)
    mass = np.array(net["mass"])[:, None]
    put(sim, velocity=0.5 * np.random.default_rng(5).normal(size=(70, 3)) + [0.5, 1.0, -0.3])
    v = state(sim)[1]
    before, scale = (mass * v).sum(axis=0), np.abs(mass * v).sum()
    sim.run(10.0)
    assert (mass * state(sim)[1]).sum(axis=0) == pytest.approx(before, abs=1e-4 * scale)


def test_a_slow_network_tumbles_on():
    """Impulses point along the new place of a spring, as in backward Euler, which costs ω² h of a spin in a time: here 2.5e-5 in 10 s."""
    net = tangle()
    del net["rest_length"]
    sim = simulate(**net, solver="xpbd", substeps=10, fps=100)
    mass = np.array(net["mass"])[:, None]
    center = (mass * state(sim)[0]).sum(axis=0) / mass.sum()
    put(sim, velocity=np.cross([0.02, 0.04, -0.02], state(sim)[0] - center))
    before = np.cross(state(sim)[0] - center, mass * state(sim)[1]).sum(axis=0)
    sim.run(10.0)
    after = np.cross(state(sim)[0] - center, mass * state(sim)[1]).sum(axis=0)
    assert np.linalg.norm(after - before) < 1e-4 * np.linalg.norm(before)


@pytest.mark.parametrize("substeps", [8, 32])
def test_damping_touches_neither_fall_nor_spin(substeps):
    """A stiff wheel falls as ever and turns as in backward Euler, dω/dt = −ω³ h; the strongest damping takes nothing more."""
    ring = {"type": "ring", "count": 8, "radius": 1.0}
    spins, seconds, h = [], 0.5, 1 / (60 * substeps)
    for damping in (0.0, 0.5, 1e9):
        keys = {"mass": 1.0, "stiffness": 4e5, "damping": damping, "gravity": (0, 0, -G), "substeps": substeps}
        sim = simulate(generator=ring, solver="xpbd", **keys)
        put(sim, velocity=np.cross([0, 0, 1.0], state(sim)[0]))
        sim.run(seconds)
        x, v = state(sim)
        spins.append((x[:, 0] * v[:, 1] - x[:, 1] * v[:, 0]).sum() / 8)
        assert v[:, 2] == pytest.approx(np.full(8, -G * seconds), rel=1e-5)
    lost = 1 - 1 / math.sqrt(1 + 2 * h * seconds)
    assert 1 - spins[0] == pytest.approx(lost, rel=0.02) and 1 - spins[1] == pytest.approx(lost, rel=0.02)
    assert 0.0 < 1 - spins[2] < 1.02 * lost


@pytest.mark.parametrize("c", [0.5, 1e9])
def test_a_damper_alone_is_backward_euler(c):
    """Two masses that part: their speed is divided by 1 + 2 c h/m each substep; with 1e9 N s/m they move together at once."""
    m, h, count = 0.5, 1 / 240, 6
    net = {"points": [[0, 0, 0], [1, 0, 0]], "springs": [[0, 1]], "mass": m, "stiffness": 0.0, "damping": c}
    sim = simulate(**net, solver="xpbd", substeps=1, fps=240)
    put(sim, velocity=[[-1.0, 0.5, 0], [1.0, 0.5, 0]])
    lengths = []
    for frame in sim.frames(count):
        velocity = frame["s"].velocity.astype(float)
        lengths.append(velocity[1, 0] - velocity[0, 0])
        assert velocity[:, 1] == pytest.approx([0.5, 0.5], rel=1e-6)
    assert lengths == pytest.approx(2.0 / (1 + 2 * c * h / m) ** np.arange(1, count + 1), rel=1e-5, abs=1e-6)


def test_no_stiffness_is_no_constraint():
    """Springs of stiffness 0 leave every point on its own way, to the last bit."""
    net = tangle() | {"stiffness": 0.0, "damping": 0.0}
    ways = []
    for springs in (net["springs"], net["springs"][:1]):
        numbers = {"rest_length": 1.0, "springs": springs}
        sim = simulate(**(net | numbers), solver="xpbd", gravity=(0.1, -G, 0), coupling={"alpha": 0.2})
        sim.run(0.5)
        ways.append(state(sim)[0])
    assert (ways[0] == ways[1]).all() and np.abs(ways[0] - np.array(net["points"])).max() > 0.5


def test_points_in_one_place_stay_finite():
    """Springs whose ends have come together have no direction: they wait until something parts them."""
    net = {"points": [[0, 0, 0], [0.1, 0, 0], [1, 0, 0]], "springs": [[0, 1], [1, 2], [0, 2]], "rest_length": 0.5, "stiffness": 1e12}
    sim = simulate(**net, solver="xpbd", damping=1e6, pins=[2], gravity=(0, -G, 0), iterations=3)
    put(sim, position=[[0, 0, 0], [0, 0, 0], [1, 0, 0]])
    sim.run(3.0)
    assert np.isfinite(np.array(state(sim))).all()


def test_a_rigid_flag_survives_ten_seconds_at_four_substeps():
    """k = 1e6 N/m in a gale: any explicit method would need 3000 substeps; it stays finite, near its size, and moves."""
    stiff = {"stiffness": 1e6, "damping": 1.0}
    flag = {"type": "cloth", "resolution": [31, 21], "edges": [[1.5, 0, 0], [0, -1, 0]], "density": 0.2, "structural": stiff}
    keys = {"shear": stiff, "bend": stiff, "air": 1.0, "pins": ["left"], "gravity": (0, -G, 0), "solver": "xpbd", "substeps": 4}
    wind = [{"type": "uniform", "velocity": [{"expression": "8 + 4*sin(t)"}, 0, {"expression": "3*sin(2*t)"}]}]
    sim = simulate(**flag, **keys, more={"flow": wind})
    speeds = []
    for frame in sim.frames(600):
        speeds.append(np.linalg.norm(frame["s"].velocity, axis=1).mean())
    x, v = state(sim)
    assert np.isfinite(x).all() and np.isfinite(v).all() and np.abs(x).max() < 3.0
    assert 0.1 < np.mean(speeds[300:]) < 20.0


def test_auto_takes_sixteen_substeps():
    chain = {"type": "chain", "count": 3, "start": [0, 0, 0], "end": [1, 0, 0]}
    sim = simulate(generator=chain, stiffness=1e12, solver="xpbd", substeps="auto")
    assert sim.systems["s"].advice.chosen == 16 and sim.systems["s"].advice.sufficient


def test_a_sheet_pulled_apart_tears():
    """Springs that tear are answered one by one; then both halves are at rest, and nothing intact is strained by more than it stands."""
    kind = {"stiffness": 500.0, "damping": 0.5}
    sheet = {"type": "cloth", "resolution": [9, 5], "edges": [[0.8, 0, 0], [0, -0.4, 0]], "structural": kind, "shear": kind}
    motion = [{"pins": ["right"], "keyframes": [[0, [0, 0, 0]], [1, [0.8, 0, 0]]]}]
    sim = simulate(**sheet, tear=0.5, pins=["left", "right"], pin_motion=motion, solver="xpbd", substeps=8, coupling={"alpha": 0.02})
    sim.run(3.0)
    x, v = state(sim)
    net, torn = sim.systems["s"].net, sim.systems["s"].torn()
    length, rest = (np.linalg.norm(np.diff(points[net.springs], axis=1)[:, 0], axis=1) for points in (x, net.points))
    assert 5 <= torn.sum() < 100 and np.abs(v).max() < 1e-3
    assert (length[~torn] < 1.5 * rest[~torn] + 1e-6).all() and (length[torn] > 3.0 * rest[torn]).any()
