"""Random numbers: the device's bits are those of Python's integers, and the numbers are uniform and independent."""

import itertools
import math

import numpy as np
import pytest
import warp as wp

from tests.reference import random as reference
from warpsim.kernels import random

CHANNELS = ("POSITION", "VELOCITY", "LIFE", "SIZE", "BULK", "INTERVAL", "COUNT")


@wp.kernel
def sample_words(key: wp.vec2ui, ordinal: wp.array[wp.int64], channel: int, words_out: wp.array2d[wp.uint32]):
    i = wp.tid()
    words = random.random_words(key, ordinal[i], channel)
    for k in range(4):
        words_out[i, k] = words[k]


@wp.kernel
def sample_numbers(words: wp.array2d[wp.uint32], single_out: wp.array2d[float], double_out: wp.array[wp.float64]):
    i = wp.tid()
    single_out[i, 0] = random.uniform(words[i, 0])
    single_out[i, 1] = random.uniform_positive(words[i, 0])
    single_out[i, 2] = random.uniform_signed(words[i, 0])
    single_out[i, 3] = random.normal(words[i, 0], words[i, 1])
    double_out[i] = random.uniform64(words[i, 0], words[i, 1])


def words_of(key, ordinals, channel, device) -> np.ndarray:
    words = wp.zeros((len(ordinals), 4), dtype=wp.uint32, device=device)
    inputs = [wp.vec2ui(*key), wp.array(ordinals, dtype=wp.int64, device=device), channel, words]
    wp.launch(sample_words, len(ordinals), inputs, device=device)
    return words.numpy()


def numbers_of(words, device) -> tuple[np.ndarray, np.ndarray]:
    single, double = wp.zeros((len(words), 4), dtype=float, device=device), wp.zeros(len(words), dtype=wp.float64, device=device)
    wp.launch(sample_numbers, len(words), [wp.array(words, dtype=wp.uint32, device=device), single, double], device=device)
    return single.numpy(), double.numpy()


def test_channels_are_numbered_alike():
    assert [getattr(random, name) for name in CHANNELS] == [getattr(reference, name) for name in CHANNELS] == list(range(len(CHANNELS)))


@pytest.mark.parametrize("channel", range(len(CHANNELS)))
def test_words_equal_those_of_python_integers(channel, rng, device):
    edges = [0, 1, 2**31, 2**32 - 1, 2**32, 2**40, 10_000 << 40, 2**59]
    ordinals = [*edges, *rng.integers(0, 2**59, 257 - len(edges)).tolist()]
    for key in ((0, 0), (0xFFFFFFFF, 1), tuple(rng.integers(0, 2**32, 2).tolist())):
        assert words_of(key, ordinals, channel, device).tolist() == [list(reference.random_words(key, n, channel)) for n in ordinals]


def test_numbers_equal_the_twin(rng, device):
    """Exact, being multiples of powers of two; the normal one to 2e-6, since its logarithm and cosine are good to 2e-7 of at most 5.8."""
    words = rng.integers(0, 2**32, (257, 4), dtype=np.uint32)
    words[:3, 0], words[:3, 1] = (0, 2**32 - 1, 255), (0, 2**32 - 1, 2**31)
    single, double = numbers_of(words, device)
    for row, (a, b) in enumerate(words[:, :2].tolist()):
        assert single[row, :3].tolist() == [reference.uniform(a), reference.uniform_positive(a), reference.uniform_signed(a)]
        assert double[row] == reference.uniform64(a, b)
        assert single[row, 3] == pytest.approx(reference.normal(a, b), abs=2e-6)


def test_no_two_inputs_share_their_words(device):
    """The hash is a bijection, so whole outputs never meet, whatever differs: key, ordinal or channel."""
    ordinals = list(range(500)) + [n << 40 for n in range(1, 500)] + [2**32 + n for n in range(500)]
    seen = [words_of(key, ordinals, c, device) for key in ((1, 2), (2, 1), (3, 2)) for c in range(len(CHANNELS))]
    flat = np.concatenate(seen)
    assert len(np.unique(flat, axis=0)) == len(flat)


@pytest.mark.parametrize("channel", range(len(CHANNELS)))
def test_words_are_uniform(channel, device):
    """Chi-square over 256 bins of each word's high byte, successive ordinals: 255 degrees, mean 255, deviation √510; at most 4 of it."""
    words = words_of((12345, 67890), np.arange(100_000), channel, device)
    for word in range(4):
        observed = np.bincount(words[:, word] >> 24, minlength=256)
        chi2 = ((observed - 100_000 / 256) ** 2 / (100_000 / 256)).sum()
        assert abs(chi2 - 255) < 4 * math.sqrt(2 * 255)


def test_channels_words_and_neighbors_are_uncorrelated(device):
    """Correlations of n = 100 000 pairs have deviation 1/√n = 0.0032; of about 500 the largest stays below 4.5 of it (p ≈ 0.003)."""
    n = 100_000
    columns = [words_of((7, 8), np.arange(n), c, device).astype(float) for c in range(len(CHANNELS))]
    columns = np.concatenate(columns, axis=1).T
    next_ones = np.roll(columns, -1, axis=1)
    other_emitter = words_of((7, 9), np.arange(n), 0, device).astype(float).T
    table = np.corrcoef(np.concatenate([columns, next_ones[:4], other_emitter]))
    off = table[np.triu_indices(len(table), k=1)]
    assert np.abs(off).max() < 4.5 / math.sqrt(n)


def test_pairs_fill_the_plane(device):
    """Chi-square of 16 × 16 cells of words of different channels and of neighboring ordinals: bins 256, p > 1e-4 for each."""
    n = 100_000
    position, velocity = words_of((7, 8), np.arange(n + 1), 0, device), words_of((7, 8), np.arange(n + 1), 1, device)
    pairs = [(position[:-1, 0], position[1:, 0]), (position[:-1, 0], position[:-1, 1]), (position[:-1, 0], velocity[:-1, 0])]
    pairs += [(position[:-1, a], position[:-1, b]) for a, b in itertools.combinations(range(4), 2)]
    for a, b in pairs:
        observed = np.bincount((a >> 28) * 16 + (b >> 28), minlength=256)
        assert abs(((observed - n / 256) ** 2 / (n / 256)).sum() - 255) < 4 * math.sqrt(2 * 255)


def test_normal_numbers_have_the_moments_of_the_normal_law(device):
    """Of n numbers: mean within 4/√n of 0, variance within 4 √(2/n) of 1, kurtosis within 4 √(24/n) of 3."""
    n = 200_000
    z = numbers_of(words_of((5, 6), np.arange(n), 2, device), device)[0][:, 3].astype(float)
    assert abs(z.mean()) < 4 / math.sqrt(n) and abs(z.var() - 1) < 4 * math.sqrt(2 / n)
    assert abs((z**4).mean() / z.var() ** 2 - 3) < 4 * math.sqrt(24 / n) and np.abs(z).max() <= 5.8
