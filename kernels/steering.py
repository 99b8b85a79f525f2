"""Steering: what a boid does toward a goal, along a path, behind a leader, past what is in its way, or at random.

Symbols: x place [m], v velocity [m/s], s the speed it wants [m/s], c where the goal is and w how fast it moves. Nearly every behavior is
F = weight (desired velocity − v) with a weight in kg/s, the desired velocity of length s.  Source: Reynolds 1999.
"""

import warp as wp

from warpsim.kernels.birth import isotropic
from warpsim.kernels.clearance import measure_gap, measure_mesh_gap
from warpsim.kernels.collider import MESH, Collider, into_frame
from warpsim.kernels.domain import PERIODIC, Domain, fold
from warpsim.kernels.emission import Particles
from warpsim.kernels.environment import Environment, sample_strength
from warpsim.kernels.planar import read3, write3
from warpsim.kernels.random import random_words
from warpsim.kernels.signals import Signals

WANDER = 11  # channel of the places on the sphere ahead (random.py has the others)
MOST_LOOKS = 8  # ahead, for what is in the way


@wp.struct
class Behavior:
    kind: int  # place in BEHAVIORS
    weight: float  # [kg/s]
    speed: float  # s [m/s]
    radius: float  # within which it acts, slows down, strays from the path, wanders, or keeps away: each behavior says [m]
    distance: float  # ahead of the boid, or behind the leader [m]
    horizon: float  # how far it looks ahead [s]
    period: float  # of wandering [s]
    leader: int  # number of the boid that leads; −1: the goal does
    first: int  # places of the path in the table of points
    count: int
    closed: int  # 1: the path leads from its last point back to the first
    signal: wp.vec3i  # of the goal's place
    goal: wp.vec3  # c at the moment of the table [m]
    drift: wp.vec3  # w [m/s]
    key: wp.vec2ui  # of the random numbers


@wp.struct
class Boid:
    number: int
    x: wp.vec3
    v: wp.vec3
    time: wp.float64  # at the substep's beginning [s]
    moment: int  # row of the environment's tables


@wp.struct
class Scenery:
    points: wp.array[wp.vec3]  # of all paths
    domain: Domain
    position: wp.array2d[float]  # (3, capacity): of all boids
    velocity: wp.array2d[float]


@wp.func
def along(d: wp.vec3, length: float) -> wp.vec3:
    """Return a vector along d with a length; none where d has no direction."""
    square = wp.dot(d, d)
    return d * wp.where(square > 0.0, length / wp.sqrt(wp.max(square, 1.0e-30)), 0.0)


@wp.func
def seek(b: Behavior, boid: Boid, scenery: Scenery, environment: Environment) -> wp.vec3:
    """Return the force toward the goal, weight (s (c − x)/|c − x| − v); within the radius, if there is one."""
    d = fold(b.goal - boid.x, scenery.domain)
    return (along(d, b.speed) - boid.v) * (b.weight * wp.where(wp.dot(d, d) <= b.radius * b.radius, 1.0, 0.0))


@wp.func
def flee(b: Behavior, boid: Boid, scenery: Scenery, environment: Environment) -> wp.vec3:
    """Return the force away from the goal, weight (s (x − c)/|x − c| − v); within the radius, if there is one."""
    d = fold(boid.x - b.goal, scenery.domain)
    return (along(d, b.speed) - boid.v) * (b.weight * wp.where(wp.dot(d, d) <= b.radius * b.radius, 1.0, 0.0))


@wp.func
def arrive_at(b: Behavior, boid: Boid, d: wp.vec3) -> wp.vec3:
    """Return the force toward a place d away, slower and slower within the radius: weight (s min(1, |d|/radius) d/|d| − v)."""
    return (along(d, b.speed * wp.min(1.0, wp.length(d) / b.radius)) - boid.v) * b.weight


@wp.func
def arrive(b: Behavior, boid: Boid, scenery: Scenery, environment: Environment) -> wp.vec3:
    """Return the force that brings a boid to the goal and to rest there."""
    return arrive_at(b, boid, fold(b.goal - boid.x, scenery.domain))


@wp.func
def lead(b: Behavior, d: wp.vec3) -> float:
    """Return how long a goal d away takes to reach at the wanted speed, at most the horizon [s]."""
    return wp.min(wp.length(d) / wp.max(b.speed, 1.0e-6), b.horizon)


@wp.func
def pursue(b: Behavior, boid: Boid, scenery: Scenery, environment: Environment) -> wp.vec3:
    """Return the force toward where the goal will be, c + w |c − x|/s, no farther ahead than the horizon."""
    d = fold(b.goal - boid.x, scenery.domain)
    return (along(d + b.drift * lead(b, d), b.speed) - boid.v) * b.weight


@wp.func
def evade(b: Behavior, boid: Boid, scenery: Scenery, environment: Environment) -> wp.vec3:
    """Return the force away from where the goal will be; within the radius, if there is one."""
    d = fold(b.goal - boid.x, scenery.domain)
    near = wp.where(wp.dot(d, d) <= b.radius * b.radius, 1.0, 0.0)
    return (along(d + b.drift * lead(b, d), -b.speed) - boid.v) * (b.weight * near)


@wp.func
def wandering(b: Behavior, boid: Boid, domain: Domain) -> wp.vec3:
    """Return a vector that changes smoothly in time: between random places on the unit sphere, one each period, by 3 s² − 2 s³."""
    share = boid.time / wp.float64(b.period)
    turn = wp.floor(share)
    s = float(share - turn)
    s = s * s * (3.0 - 2.0 * s)
    n = wp.int64(turn)
    before = random_words(b.key, n << wp.int64(32) | wp.int64(boid.number), WANDER)
    after = random_words(b.key, (n + wp.int64(1)) << wp.int64(32) | wp.int64(boid.number), WANDER)
    w = isotropic(before[0], before[1]) * (1.0 - s) + isotropic(after[0], after[1]) * s
    rate = domain.rate
    if wp.dot(rate, rate) > 0.0:
        for axis in range(3):
            w[axis] = w[axis] * wp.where(rate[axis] > 0.0, 1.0, 0.0)
    return w


@wp.func
def wander(b: Behavior, boid: Boid, scenery: Scenery, environment: Environment) -> wp.vec3:
    """Return the force toward a place that roams a sphere of the radius about a point so far ahead."""
    d = along(boid.v, b.distance) + wandering(b, boid, scenery.domain) * b.radius
    return (along(d, b.speed) - boid.v) * b.weight


@wp.func
def path_point(b: Behavior, scenery: Scenery, k: int) -> wp.vec3:
    """Return point k of the path, counted round."""
    return scenery.points[b.first + k % b.count]


@wp.func
def follow(b: Behavior, boid: Boid, scenery: Scenery, environment: Environment) -> wp.vec3:
    """Return the force back to the path of who would be farther from it than the radius, and on along it."""
    future = boid.x + boid.v * b.horizon
    best = float(1.0e30)
    near = wp.vec3()
    course = wp.vec3()
    for k in range(b.count - 1 + b.closed):
        a = path_point(b, scenery, k)
        e = path_point(b, scenery, k + 1) - a
        square = wp.dot(e, e)
        if square > 0.0:
            q = a + e * wp.clamp(wp.dot(future - a, e) / square, 0.0, 1.0)
            gap = wp.dot(future - q, future - q)
            if gap < best:
                best = gap
                near = q
                course = e
    ahead = along(course, b.speed * wp.max(b.horizon, 1.0e-3))
    if best <= b.radius * b.radius:
        return (along(course, b.speed) - boid.v) * b.weight
    return (along(near + ahead - boid.x, b.speed) - boid.v) * b.weight


@wp.func
def trail_leader(b: Behavior, boid: Boid, scenery: Scenery, environment: Environment) -> wp.vec3:
    """Return the force to a place behind the leader, slower within the radius; who is in the leader's way makes room."""
    c = b.goal
    w = b.drift
    if b.leader >= 0:
        if boid.number == b.leader:
            return wp.vec3()
        c = read3(scenery.position, b.leader)
        w = read3(scenery.velocity, b.leader)
    d = fold(c - boid.x, scenery.domain)
    e = -d  # from the leader
    ahead = wp.dot(e, along(w, 1.0))
    aside = e - along(w, ahead)
    if ahead > 0.0 and wp.dot(e, e) < 4.0 * b.distance * b.distance and wp.dot(aside, aside) < b.distance * b.distance:
        return (along(aside, b.speed) - boid.v) * b.weight
    return arrive_at(b, boid, d - along(w, b.distance))


@wp.func
def gap_ahead(c: Collider, x: wp.vec3, reach: float) -> wp.vec4:
    """Return the gap between a place and a collider, NEVER if it is beyond reach, and the normal in the scene."""
    q = into_frame(c.center, c.rotation, x)
    gap = measure_gap(c, q)
    if c.kind == MESH:
        gap = measure_mesh_gap(c, q, reach, 0)
    n = wp.quat_rotate(c.rotation, gap.n)
    return wp.vec4(gap.g, n[0], n[1], n[2])


@wp.func
def avoid(b: Behavior, boid: Boid, scenery: Scenery, environment: Environment) -> wp.vec3:
    """Return the force past the first collider that the way ahead would touch within the horizon, the stronger the nearer it is."""
    speed = wp.length(boid.v)
    reach = speed * b.horizon
    heading = along(boid.v, 1.0)
    nearest = float(reach + b.radius)
    away = wp.vec3()
    for k in range(environment.colliders.shape[1]):
        c = environment.colliders[boid.moment, k]
        way = float(0.0)
        for _look in range(MOST_LOOKS):
            ahead = gap_ahead(c, boid.x + heading * way, reach + b.radius)
            if ahead[0] < b.radius:
                if way < nearest:
                    nearest = way
                    away = wp.vec3(ahead[1], ahead[2], ahead[3])
                break
            way = way + ahead[0] - 0.5 * b.radius
            if way > reach:
                break
    if nearest > reach:
        return wp.vec3()
    aside = away - heading * wp.dot(away, heading)
    if wp.dot(aside, aside) < 1.0e-6:  # straight at it: any way round
        across = wp.where(wp.abs(heading[1]) < 0.9, wp.vec3(0.0, 1.0, 0.0), wp.vec3(1.0, 0.0, 0.0))
        aside = wp.cross(across, heading)
    urgency = 1.0 - nearest / wp.max(reach + b.radius, 1.0e-6)
    return (along(aside, b.speed) - heading * (wp.dot(heading, boid.v) * urgency)) * (b.weight * urgency)


@wp.func
def inward(x: float, v: float, low: float, edge: float, b: Behavior) -> float:
    """Return how much a boid must turn inward along an axis: 0 beyond the radius of both walls, ±1 at a wall."""
    future = x + v * b.horizon
    below = wp.clamp((low + b.radius - future) / b.radius, 0.0, 1.0)
    above = wp.clamp((future - (low + edge - b.radius)) / b.radius, 0.0, 1.0)
    return below - above


@wp.func
def contain(b: Behavior, boid: Boid, scenery: Scenery, environment: Environment) -> wp.vec3:
    """Return the force away from walls of the domain that are nearer than the radius within the horizon, the stronger the nearer."""
    size = scenery.domain.size
    low = scenery.domain.low
    turn = wp.vec3()
    for axis in range(3):
        if size[axis] > 0.0 and scenery.domain.boundary != PERIODIC:
            turn[axis] = inward(boid.x[axis], boid.v[axis], low[axis], size[axis], b)
    return turn * (b.speed * b.weight)


BEHAVIORS = {
    "seek": seek,
    "flee": flee,
    "arrive": arrive,
    "pursue": pursue,
    "evade": evade,
    "wander": wander,
    "path": follow,
    "leader": trail_leader,
    "avoid": avoid,
    "contain": contain,
}


@wp.func
def steer(b: Behavior, boid: Boid, scenery: Scenery, environment: Environment) -> wp.vec3:
    """Return nothing: there is no such behavior."""
    return wp.vec3()


def with_case(kind, formula, otherwise):
    """Chain one more behavior, as in flow.py."""

    @wp.func(name="steer")
    def steer(b: Behavior, boid: Boid, scenery: Scenery, environment: Environment) -> wp.vec3:
        """Return the force of one behavior [N]."""
        if b.kind == kind:
            return formula(b, boid, scenery, environment)
        return otherwise(b, boid, scenery, environment)

    return steer


for _kind, _formula in enumerate(BEHAVIORS.values()):
    steer = with_case(_kind, _formula, steer)


@wp.kernel(enable_backward=False)
def sample_behaviors(
    first: int,
    start_time: wp.array[wp.float64],
    dt: wp.float64,
    signals: Signals,
    behaviors: wp.array[Behavior],
    table_out: wp.array2d[Behavior],
):
    """Fill the table's row of substep s: each behavior with its goal's place at its beginning, and its velocity within it."""
    s = first + wp.tid()
    begin = start_time[0] + wp.float64(s) * dt
    for k in range(behaviors.shape[0]):
        b = behaviors[k]
        if b.signal[0] >= 0:
            b.goal = sample_strength(signals, b.signal, begin)
            b.drift = (sample_strength(signals, b.signal, begin + dt) - b.goal) * (1.0 / float(dt))
        table_out[s, k] = b


@wp.kernel(enable_backward=False)
def accumulate_steering(
    first: int,
    s: int,
    count: int,
    dt: wp.float64,
    start_time: wp.array[wp.float64],
    table: wp.array2d[Behavior],
    points: wp.array[wp.vec3],
    domain: wp.array[Domain],
    environment: wp.array[Environment],
    particles: Particles,
    steering_inout: wp.array2d[float],
):
    """Add what its behaviors make every boid do in substep s [N]."""
    i = first + wp.tid()
    if i < count:
        boid = Boid()
        boid.number = i
        boid.x = read3(particles.position, i)
        boid.v = read3(particles.velocity, i)
        boid.time = start_time[0] + wp.float64(s) * dt
        boid.moment = 2 * s
        scenery = Scenery()
        scenery.points = points
        scenery.domain = domain[0]
        scenery.position = particles.position
        scenery.velocity = particles.velocity
        force = read3(steering_inout, i)
        for k in range(table.shape[1]):
            force = force + steer(table[s, k], boid, scenery, environment[0])
        write3(steering_inout, i, force)
