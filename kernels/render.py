"""Rendering: particles as words that a viewer draws without further work: quantized place, size and color."""

import warp as wp

from warpsim.kernels.emission import Particles
from warpsim.kernels.lifetime import age_at
from warpsim.kernels.planar import read3


@wp.struct
class Box:
    low: wp.vec3  # corner [m]
    to_steps: wp.vec3  # 65535/extent [1/m]; 0 along an axis without extent


@wp.func
def quantize(value: float) -> wp.uint32:
    """Return the nearest of the 65536 steps."""
    return wp.uint32(wp.clamp(value + 0.5, 0.0, 65535.0))


@wp.kernel(enable_backward=False)
def splat_points(
    first: int,
    chosen: wp.array[int],
    frame: int,
    fps: float,
    particles: Particles,
    box: Box,
    size: wp.array[float],
    color: wp.array[wp.uint32],
    place_out: wp.array2d[wp.uint32],
    color_out: wp.array[wp.uint32],
):
    """Pack chosen particles: x y z and size as four 16-bit words (count, 2), color as rgba bytes; size [0, 1] and color by age/lifetime."""
    j = first + wp.tid()
    i = chosen[j]
    steps = wp.cw_mul(read3(particles.position, i) - box.low, box.to_steps)
    life = age_at(frame, particles.birth_frame[i], particles.birth_age[i], fps) / particles.lifetime[i]
    k = wp.clamp(int(life * float(size.shape[0])), 0, size.shape[0] - 1)
    place_out[j, 0] = quantize(steps[0]) | (quantize(steps[1]) << wp.uint32(16))
    place_out[j, 1] = quantize(steps[2]) | (quantize(size[k] * 65535.0) << wp.uint32(16))
    color_out[j] = color[k]
