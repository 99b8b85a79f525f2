"""Cloth: a sheet of points (i, j), number j·nx + i, whose springs lead to twelve neighbors at fixed steps, in the wind.

Springs 0 … 3 are structural, to (i ± 1, j) and (i, j ± 1); 4 … 7 shear, to (i ± 1, j ± 1); 8 … 11 bend, to (i ± 2, j) and
(i, j ± 2). Each point gathers them in this order by the formula of springs.py. The air acts on the velocity across the sheet alone:
the part of u − v along the normal n dies away by e^(−k h), k = c/ρ with the air's c [kg/(m²·s)] and the sheet's density ρ [kg/m²].
"""

import warp as wp

from warpsim.kernels.emission import Particles
from warpsim.kernels.flow import sample_flow
from warpsim.kernels.planar import read3, write3
from warpsim.kernels.primitive import FlowPrimitive
from warpsim.kernels.springs import spring_force

STEPS = ((1, 0), (-1, 0), (0, 1), (0, -1), (1, 1), (-1, -1), (1, -1), (-1, 1), (2, 0), (-2, 0), (0, 2), (0, -2))
SPRING_COUNT = len(STEPS)
THINNEST = wp.constant(1.0e-30)  # [m⁴]: a point whose surroundings have no area has no normal, and feels no wind


@wp.struct
class Sheet:
    nx: int
    ny: int
    step: wp.array[wp.vec2i]  # (12): to the neighbor, along i and j
    rest: wp.array[float]  # (12): rest length [m]
    stiffness: wp.array[float]  # (12) [N/m]
    damping: wp.array[float]  # (12) [N·s/m]
    inverse_mass: wp.array[float]  # (capacity) [1/kg]; 0 for a point that is pinned
    air: wp.array[float]  # (1): (1 − e^(−k h))/h [1/s], what the wind does within a substep
    flow: wp.array2d[FlowPrimitive]  # (moments, primitives): the wind


@wp.func
def sum_sheet(i: int, j: int, sheet: Sheet, position: wp.array2d[float], velocity: wp.array2d[float]) -> wp.vec3:
    """Return the sum of the forces of all springs of point (i, j) [N], in their order."""
    p = j * sheet.nx + i
    x = read3(position, p)
    v = read3(velocity, p)
    force = wp.vec3()
    for s in range(SPRING_COUNT):
        a = i + sheet.step[s][0]
        b = j + sheet.step[s][1]
        if a >= 0 and a < sheet.nx and b >= 0 and b < sheet.ny:
            q = b * sheet.nx + a
            force = force + spring_force(x, v, read3(position, q), read3(velocity, q), sheet.rest[s], sheet.stiffness[s], sheet.damping[s])
    return force


@wp.kernel(enable_backward=False)
def accumulate_cloth(first: int, sheet: Sheet, particles: Particles, internal_out: wp.array2d[float]):
    """Store what the springs do to every point, a = F/m [m/s²]; zero for one that is pinned."""
    p = first + wp.tid()
    if p < sheet.nx * sheet.ny:
        force = sum_sheet(p % sheet.nx, p // sheet.nx, sheet, particles.position, particles.velocity)
        write3(internal_out, p, force * sheet.inverse_mass[p])


@wp.func(inline=True)
def twice_area(x: wp.vec3, e: wp.vec3, ne: wp.vec3, n: wp.vec3, nw: wp.vec3, w: wp.vec3, sw: wp.vec3, s: wp.vec3, se: wp.vec3) -> wp.vec3:
    """Return twice the area vector of the cells round x, ∮ d × dd along their border, clamped to the rim.  Source: Stokes."""
    sum = wp.cross(e - x, ne - x) + wp.cross(ne - x, n - x) + wp.cross(n - x, nw - x) + wp.cross(nw - x, w - x)
    return sum + wp.cross(w - x, sw - x) + wp.cross(sw - x, s - x) + wp.cross(s - x, se - x) + wp.cross(se - x, e - x)


@wp.func(inline=True)
def wind_pull(area: wp.vec3, v: wp.vec3, u: wp.vec3, g: float) -> wp.vec3:
    """Return the acceleration by the air, g ((u − v)·n) n with n along the area vector [m/s²]; none without an area."""
    square = wp.dot(area, area)
    return area * (g * wp.dot(u - v, area) / wp.max(square, THINNEST))


@wp.func
def area_at(i: int, j: int, sheet: Sheet, position: wp.array2d[float]) -> wp.vec3:
    """Return twice the area vector of the cells round point (i, j) [m²]."""
    w = wp.max(i - 1, 0)
    e = wp.min(i + 1, sheet.nx - 1)
    n = wp.max(j - 1, 0) * sheet.nx
    m = j * sheet.nx
    s = wp.min(j + 1, sheet.ny - 1) * sheet.nx
    return twice_area(
        read3(position, m + i),
        read3(position, m + e),
        read3(position, n + e),
        read3(position, n + i),
        read3(position, n + w),
        read3(position, m + w),
        read3(position, s + w),
        read3(position, s + i),
        read3(position, s + e),
    )


@wp.kernel(enable_backward=False)
def accumulate_air(first: int, moment: int, sheet: Sheet, particles: Particles, internal_inout: wp.array2d[float]):
    """Add what the wind does to every point that is free [m/s²]."""
    p = first + wp.tid()
    if p < sheet.nx * sheet.ny and sheet.air[0] > 0.0 and sheet.inverse_mass[p] > 0.0:
        u = sample_flow(sheet.flow, moment, read3(particles.position, p))
        area = area_at(p % sheet.nx, p // sheet.nx, sheet, particles.position)
        pull = wind_pull(area, read3(particles.velocity, p), u, sheet.air[0])
        write3(internal_inout, p, read3(internal_inout, p) + pull)
