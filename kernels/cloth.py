"""Cloth: a sheet of points (i, j), number j·nx + i, whose springs lead to twelve neighbors at fixed steps, in the wind.

Structural springs lead to (i ± 1, j) and (i, j ± 1), shear to (i ± 1, j ± 1), bend to (i ± 2, j) and (i, j ± 2). Each point sums them
in the order of STEPS by the formula of springs.py: what comes from the rows above, what is within its row, what comes from below. The
native loop works out every spring once, row by row, and adds it to both ends in this order (cloth_loops.py). The air acts on the velocity
across the sheet alone: the part of u − v along the normal n dies away by e^(−k h), k = c/ρ with the air's c [kg/(m²·s)] and the sheet's
density ρ [kg/m²].
"""

import warp as wp

from warpsim.kernels.emission import Particles
from warpsim.kernels.flow import sample_flow
from warpsim.kernels.planar import read3, write3
from warpsim.kernels.primitive import FlowPrimitive
from warpsim.kernels.springs import spring_force

STEPS = ((0, -2), (0, -1), (-1, -1), (1, -1), (1, 0), (-1, 0), (2, 0), (-2, 0), (0, 1), (1, 1), (-1, 1), (0, 2))
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
    air: wp.array2d[float]  # (moments, 2): rate at which the wind acts [1/s]; for how long the springs have pulled before [s]
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


@wp.func(inline=True)
def cell_area(a: wp.vec3, b: wp.vec3, c: wp.vec3, d: wp.vec3) -> wp.vec3:
    """Return twice the area vector of a cell with corners a, b, c, d in turn, ∮ x × dx = (b − d) × (a − c).  Source: Stokes."""
    return wp.cross(b - d, a - c)


@wp.func(inline=True)
def wind_pull(area: wp.vec3, v: wp.vec3, u: wp.vec3, g: float) -> wp.vec3:
    """Return the acceleration by the air, g ((u − v)·n) n with n along the area vector [m/s²]; none without an area."""
    square = wp.dot(area, area)
    return area * (g * wp.dot(u - v, area) / wp.max(square, THINNEST))


@wp.func
def area_at(i: int, j: int, sheet: Sheet, position: wp.array2d[float]) -> wp.vec3:
    """Return twice the area vector of the cells round point (i, j) [m²], those above before those below, left before right."""
    area = wp.vec3()
    for b in range(wp.max(j - 1, 0), wp.min(j, sheet.ny - 2) + 1):
        for a in range(wp.max(i - 1, 0), wp.min(i, sheet.nx - 2) + 1):
            p = b * sheet.nx + a
            q = p + sheet.nx
            area = area + cell_area(read3(position, p), read3(position, p + 1), read3(position, q + 1), read3(position, q))
    return area


@wp.func
def sheet_air(i: int, j: int, moment: int, sheet: Sheet, particles: Particles, a: wp.vec3) -> wp.vec3:
    """Return what the wind does to point (i, j), which springs pull by a [m/s²]; nothing to one that is pinned."""
    p = j * sheet.nx + i
    if not (sheet.air[moment, 0] > 0.0 and sheet.inverse_mass[p] > 0.0):
        return wp.vec3()
    u = sample_flow(sheet.flow, moment, read3(particles.position, p))
    v = read3(particles.velocity, p) + a * sheet.air[moment, 1]
    return wind_pull(area_at(i, j, sheet, particles.position), v, u, sheet.air[moment, 0])


@wp.func
def sheet_pull(i: int, j: int, moment: int, sheet: Sheet, particles: Particles) -> wp.vec3:
    """Return what springs and wind do to point (i, j), a = F/m + wind [m/s²]."""
    a = sum_sheet(i, j, sheet, particles.position, particles.velocity) * sheet.inverse_mass[j * sheet.nx + i]
    return a + sheet_air(i, j, moment, sheet, particles, a)


@wp.kernel(enable_backward=False)
def accumulate_cloth(first: int, moment: int, sheet: Sheet, particles: Particles, internal_out: wp.array2d[float]):
    """Store what springs and wind do to every point [m/s²]; zero for one that is pinned."""
    p = first + wp.tid()
    if p < sheet.nx * sheet.ny:
        write3(internal_out, p, sheet_pull(p % sheet.nx, p // sheet.nx, moment, sheet, particles))


@wp.kernel(enable_backward=False)
def accumulate_air(first: int, moment: int, sheet: Sheet, particles: Particles, internal_out: wp.array2d[float]):
    """Store what the wind alone does to every point [m/s²]."""
    p = first + wp.tid()
    if p < sheet.nx * sheet.ny:
        write3(internal_out, p, sheet_air(p % sheet.nx, p // sheet.nx, moment, sheet, particles, wp.vec3()))
