"""Tearing: springs that break for good once they are strained beyond what they stand.

A spring with rest length r is torn as soon as |d| > (1 + ε) r at the end of a substep, ε being the strain that it stands. A torn spring
has no stiffness and no damping, wherever these are kept: in the table of springs and in both entries of the packed network.
"""

import warp as wp

from warpsim.kernels.cloth import Sheet, cell_area, wind_pull
from warpsim.kernels.emission import Particles
from warpsim.kernels.flow import sample_flow
from warpsim.kernels.planar import read3, write3
from warpsim.kernels.points import started
from warpsim.kernels.springs import Network, SpringTable


@wp.struct
class Tearing:
    spring_count: int
    opening: int  # number of the first frame, in which nothing moves
    stretch: wp.array[float]  # (1): length over rest length that a spring stands, 1 + ε [1]
    entry: wp.array[wp.vec2i]  # (m): places of each spring in the packed network, at its one end and at the other
    torn: wp.array[int]  # (m): 1 where a spring is torn


@wp.func(inline=True)
def overstrained(xi: wp.vec3, xj: wp.vec3, r: float, stretch: float) -> bool:
    """Return whether |d| > (1 + ε) r; what has no rest length has no strain.  Source: definition of engineering strain."""
    d = xj - xi
    return r > 0.0 and wp.dot(d, d) > (stretch * r) * (stretch * r)


@wp.kernel(enable_backward=False)
def mark_torn(
    first: int,
    clock: wp.array[wp.int64],
    tearing_inout: Tearing,
    particles: Particles,
    table_inout: SpringTable,
    network_inout: Network,
):
    """Tear every spring that is strained too far, and let it pull no more."""
    e = first + wp.tid()
    if e < tearing_inout.spring_count and started(clock, tearing_inout.opening):
        ends = table_inout.ends[e]
        xi = read3(particles.position, ends[0])
        xj = read3(particles.position, ends[1])
        if tearing_inout.torn[e] == 0 and overstrained(xi, xj, table_inout.rest[e], tearing_inout.stretch[0]):
            tearing_inout.torn[e] = 1
            table_inout.stiffness[e] = 0.0
            table_inout.damping[e] = 0.0
            for end in range(2):
                network_inout.stiffness[tearing_inout.entry[e][end]] = 0.0
                network_inout.damping[tearing_inout.entry[e][end]] = 0.0


@wp.func
def intact(torn: wp.array[int], e: int, f: int) -> bool:
    """Return whether two springs are still whole; where none can be torn there is nothing to look up."""
    if torn.shape[0] == 0:
        return True
    return torn[e] == 0 and torn[f] == 0


@wp.func
def cell_intact(torn: wp.array[int], i: int, j: int, nx: int, ny: int) -> bool:
    """Return whether the four sides of the cell are whole whose first point is (i, j); springs are numbered as networks.py has them."""
    e = j * (nx - 1) + i
    f = (nx - 1) * ny + j * nx + i
    return intact(torn, e, e + nx - 1) and intact(torn, f, f + 1)


@wp.func
def torn_area_at(i: int, j: int, torn: wp.array[int], sheet: Sheet, position: wp.array2d[float]) -> wp.vec3:
    """Return twice the area vector of the cells round point (i, j) that are whole [m²], in the order of cloth.py."""
    area = wp.vec3()
    for b in range(wp.max(j - 1, 0), wp.min(j, sheet.ny - 2) + 1):
        for a in range(wp.max(i - 1, 0), wp.min(i, sheet.nx - 2) + 1):
            if cell_intact(torn, a, b, sheet.nx, sheet.ny):
                p = b * sheet.nx + a
                q = p + sheet.nx
                area = area + cell_area(read3(position, p), read3(position, p + 1), read3(position, q + 1), read3(position, q))
    return area


@wp.kernel(enable_backward=False)
def accumulate_torn_air(
    first: int, moment: int, torn: wp.array[int], sheet: Sheet, particles: Particles, internal_inout: wp.array2d[float]
):
    """Add what the wind does to every point of a sheet that may be torn [m/s²]: cells with a torn side have no area."""
    p = first + wp.tid()
    if p < sheet.nx * sheet.ny and sheet.air[moment, 0] > 0.0 and sheet.inverse_mass[p] > 0.0:
        u = sample_flow(sheet.flow, moment, read3(particles.position, p))
        area = torn_area_at(p % sheet.nx, p // sheet.nx, torn, sheet, particles.position)
        a = read3(internal_inout, p)
        pull = wind_pull(area, read3(particles.velocity, p) + a * sheet.air[moment, 1], u, sheet.air[moment, 0])
        write3(internal_inout, p, a + pull)
