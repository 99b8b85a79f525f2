"""Laws of networks: frequencies, modes, sag, conserved quantities, free fall, energy. Theory says what must come out.

float32: a position near 1 m is rounded to 6e-8 m each substep; n substeps wander by about 6e-8 √n, and at worst drift by 6e-8 n.
"""

import math

import numpy as np
import pytest

from tests.reference.springs import chain_modes
from tests.simulation.networks import simulate, state, tangle

SYMPLECTIC = ("semi_implicit_euler", "drift_kick", "verlet")
STAGED = ("rk4", "heun", "adams_bashforth_3", "adams_bashforth_4", "abm_pece_2", "abm_pece_4")


def crossings(values: np.ndarray, times: np.ndarray) -> np.ndarray:
    """Return when a series rises through its mean, between samples by a straight line."""
    z = values - 0.5 * (values.max() + values.min())
    k = np.flatnonzero((z[:-1] < 0) & (z[1:] >= 0))
    return times[k] - z[k] * (times[k + 1] - times[k]) / (z[k + 1] - z[k])


def pair(solver: str, substeps: int = 16, **keys):
    net = {"points": [[0, 0, 0], [1.05, 0, 0]], "springs": [[0, 1]], "rest_length": 1.0, "mass": 0.5, "stiffness": 100.0}
    return simulate(**net, solver=solver, substeps=substeps, fps=240, **keys)


@pytest.mark.parametrize("solver", SYMPLECTIC + ("rk4", "heun", "adams_bashforth_4"))
def test_a_pair_swings_at_the_root_of_2k_over_m(solver):
    """ω = 20/s at ωh = 1/192: the method's own error is (ωh)²/24 = 1e-6, that of the crossings 1e-4 of a period over 30 of them."""
    sim = pair(solver)
    lengths = [np.ptp(frame["s"].position[:, 0].astype(float)) for frame in sim.frames(2400)]
    rises = crossings(np.array(lengths), np.arange(1, 2401) / 240)
    omega = 2 * math.pi * (len(rises) - 1) / (rises[-1] - rises[0])
    assert omega == pytest.approx(math.sqrt(2 * 100 / 0.5), rel=1e-4)


def test_verlets_frequency_at_a_long_step_is_the_discrete_one():
    """ω̃ = (2/h) asin(ωh/2): at ωh = 1 it is 4.7 % more than ω, and known to 1e-3 by the crossings of ten samples a swing."""
    sim = simulate(
        **{"points": [[0, 0, 0], [1.05, 0, 0]], "springs": [[0, 1]], "rest_length": 1.0, "mass": 0.5, "stiffness": 100.0},
        solver="verlet", substeps=1, fps=20,
    )  # fmt: skip
    lengths = [np.ptp(frame["s"].position[:, 0].astype(float)) for frame in sim.frames(2000)]
    rises = crossings(np.array(lengths), np.arange(1, 2001) / 20)
    omega = 2 * math.pi * (len(rises) - 1) / (rises[-1] - rises[0])
    assert omega == pytest.approx(40 * math.asin(0.5), rel=1e-3)


@pytest.mark.parametrize("count", [10, 20])
def test_every_mode_of_a_chain_between_walls_has_its_frequency(count):
    """2 √(k/m) sin(nπ/2(N+1)): the chain starts in one mode, and the substep is so short that (ωh)²/24 < 1e-4. Asked for: 0.5 %."""
    k, m, spacing = 200.0, 0.1, 0.1
    omegas = chain_modes(count, k, m)
    for n in sorted({1, 2, count // 2, count}):
        shape = np.sin(n * np.pi * np.arange(count + 2) / (count + 1))
        x = spacing * np.arange(count + 2) + 0.02 * spacing * shape
        points = [[float(place), 0.0, 0.0] for place in x]
        springs = [[i, i + 1] for i in range(count + 1)]
        fps = omegas[n - 1] / (2 * math.pi) * 24  # 24 samples a swing
        substeps = max(4, math.ceil(omegas[-1] / fps / 0.1))
        keys = {"points": points, "springs": springs, "rest_length": spacing, "mass": m, "stiffness": k, "pins": [0, count + 1]}
        sim = simulate(**keys, solver="verlet", fps=fps, substeps=substeps)
        i = int(np.argmax(np.abs(shape)))
        series = np.array([frame["s"].position[i, 0] for frame in sim.frames(240)], float)
        rises = crossings(series, np.arange(1, 241) / fps)
        omega = 2 * math.pi * (len(rises) - 1) / (rises[-1] - rises[0])
        assert omega == pytest.approx(omegas[n - 1], rel=2e-3), n


def test_a_hanging_chain_stretches_by_the_weight_below():
    """Σ_j (N − j) m g/k at point i, at rest; it stops where a kick moves it by less than half of a digit of 2 m."""
    count, k, m, g, spacing = 11, 50.0, 0.02, 9.81, 0.1
    chain = {"type": "chain", "count": count, "start": [0, 2, 0], "end": [0, 2 - spacing * (count - 1), 0]}
    sim = simulate(generator=chain, mass=m, stiffness=k, damping=0.6, pins=["start"], gravity=(0, -g, 0), substeps=8)
    sim.run(20.0)
    below = np.cumsum([0.0] + [(count - i) * m * g / k + spacing for i in range(1, count)])
    assert state(sim)[0][:, 1] == pytest.approx(2 - below, abs=5e-5)


@pytest.mark.parametrize(("length", "sag"), [(1.25, 0.331796886), (1.5, 0.502633262), (2.0, 0.796388356)])
def test_a_stiff_chain_hangs_as_a_catenary(length, sag):
    """Sag of an inextensible chain over span 1 within 1 %: 0.8 N stretch its 60 links by 0.2 %, which is 0.4 % of sag."""
    count = 61
    half = [0.5 * length * i / (count - 1) for i in range(count)]
    depth = math.sqrt((0.5 * length) ** 2 - 0.25)  # laid out as a V, at rest length
    points = [[2 * s / length, -depth * (1 - abs(4 * s / length - 1)), 0.0] for s in half]
    net = {"points": points, "springs": [[i, i + 1] for i in range(count - 1)], "rest_length": length / (count - 1), "pins": [0, count - 1]}
    sim = simulate(**net, mass=0.002, stiffness=2e4, damping=1.0, coupling={"alpha": 0.02}, gravity=(0, -9.81, 0), substeps=128)
    sim.run(6.0)
    assert -state(sim)[0][:, 1].min() == pytest.approx(sag, rel=0.01)


def test_the_sag_nears_that_of_an_inextensible_chain_as_springs_stiffen():
    """Length 1.5 over span 1: what stretching adds to the sag falls as 1/k; of 31 links it is (1 ± 0.1)/4 at four times the stiffness."""
    count, length = 31, 1.5
    depth = math.sqrt((0.5 * length) ** 2 - 0.25)
    points = [[i / (count - 1), -depth * (1 - abs(2 * i / (count - 1) - 1)), 0.0] for i in range(count)]
    net = {"points": points, "springs": [[i, i + 1] for i in range(count - 1)], "rest_length": length / (count - 1), "pins": [0, count - 1]}
    sags = []
    for stiffness in (100.0, 400.0, 1600.0, 25600.0):
        sim = simulate(
            **net, mass=0.002, stiffness=stiffness, damping=0.1, coupling={"alpha": 0.02}, gravity=(0, -9.81, 0), substeps="auto"
        )
        sim.run(6.0)
        sags.append(-state(sim)[0][:, 1].min())
    beyond = np.array(sags[:-1]) - sags[-1]
    assert sags[-1] == pytest.approx(0.502633262, rel=0.01)
    assert beyond[1] / beyond[0] == pytest.approx(0.25, rel=0.1) and beyond[2] / beyond[1] == pytest.approx(0.25, rel=0.1)


@pytest.mark.parametrize("solver", ("verlet", "adams_bashforth_2") + STAGED)
def test_a_damped_network_falls_freely(solver):
    """Damping knows only how fast a spring grows longer: the center falls by ½ g t², 1e-4 of 4.9 m after 240 roundings of 3e-7 m."""
    sim = simulate(**tangle(), gravity=(0, -9.81, 0), solver=solver, substeps=4 if solver == "verlet" else 16)
    mass, (before, _) = np.array(tangle()["mass"]), state(sim)
    sim.run(1.0)
    fall = ((before - state(sim)[0]) * mass[:, None]).sum(axis=0) / mass.sum()
    assert fall == pytest.approx([0, 0.5 * 9.81, 0], abs=1e-4)


def test_damping_leaves_rotation_alone():
    """A wheel whose springs hold it in, spinning rigidly: 200 substeps of the strongest damping take nothing from its spin."""
    ring = {"type": "ring", "count": 8, "radius": 1.0}
    spun = []
    for damping in (0.0, 0.5):
        sim = simulate(generator=ring, mass=1.0, stiffness=400.0, damping=damping, solver="verlet", substeps=16)
        x, _ = state(sim)
        velocity = np.zeros((3, 64), np.float32)
        velocity[:2, :8] = np.stack([-x[:, 1], x[:, 0]])
        sim.systems["s"].population.field("velocity").assign(velocity)
        sim.run(0.2)
        x, v = state(sim)
        spun.append((x[:, 0] * v[:, 1] - x[:, 1] * v[:, 0]).sum())
    assert spun == pytest.approx([8.0, 8.0], rel=1e-5)


@pytest.mark.parametrize("solver", SYMPLECTIC + STAGED)
def test_momentum_stays_over_ten_thousand_steps(solver):
    """A free, undamped network: forces come in pairs equal to the last bit; what is left are roundings. Asked for: 1e-4 of Σ m|v|."""
    net = tangle() | {"damping": 0.0}
    sim = simulate(**net, solver=solver, substeps=10, fps=100)
    mass = np.array(net["mass"])[:, None]
    sim.run(1.0)
    (x, v), moved = state(sim), 0.0
    angular = np.cross(x, mass * v).sum(axis=0)
    momentum = (mass * v).sum(axis=0)
    sim.run(10.0)
    x, v = state(sim)
    moved = np.abs(mass * v).sum()
    assert np.abs((mass * v).sum(axis=0) - momentum).max() < 1e-4 * moved
    assert np.abs(np.cross(x, mass * v).sum(axis=0) - angular).max() < 1e-4 * np.abs(x).max() * moved


def test_energy_is_kept_without_damping_and_falls_with_it():
    """Verlet's energy swings by (ωh)²/8 of itself, here 1e-4; with damping each frame has less than the one before."""
    totals = []
    for damping in (0.0, 0.3):
        sim = simulate(**(tangle(30, 40) | {"damping": damping}), solver="verlet", substeps=64)
        energy = []
        for _ in range(60):
            numbers = sim.statistics()["s"]
            energy.append(numbers["kinetic_energy"] + numbers["elastic_energy"])
            sim.step_frame()
        totals.append(np.array(energy))
    assert np.ptp(totals[0]) < 2e-3 * totals[0][0]
    assert (np.diff(totals[1]) < 1e-6 * totals[1][0]).all() and totals[1][-1] < 0.6 * totals[1][0]


def test_a_pin_goes_where_its_motion_says():
    """Keyframes, a sine and nothing: at every frame to one rounding; its velocity is that of the last substep."""
    points = [[0, 0, 0], [1, 0, 0], [2, 0, 0], [3, 0, 0]]
    motions = [
        {"pins": [0], "keyframes": [[0, [0, 0, 0]], [0.5, [0, 1, 0]]]},
        {"pins": [3], "displacement": [0, 0, {"sine": {"amplitude": 0.5, "period": 1}}]},
    ]
    keys = {"springs": [[0, 1], [1, 2], [2, 3]], "stiffness": 10.0, "damping": 0.1, "pins": [0, 1, 3], "pin_motion": motions}
    for frame in simulate(points=points, **keys).frames(60):
        s, t = frame["s"], frame.time
        assert s.position[0] == pytest.approx([0, min(2 * t, 1.0), 0], abs=2e-7)
        assert s.position[1] == pytest.approx([1, 0, 0]) and s.velocity[1] == pytest.approx([0, 0, 0])
        assert s.position[3] == pytest.approx([3, 0, 0.5 * math.sin(2 * math.pi * t)], abs=2e-6)
        assert s.velocity[0] == pytest.approx([0, 2.0 if t <= 0.5 else 0.0, 0], abs=1e-4)
