"""Kept states: small copies, to the last bit, and the ways in which a GPU's columns come and go."""

import hashlib

import numpy as np
import pytest
import warp as wp

from tests.simulation.scenes import scene
from warpsim import Simulation
from warpsim.keeping import KeptArray, digest_of, is_even
from warpsim.population import columns, put_columns


def test_rows_of_one_number_are_kept_as_one():
    array = np.array([[1, 2, 3], [7, 7, 7], [0, 0, 0]], np.uint32)
    kept = KeptArray(array)
    assert kept.nbytes == 4 * (3 + 1 + 1) and (kept.whole() == array).all() and kept.whole().dtype == array.dtype
    array[:] = 0
    assert kept.whole()[0].tolist() == [1, 2, 3], "a copy"


@pytest.mark.parametrize(
    "array", [np.zeros((3, 0), np.uint32), np.zeros(0), np.zeros((0, 4)), np.array([5]), np.arange(6.0).reshape(1, 2, 3)]
)
def test_arrays_of_any_shape_come_back(array):
    back = KeptArray(array).whole()
    assert back.shape == array.shape and back.dtype == array.dtype and (back == array).all()


def test_bits_decide():
    assert not is_even(np.array([0.0, -0.0, 0.0], np.float32)) and is_even(np.full(4, np.nan, np.float32))


def test_the_digest_is_that_of_whole_arrays():
    """Rows one after the other are the bytes of the array: hashes are what they were before rows were read where they are."""
    array = np.arange(12, dtype=np.uint32).reshape(3, 4)
    expected = hashlib.blake2b(b"5", digest_size=16)
    expected.update(b"s.slab(3, 2)<u4")
    expected.update(np.ascontiguousarray(array[:, :2]))
    assert digest_of(5, {"s": {"slab": array[:, :2]}}) == expected.hexdigest()


@pytest.mark.parametrize("count", [0, 5, 64])
def test_columns_come_from_a_device_and_go_back(count, device):
    array = wp.array(np.arange(3 * 64, dtype=np.uint32).reshape(3, 64), device=device)
    kept = KeptArray(columns(array, count))
    assert kept.whole().tolist() == array.numpy()[:, :count].tolist()
    array.zero_()
    put_columns(array, kept)
    assert array.numpy()[:, :count].tolist() == kept.whole().tolist() and not array.numpy()[:, count:].any()


def test_what_comes_back_is_the_state():
    sim = Simulation(scene(), device="cpu", threads=1)
    sim.seek(70)
    before = sim.state_hash()
    sim.seek(130)
    sim.seek(70)
    assert sim.state_hash() == before
