"""Lifetime: ages from the frame of birth, and the removal of the expired by stable compaction.

A particle's age is worked out from whole frames, never summed up, so it is exact however long it lives.
"""

import warp as wp

from warpsim.kernels.emission import ACTIVE, LIVE


@wp.func(inline=True)
def age_at(frame: int, birth_frame: int, birth_age: float, fps: float) -> float:
    """Return the age at a frame [s]; negative before birth."""
    return float(frame - birth_frame) / fps + birth_age


@wp.func(inline=True)
def active_step(age: float, dt: float, lifetime: float) -> float:
    """Return the part of a substep between birth and death [s]; age is that at the substep's end, so that one born there stays put."""
    return wp.clamp(wp.min(wp.min(age, lifetime - age + dt), lifetime), 0.0, dt)


@wp.kernel(enable_backward=False)
def advance_clock(first: int, fps: wp.float64, clock_inout: wp.array[wp.int64], start_time_out: wp.array[wp.float64]):
    """One thread. Begin a frame: its number, and the time at its beginning (frame − 1)/fps [s]."""
    frame = clock_inout[0] + wp.int64(1)
    clock_inout[0] = frame
    start_time_out[0] = wp.float64(frame - wp.int64(1)) / fps


@wp.kernel(enable_backward=False)
def scatter_survivors(
    first: int,
    counters: wp.array[wp.int64],
    alive: wp.array[int],
    order: wp.array[int],
    slab: wp.array2d[wp.uint32],
    scratch_out: wp.array2d[wp.uint32],
):
    """Move every word of a survivor to its place, if that is another; slab (rows, capacity), order = inclusive scan of alive."""
    i = first + wp.tid()
    if wp.int64(i) < counters[ACTIVE] and alive[i] == 1 and order[i] <= i:
        for row in range(slab.shape[0]):
            scratch_out[row, order[i] - 1] = slab[row, i]


@wp.kernel(enable_backward=False)
def scatter_back(
    first: int, counters: wp.array[wp.int64], order: wp.array[int], scratch: wp.array2d[wp.uint32], slab_out: wp.array2d[wp.uint32]
):
    """Copy those that moved back, so that addresses never change; whoever was before the first dead one, order[i] = i + 1, did not."""
    i = first + wp.tid()
    if wp.int64(i) < counters[LIVE] and order[i] <= i:
        for row in range(slab_out.shape[0]):
            slab_out[row, i] = scratch[row, i]


@wp.kernel(enable_backward=False)
def scan_survivors(first: int, order: wp.array[int], counters_inout: wp.array[wp.int64]):
    """One thread. The live count at the frame's end is the scan's value at the last active slot."""
    active = int(counters_inout[ACTIVE])
    survivors = int(0)
    if active > 0:
        survivors = order[active - 1]
    counters_inout[LIVE] = wp.int64(survivors)
