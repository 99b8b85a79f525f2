"""Laws of cloth: free fall, the wind, conserved momentum, energy; theory says what must come out."""

import math

import numpy as np
import pytest

from tests.simulation.networks import simulate, state

K_S, K_D, K_B = 40.0, 24.0, 3.0
SPACING = 0.1


def sheet(nx: int, ny: int, **keys) -> dict:
    """Keys of an upright sheet of square cells."""
    kinds = {kind: {"stiffness": k, "damping": 0.002 * k} for kind, k in (("structural", K_S), ("shear", K_D), ("bend", K_B))}
    edges = [[SPACING * (nx - 1), 0, 0], [0, -SPACING * (ny - 1), 0]]
    return {"type": "cloth", "resolution": [nx, ny], "edges": edges, "density": 0.4, **kinds, **keys}


def put(sim, position=None, velocity=None) -> None:
    """Set the state of the present frame, (n, 3) each."""
    for key, value in (("position", position), ("velocity", velocity)):
        if value is not None:
            field = sim.systems["s"].population.field(key)
            array = field.numpy()
            array[:, : len(value)] = np.asarray(value, np.float32).T
            field.assign(array)


def test_a_damped_cloth_falls_freely():
    """Verlet is exact in free fall: the center of a rumpled, damped cloth is at ½ g t² to 1e-4 of it."""
    sim = simulate(**sheet(12, 9, solver="verlet"), gravity=(0, -9.81, 0), substeps=16)
    mass = sim.frame()["s"].mass.astype(float)[:, None]
    home, _ = state(sim)
    put(sim, home + 0.02 * np.random.default_rng(2).normal(size=home.shape))
    start = (mass * state(sim)[0]).sum(axis=0) / mass.sum()
    sim.run(1.0)
    fall = start - (mass * state(sim)[0]).sum(axis=0) / mass.sum()
    assert fall == pytest.approx([0, 9.81 / 2, 0], abs=5e-4)


@pytest.mark.parametrize("solver", ["semi_implicit_euler", "verlet"])
def test_the_wind_takes_a_free_sheet_along_its_normal_alone(solver):
    """v_n = u_n (1 − e^(−k t)), k = air/density, exact by both but for 480 roundings; along the sheet nothing but rounding."""
    wind, k = [3.0, 1.0, 2.0], 1.5 / 0.4
    sim = simulate(**sheet(6, 5, air=1.5, solver=solver), substeps=16, more={"flow": [{"type": "uniform", "velocity": wind}]})
    put(sim, velocity=np.tile([0.7, -0.4, 0.0], (30, 1)))
    sim.run(0.5)
    _, v = state(sim)
    assert v[:, 2] == pytest.approx(2.0 * (1 - math.exp(-k * 0.5)), rel=480 * 2**-23)
    assert v[:, :2] == pytest.approx(np.tile([0.7, -0.4], (30, 1)), abs=5e-5)


def test_momentum_of_a_free_sheet_stays():
    """Ten thousand substeps: 1e-4 of Σ m|v|, linear and angular; forces come in pairs that are equal to the last bit."""
    sim = simulate(**sheet(9, 7, solver="verlet"), fps=100, substeps=10)
    mass = sim.frame()["s"].mass.astype(float)[:, None]
    home, _ = state(sim)
    put(sim, home + 0.02 * np.random.default_rng(3).normal(size=home.shape), np.random.default_rng(4).normal(size=home.shape))
    before = [(mass * state(sim)[1]).sum(axis=0), np.cross(state(sim)[0], mass * state(sim)[1]).sum(axis=0)]
    scale = np.abs(mass * state(sim)[1]).sum()
    sim.run(10.0)
    x, v = state(sim)
    assert (mass * v).sum(axis=0) == pytest.approx(before[0], abs=1e-4 * scale)
    assert np.cross(x, mass * v).sum(axis=0) == pytest.approx(before[1], abs=1e-4 * scale * np.abs(x).max())


def test_energy_only_falls_in_still_air():
    sim = simulate(**sheet(9, 7, air=0.5, drag=1e-4, pins=["top"]), substeps=64)
    home, _ = state(sim)
    put(sim, home + np.array([0, 0, 0.1]) * (home[:, 1:2] / -0.6))
    energy = []
    for _ in range(60):
        numbers = sim.statistics()["s"]
        energy.append(numbers["kinetic_energy"] + numbers["elastic_energy"])
        sim.step_frame()
    assert (np.diff(energy) < 1e-6 * energy[0]).all() and energy[-1] < 0.9 * energy[0]


def test_a_flag_hangs_in_still_air_and_flutters_in_wind():
    """Pinned along its left: without wind it comes to rest; in a steady wind it streams out and never does."""
    flag = sheet(21, 13, air=1.0, drag=4e-3, pins=["left"])
    still = simulate(**flag, gravity=(0, -9.81, 0), substeps=32)
    blown = simulate(**flag, gravity=(0, -9.81, 0), substeps=32, more={"flow": [{"type": "uniform", "velocity": [9, 0, 0.3]}]})
    for sim in (still, blown):
        sim.run(15.0)
    speeds = [np.linalg.norm(state(sim)[1], axis=1).mean() for sim in (still, blown)]
    reach = [state(sim)[0][:, 0].mean() for sim in (still, blown)]
    assert speeds[0] < 1e-3 and speeds[1] > 0.5 and reach[1] > 2.5 * reach[0]
