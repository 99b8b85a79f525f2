"""Elementary functions against Python's math, at the accuracy that their docstrings state."""

import math

import numpy as np
import pytest
import warp as wp

from warpsim.kernels import elementary


@wp.kernel
def sample_single(x: wp.array[float], y_out: wp.array2d[float]):
    i = wp.tid()
    y_out[i, 0] = elementary.exp_negative(-wp.abs(x[i]))
    y_out[i, 1] = elementary.mean_decay(wp.abs(x[i]))
    y_out[i, 2] = elementary.log_positive(wp.max(wp.abs(x[i]), 1.2e-38))
    y_out[i, 3] = elementary.sin_turns(x[i])
    y_out[i, 4] = elementary.cos_turns(x[i])
    y_out[i, 5] = elementary.exponential_integral(wp.abs(x[i]))
    y_out[i, 6] = elementary.exp_negative(wp.min(wp.abs(x[i]), 80.0))


@wp.kernel
def sample_double(x: wp.array[wp.float64], y: wp.array[wp.float64], z_out: wp.array2d[wp.float64]):
    i = wp.tid()
    z_out[i, 0] = elementary.exp64(x[i])
    z_out[i, 1] = elementary.log64(x[i])
    z_out[i, 2] = elementary.sin64(x[i])
    z_out[i, 3] = elementary.cos64(x[i])
    z_out[i, 4] = elementary.power64(x[i], y[i])


def single(x, device) -> np.ndarray:
    x = np.asarray(x, np.float32)
    out = wp.zeros((len(x), 7), dtype=float, device=device)
    wp.launch(sample_single, len(x), [wp.array(x, dtype=float, device=device), out], device=device)
    return out.numpy().astype(float)


def double(x, device, y=None) -> np.ndarray:
    x = np.asarray(x, float)
    out = wp.zeros((len(x), 5), dtype=wp.float64, device=device)
    arguments = [wp.array(v, dtype=wp.float64, device=device) for v in (x, np.zeros(len(x)) if y is None else np.asarray(y, float))]
    wp.launch(sample_double, len(x), [*arguments, out], device=device)
    return out.numpy()


def test_exp_negative(device):
    x = np.concatenate([np.linspace(0.0, 80.0, 20_001), np.geomspace(1e-30, 1.0, 2_001)]).astype(np.float32)
    exact = np.exp(-x.astype(float))
    # e^z = 2^y: y = z/ln 2 is rounded to 2^-24 relative, that is z 2^-24 absolute in the exponent
    assert (np.abs(single(x, device)[:, 0] / exact - 1.0) < 2e-7 + x * 2.0**-24 * 2).all()
    assert single([1e3, 1e30], device)[:, 0].tolist() == pytest.approx([math.exp(-80)] * 2, rel=1e-5)  # tiny, not 0: stays finite


def test_exponential_integral(device):
    """E₁(q) + ln min(q, 1) = Ein(q) − γ − ln max(q, 1), Ein by Gauss's rule on pieces; through 0 and 1, where the series ends."""
    q = np.concatenate([[0.0], np.geomspace(1e-30, 1.0, 301), np.geomspace(1.0, 30.0, 301)]).astype(np.float32).astype(float)
    nodes, weights = np.polynomial.legendre.leggauss(40)
    cuts = np.append(np.arange(0.0, 30.0), 30.0)

    def mean_decay_integral(top: float) -> float:
        ends = np.clip(cuts, 0.0, top)
        t = 0.5 * (ends[:-1, None] + ends[1:, None] + np.diff(ends)[:, None] * nodes)
        return float((0.5 * np.diff(ends)[:, None] * weights * -np.expm1(-t) / np.where(t > 0.0, t, 1.0)).sum())

    exact = [mean_decay_integral(x) - np.euler_gamma - math.log(max(x, 1.0)) for x in q]
    assert np.abs(single(q, device)[:, 5] - exact).max() < 2e-7
    assert (np.abs(single([100.0, 1e9, 1e30], device)[:, 5]) < 1e-30).all()


def test_exp_negative_of_positive_numbers(device):
    x = np.linspace(0.0, 80.0, 2001).astype(np.float32)
    assert (np.abs(single(x, device)[:, 6] / np.exp(x.astype(float)) - 1.0) < 2e-7 + x * 2.0**-24 * 2).all()


def test_mean_decay(device):
    x = np.concatenate([np.linspace(0.0, 100.0, 20_001), np.geomspace(1e-30, 1e30, 5_001), [0.5, np.nextafter(np.float32(0.5), 0)]])
    x = x.astype(np.float32).astype(float)
    exact = np.where(x > 0, -np.expm1(-x) / np.where(x > 0, x, 1), 1.0)
    assert np.abs(single(x, device)[:, 1] / exact - 1.0).max() < 5e-7


def test_log_positive(device):
    x = np.concatenate([np.geomspace(1.2e-38, 8e37, 20_001), np.linspace(0.5, 2.0, 20_001)]).astype(np.float32)
    exact = np.log(x.astype(float))
    # to 2e-7 of the larger of result and ln 2 (near 1 the whole power of two cancels against the logarithm of the mantissa)
    assert (np.abs(single(x, device)[:, 2] - exact) < 2e-7 * np.maximum(np.abs(exact), 0.7)).all()


def test_sin_and_cos_of_turns(device):
    x = np.concatenate([np.linspace(0.0, 1.0, 30_001), np.arange(5) / 4]).astype(np.float32)
    got = single(x, device)
    assert np.abs(got[:, 3] - np.sin(2 * np.pi * x.astype(float))).max() < 2.5e-7
    assert np.abs(got[:, 4] - np.cos(2 * np.pi * x.astype(float))).max() < 4.1e-7  # u + ¼ is rounded: 2^-25 turns near 1 are 1.9e-7 rad
    assert np.abs(np.hypot(got[:, 3], got[:, 4]) - 1.0).max() < 4e-7  # directions keep unit length


def test_exp64(device):
    x = np.concatenate([np.linspace(-708.0, 709.0, 20_001), np.geomspace(1e-300, 1.0, 101)])
    assert np.abs(double(x, device)[:, 0] / np.exp(x) - 1.0).max() < 1e-15
    assert double([-709.0, -1e300, 709.5, 1e300], device)[:, 0].tolist() == [0.0, 0.0] + double([709.0] * 2, device)[:, 0].tolist()


def test_log64(device):
    x = np.concatenate([np.geomspace(3e-308, 1e308, 20_001), np.linspace(0.5, 2.0, 20_001)])
    exact = np.log(x)
    assert (np.abs(double(x, device)[:, 1] - exact) < 1e-15 * np.maximum(np.abs(exact), 0.7)).all()
    assert np.isnan(double([0.0, -1.0, -np.inf], device)[:, 1]).all()


def test_sin64_and_cos64(device):
    x = np.concatenate([np.linspace(-20.0, 20.0, 20_001), np.linspace(-1e6, 1e6, 20_001), np.arange(-40, 41) * np.pi / 2])
    got = double(x, device)
    assert np.abs(got[:, 2] - np.sin(x)).max() < 1e-15
    assert np.abs(got[:, 3] - np.cos(x)).max() < 1e-15


def test_power64(device, rng):
    x, y = rng.uniform(0.01, 20.0, 5_000), rng.uniform(-20.0, 20.0, 5_000)
    exact = x**y
    # e^{y ln x}: the rounding of y ln x, up to 60, is 60 ulp of the result
    assert (np.abs(double(x, device, y)[:, 4] / exact - 1.0) < 2e-15 + 2.3e-16 * 2 * np.abs(y * np.log(x))).all()
    base, whole = rng.uniform(-3.0, 3.0, 2_000), rng.integers(-64, 65, 2_000).astype(float)
    assert (np.abs(double(base, device, whole)[:, 4] / base**whole - 1.0) < 65 * 2.3e-16).all()  # a product of up to 64 factors
    got = double([0.0, 0.0, -2.0, -2.0, 4.0], device, [0.5, 0.0, 0.5, 3.0, 0.5])[:, 4]
    assert got[0] == 0.0 and got[1] == 1.0 and np.isnan(got[2]) and got[3] == -8.0 and got[4] == pytest.approx(2.0, rel=1e-15)
    assert np.isinf(double([0.0], device, [-1.0])[0, 4])
