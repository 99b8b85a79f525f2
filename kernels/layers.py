"""Layers: what the points of a sheet do to those that it folds onto, so that it never passes through itself.

Symbols: d the distance kept between layers [m], D = |x_i − x_j| that of two points, n = (x_i − x_j)/D; u = v_i − v_j, u_n = u·n and
u_t = u − u_n n; w = 1/m; N_i how many points touch i; μ the friction. Two points touch where D < d. What one does to the other is
  position  α w_i/(w_i + w_j) ((d − D) n + h Δu_t),   velocity  α w_i/(w_i + w_j) (Δu_n n + Δu_t),   α = min(ω/max(N_i, N_j), 1),
  Δu_n = max(−u_n, 0),   Δu_t = −u_t min(1, μ Δu_n/|u_t|):
an impact without rebound and Coulomb's friction, taken from all pairs at once (Jacobi). i and j get opposite parts, so momentum stays; with
ω <= 2 all pairs together never add kinetic energy (docs/adr/0027-self-collision.md).

A substep is looked at beside the sheet's common motion t. No pair comes nearer than the core c: a substep in which one would is braked as a
whole, no point going farther toward another than half of what is left between them.
Source: Bridson, Fedkiw & Anderson 2002 for impacts and friction; Wang et al. 2023, Chen et al. 2025 for bounds on displacement.
"""

import warp as wp

from warpsim.kernels.emission import Particles
from warpsim.kernels.planar import read3, write3
from warpsim.kernels.points import started

LANES = wp.constant(64)  # points of a slice of the lists; the native loops' block
RELAXATION = wp.constant(1.75)  # ω, between 1 and 2: how much of what all pairs ask for is done at once
DEEP = wp.constant(0.94)  # 0.97²: a pair that a pin or a collider has driven so far into its core is left to contact alone
CLOSEST = wp.constant(1.0e-30)  # [m²]: points nearer than 1e-15 m have no direction, and push along y

DISTANCE, CORE, FRICTION, REACH, DRIFT, STRIDE, MOST_PUSH, STEP, FOLLOWS = range(9)  # numbers of Layers
SEARCH, BRISK, ALARM, CROWDED, SEARCHES, BRAKES = range(6)  # flags of Layers; the last two count, since the frame's beginning


@wp.struct
class Layers:
    point_count: int
    rows: int  # of a slice of the lists: the longest list that there can be
    opening: int  # number of the frame in which nothing moves
    numbers: wp.array[float]  # (9): see DISTANCE …; lengths [m], the substep [s]; FOLLOWS 0: t is none
    rest: wp.array[wp.vec3]  # (1): a·a, a·b, b·b of the cells' edges at rest [m²]
    place: wp.array[wp.vec2i]  # (capacity): i and j of a point in the sheet
    inverse_mass: wp.array[float]  # (capacity) [1/kg]; 0 for a point that is pinned
    start: wp.array2d[float]  # (6, capacity): x, v at the substep's beginning
    reference: wp.array2d[float]  # (3, capacity): where the points were when the lists were made [m]
    count: wp.array[int]  # (capacity): how many are in a point's list
    near: wp.array[int]  # (slices · rows · 64): who they are, in the order of their numbers
    touches: wp.array[int]  # (capacity): how many of them touch it
    push: wp.array2d[float]  # (6, capacity): what they do to its x [m] and v [m/s]
    boxes: wp.array2d[float]  # (13, slices): least and largest of x0 − reference and of x − x0 [m], largest |x − x0|² [m²]
    middle: wp.array[float]  # (3): the common motion t [m]: the middle of all displacements of a sheet that flies fast, else none
    flags: wp.array[int]  # (6): see SEARCH …


@wp.struct
class Push:
    x: wp.vec3  # [m]
    v: wp.vec3  # [m/s]


@wp.func(inline=True)
def nearest_square(r0: wp.vec3, r1: wp.vec3) -> float:
    """Return the least |r|² on the straight way from r0 to r1 [m²]."""
    d = r1 - r0
    m = r0 + d * wp.clamp(-wp.dot(r0, d) / wp.max(wp.dot(d, d), CLOSEST), 0.0, 1.0)
    return wp.dot(m, m)


@wp.func(inline=True)
def collides(r0: wp.vec3, r1: wp.vec3, core: float) -> int:
    """Return 1 if two points that did not begin deep in the core come into it on the way from r0 to r1, nearer than they began."""
    least = nearest_square(r0, r1)
    began = wp.dot(r0, r0)
    return wp.where(least < core * core and least < began and began > DEEP * core * core, 1, 0)


@wp.func
def push_pair(r: wp.vec3, u: wp.vec3, side: float, d: float, friction: float, most: float, h: float) -> Push:
    """Return how a pair changes r = x_i − x_j and u = v_i − v_j; side ±1 is where i lies if r is none.  Source: Bridson 2002."""
    push = Push()
    square = wp.dot(r, r)
    length = wp.sqrt(square)
    n = wp.where(square > CLOSEST, r / wp.max(length, 1.0e-15), wp.vec3(0.0, side, 0.0))
    stop = wp.max(-wp.dot(u, n), 0.0)
    across = u - n * wp.dot(u, n)
    slip = wp.length(across)
    rub = across * wp.where(slip > friction * stop, -friction * stop / wp.max(slip, 1.0e-20), -1.0)
    push.v = n * stop + rub
    push.x = n * wp.min(d - length, most) + rub * h
    return push


@wp.func
def start_at(layers: Layers, i: int) -> wp.vec3:
    """Return where the substep found point i [m]."""
    return wp.vec3(layers.start[0, i], layers.start[1, i], layers.start[2, i])


@wp.func
def common_motion(layers: Layers) -> wp.vec3:
    """Return the motion t that the sheet makes as a whole in this substep [m]."""
    return wp.vec3(layers.middle[0], layers.middle[1], layers.middle[2])


@wp.func(inline=True)
def entry_of(i: int, row: int, rows: int) -> int:
    """Return the place of a row of point i's list."""
    return (i // LANES * rows + row) * LANES + i % LANES


@wp.func
def slow_down(i: int, share: float, layers: Layers, particles_inout: Particles):
    """Let point i do only a share of its displacement beside the common motion, and of its velocity."""
    x0 = start_at(layers, i)
    t = common_motion(layers)
    along = t * (1.0 / layers.numbers[STEP])
    write3(particles_inout.position, i, x0 + t + (read3(particles_inout.position, i) - x0 - t) * share)
    write3(particles_inout.velocity, i, along + (read3(particles_inout.velocity, i) - along) * share)


@wp.kernel(enable_backward=False)
def limit_strides(first: int, layers: Layers, particles_inout: Particles):
    """Keep every free point within a stride of the common motion: the lists know of nobody who comes from farther away."""
    i = first + wp.tid()
    if layers.flags[BRISK] == 1 and i < layers.point_count and layers.inverse_mass[i] > 0.0:
        beside = wp.length(read3(particles_inout.position, i) - start_at(layers, i) - common_motion(layers))
        if beside > layers.numbers[STRIDE]:
            slow_down(i, layers.numbers[STRIDE] / beside, layers, particles_inout)


@wp.func
def count_near(i: int, layers: Layers, particles: Particles) -> int:
    """Return N_i, how many touch point i."""
    x = read3(particles.position, i)
    square = layers.numbers[DISTANCE] * layers.numbers[DISTANCE]
    total = int(0)
    for row in range(layers.count[i]):
        r = x - read3(particles.position, layers.near[entry_of(i, row, layers.rows)])
        total = total + wp.where(wp.dot(r, r) < square, 1, 0)
    return total


@wp.kernel(enable_backward=False)
def count_touches(first: int, layers_inout: Layers, particles: Particles):
    """Count who touches every point."""
    i = first + wp.tid()
    if i < layers_inout.point_count:
        layers_inout.touches[i] = count_near(i, layers_inout, particles)


@wp.func
def push_at(i: int, layers: Layers, particles: Particles) -> Push:
    """Return what all who touch point i do to it, in the order of their numbers."""
    x = read3(particles.position, i)
    v = read3(particles.velocity, i)
    w = layers.inverse_mass[i]
    d = layers.numbers[DISTANCE]
    total = Push()
    for row in range(layers.count[i]):
        j = layers.near[entry_of(i, row, layers.rows)]
        r = x - read3(particles.position, j)
        if wp.dot(r, r) < d * d:
            u = v - read3(particles.velocity, j)
            one = push_pair(r, u, wp.where(i < j, 1.0, -1.0), d, layers.numbers[FRICTION], layers.numbers[MOST_PUSH], layers.numbers[STEP])
            crowd = float(wp.max(layers.touches[i], layers.touches[j]))
            part = w / (w + layers.inverse_mass[j]) * wp.min(RELAXATION / crowd, 1.0)
            total.x = total.x + one.x * part
            total.v = total.v + one.v * part
    return total


@wp.kernel(enable_backward=False)
def gather_pushes(first: int, layers_inout: Layers, particles: Particles):
    """Store what those who touch it do to every point that is touched."""
    i = first + wp.tid()
    if i < layers_inout.point_count and layers_inout.touches[i] > 0:
        push = push_at(i, layers_inout, particles)
        for axis in range(3):
            layers_inout.push[axis, i] = push.x[axis]
            layers_inout.push[3 + axis, i] = push.v[axis]


@wp.kernel(enable_backward=False)
def advance_touched(first: int, clock: wp.array[wp.int64], layers: Layers, particles_inout: Particles):
    """Move every point that is touched as gather_pushes says."""
    i = first + wp.tid()
    if i < layers.point_count and layers.touches[i] > 0 and started(clock, layers.opening):
        for axis in range(3):
            particles_inout.position[axis, i] = particles_inout.position[axis, i] + layers.push[axis, i]
            particles_inout.velocity[axis, i] = particles_inout.velocity[axis, i] + layers.push[3 + axis, i]


@wp.func
def alarm_at(i: int, layers: Layers, particles: Particles) -> int:
    """Return 1 if point i went farther than a stride beside the common motion, or into another's core."""
    x0 = start_at(layers, i)
    x1 = read3(particles.position, i)
    beside = x1 - x0 - common_motion(layers)
    stride = layers.numbers[STRIDE] * 1.0001  # one that was slowed down to it is not over it
    found = wp.where(layers.inverse_mass[i] > 0.0 and wp.dot(beside, beside) > stride * stride, 1, 0)
    for row in range(layers.count[i]):
        j = layers.near[entry_of(i, row, layers.rows)]
        found = found | collides(x0 - start_at(layers, j), x1 - read3(particles.position, j), layers.numbers[CORE])
    return found


@wp.kernel(enable_backward=False)
def mark_alarm(first: int, layers_inout: Layers, particles: Particles):
    """Note whether any point went too far."""
    i = first + wp.tid()
    if i < layers_inout.point_count and alarm_at(i, layers_inout, particles) == 1:
        layers_inout.flags[ALARM] = 1


@wp.func
def share_left(i: int, layers: Layers, particles: Particles) -> float:
    """Return which share of its displacement beside the common motion brings point i into nobody's core, whatever the others do."""
    x0 = start_at(layers, i)
    t = common_motion(layers)
    beside = read3(particles.position, i) - x0 - t
    share = wp.min(layers.numbers[STRIDE] / wp.max(wp.length(beside), 1.0e-20), 1.0)
    for row in range(layers.count[i]):
        j = layers.near[entry_of(i, row, layers.rows)]
        r = x0 - start_at(layers, j)
        length = wp.length(r)
        n = r / wp.max(length, 1.0e-15)
        room = length - layers.numbers[CORE]
        if layers.inverse_mass[j] > 0.0:
            room = 0.5 * room
        else:  # one that is pinned goes where it must
            room = room - wp.max(wp.dot(read3(particles.position, j) - start_at(layers, j) - t, n), 0.0)
        nearer = -wp.dot(beside, n)
        if nearer > 0.0 and length * length > DEEP * layers.numbers[CORE] * layers.numbers[CORE]:
            share = wp.min(share, wp.max(room, 0.0) / nearer)
    return share


@wp.kernel(enable_backward=False)
def limit_ways(first: int, clock: wp.array[wp.int64], layers: Layers, particles_inout: Particles):
    """Brake a substep in which somebody went too far: every free point goes only so far that no core can be entered."""
    i = first + wp.tid()
    if layers.flags[ALARM] == 1 and i < layers.point_count and layers.inverse_mass[i] > 0.0 and started(clock, layers.opening):
        share = share_left(i, layers, particles_inout)
        if share < 1.0:
            slow_down(i, share, layers, particles_inout)
