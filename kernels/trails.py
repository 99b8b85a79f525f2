"""Trails: the last places of each particle, in a ring of rows that moves with it through compaction."""

import warp as wp

from warpsim.kernels.emission import ACTIVE, Particles
from warpsim.kernels.planar import read3
from warpsim.kernels.render import Box, quantize


@wp.kernel(enable_backward=False)
def advance_trails(
    first: int, every: int, clock: wp.array[wp.int64], counters: wp.array[wp.int64], particles: Particles, trail_out: wp.array2d[float]
):
    """Note where each particle is: trail (3 length, capacity) [m], a new place every so many frames; a newborn's trail is one point."""
    i = first + wp.tid()
    if wp.int64(i) < counters[ACTIVE]:
        frame = int(clock[0])
        length = trail_out.shape[0] // 3
        x = read3(particles.position, i)
        cycle = every * length
        newest = ((frame % cycle + cycle) % cycle) // every  # frames of a prewarm are negative
        for place in range(length):
            if place == newest or particles.birth_frame[i] == frame:
                for axis in range(3):
                    trail_out[3 * place + axis, i] = x[axis]


@wp.kernel(enable_backward=False)
def splat_trails(first: int, chosen: wp.array[int], newest: int, box: Box, trail: wp.array2d[float], place_out: wp.array3d[wp.uint32]):
    """Pack the trails of chosen particles (all if empty), oldest place first: x y z as 16-bit steps of the box, (count, length, 2)."""
    j = first + wp.tid()
    i = j
    if chosen.shape[0] > 0:
        i = chosen[j]
    length = trail.shape[0] // 3
    for k in range(length):
        place = (newest + 1 + k) % length
        x = wp.vec3(trail[3 * place, i], trail[3 * place + 1, i], trail[3 * place + 2, i])
        steps = wp.cw_mul(x - box.low, box.to_steps)
        place_out[j, k, 0] = quantize(steps[0]) | (quantize(steps[1]) << wp.uint32(16))
        place_out[j, k, 1] = quantize(steps[2])
