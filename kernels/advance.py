"""The frame of one particle: its substeps by one method, the colliders in its way, and whether it lives on."""

import warp as wp

from warpsim.kernels.emission import ACTIVE, FAULT, KILLED, Particles, count_one
from warpsim.kernels.encounter import age_after, meet_colliders, near_colliders
from warpsim.kernels.environment import KILL, Environment, drag_rate
from warpsim.kernels.integration import METHODS, Body, Pace, ballistic_position, drift, inside
from warpsim.kernels.lifetime import active_step, age_at
from warpsim.kernels.planar import read3, write3

AMONG_COLLIDERS = "_among_colliders"  # ends the names of the kernels that know of them


@wp.func
def recall(body: Body, i: int, frame: int, pace: Pace, particles: Particles) -> Body:
    """Return the body in slot i with its past values; a newborn's slot holds somebody else's."""
    if pace.first > 0 or frame != particles.birth_frame[i]:
        body.kept = particles.history_count[i]
        body.past1 = read3(particles.history, i)
        if particles.history.shape[0] > 3:
            body.past2 = wp.vec3(particles.history[3, i], particles.history[4, i], particles.history[5, i])
        if particles.history.shape[0] > 6:
            body.past3 = wp.vec3(particles.history[6, i], particles.history[7, i], particles.history[8, i])
    return body


@wp.func
def store_past(i: int, body: Body, particles_out: Particles):
    """Store the past values that the method's history has rows for, and how many there are."""
    for axis in range(3):
        particles_out.history[axis, i] = body.past1[axis]
        if particles_out.history.shape[0] > 3:
            particles_out.history[3 + axis, i] = body.past2[axis]
        if particles_out.history.shape[0] > 6:
            particles_out.history[6 + axis, i] = body.past3[axis]
    particles_out.history_count[i] = body.kept


@wp.func
def gather_body(i: int, frame: int, pace: Pace, environment: Environment, particles: Particles) -> Body:
    """Return the particle in slot i as a body at the launch's beginning."""
    body = Body()
    body.x = read3(particles.position, i)
    body.v = read3(particles.velocity, i)
    body.dt = pace.dt
    body.stride = 1
    if particles.history.shape[0] > 0:
        body = recall(body, i, frame, pace, particles)
    if particles.internal.shape[0] > 0:
        body.coupled = 1
        body.internal = read3(particles.internal, i)
    if pace.first > 0:
        body.dead = 1 - particles.alive[i]
    body.age = age_at(frame, particles.birth_frame[i], particles.birth_age[i], pace.fps)
    body.lifetime = particles.lifetime[i]
    body.inverse_mass = 1.0 / particles.mass[i]
    body.k = drag_rate(environment.alpha, environment.viscosity, particles.radius[i], body.inverse_mass)
    return body


@wp.func(inline=True)
def living_step(age: float, lifetime: float, dead: int, s: int, pace: Pace) -> float:
    """Return the part of substep s in which a body lives [s]; age is that at the frame's end."""
    return active_step(age_after(age, s, pace), pace.dt, wp.where(dead == 1, 0.0, lifetime))


@wp.func
def store_body(
    i: int, frame: int, body: Body, pace: Pace, environment: Environment, particles_out: Particles, counters_inout: wp.array[wp.int64]
):
    """Store where the body is and, at the frame's end, whether it lives on and whether it left the scene's extent."""
    write3(particles_out.position, i, body.x)
    write3(particles_out.velocity, i, body.v)
    if particles_out.history.shape[0] > 0:
        store_past(i, body, particles_out)
    alive = 1 - body.dead
    if pace.last == pace.substep_count:
        age = age_at(frame, particles_out.birth_frame[i], particles_out.birth_age[i], pace.fps)
        alive = alive * wp.where(age < body.lifetime, 1, 0)
        if alive == 1 and inside(body.x, body.v, environment.extent) == 0:
            if environment.policy == KILL:
                alive = 0
                count_one(KILLED, counters_inout)
            else:
                counters_inout[FAULT] = wp.int64(1)
    particles_out.alive[i] = alive


@wp.func
def pass_freely(
    i: int,
    s: int,
    h: float,
    x0: wp.vec3,
    v0: wp.vec3,
    body: Body,
    pace: Pace,
    environment: Environment,
    particles: Particles,
    counters: wp.array[wp.int64],
) -> Body:
    """Return the body as it is after its substep: there are no colliders."""
    return body


def passing(feel):
    """Make what comes after a substep among colliders, for one method."""

    @wp.func
    def pass_colliders(
        i: int,
        s: int,
        h: float,
        x0: wp.vec3,
        v0: wp.vec3,
        body: Body,
        pace: Pace,
        environment: Environment,
        particles_inout: Particles,
        counters_inout: wp.array[wp.int64],
    ) -> Body:
        """Return the body in slot i, on its way from (x0, v0), past the colliders; what it feels where it was thrown is felt anew."""
        if s == 0 and particles_inout.impact.shape[0] > 0:
            particles_inout.impact[9, i] = -1.0  # none yet in this frame
        if near_colliders(i, s, h, x0, v0, body, pace, environment, particles_inout) == 1:
            passage = meet_colliders(i, s, h, body.age, x0, v0, body.x, body.v, pace, environment, particles_inout, counters_inout)
            body.x = passage.x
            body.v = passage.v
            body.dead = passage.dead
            if passage.hits > 0:
                body.kept = 0
                body = feel(body, 2 * s + 2, environment)
        return body

    return pass_colliders


def frame_loop(feel, step, pass_colliders):
    """Make the loop over a launch's substeps for one method."""

    @wp.func
    def advance_body(
        i: int, frame: int, pace: Pace, environment: Environment, particles_inout: Particles, counters_inout: wp.array[wp.int64]
    ) -> Body:
        """Return the body in slot i after the launch's substeps."""
        body = feel(gather_body(i, frame, pace, environment, particles_inout), 2 * pace.first, environment)
        for s in range(pace.first, pace.last):
            h = living_step(body.age, body.lifetime, body.dead, s, pace)
            x0 = body.x
            v0 = body.v
            body = step(body, s, h, environment)
            body = pass_colliders(i, s, h, x0, v0, body, pace, environment, particles_inout, counters_inout)
        return body

    return advance_body


def advance_kernel(name, loop):
    """Make the plain kernel of one method."""

    @wp.kernel(name=f"advance_{name}", module=f"warpsim.kernels.advance.{name}", enable_backward=False)
    def advance_particles(
        first: int,
        pace: Pace,
        clock: wp.array[wp.int64],
        environment: wp.array[Environment],
        particles_inout: Particles,
        counters_inout: wp.array[wp.int64],
    ):
        """Advance every active particle through the frame; the environment is one row, so that what it holds stays live."""
        i = first + wp.tid()
        if wp.int64(i) < counters_inout[ACTIVE]:
            frame = int(clock[0])
            body = loop(i, frame, pace, environment[0], particles_inout, counters_inout)
            store_body(i, frame, body, pace, environment[0], particles_inout, counters_inout)

    return advance_particles


LOOPS = {name: frame_loop(feel, step, pass_freely) for name, (feel, step) in METHODS.items()}
# Apart, because contact takes longer to compile than all the rest.
LOOPS |= {name + AMONG_COLLIDERS: frame_loop(feel, step, passing(feel)) for name, (feel, step) in METHODS.items()}
ADVANCE = {name: advance_kernel(name, loop) for name, loop in LOOPS.items()}


@wp.func
def advance_flight(
    i: int,
    frame: int,
    pace: Pace,
    environment: Environment,
    births: Particles,
    particles_out: Particles,
    counters_inout: wp.array[wp.int64],
):
    """Place the particle in slot i on its arc since birth."""
    age = age_at(frame, births.birth_frame[i], births.birth_age[i], pace.fps)
    t = wp.min(age, births.lifetime[i])
    body = Body()
    body.x = ballistic_position(read3(births.position, i), read3(births.velocity, i), environment.gravity, t)
    body.v = drift(read3(births.velocity, i), environment.gravity, t)
    body.lifetime = births.lifetime[i]
    store_body(i, frame, body, pace, environment, particles_out, counters_inout)


@wp.kernel(enable_backward=False)
def advance_ballistic(
    first: int,
    pace: Pace,
    clock: wp.array[wp.int64],
    environment: wp.array[Environment],
    births: Particles,
    particles_out: Particles,
    counters_inout: wp.array[wp.int64],
):
    """Place every active particle on its arc; position and velocity in `births` are those at birth."""
    i = first + wp.tid()
    if wp.int64(i) < counters_inout[ACTIVE]:
        advance_flight(i, int(clock[0]), pace, environment[0], births, particles_out, counters_inout)
