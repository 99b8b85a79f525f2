"""Springs: what the neighbors of a network's point do to it, gathered by each point over its springs in a fixed order.

Symbols: d = x_j − x_i [m], d̂ its direction, r rest length [m], k stiffness [N/m], c damping [N·s/m]; the force on i is
F = (k (|d| − r) + c (v_j − v_i)·d̂) d̂. d changes its sign with i and j and nothing else does, so action is reaction to the last bit.

The springs of a point lie in slices of 64 points (sliced ELLPACK; Kreutzer et al. 2014): a row of a slice holds one spring of each
of its points, so that a loop over points reads whole cache lines. Where a point has none in a row, stiffness and damping are 0.
"""

import warp as wp

from warpsim.kernels.emission import FAULT, Particles
from warpsim.kernels.environment import Environment, sample_strength
from warpsim.kernels.integration import inside
from warpsim.kernels.planar import read3, write3
from warpsim.kernels.signals import Signals, sample_signal

SLICE = wp.constant(64)  # points of a slice; the native loop's block
SHORTEST = wp.constant(1.0e-30)  # [m²]: closer than 1e-15 m the direction, and with it the force, goes to zero


@wp.struct
class Network:
    point_count: int
    begin: wp.array[int]  # (slices + 1): first row of each slice
    neighbor: wp.array[int]  # (rows · 64): the point at the other end
    rest: wp.array[float]  # (rows · 64): rest length [m]
    stiffness: wp.array[float]  # (rows · 64) [N/m]
    damping: wp.array[float]  # (rows · 64) [N·s/m]
    inverse_mass: wp.array[float]  # (capacity) [1/kg]; 0 for a point that is pinned


@wp.struct
class SpringTable:
    ends: wp.array[wp.vec2i]  # (m): the points that each spring joins
    rest: wp.array[float]  # (m): rest length [m]
    stiffness: wp.array[float]  # (m) [N/m]
    damping: wp.array[float]  # (m) [N·s/m]


@wp.struct
class Pins:
    point: wp.array[int]  # (pins): the points that are held
    home: wp.array2d[float]  # (3, pins): where, but for the motion [m]
    signals: Signals
    path: wp.array[int]  # (pins): which of the paths, −1: none; those that move alike have one
    paths: wp.array[wp.vec3i]  # (paths): signals of each
    displacement: wp.array2d[wp.vec3]  # (substeps + 1, paths): at the beginning of each substep, and at the frame's end [m]
    place: wp.array2d[wp.vec3]  # (moments, paths): displacement at each half of a substep [m], for solvers that ask for stages
    rate: wp.array2d[wp.vec3]  # (moments, paths): how fast it changes there [m/s]
    point_count: int  # of the whole network


@wp.func(inline=True)
def spring_force(xi: wp.vec3, vi: wp.vec3, xj: wp.vec3, vj: wp.vec3, r: float, k: float, c: float) -> wp.vec3:
    """Return the force on i, F = (k(|d| − r) + c (v_j − v_i)·d̂) d̂ [N]; zero where the ends coincide.  Source: Hooke 1678; Provot 1995."""
    d = xj - xi
    d2 = wp.dot(d, d)
    inverse = 1.0 / wp.sqrt(wp.max(d2, SHORTEST))
    n = d * inverse
    return n * (k * (d2 * inverse - r) + c * wp.dot(n, vj - vi))


@wp.func
def sum_springs(i: int, network: Network, position: wp.array2d[float], velocity: wp.array2d[float]) -> wp.vec3:
    """Return the sum of the forces of all springs of point i [N], in their order."""
    x = read3(position, i)
    v = read3(velocity, i)
    force = wp.vec3()
    for row in range(network.begin[i // SLICE], network.begin[i // SLICE + 1]):
        e = row * SLICE + i % SLICE
        j = network.neighbor[e]
        force = force + spring_force(
            x, v, read3(position, j), read3(velocity, j), network.rest[e], network.stiffness[e], network.damping[e]
        )
    return force


@wp.kernel(enable_backward=False)
def accumulate_springs(first: int, network: Network, particles: Particles, internal_out: wp.array2d[float]):
    """Store what the springs do to every point, a = F/m [m/s²]; zero for one that is pinned."""
    i = first + wp.tid()
    if i < network.point_count:
        write3(internal_out, i, sum_springs(i, network, particles.position, particles.velocity) * network.inverse_mass[i])


@wp.kernel(enable_backward=False)
def kick_points(
    first: int,
    h: float,
    count: int,
    opening: int,
    clock: wp.array[wp.int64],
    internal: wp.array2d[float],
    velocity_inout: wp.array2d[float],
):
    """Let the springs act for a time h [s], v ← v + h a; nothing moves in the opening frame, at whose end the motion begins."""
    i = first + wp.tid()
    if i < count and int(clock[0]) > opening:
        write3(velocity_inout, i, read3(velocity_inout, i) + read3(internal, i) * h)


@wp.kernel(enable_backward=False)
def sample_paths(first: int, dt: wp.float64, start_time: wp.array[wp.float64], pins: Pins, displacement_out: wp.array2d[wp.vec3]):
    """Fill the table of the pins' displacements: element s · paths + k is path k at the beginning of substep s."""
    count = pins.paths.shape[0]
    s = (first + wp.tid()) // count
    k = (first + wp.tid()) % count
    displacement_out[s, k] = sample_strength(pins.signals, pins.paths[k], start_time[0] + wp.float64(s) * dt)


@wp.func
def hold_pin(
    p: int,
    s: int,
    dt: wp.float64,
    pins: Pins,
    environment: Environment,
    particles_inout: Particles,
    counters_inout: wp.array[wp.int64],
):
    """Put a pin where it is held at the end of substep s, with the velocity that takes it there; note one that leaves the world."""
    before = wp.vec3()
    after = wp.vec3()
    if pins.path[p] >= 0:
        before = pins.displacement[s, pins.path[p]]
        after = pins.displacement[s + 1, pins.path[p]]
    x = read3(pins.home, p) + after
    v = (after - before) * (1.0 / float(dt))
    write3(particles_inout.position, pins.point[p], x)
    write3(particles_inout.velocity, pins.point[p], v)
    if inside(x, v, environment.extent) == 0:
        counters_inout[FAULT] = wp.int64(1)


@wp.kernel(enable_backward=False)
def project_pins(
    first: int,
    s: int,
    dt: wp.float64,
    pins: Pins,
    environment: wp.array[Environment],
    particles_inout: Particles,
    counters_inout: wp.array[wp.int64],
):
    """Put every pin where it is held at the end of substep s."""
    hold_pin(first + wp.tid(), s, dt, pins, environment[0], particles_inout, counters_inout)


@wp.func
def signal_rate(signals: Signals, signal: int, t: wp.float64, step: wp.float64) -> wp.float64:
    """Return the rate of a signal by differences over two steps to either side, of fourth order."""
    near = sample_signal(signals, signal, t + step) - sample_signal(signals, signal, t - step)
    far = sample_signal(signals, signal, t + step * wp.float64(2.0)) - sample_signal(signals, signal, t - step * wp.float64(2.0))
    return (wp.float64(8.0) * near - far) / (wp.float64(12.0) * step)


@wp.kernel(enable_backward=False)
def sample_courses(
    first: int,
    dt: wp.float64,
    start_time: wp.array[wp.float64],
    pins: Pins,
    place_out: wp.array2d[wp.vec3],
    rate_out: wp.array2d[wp.vec3],
):
    """Fill the tables of the pins' displacements and their rates: element m · paths + k is path k at moment m, in half substeps."""
    count = pins.paths.shape[0]
    m = (first + wp.tid()) // count
    k = (first + wp.tid()) % count
    t = start_time[0] + wp.float64(m) * (wp.float64(0.5) * dt)
    rate = wp.vec3()
    for axis in range(3):
        if pins.paths[k][axis] >= 0:
            rate[axis] = float(signal_rate(pins.signals, pins.paths[k][axis], t, wp.float64(0.125) * dt))
    place_out[m, k] = sample_strength(pins.signals, pins.paths[k], t)
    rate_out[m, k] = rate


@wp.kernel(enable_backward=False)
def place_pins(first: int, moment: int, pins: Pins, position_out: wp.array2d[float], velocity_out: wp.array2d[float]):
    """Put every pin that moves where it is at a moment, in half substeps, with the velocity that it has there."""
    p = first + wp.tid()
    if pins.path[p] >= 0:
        write3(position_out, pins.point[p], read3(pins.home, p) + pins.place[moment, pins.path[p]])
        write3(velocity_out, pins.point[p], pins.rate[moment, pins.path[p]])
