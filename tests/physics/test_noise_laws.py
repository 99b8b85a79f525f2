"""Laws of the curl noise: free of divergence, of the speed it states, without direction, smooth in place and time, never at rest."""

import math

import numpy as np
import pytest
from numpy.polynomial import Polynomial

from tests.physics.scenes import simulate
from tests.reference.noise import turbulence
from warpsim import Simulation, load_scene
from warpsim.kernels.noise import RMS_OF_UNIT_CORNERS


def noise(amplitude=1.0, length=4.0, **keys):
    return simulate(flow=[{"type": "curl_noise", "amplitude": amplitude, "length": length, **keys}]).flow


def places(count: int, cells: float = 40.0, length: float = 4.0, seed: int = 1) -> np.ndarray:
    return np.random.default_rng(seed).uniform(-cells * length, cells * length, (count, 3))


@pytest.mark.parametrize("keys", [{}, {"frequency": 0.7}, {"octaves": 3, "length": 16.0}], ids=["still", "moving", "octaves"])
def test_it_has_no_divergence(keys):
    """By differences over 1/256 of the smallest cell, 4 m: rounding 2e-7 · 256, truncation (1/256)² times third derivatives of 60."""
    flow = noise(1.3, **keys)
    points = places(3000, 3.0)
    near_faces = np.concatenate([points, np.round(points / 4.0) * 4.0 + np.random.default_rng(2).uniform(-0.02, 0.02, points.shape)])
    for time in (0.0, 12.3):
        assert np.abs(flow.divergence(near_faces, time=time)).max() < 1e-3 * 1.3 / 4.0


def test_nothing_flows_out_of_a_ball():
    """Gauss: what leaves a sphere of many cells is nothing to the quadrature's error, against what passes to and fro."""
    flow = noise(1.3, length=1.0, seed=5)
    assert abs(flow.flux([0.3, 0.2, 0.1], radius=1.5)) < 1e-4 * 1.3 * 4.0 * math.pi * 1.5**2


def test_the_constant_in_the_kernel_is_the_mean_over_a_cell():
    """⟨Σ |M|²⟩, M = (w + ½p) I − ½ d ∇wᵀ, p = ∇w·d, is eight times 3w² + 2wp + ¼p² + ¼|d|²|∇w|², by products of integrals over one axis."""
    x = Polynomial([0.0, 1.0])
    f = 1.0 - (10.0 * x**3 - 15.0 * x**4 + 6.0 * x**5)
    g = f.deriv()

    def mean(p):
        return p.integ()(1.0)

    ff, xfg, gg, xxgg, xxff = mean(f * f), mean(x * f * g), mean(g * g), mean(x * x * g * g), mean(x * x * f * f)
    squares = 3.0 * ff**3 + 6.0 * xfg * ff**2 + 0.25 * (3.0 * xxgg * ff**2 + 6.0 * xfg**2 * ff)
    squares += 0.25 * (3.0 * xxgg * ff**2 + 6.0 * xxff * gg * ff)
    assert float(RMS_OF_UNIT_CORNERS) == pytest.approx(math.sqrt(8.0 * squares / 3.0), rel=1e-7)


@pytest.mark.parametrize("octaves", [1, 4])
@pytest.mark.parametrize("time", [0.0, 3.7])
def test_amplitude_is_the_root_mean_square_of_the_speed(octaves, time):
    """Over 200 000 places in 512 000 cells: v² has a relative deviation of about 1, so its mean is known to some 0.3 %."""
    speed = noise(2.5, frequency=0.4, octaves=octaves).sample(places(200_000), time=time).astype(float)
    assert math.sqrt((speed**2).sum(axis=1).mean()) == pytest.approx(2.5, rel=6e-3)
    assert (np.abs(speed.mean(axis=0)) < 5.0 * 2.5 / math.sqrt(3.0 * 200_000)).all(), "no wind in it"
    share = (speed**2).mean(axis=0) / (2.5**2 / 3.0)
    assert share == pytest.approx(np.ones(3), abs=0.02), "no direction either"
    assert np.abs(np.corrcoef(speed.T) - np.eye(3)).max() < 0.02


def test_lattice_is_not_seen_in_the_speed():
    """At corners, on edges, in faces and middles of cells the speed is of one size: the noise has no still points of its lattice."""
    cells = np.floor(places(60_000, length=1.0))
    flow = noise(1.0, length=1.0)
    for offset in ([0, 0, 0], [0.5, 0, 0], [0.5, 0.5, 0], [0.5, 0.5, 0.5]):
        rms = math.sqrt((flow.sample(cells + offset).astype(float) ** 2).sum(axis=1).mean())
        assert 0.65 < rms < 1.7, offset


def test_it_varies_smoothly_in_time_and_keeps_its_size():
    """Speeds of change are within what paces up to 3/2 of the frequency allow, also late; after some periods nothing is as it was."""
    flow = noise(1.0, frequency=2.0, length=4.0)
    points = places(20_000)
    for start in (0.0, 123.4, 1.0e6):
        now, soon = (flow.sample(points, time=start + dt).astype(float) for dt in (0.0, 1e-3))
        change = np.linalg.norm(soon - now, axis=1) / 1e-3
        assert 4.0 < math.sqrt((change**2).mean()) < 2.0 * math.pi * 3.0, start  # 2π f = 12.6 per second on the average
        assert change.max() < 2.0 * math.pi * 3.0 * 4.5
    first = flow.sample(points, time=0.0).astype(float)
    for time in (0.5, 1.0, 5.0, 17.0, 100.0):  # whole periods of the mean frequency
        later = flow.sample(points, time=time).astype(float)
        assert abs((first * later).sum(axis=1).mean()) < (0.25 if time < 2.0 else 0.05), time
        assert math.sqrt((later**2).sum(axis=1).mean()) == pytest.approx(1.0, rel=0.02)


def test_it_stands_still_without_a_frequency_and_follows_its_seed_and_travel():
    points = places(2000)
    still = noise(1.0)
    assert (still.sample(points, time=0.0) == still.sample(points, time=77.0)).all()
    one, two = (noise(1.0, seed=seed).sample(points).astype(float) for seed in (1, 2))
    assert abs((one * two).sum(axis=1).mean()) < 0.1, "another seed is another noise"
    assert (one == noise(1.0, seed=1).sample(points)).all()
    carried = noise(1.0, seed=1, travel=[{"expression": "2*t"}, 0, 0]).sample(points + [8.0, 0.0, 0.0], time=4.0)
    np.testing.assert_allclose(carried, one, atol=2e-4)  # points 160 m away are rounded to 1e-5 of a cell


def test_octaves_follow_kolmogorov():
    """Mean square velocity differences over a distance r inside the inertial range grow as r^(2/3): over two octaves by a factor 2.52."""
    flow = noise(1.0, length=16.0, octaves=8)
    points = places(100_000, 4.0, 16.0)

    def structure(r):
        return ((flow.sample(points + [r, 0, 0]).astype(float) - flow.sample(points)) ** 2).sum(axis=1).mean()

    assert structure(4.0) / structure(1.0) == pytest.approx(2.0 ** (4.0 / 3.0), rel=0.15)


def test_octaves_are_those_of_the_twin():
    """Three octaves, each rounded as the twin's test says; at t = 50 s the frequency's 32 bits are 3e-6 of a turn."""
    scene = load_scene("curl_noise", overrides=["time.prewarm=0"])
    flow = Simulation(scene, device="cpu", threads=1).flow
    for x in np.random.default_rng(3).uniform(-3.0, 3.0, (20, 3)).astype(np.float32):
        for time in (0.0, 1.7, 50.0):
            assert flow.sample([x], time=time)[0] == pytest.approx(turbulence(scene.flow[0], x, time), abs=3e-5)


def test_far_away_it_stays_finite():
    assert np.isfinite(noise(1.0, length=1e-3).sample([[1e9, -1e9, 3e8], [0, 0, 0], [-1e-30, 0, 1]])).all()
