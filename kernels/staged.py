"""Staged methods of networks: Runge and Kutta's, Heun's and Adams', with everything that acts asked for anew at every stage.

Symbols: x₀, v₀ where the substep found a point; N its drive [m/s²], all that accelerates it but its own drag −k v: gravity, forces, k u of
the flow, and what acts within the network, which depends on x and v of the neighbors. A stage works out N at the present x, v of all
points; then each point moves alone. Adams' methods and Heun's move exactly under a drive that is a polynomial in time (exponential.py).
Runge and Kutta's is the exponential one of Cox and Matthews with the drag as its linear part: without drag it is Kutta's.

A point that has met a collider forgets its past: it takes the drives that there are since, with one alone as kick and drift.
"""

import warp as wp

from warpsim.kernels.emission import Particles
from warpsim.kernels.environment import Environment, drag_rate, sample_felt_acceleration
from warpsim.kernels.exponential import GLIDES32
from warpsim.kernels.flow import sample_flow
from warpsim.kernels.integration import drift, kick
from warpsim.kernels.planar import read3, write3
from warpsim.kernels.points import started

JUST_BEGUN = wp.constant(4)  # past values of a point whose substep is one by Runge and Kutta: it has three, and has moved already

driven, pull, glide_velocity, glide_position = GLIDES32.driven, GLIDES32.pull, GLIDES32.glide_velocity, GLIDES32.glide_position
exponential_weights, middle_slope, middle_bend = GLIDES32.exponential_weights, GLIDES32.middle_slope, GLIDES32.middle_bend
first_slope, second_slope = GLIDES32.first_slope, GLIDES32.second_slope
first_difference, second_difference = GLIDES32.first_difference, GLIDES32.second_difference
third_difference = GLIDES32.third_difference


@wp.struct
class Staging:
    count: int  # points
    opening: int  # number of the frame in which nothing moves yet
    h: float  # substep [s]
    clock: wp.array[wp.int64]
    environment: wp.array[Environment]
    free: wp.array[float]  # (capacity): 0 for a point that is pinned
    start: wp.array2d[float]  # (6, capacity): x₀ [m], v₀ [m/s]
    drive: wp.array2d[float]  # (3, capacity): N at the present stage [m/s²]
    now: wp.array2d[float]  # (3, capacity): N at the substep's beginning [m/s²]
    middle: wp.array2d[float]  # (3, capacity): sum of the two N in the middle [m/s²]
    slide: wp.array2d[float]  # (3, capacity): v₀ + 2 v_a + 2 v_b [m/s]


@wp.struct
class Course:
    x: wp.vec3  # [m], at the present stage
    v: wp.vec3  # [m/s]
    x0: wp.vec3
    v0: wp.vec3
    n: wp.vec3  # drive at the present stage [m/s²]
    now: wp.vec3  # at the substep's beginning
    middle: wp.vec3
    slide: wp.vec3
    past1: wp.vec3  # drive one, two and three substeps ago
    past2: wp.vec3
    past3: wp.vec3
    kept: int  # how many of them there are
    k: float  # drag rate [1/s]
    h: float  # [s]


@wp.func(inline=True)
def half_kick(v: wp.vec3, n: wp.vec3, k: float, h: float) -> wp.vec3:
    """Return v after half a substep under v' = n − k v."""
    return kick(v, wp.vec3(), n, k, 0.5 * h)


@wp.func(inline=True)
def begin_stages(c: Course) -> Course:
    """Return the point halfway, as the drive at the beginning takes it there.  Source: Kutta 1901; Cox & Matthews 2002, §3."""
    c.now = c.n
    c.slide = c.v0
    c.x = drift(c.x0, c.v0, 0.5 * c.h)
    c.v = half_kick(c.v0, c.n, c.k, c.h)
    return c


@wp.func(inline=True)
def repeat_middle(c: Course) -> Course:
    """Return the point in the middle once more, as the drive there takes it."""
    c.middle = c.n
    c.slide = drift(c.slide, c.v, 2.0)
    c.x = drift(c.x0, c.v, 0.5 * c.h)
    c.v = half_kick(c.v0, c.n, c.k, c.h)
    return c


@wp.func(inline=True)
def reach_end(c: Course) -> Course:
    """Return the point at the end, as the second drive in the middle takes it: v from where the first half ends, by 2 N_b − N₀."""
    c.middle = c.middle + c.n
    c.slide = drift(c.slide, c.v, 2.0)
    c.x = drift(c.x0, c.v, c.h)
    c.v = half_kick(half_kick(c.v0, c.now, c.k, c.h), c.n * 2.0 - c.now, c.k, c.h)
    return c


@wp.func(inline=True)
def end_stages(c: Course) -> Course:
    """Return the point after the substep: v under the parabola through the drives, x by Simpson's rule over the velocities."""
    still = wp.vec3()
    m = c.middle * 0.5
    w = exponential_weights(c.k * c.h)
    c.x = drift(c.x0, c.slide + c.v, c.h * (1.0 / 6.0))
    c.v = glide_velocity(c.v0, pull(c.now, c.v0, c.k), middle_slope(c.now, m, c.n), middle_bend(c.now, m, c.n), still, w, c.h)
    return c


@wp.func(inline=True)
def imagine_past(c: Course) -> Course:
    """Return the point with the parabola through its drives continued into the past, to the order that Adams' methods need of it."""
    n1 = middle_slope(c.now, c.middle * 0.5, c.n)
    n2 = middle_bend(c.now, c.middle * 0.5, c.n)
    c.past1 = c.now
    c.past2 = c.now - n1 + n2 * 0.5
    c.past3 = c.now - n1 * 2.0 + n2 * 2.0
    c.kept = JUST_BEGUN
    return c


RUNGE_KUTTA = (begin_stages, repeat_middle, reach_end, end_stages)


def starting(order: int):
    """Make the last stage of a substep by Runge and Kutta for those alone whose past is too short for an order."""

    @wp.func(inline=True)
    def start_past(c: Course) -> Course:
        """Return the point after the substep, with a past to go on from; where it has one, it is moved from x₀ afterwards."""
        begun = imagine_past(end_stages(c))
        if c.kept >= order - 1:
            begun = c
        return begun

    return start_past


@wp.func(inline=True)
def remember(c: Course) -> Course:
    """Return the point with the drive at the substep's beginning as its latest past value."""
    if c.kept < JUST_BEGUN:
        c.past3 = c.past2
        c.past2 = c.past1
        c.past1 = c.now
    c.kept = wp.min(c.kept + 1, 3)
    return c


def predicting(order: int, corrects: bool):
    """Make the move under the polynomial through the past of one order."""

    @wp.func(inline=True)
    def predict(c: Course) -> Course:
        """Return the point at the end by the drive and the past ones that it has.  Source: Bashforth & Adams 1883; Falkner 1936."""
        c.now = c.n
        d1 = wp.vec3()
        d2 = wp.vec3()
        d3 = wp.vec3()
        if order > 1:
            d1 = first_difference(c.n, c.past1) * wp.where(c.kept > 0, 1.0, 0.0)
        if order > 2:
            d2 = second_difference(c.n, c.past1, c.past2) * wp.where(c.kept > 1, 1.0, 0.0)
        if order > 3:
            d3 = third_difference(c.n, c.past1, c.past2, c.past3) * wp.where(c.kept > 2, 1.0, 0.0)
        w = exponential_weights(c.k * c.h)
        g = pull(c.n, c.v0, c.k)
        n1 = first_slope(d1, d2, d3)
        n2 = second_slope(d2, d3)
        x = glide_position(c.x0, c.v0, g, n1, n2, d3, w, c.h)
        v = glide_velocity(c.v0, g, n1, n2, d3, w, c.h)
        if order > 1 and not corrects:
            x = wp.where(c.kept > 0, x, drift(c.x0, v, c.h))  # kick, then drift: alone of first order it lets nothing grow
        if order < 3 or c.kept < JUST_BEGUN:
            c.x = x
            c.v = v
        return c

    return predict


def correcting(order: int):
    """Make the move under the polynomial through the drive at the predicted place and the past, of one order."""

    @wp.func(inline=True)
    def correct(c: Course) -> Course:
        """Return the point at the end by the drive there; the difference of the highest order is the newer one.  Source: Moulton 1926."""
        d1 = first_difference(c.n, c.now)
        d2 = wp.vec3()
        d3 = wp.vec3()
        if order > 3:
            newest = second_difference(c.n, c.now, c.past1)
            older = second_difference(c.now, c.past1, c.past2)
            d1 = wp.where(c.kept > 0, first_difference(c.now, c.past1), d1)
            d2 = wp.where(c.kept > 1, older, newest * wp.where(c.kept > 0, 1.0, 0.0))
            d3 = third_difference(c.n, c.now, c.past1, c.past2) * wp.where(c.kept > 1, 1.0, 0.0)
        w = exponential_weights(c.k * c.h)
        g = pull(c.now, c.v0, c.k)
        n1 = first_slope(d1, d2, d3)
        n2 = second_slope(d2, d3)
        if order < 3 or c.kept < JUST_BEGUN:
            c.x = glide_position(c.x0, c.v0, g, n1, n2, d3, w, c.h)
            c.v = glide_velocity(c.v0, g, n1, n2, d3, w, c.h)
        return c

    return correct


METHODS = {
    "heun": (1, True),
    "abm_pece_2": (2, True),
    "abm_pece_4": (4, True),
}  # order of the polynomial through the past, whether corrected
METHODS |= {f"adams_bashforth_{order}": (order, False) for order in (2, 3, 4)}
PREDICT = {what: predicting(*what) for what in METHODS.values()}
CORRECT = {order: correcting(order) for order, corrects in METHODS.values() if corrects}
START = {order: starting(order) for order in (3, 4)}


@wp.func
def gather_course(i: int, staging: Staging, particles: Particles) -> Course:
    """Return a point as a stage finds it."""
    c = Course()
    c.x = read3(particles.position, i)
    c.v = read3(particles.velocity, i)
    for axis in range(3):
        c.x0[axis] = staging.start[axis, i]
        c.v0[axis] = staging.start[3 + axis, i]
    c.n = read3(staging.drive, i)
    c.k = drag_rate(staging.environment[0].alpha, staging.environment[0].viscosity, particles.radius[i], 1.0 / particles.mass[i])
    c.h = staging.h
    return c


@wp.func
def gather_stages(i: int, staging: Staging, c: Course) -> Course:
    """Return a point with what the stages before have left of their drives and velocities."""
    c.now = read3(staging.now, i)
    c.middle = read3(staging.middle, i)
    c.slide = read3(staging.slide, i)
    return c


@wp.func
def gather_past(i: int, order: int, particles: Particles, c: Course) -> Course:
    """Return a point with as many past drives as an order has."""
    if order > 1:
        c.kept = particles.history_count[i]
        c.past1 = read3(particles.history, i)
    if order > 2:
        c.past2 = wp.vec3(particles.history[3, i], particles.history[4, i], particles.history[5, i])
    if order > 3:
        c.past3 = wp.vec3(particles.history[6, i], particles.history[7, i], particles.history[8, i])
    return c


@wp.func
def store_past(i: int, order: int, c: Course, particles_out: Particles):
    """Store the past drives that an order has."""
    if order > 1:
        particles_out.history_count[i] = c.kept
        write3(particles_out.history, i, c.past1)
    for axis in range(3):
        if order > 2:
            particles_out.history[3 + axis, i] = c.past2[axis]
        if order > 3:
            particles_out.history[6 + axis, i] = c.past3[axis]


@wp.func
def store_course(i: int, c: Course, staging_out: Staging, particles_out: Particles):
    """Store where the point is and how fast, unless it is pinned, and the drive at the substep's beginning."""
    if staging_out.free[i] > 0.0:
        write3(particles_out.position, i, c.x)
        write3(particles_out.velocity, i, c.v)
    write3(staging_out.now, i, c.now)


@wp.kernel(enable_backward=False)
def accumulate_outer(first: int, moment: int, staging: Staging, particles: Particles, internal_inout: wp.array2d[float]):
    """Add gravity, forces and k u of the flow at a moment, in half substeps, to what acts within: the drive [m/s²]."""
    i = first + wp.tid()
    if i < staging.count:
        environment = staging.environment[0]
        x = read3(particles.position, i)
        w = 1.0 / particles.mass[i]
        a = sample_felt_acceleration(environment, moment, w, x) + read3(internal_inout, i)
        k = drag_rate(environment.alpha, environment.viscosity, particles.radius[i], w)
        write3(internal_inout, i, driven(a, sample_flow(environment.flow, moment, x), k))


def stage_kernel(place: int, formula):
    """Make the plain kernel of one stage by Runge and Kutta."""

    @wp.kernel(name=f"advance_stage_{place}", module="warpsim.kernels.staged.runge_kutta", enable_backward=False)
    def advance_stage(first: int, staging_inout: Staging, particles_inout: Particles):
        """Move every point to where the next stage asks for its drive, or to the substep's end."""
        i = first + wp.tid()
        if i < staging_inout.count and started(staging_inout.clock, staging_inout.opening):
            c = formula(gather_stages(i, staging_inout, gather_course(i, staging_inout, particles_inout)))
            store_course(i, c, staging_inout, particles_inout)
            write3(staging_inout.middle, i, c.middle)
            write3(staging_inout.slide, i, c.slide)

    return advance_stage


def adams_kernel(name: str, formula, order: int, keeps: bool):
    """Make the plain kernel of one stage of Adams' methods: one that begins, predicts or corrects; the last `keeps` the drive as past."""

    @wp.kernel(name=f"advance_{name}", module=f"warpsim.kernels.staged.{name}", enable_backward=False)
    def advance_adams(first: int, staging_inout: Staging, particles_inout: Particles):
        """Move every point to the substep's end."""
        i = first + wp.tid()
        if i < staging_inout.count and started(staging_inout.clock, staging_inout.opening):
            c = gather_stages(i, staging_inout, gather_course(i, staging_inout, particles_inout))
            c = formula(gather_past(i, order, particles_inout, c))
            if keeps:
                c = remember(c)
            store_course(i, c, staging_inout, particles_inout)
            store_past(i, order, c, particles_inout)

    return advance_adams


ADAMS = {f"start_{order}": (formula, order, False) for order, formula in START.items()}  # by name: formula, order, keeps
ADAMS |= {f"predict_{order}": (formula, order, not corrects) for (order, corrects), formula in PREDICT.items() if not corrects}
ADAMS |= {f"foresee_{order}": (formula, order, False) for (order, corrects), formula in PREDICT.items() if corrects}
ADAMS |= {f"correct_{order}": (formula, order, order > 1) for order, formula in CORRECT.items()}
STAGES = {f"stage_{place}": stage_kernel(place, formula) for place, formula in enumerate(RUNGE_KUTTA)}
STAGES |= {name: adams_kernel(name, *what) for name, what in ADAMS.items()}
