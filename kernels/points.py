"""Points of networks: where a substep found them, and what becomes of their way from there when colliders are in it.

The particles' kernels do this themselves; solvers and constraints that move points in ways of their own do it in these passes.
"""

import warp as wp

from warpsim.kernels.emission import FAULT, Particles
from warpsim.kernels.encounter import meet_colliders, near_colliders
from warpsim.kernels.environment import Environment
from warpsim.kernels.integration import Body, Pace, inside
from warpsim.kernels.lifetime import age_at
from warpsim.kernels.planar import read3, write3


@wp.func
def started(clock: wp.array[wp.int64], opening: int) -> bool:
    """Return whether networks move already; nothing moves in the opening frame, at whose end the motion begins."""
    return clock[0] > wp.int64(opening)


@wp.kernel(enable_backward=False)
def scatter_start(first: int, count: int, particles: Particles, start_out: wp.array2d[float]):
    """Note where every point is and how fast it moves: rows 0 … 2 are x [m], 3 … 5 v [m/s]."""
    i = first + wp.tid()
    if i < count:
        for axis in range(3):
            start_out[axis, i] = particles.position[axis, i]
            start_out[3 + axis, i] = particles.velocity[axis, i]


@wp.kernel(enable_backward=False)
def clear_internal(first: int, internal_out: wp.array2d[float]):
    """Begin to add up what acts on the points within: nothing yet [m/s²]."""
    i = first + wp.tid()
    write3(internal_out, i, wp.vec3())


@wp.kernel(enable_backward=False)
def mark_faults(first: int, count: int, environment: wp.array[Environment], particles: Particles, counters_inout: wp.array[wp.int64]):
    """Note whether any point is not finite or beyond the scene's extent."""
    i = first + wp.tid()
    if i < count and inside(read3(particles.position, i), read3(particles.velocity, i), environment[0].extent) == 0:
        counters_inout[FAULT] = wp.int64(1)


@wp.func
def start_of(i: int, start: wp.array2d[float]) -> wp.vec3:
    """Return where the substep found point i [m]."""
    return wp.vec3(start[0, i], start[1, i], start[2, i])


@wp.func
def speed_of(i: int, start: wp.array2d[float]) -> wp.vec3:
    """Return the velocity with which the substep found point i [m/s]."""
    return wp.vec3(start[3, i], start[4, i], start[5, i])


@wp.func
def approaches_colliders(i: int, pace: Pace, environment: Environment, start: wp.array2d[float], particles: Particles) -> int:
    """Return 1 if point i may touch a collider on its way since the beginning of substep pace.first."""
    body = Body()
    body.x = read3(particles.position, i)
    body.v = read3(particles.velocity, i)
    return near_colliders(i, pace.first, pace.dt, start_of(i, start), speed_of(i, start), body, pace, environment, particles)


@wp.func
def lead_past(
    i: int,
    frame: int,
    pace: Pace,
    environment: Environment,
    start: wp.array2d[float],
    particles_inout: Particles,
    counters_inout: wp.array[wp.int64],
):
    """Lead point i past the colliders, from where substep pace.first found it toward where it is now."""
    x = read3(particles_inout.position, i)
    v = read3(particles_inout.velocity, i)
    age = age_at(frame, particles_inout.birth_frame[i], particles_inout.birth_age[i], pace.fps)
    x0 = start_of(i, start)
    v0 = speed_of(i, start)
    passage = meet_colliders(i, pace.first, pace.dt, age, x0, v0, x, v, pace, environment, particles_inout, counters_inout)
    write3(particles_inout.position, i, passage.x)
    write3(particles_inout.velocity, i, passage.v)
    if passage.hits > 0 and particles_inout.history_count.shape[0] > 0:
        particles_inout.history_count[i] = 0  # what drove it before says nothing of what comes now


# Apart, because contact takes longer to compile than all the rest.
@wp.kernel(enable_backward=False, module="warpsim.kernels.points.contacts")
def resolve_points(
    first: int,
    count: int,
    opening: int,
    pace: Pace,
    clock: wp.array[wp.int64],
    environment: wp.array[Environment],
    start: wp.array2d[float],
    asked: wp.array[int],
    particles_inout: Particles,
    counters_inout: wp.array[wp.int64],
):
    """Lead every point's way from where substep pace.first found it to where it is now past the colliders, if that is asked for (1)."""
    i = first + wp.tid()
    if i < count and asked[0] == 1 and started(clock, opening):
        if approaches_colliders(i, pace, environment[0], start, particles_inout) == 1:
            lead_past(i, int(clock[0]), pace, environment[0], start, particles_inout, counters_inout)
