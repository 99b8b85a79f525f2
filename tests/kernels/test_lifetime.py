"""Ages, the part of a substep in which a particle lives, and the removal of the expired."""

from fractions import Fraction

import numpy as np
import pytest
import warp as wp

from tests.physics.scenes import emitter, simulate
from tests.reference import lifetime as reference
from warpsim.kernels import lifetime
from warpsim.kernels.emission import ACTIVE, COUNTER_COUNT, LIVE
from warpsim.kernels.lifecycle_loops import scatter_in_place


@wp.kernel
def sample_ages(frame: wp.array[int], birth_frame: wp.array[int], birth_age: wp.array[float], fps: float, age_out: wp.array[float]):
    i = wp.tid()
    age_out[i] = lifetime.age_at(frame[i], birth_frame[i], birth_age[i], fps)


@wp.kernel
def sample_steps(age: wp.array[float], dt: wp.array[float], life: wp.array[float], step_out: wp.array[float]):
    i = wp.tid()
    step_out[i] = lifetime.active_step(age[i], dt[i], life[i])


@pytest.mark.parametrize("fps", [24.0, 25.0, 30.0, 50.0, 60.0, 59.94, 120.0])
def test_age_is_correctly_rounded_at_whole_frames(fps, device):
    """Without a fraction the age is float32(n/fps) exactly, so that age < lifetime decides as real numbers would, for whole lifetimes."""
    n = np.arange(0, 3000, 7, dtype=np.int32)
    out = wp.zeros(len(n), dtype=float, device=device)
    arrays = [wp.array(v, device=device) for v in (n + 5, np.full_like(n, 5), np.zeros(len(n), np.float32))]
    wp.launch(sample_ages, len(n), [*arrays, fps, out], device=device)
    rounded = Fraction(float(np.float32(fps)))
    assert out.numpy().tolist() == [float(np.float32(float(Fraction(int(k)) / rounded))) for k in n]


def test_age_equals_the_twin(rng, device):
    """Two roundings: 2^-24 of the quotient and of the sum."""
    birth = rng.integers(-5000, 5000, 257, dtype=np.int32)
    frame, age = birth + rng.integers(-1, 100_000, 257, dtype=np.int32), rng.uniform(0, 1 / 60, 257).astype(np.float32)
    out = wp.zeros(257, dtype=float, device=device)
    wp.launch(sample_ages, 257, [*(wp.array(v, device=device) for v in (frame, birth, age)), 60.0, out], device=device)
    exact = [float(reference.age_at(int(f), int(b), float(a), 60.0)) for f, b, a in zip(frame, birth, age, strict=True)]
    np.testing.assert_allclose(out.numpy(), exact, rtol=1.3e-7, atol=1e-9)


def test_active_step_equals_the_twin(rng, device):
    """Every case: unborn, born within, alive, dying within, born and dying within, dead. Sums of numbers up to 1 s: 1.2e-7 s."""
    n = 257
    age, dt = rng.uniform(-0.03, 1.0, n).astype(np.float32), rng.choice([1 / 60, 1 / 240, 0.02], n).astype(np.float32)
    life = rng.choice([0.001, 0.01, 0.5, 1.0, 1e6], n).astype(np.float32)
    age[::3] = rng.uniform(-0.005, 0.025, len(age[::3]))
    age[1::5] = life[1::5] - rng.uniform(-0.02, 0.01, len(age[1::5])).astype(np.float32)
    out = wp.zeros(n, dtype=float, device=device)
    wp.launch(sample_steps, n, [*(wp.array(v, device=device) for v in (age, dt, life)), out], device=device)
    exact = np.array([reference.active_step(float(a), float(d), float(v)) for a, d, v in zip(age, dt, life, strict=True)])
    assert np.abs(out.numpy() - exact).max() < 1.3e-7
    assert 20 < (exact == 0).sum() < 200 and ((exact > 0) & (exact < dt)).sum() > 40, "the cases are there"


@pytest.mark.parametrize("share", [0.0, 0.01, 0.5, 1.0])
@pytest.mark.parametrize("parts", [1, 2, 3, 16])
def test_compaction_in_place_equals_the_twin(share, parts, rng):
    """Every row of the slab, in any number of parts one after the other: rows are never shared."""
    active, capacity = 257, 320
    slab = rng.integers(0, 2**32, (17, capacity), dtype=np.uint32)
    alive = np.zeros(capacity, np.int32)
    alive[:active] = rng.random(active) >= share
    counters = np.zeros(COUNTER_COUNT, np.int64)
    counters[ACTIVE] = active
    table, count = wp.array(slab, dtype=wp.uint32, device="cpu"), wp.array(counters, dtype=wp.int64, device="cpu")
    for part in range(parts):
        wp.launch(scatter_in_place, 1, [part, parts, wp.array(alive, device="cpu"), count, table], device="cpu")
    survivors = reference.compact(slab[:, :active], alive[:active])
    assert count.numpy()[LIVE] == survivors.shape[1] == alive[:active].sum()
    assert np.array_equal(table.numpy()[:, : survivors.shape[1]], survivors)


@pytest.mark.parametrize("native", [True, False])
def test_removal_keeps_order_and_every_field(native, device):
    """257 particles of random lives: those whose life is over leave, the others keep all they had, in order."""
    spec = {"mean": 0.5, "spread": 0.45}
    wide = {"shape": {"type": "box", "size": [1, 1, 1]}, "lifetime": spec, "mass": spec, "radius": spec}
    sim = simulate(emitter(257, **wide), device=device, native=native, motion="ballistic")
    first = sim.frame()["p"]
    first.keep()
    counts = []
    for frame in sim.frames(60):
        p = frame["p"]
        lives = first.lifetime > np.float32(frame.index) / np.float32(60)
        counts.append(p.count)
        for name in ("id", "lifetime", "mass", "radius", "position"):
            assert np.array_equal(getattr(p, name), getattr(first, name)[lives]), name
    assert len(set(counts)) > 30 and counts[-1] == 0
