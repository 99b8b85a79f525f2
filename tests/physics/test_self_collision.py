"""Cloth that meets itself: momentum, energy, friction, and that it never passes through itself, whatever moves it."""

import numpy as np
import pytest

from tests.reference import layers as twin
from tests.simulation.layers import RAIL, WILD_RAIL, Crumpled, crumple, folding, sheet
from tests.simulation.networks import simulate
from warpsim.crossings import crossings
from warpsim.kernels import layers
from warpsim.scene.layers import least_core


@pytest.mark.parametrize("seed", range(4))
def test_layers_keep_momentum_and_take_energy(seed):
    """A crumpled sheet with points of three masses, pushed once: Σ m v and Σ m x stay, Σ ½ m v² falls, whatever the friction."""
    one = Crumpled(**sheet(16, 15, self_collision={"friction": 0.5 * seed}, substeps=20))
    mass, rng = 1.0 / one.w, np.random.default_rng(seed)
    x = crumple(one.system.net.points, 0.25, seed)
    v = rng.normal(0, 2.0, x.shape).astype(np.float32).astype(float)
    one.put(x, x, v)
    moved, after = one.play("constrain")
    assert one.touches.max() > 5
    scale = np.abs(mass[:, None] * v).sum()
    assert np.abs(mass @ (after - v)).max() < 1e-6 * scale  # a dozen float32 roundings of each point's own change
    assert np.abs(mass @ (moved - x)).max() < 1e-6 * mass.sum()
    energy, left = (0.5 * mass @ (u * u).sum(axis=1) for u in (v, after))
    assert 0.3 * energy < left < 0.98 * energy


def test_layers_at_rest_beside_each_other_feel_nothing():
    """A flat sheet: its own neighbors are nearer than the distance, but no layers."""
    one = Crumpled(**sheet(20, 20, substeps=20))
    x = one.system.net.points.astype(np.float32).astype(float)
    one.put(x, x, np.zeros_like(x))
    moved, after = one.play("constrain", "after")
    assert one.touches.max() == 0 and np.array_equal(moved, x) and not after.any()


@pytest.mark.parametrize(("friction", "rubs"), [(0.0, 0.0), (0.2, 0.2), (2.0, 1.0)])
def test_friction_between_layers_is_coulombs(friction, rubs):
    """Two points of equal mass meet at 2 m/s, 1 m/s across: as much is rubbed off as the impact presses, and no more than there is."""
    one = Crumpled(**sheet(2, 9, substeps=200, pins=["corners"], self_collision={"friction": friction}))
    x = one.system.net.points.copy()
    here, there = 2 * 4, 2 * 6 + 1
    x[there] = x[here] + [0, 0, 0.999 * one.distance]
    x[np.arange(one.count) > there] += [0, 0, 5]
    x[np.arange(one.count) < here] -= [0, 0, 5]
    x[np.setdiff1d(np.arange(here, there), [here])] += np.outer(np.arange(1, there - here), [3.0, 0, 0])
    v = np.zeros_like(x)
    v[here], v[there] = [0, 0, 1], [1, 0, -1]
    one.put(x, x, v)
    after = one.play("constrain")[1]
    mass = 1.0 / one.w[[here, there]]
    slip, closing = (after[there] - after[here])[[0, 2]]
    assert one.touches.sum() == 2 and mass[0] == pytest.approx(mass[1], rel=1e-6)
    assert abs(closing) < 1e-5  # roundings of 5 m/200: positions are no part of it, velocities are
    assert slip == pytest.approx(1.0 - min(1.0, 2.0 * rubs), abs=1e-5)


def core_of(one: Crumpled) -> float:
    return float(one.part.layers.numbers.numpy()[layers.CORE])


@pytest.mark.parametrize("seed", range(6))
def test_a_braked_substep_brings_nobody_into_a_core(seed):
    """From any state in which no pair is within its core, at any speed, free or pinned: none is so within the substep."""
    rng = np.random.default_rng(seed)
    one = Crumpled(**sheet(14, 12, pins=[] if seed % 2 else ["top"], substeps=20))
    pairs = twin.meeting(one.places, *one.cell, one.w, one.distance)
    x0 = one.system.net.points * [1, 0.5 if seed % 3 else 1, 1] + rng.normal(0, 0.3, (one.count, 3)) * (one.w > 0)[:, None]
    for _ in range(4000):  # until no pair is within its core
        close = [(i, j) for i, j in pairs if np.linalg.norm(x0[i] - x0[j]) < 1.001 * core_of(one)]
        if not close:
            break
        for i, j in close:
            n = (x0[i] - x0[j]) / np.linalg.norm(x0[i] - x0[j]) * 0.3 * one.distance
            x0[i], x0[j] = x0[i] + n * (one.w[i] > 0), x0[j] - n * (one.w[j] > 0)
    assert not close
    x0 = x0.astype(np.float32).astype(float)
    moving = (one.w > 0)[:, None] if seed % 2 == 0 else np.ones((one.count, 1))
    v = (rng.normal(0, 10.0 ** (1 + 0.3 * seed), x0.shape) + [4.0, 0, 0]) * moving
    x1 = (x0 + one.h * v).astype(np.float32).astype(float)
    one.put(x0, x1, v)
    one.play("constrain")
    one.put(x0, x1, v)  # as if a collider had thrown everybody back to where they wanted to go
    x, _ = one.play("after")
    least = min(twin.least_distance(x0[i] - x0[j], x[i] - x[j]) for i, j in pairs)
    assert least > core_of(one) - 1e-6  # roundings of places below 2 m
    assert min(twin.least_distance(x0[i] - x0[j], x1[i] - x1[j]) for i, j in pairs) < 0.9 * core_of(one)


@pytest.mark.parametrize(
    ("solver", "substeps"),
    [("semi_implicit_euler", 24), ("verlet", 24), ("drift_kick", 24), ("xpbd", 16), ("implicit_euler", 12), ("rk4", 24)],
)
@pytest.mark.parametrize("rail", [RAIL, WILD_RAIL], ids=["laid", "crumpled"])
def test_a_folded_sheet_never_crosses_itself(rail, solver, substeps):
    """Counted every fifth frame, over 80; without self-collision it crosses itself a hundred times."""
    counts = {}
    for met in (True, False):
        sim = simulate(**folding(rail, solver=solver, substeps=substeps, self_collision=met))
        triangles = sim.frame()["s"].triangles
        counts[met] = [len(crossings(frame["s"].position, triangles)) for frame in sim.frames(80) if frame.index % 5 == 0]
    assert max(counts[True]) == 0 and max(counts[False]) > 100, counts


def test_no_pair_is_ever_within_the_least_core():
    """Which alone lets no edge through a triangle. The core is 1.15/1.1 of it; the floor may squeeze a pair that was braked into that."""
    sim, touched = simulate(**folding(substeps=24)), 0
    spec = sim.scene.systems["s"]
    core = least_core(spec.edges, spec.resolution)
    for frame in sim.frames(80):
        touched = max(touched, sim.systems["s"].statistics()["self_contacts"])
        assert nearest_layers(frame["s"].position.astype(float), 25) > core, frame.index
    assert touched > 100


def test_brakes_throw_nobody():
    """A sheet with hardly any shear stiffness whips over a box: it is braked all the time, and its energy only falls."""
    box = {"type": "box", "center": [0, -0.2, 0], "size": [0.5, 0.05, 0.4], "friction": 0.5, "restitution": 0}
    keys = {"edges": [[1.0, 0, 0], [0, 0, 0.8]], "corner": [-0.5, 0, -0.4], "shear": {"stiffness": 2, "damping": 0.001}, "thickness": 0.01}
    sim = simulate(**{**sheet(41, 33), **keys, "substeps": 32, "gravity": (0, -9.81, 0)}, more={"colliders": [box]})
    energies, brakes = [], 0
    for frame in sim.frames(50):
        x, v, m = (getattr(frame["s"], key).astype(float) for key in ("position", "velocity", "mass"))
        numbers = sim.systems["s"].statistics()
        brakes += numbers["self_brakes"]
        energies.append(float(m @ (0.5 * (v * v).sum(axis=1) + 9.81 * x[:, 1])) + numbers["elastic_energy"])
    assert brakes > 50 and np.diff(energies).max() < 1e-3 * np.ptp(energies)


def nearest_layers(x: np.ndarray, columns: int) -> float:
    """The least distance of two points that are no neighbors in a sheet with so many columns."""
    i, j = np.triu_indices(len(x), 1)
    apart = np.maximum(np.abs(i % columns - j % columns), np.abs(i // columns - j // columns)) > 1
    return float(np.linalg.norm(x[i[apart]] - x[j[apart]], axis=1).min())


def test_what_touches_does_not_depend_on_when_the_lists_were_made():
    """Back from the end into mid-fold, with the lists of the end: the same bits as on the way there."""
    sim, hashes = simulate(**folding(substeps=24)), {}
    for frame in sim.frames(64):
        hashes[frame.index] = sim.state_hash()
    assert sim.systems["s"].statistics()["self_contacts"] > 50
    sim.seek(50)
    for frame in sim.frames(14):
        assert sim.state_hash() == hashes[frame.index]


def test_the_least_core_lets_no_edge_through():
    """Random edges through random triangles of a cell, at rest lengths: some end is nearer to some corner than the least core."""
    rng = np.random.default_rng(2)
    for edges, resolution in (
        ([[1, 0, 0], [0, -1, 0]], (11, 11)),
        ([[1, 0, 0], [0, -0.6, 0]], (11, 11)),
        ([[1, 0, 0], [0.3, -1, 0]], (11, 9)),
    ):
        a, b = (np.array(edge) / (n - 1) for edge, n in zip(edges, resolution, strict=True))
        core, found = least_core(edges, resolution), 0.0
        for corners in ([0 * a, a, a + b], [0 * a, a, b], [a, a + b, b], [0 * a, b, a + b]):
            corners = np.array(corners)
            for side in (a, b, a + b, a - b):
                weights = np.concatenate([rng.dirichlet([0.4, 0.4, 0.4], 800), np.eye(3), (1 - np.eye(3)) / 2])
                for x in weights @ corners:
                    way = rng.normal(0, 1, 3)
                    way *= np.linalg.norm(side) / np.linalg.norm(way)
                    share = rng.choice([rng.random(), 0.5])
                    ends = np.stack([x - share * way, x + (1 - share) * way])
                    found = max(found, np.linalg.norm(ends[:, None] - corners, axis=2).min())
        assert 0.8 * core < found < core * (1 + 1e-9)
