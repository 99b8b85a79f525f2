"""Removal in turns: whoever has which chunk, all rows of the survivors lie together in order, and they are counted."""

from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest
import warp as wp

from tests.reference import lifetime as reference
from warpsim.crew import calls
from warpsim.kernels.crew import ABANDONED, BARRIER
from warpsim.kernels.emission import ACTIVE, COUNTER_COUNT, LIVE
from warpsim.kernels.removal_loops import RELAY, chunk_size, close_ranks


@wp.kernel(enable_backward=False)
def remove_chunks(
    part: int,
    part_count: int,
    alive: wp.array[int],
    counters_inout: wp.array[wp.int64],
    slab_inout: wp.array2d[wp.uint32],
    relay_inout: wp.array[int],
    calls: wp.uint64,
    barrier: wp.array[int],
):
    """Remove alone, with no motion before it."""
    active = int(counters_inout[ACTIVE])
    size = chunk_size(active, part_count)
    chunk = int(part)
    while chunk * size < active:
        end = wp.min(chunk * size + size, active)
        close_ranks(chunk, chunk * size, end, active, part_count, alive, counters_inout, slab_inout, relay_inout, calls, barrier)
        chunk = chunk + part_count


@pytest.mark.parametrize("share", [0.0, 0.01, 0.5, 1.0])
@pytest.mark.parametrize(("parts", "active"), [(1, 9001), (2, 257), (2, 40_001), (3, 5000), (5, 64)])
def test_chunks_in_turns_equal_the_twin(parts, active, share, rng):
    """Every row of the slab twice over; more chunks than cores, fewer, a last one that is no whole vector, and none that loses anybody."""
    capacity = -(-active // 64) * 64
    slab = rng.integers(0, 2**32, (17, capacity), dtype=np.uint32)
    table = wp.array(slab, dtype=wp.uint32, device="cpu")
    relay, barrier = (wp.zeros(words, dtype=int, device="cpu") for words in (RELAY, BARRIER))
    remove_chunks.module.load(wp.get_device("cpu"), 1)
    for _ in range(2):
        alive = np.zeros(capacity, np.int32)
        alive[:active] = rng.random(active) >= share
        counters = np.zeros(COUNTER_COUNT, np.int64)
        counters[ACTIVE] = active
        count, lives = wp.array(counters, dtype=wp.int64, device="cpu"), wp.array(alive, device="cpu")
        survivors = reference.compact(table.numpy()[:, :active].copy(), alive[:active])
        with ThreadPoolExecutor(parts) as crew:
            inputs = [parts, lives, count, table, relay, calls(), barrier]
            jobs = [crew.submit(wp.launch, remove_chunks, 1, [part, *inputs], device="cpu") for part in range(parts)]
        assert not [job.exception() for job in jobs if job.exception()]
        active = int(count.numpy()[LIVE])
        assert active == survivors.shape[1] and not relay.numpy().any(), "the words are as they were, for the next frame"
        assert np.array_equal(table.numpy()[:, :active], survivors)


def test_nobody_waits_for_a_core_that_gave_up(rng):
    """The second of two parts, whose first never comes: the barrier's word says so, and it goes on."""
    words = np.zeros(BARRIER, np.int32)
    words[ABANDONED] = 1
    counters = np.zeros(COUNTER_COUNT, np.int64)
    counters[ACTIVE] = 256
    slab = wp.array(rng.integers(0, 2**32, (3, 256), dtype=np.uint32), dtype=wp.uint32, device="cpu")
    inputs = [
        wp.ones(256, dtype=int, device="cpu"),
        wp.array(counters, dtype=wp.int64, device="cpu"),
        slab,
        wp.zeros(RELAY, dtype=int, device="cpu"),
        calls(),
    ]
    wp.launch(remove_chunks, 1, [1, 2, *inputs, wp.array(words, device="cpu")], device="cpu")
