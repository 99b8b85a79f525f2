"""Encounters of the particles of a population with colliders: who is near one, and what its rows note of a contact."""

import warp as wp

from warpsim.kernels.collision import Passage, Span, approaches, cross_colliders, ride
from warpsim.kernels.emission import PUSHED, Particles, count_one
from warpsim.kernels.environment import Environment
from warpsim.kernels.integration import Body, Pace
from warpsim.kernels.planar import read3


@wp.func(inline=True)
def age_after(age: float, s: int, pace: Pace) -> float:
    """Return the age at the end of substep s [s], from that at the frame's end."""
    return age - float(pace.substep_count - 1 - s) * pace.dt


@wp.func
def write_impact(i: int, ago: float, passage: Passage, particles_inout: Particles):
    """Note the frame's first impact of the particle in slot i, `ago` before the frame's end [s], and count all."""
    if particles_inout.impact[9, i] < 0.0:
        for axis in range(3):
            particles_inout.impact[axis, i] = passage.impact_x[axis]
            particles_inout.impact[3 + axis, i] = passage.impact_v[axis]
            particles_inout.impact[6 + axis, i] = passage.impact_normal[axis]
        particles_inout.impact[9, i] = ago
        particles_inout.impact_number[i] = particles_inout.impact_count[i]
    particles_inout.impact_count[i] = particles_inout.impact_count[i] + passage.impacts


@wp.func
def near_colliders(
    i: int, s: int, h: float, x0: wp.vec3, v0: wp.vec3, body: Body, pace: Pace, environment: Environment, p: Particles
) -> int:
    """Return 1 if the particle in slot i may touch a collider on its way from (x0, v0) to the body's place, or sticks to one."""
    if environment.colliders.shape[1] == 0 or not h > 0.0:
        return 0
    if p.contact.shape[0] > 0:
        if p.contact[i] > 0:
            return 1
    return approaches(environment.colliders, 2 * s, pace.dt, x0, v0, body.x, body.v, h)


@wp.func
def meet_colliders(
    i: int,
    s: int,
    h: float,
    age: float,
    x0: wp.vec3,
    v0: wp.vec3,
    x1: wp.vec3,
    v1: wp.vec3,
    pace: Pace,
    environment: Environment,
    particles_inout: Particles,
    counters_inout: wp.array[wp.int64],
) -> Passage:
    """Return how the particle in slot i, alive for h of substep s, gets past the colliders; note what it sticks to and its impacts."""
    older = age_after(age, s, pace)
    span = Span()
    span.moment = 2 * s
    span.begin = wp.clamp(1.0 - older / pace.dt, 0.0, 1.0)  # born on the way: the colliders have moved already
    span.rate = 1.0 / pace.dt
    span.dt = pace.dt
    span.h = h
    if particles_inout.heading.shape[0] > 0:
        span.heading = read3(particles_inout.heading, i)
        span.grip = particles_inout.grip[0]
    sticks = particles_inout.contact.shape[0] > 0
    if sticks:
        if particles_inout.contact[i] > 0:
            return ride(environment.colliders, span, particles_inout.contact[i] - 1, 0.0, x0)
    newborn = wp.where(older < 1.001 * pace.dt, 1, 0)
    passage = cross_colliders(environment.colliders, span, x0, v0, x1, v1, environment.tracer, newborn)
    if sticks:
        particles_inout.contact[i] = passage.stuck
    if passage.dead == 1:
        particles_inout.lifetime[i] = older - pace.dt * (1.0 - span.begin) + passage.time
    if passage.pushed == 1:
        count_one(PUSHED, counters_inout)
    if particles_inout.impact.shape[0] > 0 and passage.impacts > 0:
        ago = float(pace.substep_count - s) * pace.dt - span.begin * pace.dt - passage.impact_time
        write_impact(i, ago, passage, particles_inout)
    return passage
