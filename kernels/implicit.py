"""Implicit Euler for springs: the linear system of one substep, gathered by each point over its springs in a fixed order.

Symbols: h substep [s]; x places where it begins [m]; u velocities once all but the springs has acted [m/s]; sought is the change of
velocity y that the springs make, with the forces of the substep's end, linear in the way there:
(M + B) y = h f(x) − B u, where B gathers h² K + h C. A spring along n of length l with rest length r adds to B what resists p_i − p_j:
β I + w wᵀ with β = h² k max(0, 1 − r/l) across it and ww = h² k + h c − β along it. Without the max a compressed spring would push
sideways, and B would not be positive semidefinite (Choi & Ko 2002).  Source: Baraff & Witkin 1998.
"""

import warp as wp

from warpsim.kernels.elementary import mean_decay
from warpsim.kernels.emission import Particles
from warpsim.kernels.environment import Environment, drag_rate
from warpsim.kernels.planar import read3, write3
from warpsim.kernels.points import started
from warpsim.kernels.springs import SHORTEST, SLICE, SpringTable

SCATTERED = wp.constant(1 << 30)  # instead of a step: the neighbors of the row lie anywhere
# h² k and h c count as no more than so many times the mass of a spring's ends: 32-bit velocities lose the mass beside more. By its ends'
# weight such a spring is stretched by g h²/10⁵, 2e-9 m at 4 substeps a frame.
STIFFEST = wp.constant(1.0e5)
LIGHTEST = wp.constant(1.0e-30)  # [1/kg]: between two pins nothing is light
Factor = wp.types.vector(length=6, dtype=float)


@wp.struct
class Weave:
    point_count: int
    reach: int  # columns of the vectors before the first point, and behind the last
    begin: wp.array[int]  # (slices + 1): first row of each slice of 64 points
    step: wp.array[int]  # (rows): neighbor − point throughout the row, or SCATTERED
    neighbor: wp.array[int]  # (rows · 64): the point at the other end
    spring: wp.array[int]  # (rows · 64): number of the spring; −1: none
    weight: wp.array2d[float]  # (rows, 4 · 64): w in three parts, then β [√kg and kg], this substep's
    inertia: wp.array[float]  # (capacity) m/φ(k h) [kg], what drag of rate k leaves of a substep's kick counted as mass
    free: wp.array[float]  # (capacity) 1/m [1/kg]; 0 for a point that is pinned


@wp.struct
class System:
    h: float  # substep [s]
    start: wp.array2d[float]  # (6, capacity): x [m] and v [m/s] where the substep begins
    direction: wp.array2d[float]  # (3, reach + capacity + reach): the direction p of the search [m/s]
    image: wp.array2d[float]  # (3, capacity): (M + B) p [kg m/s]
    residual: wp.array2d[float]  # (3, capacity): what is missing to the right side [kg m/s]
    scaled: wp.array2d[float]  # (3, capacity): L⁻¹ times it, L Lᵀ being the block of the point itself [√kg m/s]
    change: wp.array2d[float]  # (3, capacity): y so far [m/s]
    factor: wp.array2d[float]  # (6, capacity): L⁻¹ by rows [1/√kg]; zero for pins


@wp.struct
class Tie:
    w: wp.vec3  # [√kg]
    beta: float  # [kg]
    impulse: wp.vec3  # h f on i [kg m/s]


@wp.func(inline=True)
def tie_of(d: wp.vec3, r: float, k: float, c: float, h: float, lightness: float) -> Tie:
    """Return what a spring with d = x_j − x_i adds to B and the right side; lightness is 1/m_i + 1/m_j; ends may coincide."""
    d2 = wp.dot(d, d)
    inverse = 1.0 / wp.sqrt(wp.max(d2, SHORTEST))
    n = d * inverse
    across = wp.clamp(1.0 - r * inverse, 0.0, 1.0)
    most = STIFFEST / wp.max(lightness, LIGHTEST)
    hhk = wp.min(h * h * k, most)
    tie = Tie()
    tie.w = n * wp.sqrt(hhk * (1.0 - across) + wp.min(h * c, most))
    tie.beta = hhk * across
    tie.impulse = n * (hhk / h * (d2 * inverse - r))
    return tie


@wp.func(inline=True)
def resist(w: wp.vec3, beta: float, e: wp.vec3) -> wp.vec3:
    """Return (β I + w wᵀ) e: how a spring resists that its ends part by e."""
    return e * beta + w * wp.dot(w, e)


@wp.func(inline=True)
def inverse_factor(m: wp.float64, a: wp.float64, b: wp.float64, c: wp.float64, d: wp.float64, e: wp.float64, f: wp.float64) -> Factor:
    """Return L⁻¹ by rows of the matrix m I + [a b c; b d e; c e f] = L Lᵀ, whose bracket is positive semidefinite.  Source: Cholesky."""
    l11 = wp.sqrt(m + a)
    l21 = b / l11
    l31 = c / l11
    l22 = wp.sqrt(wp.max(m + d - l21 * l21, m))  # what elimination leaves is no less than m, but for rounding
    l32 = (e - l31 * l21) / l22
    l33 = wp.sqrt(wp.max(m + f - l31 * l31 - l32 * l32, m))
    i11 = wp.float64(1.0) / l11
    i22 = wp.float64(1.0) / l22
    i33 = wp.float64(1.0) / l33
    i21 = -l21 * i11 * i22
    i32 = -l32 * i22 * i33
    i31 = (l21 * l32 - l31 * l22) * i11 * i22 * i33
    return Factor(float(i11), float(i21), float(i22), float(i31), float(i32), float(i33))


@wp.func(inline=True)
def scale_down(factor: Factor, r: wp.vec3) -> wp.vec3:
    """Return L⁻¹ r."""
    y = factor[1] * r[0] + factor[2] * r[1]
    return wp.vec3(factor[0] * r[0], y, factor[3] * r[0] + factor[4] * r[1] + factor[5] * r[2])


@wp.func(inline=True)
def scale_back(factor: Factor, s: wp.vec3) -> wp.vec3:
    """Return L⁻ᵀ s, so that scale_back(scale_down(r)) is the inverse of the point's own block times r."""
    x = factor[0] * s[0] + factor[1] * s[1] + factor[3] * s[2]
    return wp.vec3(x, factor[2] * s[1] + factor[4] * s[2], factor[5] * s[2])


@wp.func
def read_factor(factor: wp.array2d[float], i: int) -> Factor:
    """Return column i of a field of shape (6, capacity)."""
    return Factor(factor[0, i], factor[1, i], factor[2, i], factor[3, i], factor[4, i], factor[5, i])


@wp.kernel(enable_backward=False)
def sample_inertia(first: int, h: float, environment: wp.array[Environment], particles: Particles, inertia_out: wp.array[float]):
    """Store m/φ(k h) with the drag rate k [kg]: springs then act as gravity does, and drag does not shift where points come to rest."""
    i = first + wp.tid()
    k = drag_rate(environment[0].alpha, environment[0].viscosity, particles.radius[i], 1.0 / particles.mass[i])
    inertia_out[i] = particles.mass[i] / mean_decay(k * h)


@wp.func
def assemble_point(i: int, weave_inout: Weave, table: SpringTable, particles: Particles, system_inout: System):
    """Set up the rows of one point: weights, its block's factor, the right side for y = 0, and the first direction, v − u."""
    x = wp.vec3(system_inout.start[0, i], system_inout.start[1, i], system_inout.start[2, i])
    u = read3(particles.velocity, i)
    right = wp.vec3()
    block = wp.mat33d()
    for row in range(weave_inout.begin[i // SLICE], weave_inout.begin[i // SLICE + 1]):
        lane = i % SLICE
        j = weave_inout.neighbor[row * SLICE + lane]
        number = weave_inout.spring[row * SLICE + lane]
        tie = Tie()
        if number >= 0:
            xj = wp.vec3(system_inout.start[0, j], system_inout.start[1, j], system_inout.start[2, j])
            tie = tie_of(
                xj - x,
                table.rest[number],
                table.stiffness[number],
                table.damping[number],
                system_inout.h,
                weave_inout.free[i] + weave_inout.free[j],
            )
        right = right + (tie.impulse + resist(tie.w, tie.beta, read3(particles.velocity, j) - u))
        for axis in range(3):
            weave_inout.weight[row, SLICE * axis + lane] = tie.w[axis]
        weave_inout.weight[row, SLICE * 3 + lane] = tie.beta
        w = wp.vec3d(wp.float64(tie.w[0]), wp.float64(tie.w[1]), wp.float64(tie.w[2]))
        block = block + wp.outer(w, w)
        for axis in range(3):
            block[axis, axis] = block[axis, axis] + wp.float64(tie.beta)
    factor = Factor()
    p = wp.vec3()
    if i < weave_inout.point_count and weave_inout.free[i] > 0.0:
        m = wp.float64(weave_inout.inertia[i])
        factor = inverse_factor(m, block[0, 0], block[0, 1], block[0, 2], block[1, 1], block[1, 2], block[2, 2])
        p = wp.vec3(system_inout.start[3, i], system_inout.start[4, i], system_inout.start[5, i]) - u
    for k in range(6):
        system_inout.factor[k, i] = factor[k]
    write3(system_inout.residual, i, right)
    write3(system_inout.scaled, i, scale_down(factor, right))
    write3(system_inout.change, i, wp.vec3())
    write3(system_inout.direction, weave_inout.reach + i, p)


@wp.kernel(enable_backward=False)
def assemble_system(first: int, weave_inout: Weave, table: SpringTable, particles: Particles, system_inout: System):
    """Set up the linear system of a substep."""
    assemble_point(first + wp.tid(), weave_inout, table, particles, system_inout)


@wp.func
def multiply_point(i: int, weave: Weave, direction: wp.array2d[float], mass: wp.array[float]) -> wp.vec3:
    """Return row i of (M + B) p."""
    p = read3(direction, weave.reach + i)
    q = wp.vec3()
    lane = i % SLICE
    for row in range(weave.begin[i // SLICE], weave.begin[i // SLICE + 1]):
        w = wp.vec3(weave.weight[row, lane], weave.weight[row, SLICE + lane], weave.weight[row, SLICE * 2 + lane])
        e = p - read3(direction, weave.reach + weave.neighbor[row * SLICE + lane])
        q = q + resist(w, weave.weight[row, SLICE * 3 + lane], e)
    return q + p * mass[i]


@wp.kernel(enable_backward=False)
def multiply_direction(first: int, weave: Weave, mass: wp.array[float], direction: wp.array2d[float], image_out: wp.array2d[float]):
    """Store (M + B) p."""
    i = first + wp.tid()
    write3(image_out, i, multiply_point(i, weave, direction, mass))


@wp.kernel(enable_backward=False)
def apply_change(
    first: int,
    weave: Weave,
    system: System,
    drift: wp.array[wp.vec3],
    opening: int,
    clock: wp.array[wp.int64],
    particles_inout: Particles,
):
    """End the substep: v = u + y, y less its drift, and x moves by h v from where it began."""
    i = first + wp.tid()
    if i < weave.point_count and started(clock, opening):
        v = read3(particles_inout.velocity, i) + (read3(system.change, i) - drift[0])
        x = wp.vec3(system.start[0, i], system.start[1, i], system.start[2, i])
        write3(particles_inout.velocity, i, v)
        write3(particles_inout.position, i, x + v * system.h)
