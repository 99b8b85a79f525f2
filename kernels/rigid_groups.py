"""Rigid groups: the coarse level of the search, on which neighboring points move together and turn together.

Between points, a search learns of distant ones a spring at a time, and what whole parts of a network should do comes last. Here a few
groups of points have six numbers each, a translation t and a rotation ω about one of their points: Z takes them to velocities t + ω × o,
o being the offset from that point. To the preconditioner it adds Z E⁻¹ Zᵀ with E = Zᵀ (M + B) Z, but for what stretched springs between
free points of a group do to its rotation. E is small and dense; motions without meaning, as of pins or of lines about themselves, are
left out where it is factored.
Source: Nicolaides 1987; additive Schwarz with a coarse space of rigid motions: Smith, Bjørstad & Gropp 1996.
"""

import warp as wp

from warpsim.kernels.implicit import System, Weave
from warpsim.kernels.planar import read3, write3
from warpsim.kernels.springs import SLICE

LEAST = wp.constant(wp.float64(1.0e-13))  # of its diagonal: a pivot that is nothing but rounding
Vec6 = wp.types.vector(length=6, dtype=wp.float64)
Vec10 = wp.types.vector(length=10, dtype=wp.float64)
Mat6 = wp.types.matrix(shape=(6, 6), dtype=wp.float64)


@wp.struct
class RigidGroups:
    group: wp.array[int]  # (capacity): of every point
    center: wp.array[int]  # (groups): the point about which a group turns
    order: wp.array[int]  # (chunks · 64): points group by group; −1: none
    chunk_begin: wp.array[int]  # (groups + 1): first chunk of each group
    pair: wp.array[wp.vec2i]  # (pairs): groups that springs join, the smaller number first; or one and its pins
    pair_begin: wp.array[int]  # (pairs + 1): first of their springs in `crossing`
    crossing: wp.array[wp.vec3i]  # point of the first group, of the second, and the first's entry in the weave
    offset: wp.array2d[float]  # (3, capacity): o [m]
    moment: wp.array2d[wp.float64]  # (10, chunks): m, m o, and of m o oᵀ xx, xy, xz, yy, yz, zz [kg, kg m, kg m²]
    joint: wp.array3d[wp.float64]  # (pairs, 3, 36): blocks of E by the springs between two groups: first, second, both
    matrix: wp.array2d[wp.float64]  # (6 groups, 6 groups): E, then its Cholesky factor; a zero on the diagonal: left out
    load: wp.array2d[wp.float64]  # (6, chunks): Zᵀ r, part by part
    solution: wp.array[wp.float64]  # (6 groups): E⁻¹ Zᵀ r
    lift: wp.array2d[float]  # (6, groups): the same, for the points


@wp.kernel(enable_backward=False)
def measure_chunks(first: int, weave: Weave, mass: wp.array[float], system: System, groups_inout: RigidGroups):
    """Store the offset of the points of a chunk, and the moments of those that are free."""
    chunk = first + wp.tid()
    m = wp.float64(0.0)
    mo = wp.vec3d()
    moo = wp.mat33d()
    for t in range(SLICE):
        i = groups_inout.order[chunk * SLICE + t]
        if i >= 0:
            c = groups_inout.center[groups_inout.group[i]]
            o = wp.vec3(
                system.start[0, i] - system.start[0, c],
                system.start[1, i] - system.start[1, c],
                system.start[2, i] - system.start[2, c],
            )
            write3(groups_inout.offset, i, o)
            if weave.free[i] > 0.0:
                wide = wp.vec3d(wp.float64(o[0]), wp.float64(o[1]), wp.float64(o[2]))
                m = m + wp.float64(mass[i])
                mo = mo + wide * wp.float64(mass[i])
                moo = moo + wp.outer(wide, wide) * wp.float64(mass[i])
    groups_inout.moment[0, chunk] = m
    for axis in range(3):
        groups_inout.moment[1 + axis, chunk] = mo[axis]
        groups_inout.moment[4 + axis, chunk] = moo[0, axis]
    groups_inout.moment[7, chunk] = moo[1, 1]
    groups_inout.moment[8, chunk] = moo[1, 2]
    groups_inout.moment[9, chunk] = moo[2, 2]


@wp.func
def rigid_block(b: wp.float64, bp: wp.vec3d, bq: wp.vec3d, bpq: wp.mat33d) -> Mat6:
    """Return Σ β Zᵢᵀ Zⱼ from b = Σ β, Σ β p, Σ β q and Σ β p qᵀ, p and q being the offsets of i and j."""
    block = Mat6()
    trace = bpq[0, 0] + bpq[1, 1] + bpq[2, 2]
    for row in range(3):
        block[row, row] = b
        for column in range(3):
            block[3 + row, 3 + column] = -bpq[column, row]
        block[3 + row, 3 + row] = block[3 + row, 3 + row] + trace
    block[0, 4] = bq[2]  # −[q]×
    block[0, 5] = -bq[1]
    block[1, 3] = -bq[2]
    block[1, 5] = bq[0]
    block[2, 3] = bq[1]
    block[2, 4] = -bq[0]
    block[3, 1] = -bp[2]  # [p]×
    block[3, 2] = bp[1]
    block[4, 0] = bp[2]
    block[4, 2] = -bp[0]
    block[5, 0] = -bp[1]
    block[5, 1] = bp[0]
    return block


@wp.func
def rigid_row(w: wp.vec3d, o: wp.vec3d) -> Vec6:
    """Return Zᵢᵀ w = (w, o × w)."""
    turn = wp.cross(o, w)
    return Vec6(w[0], w[1], w[2], turn[0], turn[1], turn[2])


@wp.func
def store_block(pair: int, place: int, block: Mat6, joint_out: wp.array3d[wp.float64]):
    """Store a block of E."""
    for row in range(6):
        for column in range(6):
            joint_out[pair, place, 6 * row + column] = block[row, column]


@wp.kernel(enable_backward=False)
def join_groups(first: int, weave: Weave, groups_inout: RigidGroups):
    """Store what the springs between two groups add to E."""
    pair = first + wp.tid()
    near = Mat6()
    far = Mat6()
    both = Mat6()
    b = wp.vec3d()  # Σ β over springs whose first end is free, whose second, whose both
    bp = wp.mat33d()  # rows: Σ β p over those of the first kind; of the third; Σ β q over the third
    bq = wp.vec3d()
    bpp = wp.mat33d()
    bqq = wp.mat33d()
    bpq = wp.mat33d()
    for k in range(groups_inout.pair_begin[pair], groups_inout.pair_begin[pair + 1]):
        i = groups_inout.crossing[k][0]
        j = groups_inout.crossing[k][1]
        row = groups_inout.crossing[k][2] // SLICE
        lane = groups_inout.crossing[k][2] % SLICE
        w32 = wp.vec3(weave.weight[row, lane], weave.weight[row, SLICE + lane], weave.weight[row, SLICE * 2 + lane])
        w = wp.vec3d(wp.float64(w32[0]), wp.float64(w32[1]), wp.float64(w32[2]))
        p32 = read3(groups_inout.offset, i)
        q32 = read3(groups_inout.offset, j)
        p = wp.vec3d(wp.float64(p32[0]), wp.float64(p32[1]), wp.float64(p32[2]))
        q = wp.vec3d(wp.float64(q32[0]), wp.float64(q32[1]), wp.float64(q32[2]))
        beta = wp.float64(weave.weight[row, SLICE * 3 + lane])
        here = wp.float64(wp.where(weave.free[i] > 0.0, 1.0, 0.0))
        there = wp.float64(wp.where(weave.free[j] > 0.0, 1.0, 0.0))
        a = rigid_row(w, p) * here
        c = rigid_row(w, q) * there
        near = near + wp.outer(a, a)
        far = far + wp.outer(c, c)
        both = both - wp.outer(a, c)
        b = b + wp.vec3d(here, there, here * there) * beta
        bp = bp + wp.outer(wp.vec3d(here, here * there, wp.float64(0.0)), p) * beta
        bp = bp + wp.outer(wp.vec3d(wp.float64(0.0), wp.float64(0.0), here * there), q) * beta
        bq = bq + q * (beta * there)
        bpp = bpp + wp.outer(p, p) * (beta * here)
        bqq = bqq + wp.outer(q, q) * (beta * there)
        bpq = bpq + wp.outer(p, q) * (beta * here * there)
    store_block(pair, 0, near + rigid_block(b[0], bp[0], bp[0], bpp), groups_inout.joint)
    store_block(pair, 1, far + rigid_block(b[1], bq, bq, bqq), groups_inout.joint)
    store_block(pair, 2, both - rigid_block(b[2], bp[1], bp[2], bpq), groups_inout.joint)


@wp.func
def add_block(row: int, column: int, block: Mat6, matrix_inout: wp.array2d[wp.float64]):
    """Add a block to E at rows 6·row, columns 6·column."""
    for a in range(6):
        for b in range(6):
            matrix_inout[6 * row + a, 6 * column + b] = matrix_inout[6 * row + a, 6 * column + b] + block[a, b]


@wp.func
def read_block(joint: wp.array3d[wp.float64], pair: int, place: int) -> Mat6:
    """Return a stored block of E."""
    block = Mat6()
    for row in range(6):
        for column in range(6):
            block[row, column] = joint[pair, place, 6 * row + column]
    return block


@wp.func
def gather_matrix(groups_inout: RigidGroups):
    """Put E together, its lower triangle, from what chunks and pairs have."""
    for row in range(groups_inout.matrix.shape[0]):
        for column in range(groups_inout.matrix.shape[0]):
            groups_inout.matrix[row, column] = wp.float64(0.0)
    for g in range(groups_inout.center.shape[0]):
        sum = Vec10()
        for chunk in range(groups_inout.chunk_begin[g], groups_inout.chunk_begin[g + 1]):
            for k in range(10):
                sum[k] = sum[k] + groups_inout.moment[k, chunk]
        mo = wp.vec3d(sum[1], sum[2], sum[3])
        moo = wp.mat33d(sum[4], sum[5], sum[6], sum[5], sum[7], sum[8], sum[6], sum[8], sum[9])
        add_block(g, g, rigid_block(sum[0], mo, mo, moo), groups_inout.matrix)
    for pair in range(groups_inout.pair.shape[0]):
        g = groups_inout.pair[pair][0]
        h = groups_inout.pair[pair][1]
        add_block(g, g, read_block(groups_inout.joint, pair, 0), groups_inout.matrix)
        add_block(h, h, read_block(groups_inout.joint, pair, 1), groups_inout.matrix)
        add_block(h, g, wp.transpose(read_block(groups_inout.joint, pair, 2)), groups_inout.matrix)


@wp.kernel(enable_backward=False)
def factor_matrix(first: int, groups_inout: RigidGroups):
    """One thread. Put E together and factor it, E = L Lᵀ; a motion that adds nothing to those before it is left out."""
    gather_matrix(groups_inout)
    n = groups_inout.matrix.shape[0]
    for k in range(n):
        groups_inout.solution[k] = groups_inout.matrix[k, k]
    for k in range(n):
        pivot = groups_inout.matrix[k, k]
        inverse = wp.float64(0.0)
        groups_inout.matrix[k, k] = wp.float64(0.0)
        if pivot > LEAST * groups_inout.solution[k]:
            groups_inout.matrix[k, k] = wp.sqrt(pivot)
            inverse = wp.float64(1.0) / wp.sqrt(pivot)
        for i in range(k + 1, n):
            groups_inout.matrix[i, k] = groups_inout.matrix[i, k] * inverse
        for i in range(k + 1, n):
            for j in range(k + 1, i + 1):
                product = groups_inout.matrix[i, k] * groups_inout.matrix[j, k]
                groups_inout.matrix[i, j] = groups_inout.matrix[i, j] - product


@wp.func
def load_chunk(chunk: int, free: wp.array[float], residual: wp.array2d[float], groups_inout: RigidGroups):
    """Store Zᵀ r of the free points of a chunk."""
    force = wp.vec3d()
    turn = wp.vec3d()
    for t in range(SLICE):
        i = groups_inout.order[chunk * SLICE + t]
        if i >= 0 and free[wp.max(i, 0)] > 0.0:
            r = wp.vec3d(wp.float64(residual[0, i]), wp.float64(residual[1, i]), wp.float64(residual[2, i]))
            o = wp.vec3d(
                wp.float64(groups_inout.offset[0, i]), wp.float64(groups_inout.offset[1, i]), wp.float64(groups_inout.offset[2, i])
            )
            force = force + r
            turn = turn + wp.cross(o, r)
    for axis in range(3):
        groups_inout.load[axis, chunk] = force[axis]
        groups_inout.load[3 + axis, chunk] = turn[axis]


@wp.kernel(enable_backward=False)
def load_groups(first: int, free: wp.array[float], residual: wp.array2d[float], groups_inout: RigidGroups):
    """Store Zᵀ r chunk by chunk."""
    load_chunk(first + wp.tid(), free, residual, groups_inout)


@wp.func
def solve_groups(groups_inout: RigidGroups) -> wp.float64:
    """Store E⁻¹ Zᵀ r and return what it adds to γ, |L⁻¹ Zᵀ r|²."""
    n = groups_inout.matrix.shape[0]
    for g in range(groups_inout.center.shape[0]):
        for k in range(6):
            sum = wp.float64(0.0)
            for chunk in range(groups_inout.chunk_begin[g], groups_inout.chunk_begin[g + 1]):
                sum = sum + groups_inout.load[k, chunk]
            groups_inout.solution[6 * g + k] = sum
    gain = wp.float64(0.0)
    for k in range(n):
        y = wp.float64(0.0)
        if groups_inout.matrix[k, k] > wp.float64(0.0):
            y = groups_inout.solution[k] / groups_inout.matrix[k, k]
        groups_inout.solution[k] = y
        gain = gain + y * y
        for i in range(k + 1, n):
            groups_inout.solution[i] = groups_inout.solution[i] - groups_inout.matrix[i, k] * y
    for turn in range(n):
        k = n - 1 - turn
        y = wp.float64(0.0)
        if groups_inout.matrix[k, k] > wp.float64(0.0):
            y = groups_inout.solution[k] / groups_inout.matrix[k, k]
        groups_inout.solution[k] = y
        groups_inout.lift[k % 6, k // 6] = float(y)
        for i in range(k):
            groups_inout.solution[i] = groups_inout.solution[i] - groups_inout.matrix[k, i] * y
    return gain


@wp.func(inline=True)
def lifted(t: wp.vec3, w: wp.vec3, o: wp.vec3) -> wp.vec3:
    """Return the velocity t + ω × o of a point at offset o."""
    return t + wp.cross(w, o)


@wp.func
def lift_at(i: int, free: wp.array[float], groups: RigidGroups) -> wp.vec3:
    """Return Z E⁻¹ Zᵀ r at a point; nothing for one that is pinned."""
    g = groups.group[i]
    t = wp.vec3(groups.lift[0, g], groups.lift[1, g], groups.lift[2, g])
    w = wp.vec3(groups.lift[3, g], groups.lift[4, g], groups.lift[5, g])
    v = lifted(t, w, read3(groups.offset, i))
    return v * wp.where(free[i] > 0.0, 1.0, 0.0)
