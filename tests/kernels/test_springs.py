"""Springs: the packed network, forces and whole frames against the twin; native loops, plain kernels and any parts to the bit."""

import numpy as np
import pytest
import warp as wp

from tests.reference import springs as twin
from tests.simulation.networks import network, simulate, state, tangle
from warpsim import Simulation
from warpsim.kernels.springs import spring_force
from warpsim.networks import packed
from warpsim.systems.solvers import SOLVERS
from warpsim.systems.solvers.split import WHEN

GRAVITY, ALPHA = (0.3, -9.81, 0.0), 0.4
MOTION = {"pins": [3], "keyframes": [[0.0, [0, 0, 0]], [0.1, [0.2, 0, 0.1]], [0.2, [0.2, 0.3, 0.1]]]}


def random_springs(count: int) -> np.ndarray:
    rng = np.random.default_rng(count)
    return np.array([(i, j) for i in range(count) for j in range(i) if rng.random() < 0.1], np.int32).reshape(-1, 2)


def check_entries(net, springs: np.ndarray, count: int) -> None:
    """Every spring has one entry at either end, and nothing else has one."""
    lanes = np.repeat(np.arange(len(net.begin) - 1), np.diff(net.begin))[:, None] * 64 + np.arange(64)
    row, lane = np.nonzero(net.spring >= 0)
    point, number = lanes[row, lane], net.spring[row, lane]
    assert sorted(zip(point, number, strict=True)) == sorted((i, n) for n, pair in enumerate(springs.tolist()) for i in pair)
    assert (springs[number].sum(axis=1) - point == net.neighbor[row, lane]).all()
    assert (net.neighbor >= 0).all() and (net.neighbor < 64 * (len(net.begin) - 1)).all() and point.max(initial=0) < count


@pytest.mark.parametrize("count", [1, 2, 63, 64, 65, 200])
def test_every_spring_is_packed_twice(count):
    springs = random_springs(count)
    net = packed(count, springs)
    check_entries(net, springs, count)
    numbers = np.arange(len(springs)) + 0.5
    assert (net.values(numbers).reshape(net.spring.shape) == np.append(numbers, 0.0)[net.spring]).all()


def test_springs_of_a_tangle_are_packed_in_order():
    springs = random_springs(200)
    net = packed(200, springs)
    for i in range(200):
        mine = net.spring[net.begin[i // 64] : net.begin[i // 64 + 1], i % 64]
        expected = np.flatnonzero((springs == i).any(axis=1))
        assert (mine[: len(expected)] == expected).all() and (mine[len(expected) :] == -1).all()


@pytest.mark.parametrize("shape", [(300,), (33, 20), (9, 9, 9)])
def test_neighbors_in_a_grid_lie_in_rows(shape):
    """Each row of a slice has one step to the neighbor; what it has where there is no spring goes on the row, and pulls with nothing."""
    number = np.arange(np.prod(shape)).reshape(shape)
    pairs = []
    for step in np.ndindex(*(3,) * len(shape)):
        ends = [number[tuple(slice(max(0, -d), min(n, n - d)) for n, d in zip(shape, np.array(s) * (np.array(step) - 1), strict=True))]
                for s in ([1] * len(shape), [-1] * len(shape))]  # fmt: skip
        pairs += [pair for pair in zip(ends[0].ravel().tolist(), ends[1].ravel().tolist(), strict=True) if pair[0] < pair[1]]
    springs = np.array(pairs, np.int32)
    net = packed(number.size, springs)
    check_entries(net, springs, number.size)
    quarters = net.neighbor.reshape(-1, 4, 16)
    assert (quarters - quarters[:, :, :1] == np.arange(16)).all(axis=2).mean() > 0.9
    assert not net.values(np.ones(len(springs)))[net.spring.reshape(-1) < 0].any()


def test_a_force_equals_the_twin_and_its_reaction():
    """float32: 6 roundings of the largest term, |F| < 100 N; turned round it is the same to the last bit; coincident ends: none."""
    rng = np.random.default_rng(1)
    for _ in range(200):
        xi, vi, xj, vj = rng.normal(size=(4, 3)).astype(np.float32)
        r, k, c = (float(np.float32(x)) for x in rng.uniform(0, 10, 3))
        f = np.array(spring_force(*(wp.vec3(*map(float, w)) for w in (xi, vi, xj, vj)), r, k, c))
        g = np.array(spring_force(*(wp.vec3(*map(float, w)) for w in (xj, vj, xi, vi)), r, k, c))
        expected = twin.spring_force(*(w.astype(float) for w in (xi, vi, xj, vj)), k, c, r)
        assert (f == -g).all() and np.abs(f - expected).max() < 6 * 2**-24 * 100 * 4
    still = wp.vec3(1.0, 2.0, 3.0)
    assert list(spring_force(still, wp.vec3(), still, wp.vec3(1.0, 0.0, 0.0), 0.5, 1e12, 1e12)) == [0.0, 0.0, 0.0]


def test_the_solvers_are_those_of_the_format():
    from typing import get_args

    from warpsim.scene.springs import CoupledSolver

    assert set(SOLVERS) == set(get_args(CoupledSolver))


@pytest.mark.parametrize("native", [True, False])
@pytest.mark.parametrize("solver", WHEN)
def test_frames_equal_the_twin(solver, native, device):
    """Each frame starts the twin from the device's state: 3 substeps of float32, |x| < 3 m, |v| < 8 m/s, each force of ~6 springs."""
    net, substeps = tangle(), 3
    keys = {
        "solver": solver,
        "gravity": GRAVITY,
        "substeps": substeps,
        "pins": [3, 8],
        "pin_motion": [MOTION],
        "coupling": {"alpha": ALPHA},
    }
    sim = simulate(device=device, native=native, **net, **keys)
    springs = [
        (*pair, k, c, r) for pair, k, c, r in zip(*(net[n] for n in ("springs", "stiffness", "damping", "rest_length")), strict=True)
    ]
    mass, home = np.array(net["mass"]), np.array(net["points"])
    h = 1 / 60 / substeps
    free = np.ones(len(home), bool)
    free[[3, 8]] = False

    def internal(x, v):
        return twin.forces(x, v, springs) / mass[:, None] * free[:, None]

    assert np.abs(state(sim)[0] - home).max() < 1e-7 and not state(sim)[1].any()
    times, places = [row[0] for row in MOTION["keyframes"]], np.array([row[1] for row in MOTION["keyframes"]])

    def held(t):
        return {3: home[3] + [np.interp(t, times, places[:, axis]) for axis in range(3)], 8: home[8]}

    for index in range(12):
        pins = [held((index * substeps + s + 1) * h) for s in range(substeps)]
        x, v = twin.frame(solver, *state(sim), internal, lambda x: np.tile(GRAVITY, (len(x), 1)), ALPHA / mass, h, pins)
        sim.step_frame()
        assert np.abs(state(sim)[0] - x).max() < 2e-6 and np.abs(state(sim)[1] - v).max() < 3e-5, index


@pytest.mark.parametrize("count", [2, 63, 64, 65, 500])
@pytest.mark.parametrize("solver", WHEN)
def test_parts_and_plain_kernels_share_their_bits(solver, count, monkeypatch):
    monkeypatch.setattr("warpsim.launch.PARALLEL_FROM", 0)
    wind = {"flow": [{"type": "uniform", "velocity": [1, 0, {"sine": {"amplitude": 1, "period": 0.1}}]}]}
    pins = {"pins": [1], "pin_motion": [{"displacement": [{"expression": "sin(9*t)"}, 0, 0]}]}
    scene = network(**tangle(count, 3 * count), **pins, solver=solver, gravity=GRAVITY, coupling={"viscosity": 1e-2}, radius=0.1, more=wind)
    hashes = set()
    for native, threads in ((True, 1), (True, 2), (True, 3), (True, 5), (False, 1), (False, 3)):
        sim = Simulation(scene, device="cpu", threads=threads, native=native)
        sim.run(0.2)
        hashes.add(sim.state_hash())
    assert len(hashes) == 1
