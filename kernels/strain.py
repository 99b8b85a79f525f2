"""Strain limit: after every substep springs that are too long are shortened, in sweeps over all of them until none is.

Symbols: d = x_j − x_i, n its direction, r rest length [m], ε the strain that is allowed, w = 1/m_i + 1/m_j [1/kg], h substep [s],
T = (1 + 0.9 ε) r the length that a spring is brought to if it is longer, λ ≥ 0 what has pulled it there in this substep [kg m]. A sweep
adds to each Δλ = max((|d| − T)/w, −λ), color by color, so that no two springs that are treated at once share a point, moves the ends
towards each other by n Δλ/m and changes their velocities by as much over h. Sweeps end when none is longer than (1 + ε) r. A substep
begins with half of the λ of the one before: much of what holds up a sheet that hangs is known, and what is too much of it is given
back, down to λ = 0. Equal and opposite impulses along n leave momentum alone.
Where many sweeps were not enough, the last of them project the places onto what is allowed, spring by spring, and leave velocities
alone: an allowed place of all points is a convex set, so that each such step comes closer to all of it.
Source: Provot 1995, Deformation constraints in a mass-spring model; λ as in Macklin et al. 2016, without compliance; begun with the
last λ as in Catto 2005, Iterative dynamics with temporal coherence; projections as in Bregman 1965.
"""

import warp as wp

from warpsim.kernels.emission import Particles
from warpsim.kernels.planar import read3, write3
from warpsim.kernels.points import started
from warpsim.kernels.springs import SHORTEST, SpringTable

LEAST = wp.constant(4)  # sweeps, for the same reason
AIM = wp.constant(0.9)  # of the strain allowed: sweeps need not be exact
PATIENCE = wp.constant(64)  # sweeps after which places alone are moved, not velocities, and those of springs that still are too long
HASTE = wp.constant(0.005)  # by which each of these sweeps aims lower: what is good enough is then round what is aimed at, and is reached
KEPT = wp.constant(0.5)  # of λ, from substep to substep: with more of it errors live on, and a sheet that hangs still would shiver
FREE = wp.constant(1.0e15)  # [m]: the limit of a spring without rest length, which has no strain; its square is a float32 yet


@wp.struct
class StrainLimit:
    h: float  # substep [s]
    opening: int  # number of the first frame, in which nothing moves
    most: int  # sweeps in a substep
    strain: wp.array[float]  # (1): ε, what springs are allowed [1]
    aim: wp.array[float]  # (1): what part of it they are brought to in this sweep [1]
    begin: wp.array[int]  # (colors + 1): first place of each color in `order`
    order: wp.array[int]  # (q): the limited springs color by color
    inverse_mass: wp.array[float]  # (capacity) [1/kg]; 0 for a point that is pinned
    multiplier: wp.array[float]  # (q): λ of each place of the order [kg m]
    over: wp.array[int]  # (1): 1 once a spring was found that is too long
    going: wp.array[int]  # (1): 1 while another sweep is wanted
    turn: wp.array[int]  # (1): sweeps of this substep so far
    kept: wp.array[float]  # (1): what part of its λ the substep before has handed on [1]


@wp.func(inline=True)
def longest(r: float, strain: float) -> float:
    """Return (1 + ε) r, how long a spring may be [m]; one without rest length as long as it likes.  Source: engineering strain."""
    return wp.where(r > 0.0, (1.0 + strain) * r, FREE)


@wp.func(inline=True)
def stretched_beyond(xi: wp.vec3, xj: wp.vec3, reach: float) -> bool:
    """Return whether |d| > reach [m].  Source: Pythagoras."""
    d = xj - xi
    return wp.dot(d, d) > reach * reach


@wp.func(inline=True)
def limit_pull(xi: wp.vec3, xj: wp.vec3, target: float, w: float, multiplier: float) -> wp.vec4:
    """Return n Δλ and Δλ = max((|d| − T)/w, −λ) [kg m].  Source: Macklin et al. 2016, eq. 18, for a limit that does not give way."""
    d = xj - xi
    d2 = wp.dot(d, d)
    inverse = 1.0 / wp.sqrt(wp.max(d2, SHORTEST))
    change = wp.max((d2 * inverse - target) / w, -multiplier)
    n = d * inverse
    return wp.vec4(n[0] * change, n[1] * change, n[2] * change, change)


@wp.func(inline=True)
def remembered(multiplier: float, kept: float) -> float:
    """Return what a substep begins with of the λ of the one before [kg m]; of one whose sweeps did not suffice, nothing is known."""
    return kept * multiplier


@wp.func(inline=True)
def known_pull(xi: wp.vec3, xj: wp.vec3, multiplier: float) -> wp.vec3:
    """Return n λ [kg m], a known pull along the spring as it is now.  Source: Catto 2005."""
    d = xj - xi
    return d * (multiplier / wp.sqrt(wp.max(wp.dot(d, d), SHORTEST)))


@wp.func
def pull_ends(i: int, j: int, towards: wp.vec3, rate: float, limit: StrainLimit, particles_inout: Particles):
    """Move two points towards each other by a pull [kg m], and change their velocities by `rate` [1/s] as much."""
    a = towards * limit.inverse_mass[i]
    b = towards * limit.inverse_mass[j]
    write3(particles_inout.position, i, read3(particles_inout.position, i) + a)
    write3(particles_inout.position, j, read3(particles_inout.position, j) - b)
    write3(particles_inout.velocity, i, read3(particles_inout.velocity, i) + a * rate)
    write3(particles_inout.velocity, j, read3(particles_inout.velocity, j) - b * rate)


@wp.func
def pull_again(place: int, limit_inout: StrainLimit, table: SpringTable, particles_inout: Particles):
    """Pull at the ends of the spring at a place of the order as the substep before ended with."""
    ends = table.ends[limit_inout.order[place]]
    known = limit_inout.multiplier[place]
    if known > 0.0:
        pull = remembered(known, limit_inout.kept[0])
        limit_inout.multiplier[place] = pull
        towards = known_pull(read3(particles_inout.position, ends[0]), read3(particles_inout.position, ends[1]), pull)
        pull_ends(ends[0], ends[1], towards, 1.0 / limit_inout.h, limit_inout, particles_inout)


@wp.func
def shorten_spring(place: int, limit_inout: StrainLimit, table: SpringTable, particles_inout: Particles):
    """Pull at the ends of the spring at a place of the order as far as it is too long; late sweeps only move those that still are."""
    e = limit_inout.order[place]
    i = table.ends[e][0]
    j = table.ends[e][1]
    xi = read3(particles_inout.position, i)
    xj = read3(particles_inout.position, j)
    w = limit_inout.inverse_mass[i] + limit_inout.inverse_mass[j]
    strain = limit_inout.strain[0]
    known = limit_inout.multiplier[place]
    target = longest(table.rest[e], strain * limit_inout.aim[0])
    if limit_inout.turn[0] >= PATIENCE:
        if stretched_beyond(xi, xj, longest(table.rest[e], strain)):
            pull = limit_pull(xi, xj, target, w, 0.0)
            pull_ends(i, j, wp.vec3(pull[0], pull[1], pull[2]), 0.0, limit_inout, particles_inout)
    elif known > 0.0 or stretched_beyond(xi, xj, target):
        pull = limit_pull(xi, xj, target, w, known)
        limit_inout.multiplier[place] = known + pull[3]
        pull_ends(i, j, wp.vec3(pull[0], pull[1], pull[2]), 1.0 / limit_inout.h, limit_inout, particles_inout)


@wp.kernel(enable_backward=False)
def open_sweeps(first: int, clock: wp.array[wp.int64], limit_inout: StrainLimit):
    """Begin a substep: one sweep is wanted, once the motion has begun."""
    limit_inout.going[first] = wp.where(started(clock, limit_inout.opening), 1, 0)
    limit_inout.kept[first] = wp.where(limit_inout.turn[first] < limit_inout.most, KEPT, 0.0)
    limit_inout.turn[first] = 0
    limit_inout.aim[first] = AIM


@wp.kernel(enable_backward=False)
def mark_overlong(first: int, limit_inout: StrainLimit, table: SpringTable, particles: Particles):
    """Note whether any spring is longer than it may be."""
    place = first + wp.tid()
    if place < limit_inout.order.shape[0]:
        e = limit_inout.order[place]
        xi = read3(particles.position, table.ends[e][0])
        xj = read3(particles.position, table.ends[e][1])
        if stretched_beyond(xi, xj, longest(table.rest[e], limit_inout.strain[0])):
            limit_inout.over[0] = 1


@wp.kernel(enable_backward=False)
def choose_sweep(first: int, limit_inout: StrainLimit):
    """Decide whether another sweep is wanted: something is too long, and not all sweeps are used up."""
    if limit_inout.going[first] == 1:
        turn = limit_inout.turn[first] + 1
        wanted = limit_inout.over[first] == 1 or turn < LEAST
        limit_inout.going[first] = wp.where(wanted and turn < limit_inout.most, 1, 0)
        limit_inout.turn[first] = turn
        limit_inout.aim[first] = AIM - HASTE * float(wp.max(turn + 1 - PATIENCE, 0))
    limit_inout.over[first] = 0


@wp.func
def project_place(place: int, begins: int, limit_inout: StrainLimit, table: SpringTable, particles_inout: Particles):
    """Pull at the ends of the spring at a place of the order, as a substep begins or in a sweep."""
    if begins == 1:
        pull_again(place, limit_inout, table, particles_inout)
    else:
        shorten_spring(place, limit_inout, table, particles_inout)


@wp.kernel(enable_backward=False)
def project_springs(first: int, color: int, begins: int, limit_inout: StrainLimit, table: SpringTable, particles_inout: Particles):
    """Pull at the ends of the springs of one color."""
    if limit_inout.going[0] == 1:
        project_place(limit_inout.begin[color] + (first + wp.tid()), begins, limit_inout, table, particles_inout)


@wp.kernel(enable_backward=False)
def project_colors(first: int, color: int, end: int, begins: int, limit_inout: StrainLimit, table: SpringTable, particles_inout: Particles):
    """Pull at the ends of the springs of a run of colors, one after the other: colors of few springs are not worth a launch each."""
    if limit_inout.going[0] == 1:
        for place in range(limit_inout.begin[color + first], limit_inout.begin[end]):
            project_place(place, begins, limit_inout, table, particles_inout)
