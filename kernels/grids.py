"""Velocities on a grid: trilinear sampling, and the copy of a sparse volume into a dense grid.

Symbols: x point [m], h spacing [m], s = (x − corner)/h place in the grid [1], n nodes along an axis, f fraction of a cell.
"""

import warp as wp

from warpsim.kernels.primitive import FlowPrimitive

ZERO, CLAMP = range(2)
OUTSIDES = {"zero": ZERO, "clamp": CLAMP}


@wp.func(inline=True)
def within(s: float, n: int) -> float:
    """Return the nearest place within the grid; of what is not a number, the first."""
    return wp.min(wp.where(s > 0.0, s, 0.0), float(n - 1))


@wp.func(inline=True)
def node(values: wp.array[float], place: int) -> wp.vec3:
    """Return the velocity whose first component is at a place of the flat array [m/s]."""
    return wp.vec3(values[place], values[place + 1], values[place + 2])


@wp.func(inline=True)
def sample_grid(p: FlowPrimitive, x: wp.vec3) -> wp.vec3:
    """Return v = Σ (1 − |s₁ − i|)(1 − |s₂ − j|)(1 − |s₃ − k|) v_ijk over the eight nodes around x, times the scale; outside as told."""
    s = wp.cw_mul(x - p.center, p.inverse_spacing)
    q = wp.vec3(within(s[0], p.nodes[0]), within(s[1], p.nodes[1]), within(s[2], p.nodes[2]))
    i = wp.min(int(q[0]), p.nodes[0] - 2)
    j = wp.min(int(q[1]), p.nodes[1] - 2)
    k = wp.min(int(q[2]), p.nodes[2] - 2)
    f = q - wp.vec3(float(i), float(j), float(k))
    above = 3 * p.nodes[2]  # from a node to the next in y, and in x
    right = above * p.nodes[1]
    a = i * right + j * above + 3 * k
    b = a + 3
    near = wp.lerp(
        wp.lerp(node(p.values, a), node(p.values, a + right), f[0]),
        wp.lerp(node(p.values, a + above), node(p.values, a + above + right), f[0]),
        f[1],
    )
    far = wp.lerp(
        wp.lerp(node(p.values, b), node(p.values, b + right), f[0]),
        wp.lerp(node(p.values, b + above), node(p.values, b + above + right), f[0]),
        f[1],
    )
    inside = float(s[0] == q[0]) * float(s[1] == q[1]) * float(s[2] == q[2])
    return wp.lerp(near, far, f[2]) * wp.where(p.outside == CLAMP, p.strength[0], p.strength[0] * inside)


@wp.kernel(enable_backward=False)
def gather_voxels(first: int, volume: wp.uint64, corner: wp.vec3i, values_out: wp.array3d[wp.vec3]):
    """Copy the voxels of a volume from index `corner` on into a dense grid (nx, ny, nz); those it has not are its background."""
    element = first + wp.tid()
    k = element % values_out.shape[2]
    j = (element // values_out.shape[2]) % values_out.shape[1]
    i = element // (values_out.shape[1] * values_out.shape[2])
    values_out[i, j, k] = wp.volume_lookup_v(volume, corner[0] + i, corner[1] + j, corner[2] + k)
