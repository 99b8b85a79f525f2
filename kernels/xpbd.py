"""XPBD: springs answered by moving their ends, one color of springs after the other, so that no two of a color share a point.

Symbols: n = (x_j − x_i)/|x_j − x_i|, C = |x_j − x_i| − r how far a spring is stretched [m], w = w_i + w_j, w_i = 1/m_i [1/kg],
h substep [s], κ = k h² [kg], the inverse of the paper's compliance α̃ = 1/(k h²): nothing is divided by k, and stiffness 0 is no
constraint. λ is the spring's pull times h² [kg m], 0 when a substep begins. Ends are moved by w_i Δλ n towards each other,
Δλ = (κ C − λ)/(1 + κ w), and their velocities changed by as much over h: the difference of two places would have lost the digits.
Then damping, an implicit step of its own: the speed u at which a spring grows longer becomes u/(1 + g w), g = c h [kg], by equal and
opposite impulses along the spring. Source: Macklin, Müller & Chentanez 2016; Macklin et al. 2019 (small steps).
"""

import warp as wp

from warpsim.kernels.cloth import STEPS, Sheet
from warpsim.kernels.elementary import mean_decay
from warpsim.kernels.emission import Particles
from warpsim.kernels.environment import Environment, drag_rate
from warpsim.kernels.planar import read3, write3
from warpsim.kernels.springs import SHORTEST, SpringTable

# The colors of a sheet in the order in which they act: which of the sheet's springs (kernels/cloth.py, STEPS), in which direction, and
# from which points, by the remainder of i (along a row) or j (down) mod 4. Springs ALONG stay within a block of columns, those ACROSS
# lead to the next, so that a native loop takes block by block through all colors. Of those DOWN, the first colors join points of four
# rows 4q … 4q + 3, the rest, from STRIP_COLORS on, those of rows 4q + 2 … 4q + 5: it takes such strips through several colors at once.
ALONG, ACROSS, DOWN = 0, 1, 2
COLUMNS = wp.constant(256)  # of a block
SHEET_COLORS = (
    (STEPS.index((1, 0)), ALONG, (0, 2)),
    (STEPS.index((1, 0)), ALONG, (1, 3)),
    (STEPS.index((2, 0)), ALONG, (0, 1)),
    (STEPS.index((2, 0)), ALONG, (2, 3)),
    (STEPS.index((1, 0)), ACROSS, (3,)),
    (STEPS.index((2, 0)), ACROSS, (2, 3)),
    (STEPS.index((0, 1)), DOWN, (0, 2)),
    (STEPS.index((1, 1)), DOWN, (0, 2)),
    (STEPS.index((-1, 1)), DOWN, (0, 2)),
    (STEPS.index((0, 1)), DOWN, (1,)),
    (STEPS.index((1, 1)), DOWN, (1,)),
    (STEPS.index((-1, 1)), DOWN, (1,)),
    (STEPS.index((0, 2)), DOWN, (0, 1)),
    (STEPS.index((0, 1)), DOWN, (3,)),
    (STEPS.index((1, 1)), DOWN, (3,)),
    (STEPS.index((-1, 1)), DOWN, (3,)),
    (STEPS.index((0, 2)), DOWN, (2, 3)),
)
STRIP_COLORS = 13


@wp.struct
class Projection:
    h: float  # substep [s]
    turns: int  # passes over all springs in a substep
    opening: int  # number of the first frame, in which nothing moves
    damped: wp.array[int]  # (1): 1 if any spring has damping; a sheet's kinds tell themselves
    begin: wp.array[int]  # (colors + 1): first place of each color in `order`; none for a sheet
    order: wp.array[int]  # (m): the springs color by color; none for a sheet
    piece: wp.array[wp.vec2i]  # (pieces): for native loops, first place and how many springs, negative where they are scattered
    first_piece: wp.array[int]  # (colors + 1): first piece of each color
    inverse_mass: wp.array[float]  # (capacity) [1/kg]; 0 for a point that is pinned
    response: wp.array[float]  # (capacity): the same, less what drag takes of an impulse within a substep [1/kg]


@wp.func(inline=True)
def spring_pull(xi: wp.vec3, xj: wp.vec3, r: float, kappa: float, w: float, multiplier: float) -> wp.vec4:
    """Return n Δλ and Δλ = (κ C − λ)/(1 + κ w) [kg m]; no direction where the ends coincide.  Source: Macklin et al. 2016, eq. 18."""
    d = xj - xi
    d2 = wp.dot(d, d)
    inverse = 1.0 / wp.sqrt(wp.max(d2, SHORTEST))
    change = (kappa * (d2 * inverse - r) - multiplier) / (1.0 + kappa * w)
    n = d * inverse
    return wp.vec4(n[0] * change, n[1] * change, n[2] * change, change)


@wp.func(inline=True)
def damping_impulse(xi: wp.vec3, vi: wp.vec3, xj: wp.vec3, vj: wp.vec3, g: float, w: float) -> wp.vec3:
    """Return n g u/(1 + g w), the impulse on i that takes u = n·(v_j − v_i) to u/(1 + g w) [kg m/s].  Source: backward Euler."""
    d = xj - xi
    n = d * (1.0 / wp.sqrt(wp.max(wp.dot(d, d), SHORTEST)))
    return n * (g * wp.dot(n, vj - vi) / (1.0 + g * w))


@wp.func
def moves(projection: Projection, clock: wp.array[wp.int64]) -> bool:
    """Return whether the network moves already; its motion begins at the end of the opening frame."""
    return clock[0] > wp.int64(projection.opening)


@wp.kernel(enable_backward=False)
def sample_responses(
    first: int,
    count: int,
    h: float,
    environment: wp.array[Environment],
    particles: Particles,
    inverse_mass: wp.array[float],
    response_out: wp.array[float],
):
    """Store φ(k h)/m with the drag rate k: a spring then acts as gravity does, and drag does not shift where points come to rest."""
    i = first + wp.tid()
    if i < count:
        k = drag_rate(environment[0].alpha, environment[0].viscosity, particles.radius[i], inverse_mass[i])
        response_out[i] = inverse_mass[i] * mean_decay(k * h)


@wp.func
def project_pair(
    i: int,
    j: int,
    r: float,
    k: float,
    place: int,
    turn: int,
    projection: Projection,
    multiplier_inout: wp.array[float],
    particles_inout: Particles,
):
    """Move the ends of a spring; λ, at its place, is kept from one pass of a substep to the next."""
    wi = projection.response[i]
    wj = projection.response[j]
    multiplier = float(0.0)
    if turn > 0:
        multiplier = multiplier_inout[place]
    xi = read3(particles_inout.position, i)
    xj = read3(particles_inout.position, j)
    pull = spring_pull(xi, xj, r, k * (projection.h * projection.h), wi + wj, multiplier)
    if projection.turns > 1:
        multiplier_inout[place] = multiplier + pull[3]
    towards = wp.vec3(pull[0], pull[1], pull[2])
    rate = 1.0 / projection.h
    write3(particles_inout.position, i, xi + towards * wi)
    write3(particles_inout.position, j, xj - towards * wj)
    write3(particles_inout.velocity, i, read3(particles_inout.velocity, i) + (towards * wi) * rate)
    write3(particles_inout.velocity, j, read3(particles_inout.velocity, j) - (towards * wj) * rate)


@wp.func
def damp_pair(i: int, j: int, c: float, projection: Projection, particles_inout: Particles):
    """Slow down how fast the ends of a spring part."""
    wi = projection.inverse_mass[i]
    wj = projection.inverse_mass[j]
    vi = read3(particles_inout.velocity, i)
    vj = read3(particles_inout.velocity, j)
    xi = read3(particles_inout.position, i)
    impulse = damping_impulse(xi, vi, read3(particles_inout.position, j), vj, c * projection.h, wi + wj)
    write3(particles_inout.velocity, i, vi + impulse * wi)
    write3(particles_inout.velocity, j, vj - impulse * wj)


@wp.func
def project_spring(
    place: int, turn: int, projection: Projection, table: SpringTable, multiplier_inout: wp.array[float], particles_inout: Particles
):
    """Move the ends of the spring at a place of the order."""
    e = projection.order[place]
    ends = table.ends[e]
    project_pair(ends[0], ends[1], table.rest[e], table.stiffness[e], place, turn, projection, multiplier_inout, particles_inout)


@wp.func
def damp_spring(place: int, projection: Projection, table: SpringTable, particles_inout: Particles):
    """Slow down the spring at a place of the order."""
    e = projection.order[place]
    damp_pair(table.ends[e][0], table.ends[e][1], table.damping[e], projection, particles_inout)


@wp.kernel(enable_backward=False)
def project_springs(
    first: int,
    color: int,
    turn: int,
    projection: Projection,
    table: SpringTable,
    clock: wp.array[wp.int64],
    multiplier_inout: wp.array[float],
    particles_inout: Particles,
):
    """Move the ends of the springs of one color."""
    place = projection.begin[color] + (first + wp.tid())
    if moves(projection, clock):
        project_spring(place, turn, projection, table, multiplier_inout, particles_inout)


@wp.kernel(enable_backward=False)
def project_colors(
    first: int,
    color: int,
    end: int,
    turn: int,
    projection: Projection,
    table: SpringTable,
    clock: wp.array[wp.int64],
    multiplier_inout: wp.array[float],
    particles_inout: Particles,
):
    """Move the ends of the springs of a run of colors, one after the other: colors of few springs are not worth a launch each."""
    if moves(projection, clock):
        for place in range(projection.begin[color + first], projection.begin[end]):
            project_spring(place, turn, projection, table, multiplier_inout, particles_inout)


@wp.kernel(enable_backward=False)
def damp_springs(first: int, color: int, projection: Projection, table: SpringTable, clock: wp.array[wp.int64], particles_inout: Particles):
    """Slow down how fast the springs of one color grow longer."""
    place = projection.begin[color] + (first + wp.tid())
    if projection.damped[0] == 1 and moves(projection, clock):
        damp_spring(place, projection, table, particles_inout)


@wp.kernel(enable_backward=False)
def damp_colors(
    first: int, color: int, end: int, projection: Projection, table: SpringTable, clock: wp.array[wp.int64], particles_inout: Particles
):
    """Slow down how fast the springs of a run of colors grow longer, one after the other."""
    if projection.damped[0] == 1 and moves(projection, clock):
        for place in range(projection.begin[color + first], projection.begin[end]):
            damp_spring(place, projection, table, particles_inout)


@wp.func
def sheet_end(p: int, step: int, direction: int, remainders: int, sheet: Sheet) -> int:
    """Return the other end of the spring of a color that begins at point p, −1 if there is none; the remainders are bits."""
    i = p % sheet.nx
    j = p // sheet.nx
    a = i + sheet.step[step][0]
    b = j + sheet.step[step][1]
    told = wp.where(direction == DOWN, j, i)
    crossing = wp.where(i // COLUMNS == a // COLUMNS, ALONG, ACROSS)
    within = p < sheet.nx * sheet.ny and a >= 0 and a < sheet.nx and b < sheet.ny
    if within and (remainders >> (told & 3)) & 1 == 1 and (direction == DOWN or direction == crossing):
        return b * sheet.nx + a
    return -1


@wp.kernel(enable_backward=False)
def project_sheet(
    first: int,
    step: int,
    direction: int,
    remainders: int,
    turn: int,
    projection: Projection,
    sheet: Sheet,
    clock: wp.array[wp.int64],
    multiplier_inout: wp.array[float],
    particles_inout: Particles,
):
    """Move the ends of the springs of one color of a sheet."""
    p = first + wp.tid()
    q = sheet_end(p, step, direction, remainders, sheet)
    k = sheet.stiffness[step]
    if q >= 0 and k > 0.0 and moves(projection, clock):
        place = step * sheet.nx * sheet.ny + p
        project_pair(p, q, sheet.rest[step], k, place, turn, projection, multiplier_inout, particles_inout)


@wp.kernel(enable_backward=False)
def damp_sheet(
    first: int,
    step: int,
    direction: int,
    remainders: int,
    projection: Projection,
    sheet: Sheet,
    clock: wp.array[wp.int64],
    particles_inout: Particles,
):
    """Slow down how fast the springs of one color of a sheet grow longer."""
    p = first + wp.tid()
    q = sheet_end(p, step, direction, remainders, sheet)
    c = sheet.damping[step]
    if q >= 0 and c > 0.0 and moves(projection, clock):
        damp_pair(p, q, c, projection, particles_inout)
