"""Laws of implicit Euler: how it damps, what it keeps, where it rests, and that neither stiffness nor a lack of iterations upsets it."""

import numpy as np
import pytest

from tests.physics.test_cloth_laws import put
from tests.simulation.networks import network, simulate, state, tangle
from warpsim import Simulation

G = 9.81


def implicit(**keys):
    """A simulation of one network by implicit Euler."""
    return simulate(**keys, solver="implicit_euler")


@pytest.mark.parametrize("rate", [0.1, 1.0, 30.0])
def test_an_oscillator_shrinks_and_turns_as_theory_says(rate):
    """x + v/(iω) is divided by 1 − iωh each substep: amplitude by √(1 + ω²h²), phase by atan ωh; 20 substeps of 3 roundings each."""
    h, stretch, substeps = 1 / 240, 0.01, 20
    omega = rate / h
    wall = {"points": [[0, 0, 0], [1 + stretch, 0, 0]], "springs": [[0, 1]], "rest_length": 1.0, "pins": [0], "mass": 2.0}
    sim = implicit(**wall, stiffness=2.0 * omega**2, substeps=1, fps=240)
    for n in range(1, substeps + 1):
        sim.step_frame()
        x, v = (array[1, 0] for array in state(sim))
        expected = stretch / (1 - 1j * rate) ** n
        grain = 2.0**-23 * n * max(1.0, rate)  # of a place near 1 m, which the spring turns into a velocity of ω times as much
        assert x - 1 == pytest.approx(expected.real, abs=grain) and v / omega == pytest.approx(-expected.imag, abs=grain)


def test_damping_acts_as_it_will_at_the_substeps_end():
    """v is divided by 1 + 2 h c/m each substep when two masses part without stiffness, however large the damping: to 5 roundings of 1."""
    for damping in (1.0, 1e4):
        sim = implicit(points=[[0, 0, 0], [1, 0, 0]], springs=[[0, 1]], mass=0.5, stiffness=0.0, damping=damping, substeps=1, fps=100)
        put(sim, velocity=[[-1.0, 0.5, 0], [1.0, 0.5, 0]])
        sim.step_frame()
        expected = np.array([[-1, 0, 0], [1, 0, 0]]) / (1 + 2 * 0.01 * damping / 0.5) + [0, 0.5, 0]
        assert state(sim)[1] == pytest.approx(expected, abs=5 * 2**-24)


@pytest.mark.parametrize("stiffness", [1.0, 1e3])
@pytest.mark.parametrize("iterations", [1, 100])
def test_momentum_stays_over_ten_thousand_substeps(stiffness, iterations):
    """Of a free network, to 1e-4 of Σ m|v|, however early the iterations end: what they leave undone is none of the whole's."""
    net = tangle() | {"damping": 0.0, "stiffness": [stiffness * k for k in tangle()["stiffness"]]}
    sim = implicit(**net, substeps=10, fps=100, iterations=iterations)
    put(sim, velocity=np.random.default_rng(6).normal(size=(70, 3)) + [0.5, 0.2, 0.0])
    mass = np.array(net["mass"])[:, None]
    before, scale = (mass * state(sim)[1]).sum(axis=0), np.abs(mass * state(sim)[1]).sum()
    sim.run(10.0)
    assert (mass * state(sim)[1]).sum(axis=0) == pytest.approx(before, abs=1e-4 * scale)


@pytest.mark.parametrize("stiffness", [10.0, 1e6])
def test_a_damped_network_falls_as_if_it_were_loose(stiffness):
    """Springs at rest that fall together leave each other alone: every point falls by g h² n (n + 1)/2, to 1e-5 of 5 m."""
    block = {"type": "block", "resolution": [5, 4, 3], "size": [0.4, 0.3, 0.2]}
    sim = implicit(generator=block, stiffness=stiffness, damping=stiffness / 100, mass=0.01, gravity=(0, -G, 0))
    home, _ = state(sim)
    sim.run(1.0)
    n = 240
    assert state(sim)[0] - home == pytest.approx(np.tile([0, -0.5 * G * n * (n + 1) / 240**2, 0], (60, 1)), abs=5e-5)


def test_a_hanging_chain_stretches_by_the_weight_below():
    """Σ_j (N − j) m g/k at point i, as with any solver: the end of a substep at rest is where it began."""
    count, k, m, spacing = 11, 500.0, 0.02, 0.1
    chain = {"type": "chain", "count": count, "start": [0, 2, 0], "end": [0, 2 - spacing * (count - 1), 0]}
    sim = implicit(generator=chain, mass=m, stiffness=k, pins=["start"], gravity=(0, -G, 0))
    sim.run(20.0)
    below = np.cumsum([0.0] + [(count - i) * m * G / k + spacing for i in range(1, count)])
    assert state(sim)[0][:, 1] == pytest.approx(2 - below, abs=2e-6)  # ten roundings of a place
    assert np.abs(state(sim)[1]).max() < 1e-4


@pytest.mark.parametrize("alpha", [0.0, 5.0, 50.0])
def test_drag_does_not_shift_where_a_mass_hangs(alpha):
    """mg/k = 0.04905 m in any medium: the spring's kick is damped as gravity's is. Steps below half a rounding of 1 m, 6e-8, are lost:
    the way that is left then is 6e-8 α/(k h) = 7e-6 m at most."""
    net = {"points": [[0, 0, 0], [0, -1, 0]], "springs": [[0, 1]], "mass": 0.5, "stiffness": 100.0, "damping": 5.0, "pins": [0]}
    sim = simulate(**net, solver="implicit_euler", gravity=(0, -9.81, 0), substeps=4, coupling={"alpha": alpha})
    sim.run(15.0)
    assert -1.0 - sim.frame()["s"].position[1, 1] == pytest.approx(0.5 * 9.81 / 100, abs=1e-5)


@pytest.mark.parametrize("iterations", [1, 3, 300])
def test_energy_only_falls_however_early_iterations_end(iterations):
    """A tangle stretched at random, of ωh up to 6, left to itself: each substep has no more energy than the one before, to 1e-5."""
    net = tangle(40, 80) | {"damping": 0.0, "rest_length": 0.3}
    net["stiffness"] = [300 * k for k in net["stiffness"]]
    sim = implicit(**net, substeps=1, fps=60, iterations=iterations)
    energy = []
    for _ in range(120):
        numbers = sim.statistics()["s"]
        energy.append(numbers["kinetic_energy"] + numbers["elastic_energy"])
        sim.step_frame()
    assert (np.diff(energy) < 1e-5 * energy[0]).all() and energy[-1] < 0.2 * energy[0]


def test_a_flag_of_a_million_newtons_per_meter_lives_for_ten_seconds():
    """Four substeps of 4 ms, where explicit ones would be 2 µs long: it stays in one piece, within 1 % of its lengths, and flutters."""
    kinds = {kind: {"stiffness": 1e6} for kind in ("structural", "shear")} | {"bend": {"stiffness": 1e3}}
    flag = {"type": "cloth", "resolution": [25, 17], "edges": [[1.2, 0, 0], [0, -0.8, 0]], "density": 0.2, "pins": ["left"], "air": 1.0}
    gusts = {"flow": [{"type": "uniform", "velocity": [6, 0, {"sine": {"amplitude": 2, "period": 0.7}}]}]}
    sim = implicit(**flag, **kinds, gravity=(0, -G, 0), more=gusts, substeps=4)
    net, speeds = sim.systems["s"].net, []
    for _ in range(20):
        sim.run(0.5)
        x, v = state(sim)
        length = np.linalg.norm(np.diff(x[net.springs], axis=1)[:, 0], axis=1)
        rest = np.linalg.norm(np.diff(net.points[net.springs], axis=1)[:, 0], axis=1)
        assert np.abs(length / rest - 1)[: 24 * 17 + 25 * 16].max() < 0.01
        speeds.append(np.linalg.norm(v, axis=1).mean())
    assert np.mean(speeds[4:]) > 0.2


@pytest.mark.parametrize("mass", [1e-12, 1.0, 1e6])
@pytest.mark.parametrize("damping", [0.0, 1e12])
@pytest.mark.parametrize("stiffness", [1e6, 1e12])
def test_no_stiffness_and_no_lightness_upsets_a_swinging_chain(stiffness, damping, mass):
    """It keeps its length to 2 % and what the softest give way to the heaviest, 190 m g/k and three times that; energy does not grow."""
    chain = {"type": "chain", "count": 20, "start": [0, 0, 0], "end": [1.9, 0, 0]}
    sim = implicit(generator=chain, mass=mass, stiffness=stiffness, damping=damping, pins=["start"], gravity=(0, -G, 0))
    sim.run(0.75)
    x, v = state(sim)
    heavy = mass * G * 190 / stiffness
    assert np.linalg.norm(np.diff(x, axis=0), axis=1).sum() < 1.9 * 1.02 + 3 * heavy
    assert (0.5 * (v**2).sum(axis=1) + G * x[:, 1]).sum() < 1e-2 * G * 1.9 * 20
    assert x[:, 1].min() < -1.0  # it swings: it does not stick where it was


def test_caps_and_residuals_are_told():
    """A chain of 19 free points ends within the digits of its 57 unknowns; with two iterations every substep counts as cut short."""
    chain = {"type": "chain", "count": 21, "start": [0, 0, 0], "end": [2, 0, 0]}
    keys = {"generator": chain, "mass": 0.01, "stiffness": 1e5, "pins": ["start", "end"], "gravity": (0, -G, 0)}
    numbers = []
    for iterations in (None, 2):
        sim = implicit(**keys, iterations=iterations)
        sim.run(0.5)
        numbers.append(sim.statistics()["s"])
    whole, cut = numbers
    assert whole["cg_unconverged"] == 0 and 0 < whole["cg_residual"] <= 1e-4 and 0 < whole["cg_iterations"] <= 3 * 19
    assert cut["cg_unconverged"] == 4 * 30 and cut["cg_residual"] > 1e-4 and cut["cg_iterations"] == 2.0


def stiff_tangle(**keys) -> dict:
    """Keys of a tangle that takes some iterations."""
    net = tangle()
    return net | {"stiffness": [1e3 * k for k in net["stiffness"]], "pins": [0], "gravity": (0, -G, 0), **keys}


def test_what_it_remembers_is_taken_back():
    """Counts are part of the state: after going back and on again all is as it was, and as on a run without."""
    scene = network(**stiff_tangle(iterations=3), solver="implicit_euler")
    sim = Simulation(scene, device="cpu")
    sim.run(1.5)
    before = sim.state_hash(), sim.statistics()["s"]
    sim.seek(10)
    sim.seek(90)
    assert (sim.state_hash(), sim.statistics()["s"]) == before and before[1]["cg_unconverged"] > 0


def test_its_tolerance_may_change_while_it_runs():
    sim = implicit(**stiff_tangle(tolerance=0.1))
    sim.run(0.5)
    coarse = sim.statistics()["s"]["cg_iterations"]
    sim.change("systems.s.tolerance", 1e-6)
    sim.run(0.1)
    assert sim.statistics()["s"]["cg_iterations"] > coarse + 3 and sim.statistics()["s"]["cg_residual"] <= 1e-6


def test_it_is_of_first_order():
    """A slow tangle at 4, 8 and 16 substeps: twice as many leave half of the error against Verlet at 256, which has next to none."""
    keys = tangle(30, 40) | {"gravity": (0, -G, 0), "pins": [0]}
    exact, errors = simulate(**keys, solver="verlet", substeps=256), []
    exact.run(0.25)
    for substeps in (4, 8, 16):
        sim = implicit(**keys, substeps=substeps, tolerance=1e-6)
        sim.run(0.25)
        errors.append(np.abs(state(sim)[0] - state(exact)[0]).max())
    assert errors[0] / errors[1] == pytest.approx(2.0, rel=0.1) and errors[1] / errors[2] == pytest.approx(2.0, rel=0.1)


def test_its_springs_may_change_while_it_runs():
    """Made ten times as stiff, a weight that hangs comes to hang a tenth as deep."""
    hung = {"points": [[0, 0, 0], [0, -1, 0]], "springs": [[0, 1]], "mass": 0.1, "damping": 1.0, "pins": [0], "gravity": (0, -G, 0)}
    sim = implicit(**hung, stiffness=10.0)
    for stiffness in (10.0, 100.0):
        sim.change("systems.s.stiffness", stiffness)
        sim.run(10.0)
        assert state(sim)[0][1, 1] == pytest.approx(-1 - 0.1 * G / stiffness, abs=2e-6)
