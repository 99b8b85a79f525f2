"""Integration: the motion of one particle through all substeps of a frame, one method each.

Symbols: x position [m], v velocity [m/s], u flow at x [m/s], a acceleration by gravity and forces [m/s²], k drag rate [1/s],
h the part of the substep in which the particle lives [s]. Moment 2s of the tables is the beginning of substep s, 2s + 1 its
middle. The native loops (loops.py) follow these line by line; tests hold the two equal to the bit.
"""

import warp as wp

from warpsim.kernels.elementary import mean_decay
from warpsim.kernels.emission import ACTIVE, FAULT, KILLED, Particles
from warpsim.kernels.environment import KILL, Environment, drag_rate, sample_felt_acceleration
from warpsim.kernels.flow import sample_flow
from warpsim.kernels.lifetime import active_step, age_at
from warpsim.kernels.planar import read3, write3

LARGEST_SPEED = wp.constant(1.0e30)  # [m/s]: beyond it counts as not finite


@wp.struct
class Pace:
    dt: float  # substep [s]
    fps: float  # frames per second
    substep_count: int  # per frame


@wp.struct
class Body:
    x: wp.vec3  # [m]
    v: wp.vec3  # [m/s]
    age: float  # at the frame's end [s]
    lifetime: float  # [s]
    inverse_mass: float  # [1/kg]
    k: float  # drag rate [1/s]


@wp.func(inline=True)
def kick(v: wp.vec3, u: wp.vec3, a: wp.vec3, k: float, h: float) -> wp.vec3:
    """Return v + h φ(kh)(a + k(u − v)), exact for constant u and a, stable for any h.  Source: Hochbruck & Ostermann 2010, §2.1."""
    return v + (a + (u - v) * k) * (h * mean_decay(k * h))


@wp.func(inline=True)
def drift(x: wp.vec3, v: wp.vec3, h: float) -> wp.vec3:
    """Return x + h v."""
    return x + v * h


@wp.func(inline=True)
def ballistic_position(x: wp.vec3, v: wp.vec3, a: wp.vec3, t: float) -> wp.vec3:
    """Return x + v t + ½ a t², closed form for constant a.  Source: Galilei 1638."""
    return x + (v + a * (0.5 * t)) * t


@wp.func(inline=True)
def inside(x: wp.vec3, v: wp.vec3, extent: float) -> int:
    """Return 1 if the state is finite and within the scene's extent, else 0; a NaN fails every comparison."""
    far = wp.max(wp.max(wp.abs(x[0]), wp.abs(x[1])), wp.abs(x[2]))
    sum = wp.abs(x[0]) + wp.abs(x[1]) + wp.abs(x[2])
    speed = wp.abs(v[0]) + wp.abs(v[1]) + wp.abs(v[2])
    return wp.where(far <= extent, 1, 0) * wp.where(sum < LARGEST_SPEED, 1, 0) * wp.where(speed < LARGEST_SPEED, 1, 0)


@wp.func
def substep(body: Body, s: int, pace: Pace) -> float:
    """Return the part of substep s in which the body lives [s]."""
    return active_step(body.age - float(pace.substep_count - 1 - s) * pace.dt, pace.dt, body.lifetime)


@wp.func
def advance_euler(body: Body, pace: Pace, environment: Environment) -> Body:
    """Explicit Euler: position and velocity both from the old state.  Source: Euler 1768."""
    x = body.x
    v = body.v
    for s in range(pace.substep_count):
        h = substep(body, s, pace)
        u = sample_flow(environment.flow, 2 * s, x)
        a = sample_felt_acceleration(environment, 2 * s, body.inverse_mass, x)
        x = drift(x, v, h)
        v = kick(v, u, a, body.k, h)
    body.x = x
    body.v = v
    return body


@wp.func
def advance_drift_kick(body: Body, pace: Pace, environment: Environment) -> Body:
    """Symplectic Euler that moves first: forces at the new position.  Source: Hairer, Lubich & Wanner 2006, I.1.2."""
    x = body.x
    v = body.v
    for s in range(pace.substep_count):
        h = substep(body, s, pace)
        x = drift(x, v, h)
        u = sample_flow(environment.flow, 2 * s + 2, x)
        a = sample_felt_acceleration(environment, 2 * s + 2, body.inverse_mass, x)
        v = kick(v, u, a, body.k, h)
    body.x = x
    body.v = v
    return body


@wp.func
def advance_semi_implicit_euler(body: Body, pace: Pace, environment: Environment) -> Body:
    """Symplectic Euler that kicks first, the lecture's: forces at the old position, then the new velocity moves it."""
    x = body.x
    v = body.v
    for s in range(pace.substep_count):
        h = substep(body, s, pace)
        u = sample_flow(environment.flow, 2 * s, x)
        a = sample_felt_acceleration(environment, 2 * s, body.inverse_mass, x)
        v = kick(v, u, a, body.k, h)
        x = drift(x, v, h)
    body.x = x
    body.v = v
    return body


@wp.func
def advance_verlet(body: Body, pace: Pace, environment: Environment) -> Body:
    """Velocity Verlet: half a kick, a drift, half a kick.  Source: Swope et al. 1982."""
    x = body.x
    v = body.v
    u = sample_flow(environment.flow, 0, x)
    a = sample_felt_acceleration(environment, 0, body.inverse_mass, x)
    for s in range(pace.substep_count):
        h = substep(body, s, pace)
        v = kick(v, u, a, body.k, 0.5 * h)
        x = drift(x, v, h)
        u = sample_flow(environment.flow, 2 * s + 2, x)
        a = sample_felt_acceleration(environment, 2 * s + 2, body.inverse_mass, x)
        v = kick(v, u, a, body.k, 0.5 * h)
    body.x = x
    body.v = v
    return body


@wp.func
def advance_rk4(body: Body, pace: Pace, environment: Environment) -> Body:
    """Classical Runge–Kutta under the forces, between two halves of the drag (Strang splitting).  Source: Kutta 1901; Strang 1968."""
    still = wp.vec3()
    x = body.x
    v = body.v
    u = sample_flow(environment.flow, 0, x)
    a = sample_felt_acceleration(environment, 0, body.inverse_mass, x)
    for s in range(pace.substep_count):
        h = substep(body, s, pace)
        v = kick(v, u, still, body.k, 0.5 * h)
        x0 = x
        v0 = v
        dx = v
        dv = a
        x = drift(x0, v, 0.5 * h)
        v = drift(v0, a, 0.5 * h)
        a = sample_felt_acceleration(environment, 2 * s + 1, body.inverse_mass, x)
        dx = drift(dx, v, 2.0)
        dv = drift(dv, a, 2.0)
        x = drift(x0, v, 0.5 * h)
        v = drift(v0, a, 0.5 * h)
        a = sample_felt_acceleration(environment, 2 * s + 1, body.inverse_mass, x)
        dx = drift(dx, v, 2.0)
        dv = drift(dv, a, 2.0)
        x = drift(x0, v, h)
        v = drift(v0, a, h)
        a = sample_felt_acceleration(environment, 2 * s + 2, body.inverse_mass, x)
        x = drift(x0, drift(dx, v, 1.0), h / 6.0)
        v = drift(v0, drift(dv, a, 1.0), h / 6.0)
        u = sample_flow(environment.flow, 2 * s + 2, x)
        a = sample_felt_acceleration(environment, 2 * s + 2, body.inverse_mass, x)
        v = kick(v, u, still, body.k, 0.5 * h)
    body.x = x
    body.v = v
    return body


@wp.func
def advance_tracer_euler(body: Body, pace: Pace, environment: Environment) -> Body:
    """Explicit Euler of dx/dt = u: a particle without inertia.  Source: Euler 1768."""
    x = body.x
    u = sample_flow(environment.flow, 0, x)
    for s in range(pace.substep_count):
        h = substep(body, s, pace)
        x = drift(x, u, h)
        u = sample_flow(environment.flow, 2 * s + 2, x)
    body.x = x
    body.v = u
    return body


@wp.func
def advance_tracer_rk4(body: Body, pace: Pace, environment: Environment) -> Body:
    """Classical Runge–Kutta of dx/dt = u: a particle without inertia.  Source: Kutta 1901."""
    x = body.x
    u = sample_flow(environment.flow, 0, x)
    for s in range(pace.substep_count):
        h = substep(body, s, pace)
        x0 = x
        dx = u
        u = sample_flow(environment.flow, 2 * s + 1, drift(x0, u, 0.5 * h))
        dx = drift(dx, u, 2.0)
        u = sample_flow(environment.flow, 2 * s + 1, drift(x0, u, 0.5 * h))
        dx = drift(dx, u, 2.0)
        u = sample_flow(environment.flow, 2 * s + 2, drift(x0, u, h))
        x = drift(x0, drift(dx, u, 1.0), h / 6.0)
        u = sample_flow(environment.flow, 2 * s + 2, x)
    body.x = x
    body.v = u
    return body


METHODS = {
    "euler": advance_euler,
    "drift_kick": advance_drift_kick,
    "semi_implicit_euler": advance_semi_implicit_euler,
    "verlet": advance_verlet,
    "rk4": advance_rk4,
    "tracer_euler": advance_tracer_euler,
    "tracer_rk4": advance_tracer_rk4,
}


@wp.func
def gather_body(i: int, frame: int, pace: Pace, environment: Environment, particles: Particles) -> Body:
    """Return the particle in slot i as a body at the frame's beginning."""
    body = Body()
    body.x = read3(particles.position, i)
    body.v = read3(particles.velocity, i)
    body.age = age_at(frame, particles.birth_frame[i], particles.birth_age[i], pace.fps)
    body.lifetime = particles.lifetime[i]
    body.inverse_mass = 1.0 / particles.mass[i]
    body.k = drag_rate(environment.alpha, environment.viscosity, particles.radius[i], body.inverse_mass)
    return body


@wp.func
def store_body(
    i: int, frame: int, body: Body, pace: Pace, environment: Environment, particles_out: Particles, counters_inout: wp.array[wp.int64]
):
    """Store where the body is, whether it lives on, and whether it left the scene's extent."""
    write3(particles_out.position, i, body.x)
    write3(particles_out.velocity, i, body.v)
    age = age_at(frame, particles_out.birth_frame[i], particles_out.birth_age[i], pace.fps)
    alive = wp.where(age < body.lifetime, 1, 0)
    if alive == 1 and inside(body.x, body.v, environment.extent) == 0:
        if environment.policy == KILL:
            alive = 0
            wp.atomic_add(counters_inout, KILLED, wp.int64(1))
        else:
            counters_inout[FAULT] = wp.int64(1)
    particles_out.alive[i] = alive


def advance_kernel(name, method):
    """Make the plain kernel of one method."""

    @wp.kernel(name=f"advance_{name}", module=f"warpsim.kernels.integration.{name}", enable_backward=False)
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
            body = method(gather_body(i, frame, pace, environment[0], particles_inout), pace, environment[0])
            store_body(i, frame, body, pace, environment[0], particles_inout, counters_inout)

    return advance_particles


ADVANCE = {name: advance_kernel(name, method) for name, method in METHODS.items()}


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
