"""Staged solvers: whole frames of nets and sheets against the twins; native loops, plain kernels and any parts to the bit; contacts."""

import math

import numpy as np
import pytest

from tests.reference import cloth as sheets
from tests.reference import springs, staged
from tests.simulation.networks import network, simulate, state, tangle
from warpsim import Simulation
from warpsim.networks import network_of
from warpsim.systems.solvers.staged import STAGED

GRAVITY, ALPHA, SUBSTEPS = np.array([0.3, -9.81, 0.0]), 0.6, 3
WIND = {"flow": [{"type": "uniform", "velocity": [1.0, 0, {"sine": {"amplitude": 3.0, "period": 0.2}}]}]}
SWING = [{"pins": [3], "displacement": [0, {"sine": {"amplitude": 0.2, "period": 0.5}}, 0]}]


def wind(t: float) -> np.ndarray:
    return np.array([1.0, 0.0, 3.0 * math.sin(2 * math.pi * t / 0.2)])


class TwinNet:
    """The same net by the twin: pins are put where they are at each stage's moment, and forces asked for there."""

    def __init__(self, spec, forces, mass, k, rate, h):
        self.spec, self.forces, self.mass, self.k, self.rate, self.h = spec, forces, mass, k, rate, h
        self.home, self.past = network_of(spec, "systems.s").points, []
        self.held = spec.pinned(spec.pins)

    def hold(self, x, v, t: float) -> None:
        """Pins at time t: number 3 swings, the others stay."""
        for i in self.held:
            x[i], v[i] = self.home[i], 0.0
            if self.spec.pin_motion and i == 3:
                x[i, 1] += 0.2 * math.sin(4 * math.pi * t)
                v[i, 1] = 0.2 * 4 * math.pi * math.cos(4 * math.pi * t)

    def substep(self, solver: str, x, v, s: int, substeps: int):
        """Positions and velocities after substep s of the run."""
        h = self.h

        def drive(x, v, m):
            x, v = x.copy(), v.copy()
            self.hold(x, v, (s + m) * h)
            return self.forces(x, v, (s + m) * h) / self.mass[:, None] + GRAVITY + self.rate * self.k * wind((s + m) * h)

        self.hold(x, v, s * h)
        x, v, self.past = staged.step(solver, x, v, drive, self.k, h, self.past, s % substeps == 0)
        self.hold(x, v, (s + 1) * h)
        return x, v


def twin_of_a_net(keys: dict, h: float) -> TwinNet:
    spec = network(**keys).systems["s"]
    joined = zip(*(keys[n] for n in ("springs", "stiffness", "damping", "rest_length")), strict=True)
    table = [(*pair, k, c, r) for pair, k, c, r in joined]
    mass = np.array(np.broadcast_to(keys["mass"], len(keys["points"])), float)
    return TwinNet(spec, lambda x, v, t: springs.forces(x, v, table), mass, ALPHA / keys["mass"], 1.0, h)


def net_keys(**more) -> dict:
    return (
        tangle(20, 50) | {"mass": 0.8, "pins": [3, 8], "pin_motion": SWING, "coupling": {"alpha": ALPHA}, "gravity": tuple(GRAVITY)} | more
    )


@pytest.mark.parametrize("native", [True, False])
@pytest.mark.parametrize("solver", STAGED)
def test_frames_of_a_net_equal_the_twin(solver, native, device):
    """Ten frames on their own, 30 substeps: roundings of 1e-7 m and, in forces of up to 200 N, 2e-5 N, carried along by stable springs."""
    sim = simulate(**net_keys(), solver=solver, substeps=SUBSTEPS, device=device, native=native, more=WIND)
    twin = twin_of_a_net(net_keys(), 1 / 60 / SUBSTEPS)
    x, v = state(sim)
    for s in range(10 * SUBSTEPS):
        x, v = twin.substep(solver, x, v, s, SUBSTEPS)
    sim.run(10 / 60)
    moved = [i for i in range(20) if i not in (3, 8)]
    assert np.abs(state(sim)[0] - x).max() < 5e-6 and np.abs(state(sim)[1] - v)[moved].max() < 5e-5
    assert np.abs(x - np.array(net_keys()["points"])).max() > 0.2


@pytest.mark.parametrize("solver", STAGED)
def test_frames_of_a_sheet_equal_the_twin(solver):
    """The wind across the sheet is one more force, c/ρ ((u − v)·n) n, asked for at every stage."""
    nx, ny, density, air, edges = 6, 5, 0.5, 2.0, np.array([[1.0, 0, 0], [0.1, -0.8, 0.05]])
    numbers = {"structural": (20.0, 0.02), "shear": (10.0, 0.01), "bend": (1.0, 0.005)}
    kinds = {kind: {"stiffness": k, "damping": c} for kind, (k, c) in numbers.items()}
    keys = {"type": "cloth", "resolution": [nx, ny], "edges": edges.tolist(), "density": density, "air": air, "pins": ["left"], **kinds}
    sim = simulate(**keys, gravity=tuple(GRAVITY), solver=solver, substeps=SUBSTEPS, more=WIND)
    table = sheets.springs(nx, ny, edges[0] / (nx - 1), edges[1] / (ny - 1), numbers)
    mass = sim.frame()["s"].mass.astype(float)

    def forces(x, v, t):
        brief = 1e-6  # of so short a time the decay's mean is its rate
        return springs.forces(x, v, table) + mass[:, None] * sheets.pull(nx, ny, x, v, wind(t), air / density, brief)

    twin = TwinNet(sim.scene.systems["s"], forces, mass, 0.0, 0.0, 1 / 60 / SUBSTEPS)
    x, v = state(sim)
    for s in range(10 * SUBSTEPS):
        x, v = twin.substep(solver, x, v, s, SUBSTEPS)
    sim.run(10 / 60)
    assert np.abs(state(sim)[0] - x).max() < 5e-6 and np.abs(state(sim)[1] - v).max() < 1e-4
    assert np.abs(x - twin.home).max() > 0.1


BALL = {"type": "sphere", "center": [0, -0.6, 0], "radius": 0.5}


@pytest.mark.parametrize("count", [2, 64, 65, 300])
@pytest.mark.parametrize("solver", STAGED)
def test_parts_and_plain_kernels_share_their_bits(solver, count, monkeypatch):
    """A ball in the way, so that pasts of all lengths are there."""
    monkeypatch.setattr("warpsim.launch.PARALLEL_FROM", 0)
    flow = [
        {"type": "uniform", "velocity": [1, 0, {"sine": {"amplitude": 4, "period": 0.1}}]},
        {"type": "vortex", "axis": [0, 1, 0], "circulation": 2.0, "core": {"model": "lamb_oseen", "radius": 0.2}},
        {"type": "expression", "velocity": ["y*sin(9*t)", "x", "z + 1"]},
    ]
    forces = [{"type": "attractor", "law": "spring", "strength": 2.0}]
    more = {"flow": flow, "forces": forces, "colliders": [BALL]}
    pins = {"pins": [1], "pin_motion": [{"displacement": [{"expression": "0.1*sin(9*t)"}, 0, 0]}]}
    keys = tangle(count, 2 * count) | pins | {"coupling": {"viscosity": 1e-2}, "radius": 0.1}
    scene = network(**keys, solver=solver, gravity=(0, -9.81, 0), substeps=6, more=more)
    hashes = set()
    for native, threads in ((True, 1), (True, 2), (True, 5), (False, 1), (False, 3)):
        sim = Simulation(scene, device="cpu", threads=threads, native=native)
        sim.run(0.15)
        hashes.add(sim.state_hash())
    assert len(hashes) == 1


@pytest.mark.parametrize("solver", ["adams_bashforth_2", "adams_bashforth_4", "abm_pece_4"])
def test_who_meets_a_collider_forgets_and_is_put_back_with_the_rest(solver):
    """A point above a plate, one beside it, not joined: one bounces, 0.76 through a frame, and has a short past at its end."""
    height, g = 1.05, 9.81
    plate = {"type": "box", "center": [0, -0.1, 0], "size": [1, 0.2, 1], "restitution": 0.5}
    keys = {
        "points": [[0, height, 0], [3, height, 0]],
        "springs": [],
        "stiffness": 1.0,
        "gravity": (0, -g, 0),
        "solver": solver,
        "substeps": 8,
    }
    sim = simulate(**keys, more={"colliders": [plate]})
    kept, hashes = [], []
    for _ in range(40):
        sim.step_frame()
        kept.append(sim.systems["s"].population.host("history_count"))
        hashes.append(sim.state_hash())
    kept = np.array(kept)
    assert (kept[1:, 1] == 3).all() and kept[:, 0].min() < 3 and state(sim)[0][0, 1] > 0.0
    bounce = int(np.argmin(kept[:, 0]))
    assert bounce == math.floor(math.sqrt(2 * height / g) * 60), "√(2 y/g) after it is let go"
    for frame in (5, bounce + 1, bounce + 3):
        sim.seek(frame)
        assert sim.state_hash() == hashes[frame - 1]


def test_a_slider_acts_and_one_on_the_look_leaves_the_motion_alone():
    """The past stays when a number changes, as that of particles does: what is only seen must not be felt."""
    hashes = []
    for path, value in ((None, None), ("look.size", 0.3), ("mass", 0.9)):
        sim = simulate(**net_keys(), solver="adams_bashforth_4", substeps=8)
        sim.run(0.2)
        if path:
            sim.change(f"systems.s.{path}", value)
        sim.run(0.2)
        hashes.append(sim.state_hash())
    assert hashes[0] == hashes[1] != hashes[2]
