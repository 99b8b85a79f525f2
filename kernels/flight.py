"""Flight of a flock: how boids start, how their steering moves them within their limits, and what the domain's borders do.

Symbols: x position [m], v velocity [m/s], u flow [m/s], F steering [N], m mass [kg], h substep [s].
"""

import warp as wp

from warpsim.kernels.birth import isotropic
from warpsim.kernels.domain import CONTAIN, PERIODIC, Domain, wrap
from warpsim.kernels.elementary import cos_turns, sin_turns
from warpsim.kernels.emission import Particles
from warpsim.kernels.environment import Environment, drag_rate, sample_felt_acceleration
from warpsim.kernels.flow import sample_flow
from warpsim.kernels.integration import Pace, drift, kick
from warpsim.kernels.planar import read3, write3
from warpsim.kernels.points import started
from warpsim.kernels.random import POSITION, VELOCITY, random_words, uniform

NO_LIMIT = 1.0e30
NOISE = 10  # channel of the headings' random turns (random.py has the others)
INVERSE_TURN = wp.constant(0.15915494309189535)  # 1/2π


@wp.struct
class Limits:
    slowest: float  # [m/s]
    fastest: float  # [m/s]; NO_LIMIT
    strongest: float  # most steering force [N]; NO_LIMIT
    turn_cosine: float  # of the largest turn in a substep; −2: any
    turn_sine: float


@wp.struct
class Vicsek:
    key: wp.vec2ui  # of the random turns
    speed: float  # [m/s]
    noise: float  # width of the angles of the turns [rad]


@wp.func
def emit_place(words: wp.vec4ui, domain: Domain) -> wp.vec3:
    """Return a place uniform in the domain [m]."""
    share = wp.vec3(uniform(words[0]), uniform(words[1]), uniform(words[2]))
    return domain.low + wp.cw_mul(domain.size, share)


@wp.func
def emit_heading(words: wp.vec4ui, domain: Domain) -> wp.vec3:
    """Return a unit vector, isotropic in the axes that the domain has."""
    rate = domain.rate
    axes = wp.where(rate[0] > 0.0, 1, 0) + wp.where(rate[1] > 0.0, 1, 0) + wp.where(rate[2] > 0.0, 1, 0)
    if axes == 3 or axes == 0:
        return isotropic(words[0], words[1])
    a = cos_turns(uniform(words[1]))
    b = sin_turns(uniform(words[1]))
    if axes == 1:
        a = wp.where(a < 0.0, -1.0, 1.0)
        return wp.vec3(wp.where(rate[0] > 0.0, a, 0.0), wp.where(rate[1] > 0.0, a, 0.0), wp.where(rate[2] > 0.0, a, 0.0))
    return wp.vec3(
        wp.where(rate[0] > 0.0, a, 0.0),
        wp.where(rate[1] > 0.0, wp.where(rate[0] > 0.0, b, a), 0.0),
        wp.where(rate[2] > 0.0, b, 0.0),
    )


@wp.kernel(enable_backward=False, module="warpsim.kernels.flight.start")
def emit_flock(first: int, count: int, key: wp.vec2ui, speed: float, domain: wp.array[Domain], particles_out: Particles):
    """Put every boid somewhere in the domain, on an isotropic heading at a speed [m/s]."""
    i = first + wp.tid()
    if i < count:
        write3(particles_out.position, i, emit_place(random_words(key, wp.int64(i), POSITION), domain[0]))
        write3(particles_out.velocity, i, emit_heading(random_words(key, wp.int64(i), VELOCITY), domain[0]) * speed)


@wp.func(inline=True)
def positive(square: float) -> float:
    """Return a square, 1 instead of 0: no branch has to guard its root in a quotient that is not used then."""
    return wp.where(square > 0.0, square, 1.0)


@wp.func(inline=True)
def limit_force(f: wp.vec3, strongest: float) -> wp.vec3:
    """Return a force of at most a strength [N], in its direction."""
    square = wp.dot(f, f)
    return f * wp.where(square > strongest * strongest, strongest / wp.sqrt(positive(square)), 1.0)


@wp.func(inline=True)
def any_across(n: wp.vec3) -> wp.vec3:
    """Return a vector at right angles to a unit vector, of length 0.4 at least."""
    upright = wp.where(wp.abs(n[1]) < 0.9, 1.0, 0.0)
    return wp.cross(wp.vec3(1.0 - upright, upright, 0.0), n)


@wp.func(inline=True)
def limit_turn(v0: wp.vec3, v: wp.vec3, cosine: float, sine: float) -> wp.vec3:
    """Return v turned back toward v0 so far that the angle between them is at most the largest; its length stays."""
    a = wp.dot(v0, v0)
    b = wp.dot(v, v)
    speed = wp.sqrt(a)
    length = wp.sqrt(b)
    ahead = v0 / wp.sqrt(positive(a))
    aside = v - ahead * wp.dot(ahead, v)
    square = wp.dot(aside, aside)
    other = any_across(ahead)
    back = wp.where(square < 1.0e-12 * b, 1, 0)  # right about: any way round
    ax = wp.where(back == 1, other[0], aside[0])
    ay = wp.where(back == 1, other[1], aside[1])
    az = wp.where(back == 1, other[2], aside[2])
    square = wp.where(back == 1, wp.dot(other, other), square)
    most = (ahead * cosine + wp.vec3(ax, ay, az) * (sine / wp.sqrt(positive(square)))) * length
    turns = wp.where(cosine >= -1.0, 1, 0) * wp.where(a > 0.0, 1, 0) * wp.where(b > 0.0, 1, 0)
    turns = turns * wp.where(wp.dot(v0, v) < cosine * speed * length, 1, 0)
    return wp.vec3(wp.where(turns == 1, most[0], v[0]), wp.where(turns == 1, most[1], v[1]), wp.where(turns == 1, most[2], v[2]))


@wp.func(inline=True)
def limit_speed(v0: wp.vec3, v: wp.vec3, slowest: float, fastest: float) -> wp.vec3:
    """Return v with a speed within the band [m/s]; who stands still goes where it went before."""
    square = wp.dot(v, v)
    before = wp.dot(v0, v0)
    limit = wp.where(square > fastest * fastest, fastest, slowest)
    beyond = wp.where(square > fastest * fastest, 1, 0) + wp.where(square < slowest * slowest, 1, 0)
    still = wp.where(square > 0.0, 0, 1) * wp.where(before > 0.0, 1, 0)
    x = wp.where(still == 1, v0[0], v[0])
    y = wp.where(still == 1, v0[1], v[1])
    z = wp.where(still == 1, v0[2], v[2])
    scale = limit / wp.sqrt(positive(wp.where(still == 1, before, square)))
    return wp.vec3(wp.where(beyond > 0, x * scale, v[0]), wp.where(beyond > 0, y * scale, v[1]), wp.where(beyond > 0, z * scale, v[2]))


@wp.func
def fly(
    i: int,
    pace: Pace,
    environment: Environment,
    bounds: Limits,
    steering: wp.array2d[float],
    particles_inout: Particles,
    swimming_out: wp.array2d[float],
):
    """Let steering, forces and the flow act on boid i for substep pace.first, within its limits, and move it: kick, then drift."""
    moment = 2 * pace.first
    x = read3(particles_inout.position, i)
    v0 = read3(particles_inout.velocity, i)
    inverse_mass = 1.0 / particles_inout.mass[i]
    a = sample_felt_acceleration(environment, moment, inverse_mass, x)
    a = a + limit_force(read3(steering, i), bounds.strongest) * inverse_mass
    u = sample_flow(environment.flow, moment, x)
    k = drag_rate(environment.alpha, environment.viscosity, particles_inout.radius[i], inverse_mass)
    v = kick(v0, u, a, k, pace.dt)
    carried = u * wp.where(swimming_out.shape[1] > 0, 1.0, 0.0)  # who is carried turns and swims through what carries it
    w = limit_turn(v0 - carried, v - carried, bounds.turn_cosine, bounds.turn_sine)
    w = limit_speed(v0 - carried, w, bounds.slowest, bounds.fastest)
    if swimming_out.shape[1] > 0:
        write3(swimming_out, i, w)
    v = w + carried
    write3(particles_inout.velocity, i, v)
    write3(particles_inout.position, i, drift(x, v, pace.dt))


@wp.kernel(enable_backward=False)
def advance_flock(
    first: int,
    count: int,
    opening: int,
    pace: Pace,
    clock: wp.array[wp.int64],
    environment: wp.array[Environment],
    limits: wp.array[Limits],
    steering: wp.array2d[float],
    particles_inout: Particles,
    swimming_out: wp.array2d[float],
):
    """Move every boid through substep pace.first."""
    i = first + wp.tid()
    if i < count and started(clock, opening):
        fly(i, pace, environment[0], limits[0], steering, particles_inout, swimming_out)


@wp.func(inline=True)
def turned(n: wp.vec3, words: wp.vec4ui, noise: float, flat: wp.vec3) -> wp.vec3:
    """Return a unit vector turned by an angle uniform on ±½ noise [rad]: about `flat`, or where that is 0 about any axis across it."""
    u = (uniform(words[0]) - 0.5) * noise * INVERSE_TURN
    across = wp.where(wp.abs(n[0]) < 0.7, 1.0, 0.0)
    first = wp.cross(n, wp.vec3(across, 1.0 - across, 0.0))
    first = first / wp.sqrt(positive(wp.dot(first, first)))
    second = wp.cross(n, first)
    aside = first * cos_turns(uniform(words[1])) + second * sin_turns(uniform(words[1]))
    aside = wp.cross(flat, n) + aside * wp.where(wp.dot(flat, flat) == 0.0, 1.0, 0.0)
    return n * cos_turns(wp.abs(u)) + aside * (sin_turns(wp.abs(u)) * wp.where(u < 0.0, -1.0, 1.0))


@wp.func
def missing_axis(domain: Domain) -> wp.vec3:
    """Return the axis that a flat domain does not have; 0 in space."""
    rate = domain.rate
    return wp.vec3(wp.where(rate[0] > 0.0, 0.0, 1.0), wp.where(rate[1] > 0.0, 0.0, 1.0), wp.where(rate[2] > 0.0, 0.0, 1.0))


@wp.func(inline=True)
def common_course(v: wp.vec3, steering: wp.vec3, count: int) -> wp.vec3:
    """Return the unit vector along Σ v_j + v, from what alignment made of it, F = Σ v_j/n − v; along v where the sum is 0."""
    course = steering * float(count) + v * float(count + 1)
    square = wp.dot(course, course)
    own = wp.where(square == 0.0, 1.0, 0.0)
    course = course + v * own
    square = square + wp.dot(v, v) * own
    return course / wp.sqrt(positive(square))


@wp.func
def step_of(clock: wp.int64, pace: Pace) -> wp.int64:
    """Return the number of the substep, by which turns are drawn."""
    return (clock * wp.int64(pace.substep_count) + wp.int64(pace.first)) << wp.int64(32)


@wp.func
def wander(
    i: int,
    step: wp.int64,
    h: float,
    mode: Vicsek,
    flat: wp.vec3,
    steering: wp.array2d[float],
    neighbors: wp.array[int],
    particles_inout: Particles,
):
    """Move boid i along its heading, then give it the mean one of its neighborhood, turned at random.  Source: Vicsek et al. 1995."""
    v = read3(particles_inout.velocity, i)
    write3(particles_inout.position, i, drift(read3(particles_inout.position, i), v, h))
    n = common_course(v, read3(steering, i), neighbors[i])
    words = random_words(mode.key, step | wp.int64(i), NOISE)
    write3(particles_inout.velocity, i, turned(n, words, mode.noise, flat) * mode.speed)


@wp.kernel(enable_backward=False)
def advance_vicsek(
    first: int,
    count: int,
    opening: int,
    pace: Pace,
    clock: wp.array[wp.int64],
    domain: wp.array[Domain],
    mode: wp.array[Vicsek],
    steering: wp.array2d[float],
    neighbors: wp.array[int],
    particles_inout: Particles,
):
    """Move every boid of Vicsek's flock."""
    i = first + wp.tid()
    if i < count and started(clock, opening):
        step = step_of(clock[0], pace)
        wander(i, step, pace.dt, mode[0], missing_axis(domain[0]), steering, neighbors, particles_inout)


@wp.func(inline=True)
def reflected_place(x: float, low: float, edge: float) -> float:
    """Return a coordinate thrown back by the two walls of an axis [m]; who is far beyond stops at the wall."""
    below = wp.min(low + (low - x), low + edge)
    above = wp.max(low + edge - (x - (low + edge)), low)
    return wp.where(x < low, below, wp.where(x > low + edge, above, x))


@wp.func(inline=True)
def reflected_speed(x: float, v: float, low: float, edge: float) -> float:
    """Return the velocity along an axis of who is thrown back at x by its walls [m/s]."""
    return wp.where(x < low, wp.abs(v), wp.where(x > low + edge, -wp.abs(v), v))


@wp.func
def project_boid(i: int, domain: Domain, particles_inout: Particles):
    """Keep boid i in the domain: thrown back by its walls, or come in on the other side."""
    x = read3(particles_inout.position, i)
    if domain.boundary == PERIODIC:
        write3(particles_inout.position, i, wrap(x, domain))
    elif domain.boundary == CONTAIN:
        low = domain.low
        size = domain.size
        for axis in range(3):
            if size[axis] > 0.0:
                v = particles_inout.velocity[axis, i]
                particles_inout.position[axis, i] = reflected_place(x[axis], low[axis], size[axis])
                particles_inout.velocity[axis, i] = reflected_speed(x[axis], v, low[axis], size[axis])


@wp.kernel(enable_backward=False)
def project_domain(first: int, count: int, domain: wp.array[Domain], particles_inout: Particles):
    """Keep every boid in the domain."""
    i = first + wp.tid()
    if i < count and domain[0].boundary > 0:
        project_boid(i, domain[0], particles_inout)
