"""Laws of the strain limit: no spring is beyond it after its pass, momentum stays, no energy comes from it, what hangs comes to rest."""

import math

import numpy as np
import pytest

from tests.simulation.networks import simulate, state
from warpsim.systems.parts.strain import StrainLimit

HUNG = {"type": "cloth", "resolution": [21, 17], "corner": [-0.5, 1, 0], "edges": [[1, 0, 0], [0, -0.8, 0]], "density": 0.2}
HUNG |= {"structural": {"stiffness": 4.0, "damping": 0.02}, "shear": {"stiffness": 2.0, "damping": 0.01}, "pins": [[0, 0], [20, 0]]}
HUNG |= {"gravity": (0, -9.81, 0), "substeps": 16, "strain_limit": 0.05, "drag": 2e-4}


def strains(sim) -> np.ndarray:
    """Strain of every limited spring at the present frame, float64."""
    system = sim.systems["s"]
    part = next(part for part in system.parts if isinstance(part, StrainLimit))
    order = part._limit.order.numpy()
    ends = state(sim)[0][system.net.springs[order]]
    return np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1) / system.table.rest.numpy()[order].astype(float) - 1.0


@pytest.mark.parametrize("solver", ["semi_implicit_euler", "verlet", "drift_kick", "xpbd", "implicit_euler"])
def test_no_spring_is_beyond_the_limit_after_any_frame(solver):
    """Springs so weak that they stretch by half; one rounding of a place of 1 m is 1e-6 of 0.05 m."""
    sim = simulate(**HUNG, solver=solver)
    most = max(strains(sim).max() for _ in sim.frames(90))
    assert 0.04 < most <= 0.05 * (1 + 1e-6) + 5e-6 and sim.statistics()["s"]["overlong"] == 0
    free = simulate(**{**HUNG, "strain_limit": None}, solver=solver)
    free.run(1.5)
    assert np.ptp(state(free)[0][:, 1]) > 1.5 * np.ptp(state(sim)[0][:, 1])


def test_what_hangs_comes_to_rest():
    """2 cm/s at most, 2 % of what gravity adds in 0.1 s, after 6 s of drag: sweeps that end early do not make it shiver."""
    sim = simulate(**HUNG | {"drag": 5e-4})
    sim.run(6.0)
    assert np.abs(state(sim)[1]).max() < 0.02 and strains(sim).max() > 0.04


def test_a_stone_hangs_from_its_rope_at_nine_tenths_of_the_limit():
    """The rope's spring carries 0.1 N of 1 N, the limit the rest: r (1 + 0.9 ε), to a rounding and to what falls in a substep, g h²."""
    sim = simulate(points=[[0, 0, 0], [0, -1, 0]], springs=[[0, 1]], stiffness=1.0, damping=0.5, mass=0.1, pins=[0], strain_limit=0.1,
                   gravity=(0, -9.81, 0), substeps=16)  # fmt: skip
    sim.run(4.0)
    assert state(sim)[0][1, 1] == pytest.approx(-1.09, abs=2 * 9.81 / 960**2)


def test_a_stone_on_a_short_rope_swings_as_a_pendulum():
    """A rope that does not give way: from 0.1 rad the lowest point is passed after a quarter of 2π √(l/g) (1 + θ²/16), within 1 %."""
    angle, length = 0.1, 1.0009
    start = [length * math.sin(angle), -length * math.cos(angle), 0.0]
    sim = simulate(points=[[0, 0, 0], start], springs=[[0, 1]], stiffness=0.0, mass=0.1, pins=[0], rest_length=1.0, strain_limit=1e-3,
                   gravity=(0, -9.81, 0), fps=240, substeps=16)  # fmt: skip
    x = [frame["s"].position[1, 0] for frame in sim.frames(240)]
    below = int(np.argmax(np.array(x) < 0.0))
    quarter = (below + x[below - 1] / (x[below - 1] - x[below])) / 240
    assert quarter == pytest.approx(0.5 * math.pi * math.sqrt(length / 9.81) * (1 + angle**2 / 16), rel=0.01)


def thrown(**keys):
    """A free block of jelly, turning and pulled apart, without anything that damps."""
    block = {"type": "block", "resolution": [4, 4, 4], "size": [0.6, 0.6, 0.6]}
    sim = simulate(generator=block, stiffness=2.0, mass=0.02, strain_limit=0.1, substeps=32, **keys)
    x, _ = state(sim)
    velocity = np.cross([1.0, 2.0, 0.5], x) + 1.5 * x + np.random.default_rng(5).normal(scale=0.3, size=x.shape)
    field = sim.systems["s"].population.field("velocity")
    array = field.numpy()
    array[:, :64] = velocity.T
    field.assign(array)
    return sim


def test_momentum_stays_and_angular_momentum_nearly():
    """Impulses along springs, equal and opposite: 1e-6 of Σ m|v|; about the center a pull turns as much as a substep is long: 2 %."""
    sim = thrown(solver="verlet")

    def momenta():
        x, v = state(sim)
        x = x - x.mean(axis=0)
        return v.sum(axis=0), np.cross(x, v).sum(axis=0), np.abs(v).sum()

    before = momenta()
    held = max(strains(sim).max() for _ in sim.frames(60))
    after = momenta()
    assert held > 0.09
    assert after[0] == pytest.approx(before[0], abs=2e-6 * before[2])
    assert np.linalg.norm(after[1] - before[1]) < 0.02 * np.linalg.norm(before[1])


def test_no_energy_comes_from_it():
    """Undamped and free: kinetic and elastic energy never rise by more than Verlet's own 1e-3 between frames, and fall where it acts."""
    sim = thrown(solver="verlet")
    energy = []
    for _ in range(90):
        numbers = sim.statistics()["s"]
        energy.append(numbers["kinetic_energy"] + numbers["elastic_energy"])
        sim.step_frame()
    assert (np.diff(energy) < 2e-3 * energy[0]).all() and energy[-1] < 0.95 * energy[0]


def test_pins_that_go_too_far_are_reported_and_leave_all_finite():
    """A chain of 1 m whose ends are drawn 2 m apart: it stays stretched, says so, and is whole again when they come back."""
    chain = {"type": "chain", "count": 11, "start": [0, 0, 0], "end": [1, 0, 0]}
    motion = [{"pins": ["end"], "keyframes": [[0, [0, 0, 0]], [0.5, [1, 0, 0]], [1, [1, 0, 0]], [1.5, [0, 0, 0]]]}]
    sim = simulate(generator=chain, stiffness=5.0, damping=0.05, mass=0.01, pins=["start", "end"], pin_motion=motion, strain_limit=0.1,
                   gravity=(0, -9.81, 0), substeps=16)  # fmt: skip
    sim.run(1.0)
    assert sim.statistics()["s"]["overlong"] >= 5 and np.isfinite(state(sim)[0]).all()
    sim.run(1.5)
    assert sim.statistics()["s"]["overlong"] == 0 and strains(sim).max() < 0.1 * (1 + 1e-4)


def test_state_and_sliders():
    """What is remembered from substep to substep is state: back and forth gives the same; a lower limit acts at once."""
    sim = simulate(**HUNG)
    sim.run(0.5)
    after = sim.state_hash()
    sim.seek(7)
    sim.seek(30)
    assert sim.state_hash() == after
    sim.change("systems.s.strain_limit", 0.02)
    sim.run(0.2)
    assert strains(sim).max() < 0.02 * (1 + 1e-5) + 5e-6
