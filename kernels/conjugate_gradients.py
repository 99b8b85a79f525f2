"""Conjugate gradients with a block for each point and a coarse level as preconditioner, for the system of implicit.py; sums in one order.

Symbols: p direction, q = A p, r residual, s = L⁻¹ r with the point's own block L Lᵀ, γ = s·s and what the groups of rigid_groups.py add,
whose root is the length of a residual [√kg m/s]; α = γ/(p·q) is the way along p, β = γ'/γ makes the next direction conjugate.
The first direction is the user's guess, a line: the way along it is p·r/(p·q), by which the search can begin no worse than without it.
Sums go over blocks of 64 points in float64, in eight lanes and then by halves, and over the blocks in their order.
Source: Hestenes & Stiefel 1952; Shewchuk 1994.
"""

import warp as wp

from warpsim.kernels.implicit import System, Weave, read_factor, scale_back, scale_down
from warpsim.kernels.planar import read3, write3
from warpsim.kernels.points import started
from warpsim.kernels.rigid_groups import RigidGroups, lift_at, solve_groups
from warpsim.kernels.springs import SLICE

LANES = wp.constant(8)
Lanes = wp.types.vector(length=8, dtype=wp.float64)
SQUARE, GUESS, CURVATURE = range(3)  # rows of the partial sums: s·s, p·r, p·q; at the end the parts of Σ m y, and Σ m


@wp.struct
class Search:
    tolerance: wp.array[wp.float64]  # (1): of the residual, relative to that of no change
    most: int  # iterations
    partial: wp.array2d[wp.float64]  # (4, blocks): sums over the points of each block
    goal: wp.array[wp.float64]  # (1): γ at which the search ends
    whole: wp.array[wp.float64]  # (1): γ of no change
    square: wp.array[wp.float64]  # (1): γ
    along: wp.array[float]  # (1): α
    turn: wp.array[float]  # (1): β; 0 begins anew
    going: wp.array[int]  # (1): 1 while the search goes on
    iteration: wp.array[int]  # (1): how many there were in this substep
    frame_iterations: wp.array[int]  # (1): in this frame
    frame_residual: wp.array[wp.float64]  # (1): the largest of the frame's relative residuals at their end
    drift: wp.array[wp.vec3]  # (1): mean of y, which springs cannot change; 0 where pins can [m/s]
    unconverged: wp.array[wp.int64]  # (1): substeps since the start that ended short of the tolerance


@wp.func
def block_dot(b: int, a: wp.array2d[float], a_shift: int, c: wp.array2d[float]) -> wp.float64:
    """Return the sum over block b of a·c, planar (3, …); columns of a are a_shift further on."""
    lanes = Lanes()
    for turn in range(SLICE // LANES):
        for lane in range(LANES):
            i = b * SLICE + turn * LANES + lane
            x = wp.float64(a[0, a_shift + i]) * wp.float64(c[0, i])
            y = wp.float64(a[1, a_shift + i]) * wp.float64(c[1, i])
            z = wp.float64(a[2, a_shift + i]) * wp.float64(c[2, i])
            lanes[lane] = lanes[lane] + ((x + y) + z)
    return ((lanes[0] + lanes[4]) + (lanes[2] + lanes[6])) + ((lanes[1] + lanes[5]) + (lanes[3] + lanes[7]))


@wp.kernel(enable_backward=False)
def accumulate_blocks(first: int, row: int, a: wp.array2d[float], a_shift: int, c: wp.array2d[float], partial_out: wp.array2d[wp.float64]):
    """Store the sum of a·c over each block as a row of the partial sums."""
    b = first + wp.tid()
    partial_out[row, b] = block_dot(b, a, a_shift, c)


@wp.func
def total_of(partial: wp.array2d[wp.float64], row: int) -> wp.float64:
    """Return the sum of a row of partial sums, in their order."""
    total = wp.float64(0.0)
    for b in range(partial.shape[1]):
        total = total + partial[row, b]
    return total


@wp.kernel(enable_backward=False)
def begin_search(first: int, substep: int, clock: wp.array[wp.int64], opening: int, groups_inout: RigidGroups, search_inout: Search):
    """One thread. Set the goal and the way along the guess; substep 0 begins to count the frame anew."""
    whole = total_of(search_inout.partial, SQUARE) + solve_groups(groups_inout)
    curvature = total_of(search_inout.partial, CURVATURE)
    tolerance = search_inout.tolerance[0]
    search_inout.whole[0] = whole
    search_inout.goal[0] = tolerance * tolerance * whole
    search_inout.along[0] = 0.0
    if curvature > wp.float64(0.0):
        search_inout.along[0] = float(total_of(search_inout.partial, GUESS) / curvature)
    search_inout.iteration[0] = -1
    search_inout.going[0] = 0
    if started(clock, opening):
        search_inout.going[0] = 1
    if substep == 0:
        search_inout.frame_iterations[0] = 0
        search_inout.frame_residual[0] = wp.float64(0.0)


@wp.kernel(enable_backward=False)
def choose_length(first: int, search_inout: Search):
    """One thread. Store α = γ/(p·q); 0 at the end, and where A is not positive along p, as with numbers that are not finite."""
    curvature = total_of(search_inout.partial, CURVATURE)
    search_inout.along[0] = 0.0
    if search_inout.going[0] == 1 and curvature > wp.float64(0.0):
        search_inout.along[0] = float(search_inout.square[0] / curvature)


@wp.func
def step_point(i: int, along: float, reach: int, system_inout: System):
    """Go along p: y ← y + α p, r ← r − α q, s = L⁻¹ r."""
    r = read3(system_inout.residual, i) - read3(system_inout.image, i) * along
    write3(system_inout.change, i, read3(system_inout.change, i) + read3(system_inout.direction, reach + i) * along)
    write3(system_inout.residual, i, r)
    write3(system_inout.scaled, i, scale_down(read_factor(system_inout.factor, i), r))


@wp.kernel(enable_backward=False)
def step_along(first: int, search: Search, reach: int, system_inout: System):
    """Go along the direction."""
    step_point(first + wp.tid(), search.along[0], reach, system_inout)


@wp.kernel(enable_backward=False)
def choose_turn(first: int, groups_inout: RigidGroups, search_inout: Search):
    """One thread. Store how the groups should move, β = γ'/γ, 0 after the guess, and whether to go on; at the end, count."""
    search_inout.turn[0] = 0.0
    if search_inout.going[0] == 0:
        return
    square = total_of(search_inout.partial, SQUARE) + solve_groups(groups_inout)
    iteration = search_inout.iteration[0] + 1
    stuck = iteration > 0 and not search_inout.along[0] > 0.0
    converged = square <= search_inout.goal[0]
    if iteration > 0:
        search_inout.turn[0] = float(square / search_inout.square[0])
    search_inout.square[0] = square
    search_inout.iteration[0] = iteration
    if converged or stuck or iteration >= search_inout.most:
        search_inout.going[0] = 0
        search_inout.frame_iterations[0] = search_inout.frame_iterations[0] + iteration
        if not converged:
            search_inout.unconverged[0] = search_inout.unconverged[0] + wp.int64(1)
        if search_inout.whole[0] > wp.float64(0.0):
            relative = wp.sqrt(square / search_inout.whole[0])
            search_inout.frame_residual[0] = wp.max(search_inout.frame_residual[0], relative)


@wp.func
def turn_point(i: int, turn: float, weave: Weave, groups: RigidGroups, system_inout: System):
    """Store the next direction, p ← L⁻ᵀ s + Z E⁻¹ Zᵀ r + β p."""
    z = scale_back(read_factor(system_inout.factor, i), read3(system_inout.scaled, i)) + lift_at(i, weave.free, groups)
    reach = weave.reach
    write3(system_inout.direction, reach + i, z + read3(system_inout.direction, reach + i) * turn)


@wp.kernel(enable_backward=False)
def turn_direction(first: int, search: Search, weave: Weave, groups: RigidGroups, system_inout: System):
    """Turn to the next direction."""
    turn_point(first + wp.tid(), search.turn[0], weave, groups, system_inout)


@wp.kernel(enable_backward=False)
def accumulate_momentum(first: int, mass: wp.array[float], point_count: int, system: System, partial_out: wp.array2d[wp.float64]):
    """Store the sums of m y, part by part, and of m over each block."""
    b = first + wp.tid()
    sum = wp.vec3d()
    total = wp.float64(0.0)
    for i in range(b * SLICE, wp.min((b + 1) * SLICE, point_count)):
        y = read3(system.change, i)
        sum = sum + wp.vec3d(wp.float64(y[0]), wp.float64(y[1]), wp.float64(y[2])) * wp.float64(mass[i])
        total = total + wp.float64(mass[i])
    for axis in range(3):
        partial_out[axis, b] = sum[axis]
    partial_out[3, b] = total


@wp.kernel(enable_backward=False)
def resolve_drift(first: int, search_inout: Search):
    """One thread. Store Σ m y/Σ m: what iterations that end early make of a momentum that springs between free points leave alone."""
    drift = wp.vec3()
    for axis in range(3):
        drift[axis] = float(total_of(search_inout.partial, axis) / total_of(search_inout.partial, 3))
    search_inout.drift[0] = drift
