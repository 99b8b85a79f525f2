"""Velocities on a grid: trilinear sampling, and the copy of a sparse volume into a dense grid.

Symbols: x point [m], h spacing [m], s = (x − corner)/h place in the grid [1], n nodes along an axis, f fraction of a cell.
"""

import warp as wp

from warpsim.kernels.primitive import FlowPrimitive

ZERO, CLAMP = range(2)
OUTSIDES = {"zero": ZERO, "clamp": CLAMP}


@wp.func(inline=True)
def cell_of(s: float, n: int) -> int:
    """Return the node before a place within the grid, the last but one at most."""
    return wp.max(wp.min(int(s), n - 2), 0)


@wp.func(inline=True)
def within(s: float, n: int) -> float:
    """Return the nearest place within the grid; of what is not a number, the first."""
    return wp.min(wp.where(s > 0.0, s, 0.0), float(n - 1))


@wp.func(inline=True)
def sample_grid(p: FlowPrimitive, x: wp.vec3) -> wp.vec3:
    """Return v = Σ (1 − |s₁ − i|)(1 − |s₂ − j|)(1 − |s₃ − k|) v_ijk over the eight nodes around x, times the scale; outside as told."""
    s = wp.cw_mul(x - p.center, p.inverse_spacing)
    n = wp.vec3i(p.values.shape[0], p.values.shape[1], p.values.shape[2])
    q = wp.vec3(within(s[0], n[0]), within(s[1], n[1]), within(s[2], n[2]))
    i = cell_of(q[0], n[0])
    j = cell_of(q[1], n[1])
    k = cell_of(q[2], n[2])
    f = q - wp.vec3(float(i), float(j), float(k))
    right = wp.min(i + 1, n[0] - 1)
    above = wp.min(j + 1, n[1] - 1)
    before = wp.min(k + 1, n[2] - 1)
    near = wp.lerp(
        wp.lerp(p.values[i, j, k], p.values[right, j, k], f[0]), wp.lerp(p.values[i, above, k], p.values[right, above, k], f[0]), f[1]
    )
    far = wp.lerp(
        wp.lerp(p.values[i, j, before], p.values[right, j, before], f[0]),
        wp.lerp(p.values[i, above, before], p.values[right, above, before], f[0]),
        f[1],
    )
    inside = s[0] == q[0] and s[1] == q[1] and s[2] == q[2]
    return wp.lerp(near, far, f[2]) * wp.where(inside or p.outside == CLAMP, p.strength[0], 0.0)


@wp.kernel(enable_backward=False)
def gather_voxels(first: int, volume: wp.uint64, corner: wp.vec3i, values_out: wp.array3d[wp.vec3]):
    """Copy the voxels of a volume from index `corner` on into a dense grid (nx, ny, nz); those it has not are its background."""
    element = first + wp.tid()
    k = element % values_out.shape[2]
    j = (element // values_out.shape[2]) % values_out.shape[1]
    i = element // (values_out.shape[1] * values_out.shape[2])
    values_out[i, j, k] = wp.volume_lookup_v(volume, corner[0] + i, corner[1] + j, corner[2] + k)
