"""Native loops of the implicit solver for the CPU, beside the plain kernels whose bits they share; see loops.py."""

import warp as wp

from warpsim.kernels.conjugate_gradients import Search, block_dot, step_point, turn_point
from warpsim.kernels.emission import Particles
from warpsim.kernels.implicit import (
    SCATTERED,
    System,
    Weave,
    assemble_point,
    inverse_factor,
    multiply_point,
    resist,
    scale_back,
    scale_down,
    tie_of,
)
from warpsim.kernels.planar import write3
from warpsim.kernels.rigid_groups import RigidGroups, lifted, load_chunk
from warpsim.kernels.snippets import BLOCK, share, snippet
from warpsim.kernels.springs import SpringTable

ASSEMBLE = """
    constexpr int B = @BLOCK@;
    const int S = particles.velocity.shape[1], T = system.direction.shape[1];
    const float *X = system.start.data, *Y = X + S, *Z = Y + S, *OX = Z + S, *OY = OX + S, *OZ = OY + S;
    const float *UX = particles.velocity.data, *UY = UX + S, *UZ = UY + S;
    float *R = system.residual.data, *C = system.scaled.data, *F = system.factor.data, *D = system.direction.data + weave.reach;
    for (int b = begin; b < end; b += B) {
        float RX[B] = {}, RY[B] = {}, RZ[B] = {};
        double M[6][B] = {};
        const int last = weave.begin.data[b / B + 1];
        for (int row = weave.begin.data[b / B]; row < last; ++row) {
            const int *J = weave.neighbor.data + (size_t)row * B, *N = weave.spring.data + (size_t)row * B;
            float *W = weave.weight.data + (size_t)row * 4 * B;
            const int step = weave.step.data[row];
            #define ENTRY(place) _Pragma("clang loop vectorize(assume_safety)") for (int t = 0; t < B; ++t) { \
                const int i = b + t, j = place, n = N[t] < 0 ? 0 : N[t]; \
                const float is = N[t] < 0 ? 0.0f : 1.0f; \
                const float rest = is * table.rest.data[n], k = is * table.stiffness.data[n], c = is * table.damping.data[n]; \
                const auto tie = $tie_of(vec(X[j], Y[j], Z[j]) - vec(X[i], Y[i], Z[i]), rest, k, c, system.h, \
                                         weave.free.data[i] + weave.free.data[j]); \
                const vec e = vec(UX[j], UY[j], UZ[j]) - vec(UX[i], UY[i], UZ[i]), f = tie.impulse + $resist(tie.w, tie.beta, e); \
                RX[t] += f[0]; RY[t] += f[1]; RZ[t] += f[2]; \
                W[t] = tie.w[0]; W[B + t] = tie.w[1]; W[2 * B + t] = tie.w[2]; W[3 * B + t] = tie.beta; }
            if (step == SCATTERED || b + step < 0 || b + step + B > S) { ENTRY(J[t]) }
            else { const int o = b + step; ENTRY(o + t) }
            for (int t = 0; t < B; ++t) {
                const double x = W[t], y = W[B + t], z = W[2 * B + t], beta = W[3 * B + t];
                M[0][t] = (M[0][t] + x * x) + beta; M[1][t] += x * y; M[2][t] += x * z;
                M[3][t] = (M[3][t] + y * y) + beta; M[4][t] += y * z; M[5][t] = (M[5][t] + z * z) + beta;
            }
        }
        for (int t = 0; t < B; ++t) {
            const int i = b + t, loose = i < weave.point_count && weave.free.data[i] > 0.0f;
            const auto full = $inverse_factor((double)weave.inertia.data[i], M[0][t], M[1][t], M[2][t], M[3][t], M[4][t], M[5][t]);
            auto l = full;
            for (int k = 0; k < 6; ++k) { l[k] = loose ? full[k] : 0.0f; F[i + k * S] = l[k]; }
            const vec s = $scale_down(l, vec(RX[t], RY[t], RZ[t]));
            R[i] = RX[t]; R[i + S] = RY[t]; R[i + 2 * S] = RZ[t];
            C[i] = s[0]; C[i + S] = s[1]; C[i + 2 * S] = s[2];
            D[i] = loose ? OX[i] - UX[i] : 0.0f;
            D[i + T] = loose ? OY[i] - UY[i] : 0.0f;
            D[i + 2 * T] = loose ? OZ[i] - UZ[i] : 0.0f;
            for (int k = 0; k < 3; ++k) system.change.data[i + k * S] = 0.0f;
        }
    }
"""
MULTIPLY = """
    constexpr int B = @BLOCK@;
    const int S = image.shape[1], T = direction.shape[1];
    const float *PX = direction.data + weave.reach, *PY = PX + T, *PZ = PY + T;
    float *Q = image.data;
    for (int b = begin; b < end; b += B) {
        float X[B], Y[B], Z[B], QX[B] = {}, QY[B] = {}, QZ[B] = {};
        for (int t = 0; t < B; ++t) { X[t] = PX[b + t]; Y[t] = PY[b + t]; Z[t] = PZ[b + t]; }
        const int last = weave.begin.data[b / B + 1];
        for (int row = weave.begin.data[b / B]; row < last; ++row) {
            const float *W = weave.weight.data + (size_t)row * 4 * B;
            const int step = weave.step.data[row];
            #define EACH(place) for (int t = 0; t < B; ++t) { \\
                const int j = place; \\
                const vec e = vec(X[t], Y[t], Z[t]) - vec(PX[j], PY[j], PZ[j]); \\
                const vec f = $resist(vec(W[t], W[B + t], W[2 * B + t]), W[3 * B + t], e); \\
                QX[t] += f[0]; QY[t] += f[1]; QZ[t] += f[2]; }
            if (step == SCATTERED) { const int *J = weave.neighbor.data + (size_t)row * B; EACH(J[t]) }
            else { const int o = b + step; EACH(o + t) }
        }
        for (int t = 0; t < B; ++t) {
            const int i = b + t;
            const float m = mass.data[i];
            Q[i] = QX[t] + X[t] * m; Q[i + S] = QY[t] + Y[t] * m; Q[i + 2 * S] = QZ[t] + Z[t] * m;
        }
    }
"""
ASSEMBLE, MULTIPLY = (
    text.replace("SCATTERED", str(int(SCATTERED))).replace("\n            #define", "\n#define") for text in (ASSEMBLE, MULTIPLY)
)
DOTS = """
    constexpr int B = @BLOCK@, L = 8;
    const int S = c.shape[1], T = a.shape[1];
    for (int b = begin; b < end; ++b) {
        const float *A = a.data + a_shift + (size_t)b * B, *C = c.data + (size_t)b * B;
        double lane[L] = {};
        for (int turn = 0; turn < B; turn += L) for (int k = 0; k < L; ++k) {
            const int i = turn + k;
            const double x = (double)A[i] * (double)C[i], y = (double)A[i + T] * (double)C[i + S];
            const double z = (double)A[i + 2 * T] * (double)C[i + 2 * S];
            lane[k] += (x + y) + z;
        }
        const double even = (lane[0] + lane[4]) + (lane[2] + lane[6]), odd = (lane[1] + lane[5]) + (lane[3] + lane[7]);
        partial.data[(size_t)row * partial.shape[1] + b] = even + odd;
    }
"""
POINTS = """
    const int S = system.residual.shape[1], T = system.direction.shape[1];
    const float *F = system.factor.data, *Q = system.image.data;
    float *R = system.residual.data, *C = system.scaled.data, *P = system.direction.data + reach, *G = system.change.data;
    typedef wp::vec_t<6, float> Factor;
    #pragma clang loop vectorize(assume_safety)
    for (int i = begin; i < end; ++i) {
        Factor l;
        for (int k = 0; k < 6; ++k) l[k] = F[i + k * S];
        const vec p(P[i], P[i + T], P[i + 2 * T]);
BODY    }
"""
STEP = """        const vec r = vec(R[i], R[i + S], R[i + 2 * S]) - vec(Q[i], Q[i + S], Q[i + 2 * S]) * along, s = $scale_down(l, r);
        const vec g = vec(G[i], G[i + S], G[i + 2 * S]) + p * along;
        for (int k = 0; k < 3; ++k) { R[i + k * S] = r[k]; C[i + k * S] = s[k]; G[i + k * S] = g[k]; }
"""
TURN = """        const int g = groups.group.data[i];
        const float *A = groups.lift.data + g, *O = groups.offset.data + i, loose = weave.free.data[i] > 0.0f ? 1.0f : 0.0f;
        const vec t(A[0], A[H], A[2 * H]), w(A[3 * H], A[4 * H], A[5 * H]), o(O[0], O[S], O[2 * S]);
        const vec z = $scale_back(l, vec(C[i], C[i + S], C[i + 2 * S])) + $lifted(t, w, o) * loose, d = z + p * turn;
        for (int k = 0; k < 3; ++k) P[i + k * T] = d[k];
"""


LOAD = """
    constexpr int B = @BLOCK@;
    const int S = residual.shape[1], N = groups.load.shape[1];
    const float *R = residual.data, *O = groups.offset.data;
    for (int chunk = begin; chunk < end; ++chunk) {
        double FX = 0.0, FY = 0.0, FZ = 0.0, TX = 0.0, TY = 0.0, TZ = 0.0;
        for (int t = 0; t < B; ++t) {
            const int i = groups.order.data[(size_t)chunk * B + t];
            if (i < 0 || !(free.data[i] > 0.0f)) continue;
            const double x = R[i], y = R[i + S], z = R[i + 2 * S], a = O[i], b = O[i + S], c = O[i + 2 * S];
            FX += x; FY += y; FZ += z;
            TX += b * z - c * y; TY += c * x - a * z; TZ += a * y - b * x;
        }
        double *L = groups.load.data + chunk;
        L[0] = FX; L[N] = FY; L[2 * N] = FZ; L[3 * N] = TX; L[4 * N] = TY; L[5 * N] = TZ;
    }
"""


@wp.func_native(snippet(ASSEMBLE, tie_of, resist, inverse_factor, scale_down) + "#undef ENTRY\n")
def assemble_range(begin: int, end: int, weave: Weave, table: SpringTable, particles: Particles, system: System):
    """Set up the rows of a range of points."""
    for i in range(begin, end):
        assemble_point(i, weave, table, particles, system)


@wp.func_native(snippet(MULTIPLY, resist) + "#undef EACH\n")
def multiply_range(begin: int, end: int, weave: Weave, mass: wp.array[float], direction: wp.array2d[float], image: wp.array2d[float]):
    """Multiply the rows of a range of points."""
    for i in range(begin, end):
        write3(image, i, multiply_point(i, weave, direction, mass))


@wp.func_native(snippet(DOTS))
def dot_range(begin: int, end: int, row: int, a: wp.array2d[float], a_shift: int, c: wp.array2d[float], partial: wp.array2d[wp.float64]):
    """Sum a range of blocks."""
    for b in range(begin, end):
        partial[row, b] = block_dot(b, a, a_shift, c)


@wp.func_native(snippet(POINTS.replace("BODY", STEP), scale_down))
def step_range(begin: int, end: int, along: float, reach: int, system: System):
    """Go along the direction with a range of points."""
    for i in range(begin, end):
        step_point(i, along, reach, system)


@wp.func_native(
    snippet("\n    const int reach = weave.reach, H = groups.lift.shape[1];" + POINTS.replace("BODY", TURN), scale_back, lifted)
)
def turn_range(begin: int, end: int, turn: float, weave: Weave, groups: RigidGroups, system: System):
    """Turn the direction of a range of points."""
    for i in range(begin, end):
        turn_point(i, turn, weave, groups, system)


@wp.func_native(snippet(LOAD))
def load_range(begin: int, end: int, free: wp.array[float], residual: wp.array2d[float], groups: RigidGroups):
    """Sum what a range of chunks bears."""
    for chunk in range(begin, end):
        load_chunk(chunk, free, residual, groups)


@wp.kernel(enable_backward=False)
def load_groups(part: int, part_count: int, free: wp.array[float], residual: wp.array2d[float], groups_inout: RigidGroups):
    """Store Zᵀ r of one part of the chunks."""
    chunks = groups_inout.load.shape[1]
    mine = part + wp.tid()
    load_range(chunks * mine // part_count, chunks * (mine + 1) // part_count, free, residual, groups_inout)


@wp.kernel(enable_backward=False)
def assemble_system(part: int, part_count: int, weave_inout: Weave, table: SpringTable, particles: Particles, system_inout: System):
    """Set up one part of the linear system of a substep."""
    cut = share(part + wp.tid(), part_count, particles.velocity.shape[1])
    assemble_range(cut[0], cut[1], weave_inout, table, particles, system_inout)


@wp.kernel(enable_backward=False)
def multiply_direction(
    part: int, part_count: int, weave: Weave, mass: wp.array[float], direction: wp.array2d[float], image_out: wp.array2d[float]
):
    """Store one part of (M + B) p."""
    cut = share(part + wp.tid(), part_count, image_out.shape[1])
    multiply_range(cut[0], cut[1], weave, mass, direction, image_out)


@wp.kernel(enable_backward=False)
def accumulate_blocks(
    part: int,
    part_count: int,
    row: int,
    a: wp.array2d[float],
    a_shift: int,
    c: wp.array2d[float],
    partial_out: wp.array2d[wp.float64],
):
    """Store the sums of one part of the blocks."""
    cut = share(part + wp.tid(), part_count, c.shape[1])
    dot_range(cut[0] // BLOCK, cut[1] // BLOCK, row, a, a_shift, c, partial_out)


@wp.kernel(enable_backward=False)
def step_along(part: int, part_count: int, search: Search, reach: int, system_inout: System):
    """Go along the direction with one part of the points."""
    cut = share(part + wp.tid(), part_count, system_inout.residual.shape[1])
    step_range(cut[0], cut[1], search.along[0], reach, system_inout)


@wp.kernel(enable_backward=False)
def turn_direction(part: int, part_count: int, search: Search, weave: Weave, groups: RigidGroups, system_inout: System):
    """Turn the direction of one part of the points."""
    cut = share(part + wp.tid(), part_count, system_inout.residual.shape[1])
    turn_range(cut[0], cut[1], search.turn[0], weave, groups, system_inout)
