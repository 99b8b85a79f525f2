"""Native loops of XPBD for the CPU, beside the plain kernels whose bits they share; see loops.py.

No two springs of a color share a point, so that the compiler may take their ends all at once: what a pragma promises it.
"""

import warp as wp

from warpsim.kernels.cloth import STEPS, Sheet
from warpsim.kernels.emission import Particles
from warpsim.kernels.loops import share, snippet
from warpsim.kernels.springs import SpringTable
from warpsim.kernels.xpbd import (
    ALONG,
    SHEET_COLORS,
    STRIP_COLORS,
    Projection,
    damp_pair,
    damp_spring,
    damping_impulse,
    moves,
    project_pair,
    project_spring,
    sheet_end,
    spring_pull,
)

POINTS = """
    constexpr int B = @BLOCK@;
    const int S = particles.position.shape[1];
    float *X = particles.position.data, *Y = X + S, *Z = Y + S;
    float *VX = particles.velocity.data, *VY = VX + S, *VZ = VY + S;
    const float h = projection.h;
    #define EACH(count) _Pragma("clang loop vectorize(assume_safety)") for (int t = 0; t < count; ++t)
"""
PROJECT = """
    const float *W = projection.response.data;
    float *M = multiplier.data;
    const float hh = h * h, rate = 1.0f / h;
    const bool recalls = turn > 0, keeps = projection.turns > 1;
    auto answer = [&](int i, int j, float r, float k, float &l) {
        const float a = W[i], b = W[j];
        const auto f = $spring_pull(vec(X[i], Y[i], Z[i]), vec(X[j], Y[j], Z[j]), r, k * hh, a + b, l);
        l += f[3];
        X[i] += f[0] * a; Y[i] += f[1] * a; Z[i] += f[2] * a;
        X[j] -= f[0] * b; Y[j] -= f[1] * b; Z[j] -= f[2] * b;
        VX[i] += (f[0] * a) * rate; VY[i] += (f[1] * a) * rate; VZ[i] += (f[2] * a) * rate;
        VX[j] -= (f[0] * b) * rate; VY[j] -= (f[1] * b) * rate; VZ[j] -= (f[2] * b) * rate;
    };
"""
DAMP = """
    const float *W = projection.inverse_mass.data;
    auto answer = [&](int i, int j, float c) {
        const float a = W[i], b = W[j];
        const vec f = $damping_impulse(vec(X[i], Y[i], Z[i]), vec(VX[i], VY[i], VZ[i]), vec(X[j], Y[j], Z[j]),
                                       vec(VX[j], VY[j], VZ[j]), c * h, a + b);
        VX[i] += f[0] * a; VY[i] += f[1] * a; VZ[i] += f[2] * a;
        VX[j] -= f[0] * b; VY[j] -= f[1] * b; VZ[j] -= f[2] * b;
    };
"""
LISTED = """
    const int *O = projection.order.data;
    const auto *E = table.ends.data;
    for (int b = begin; b < end; b += B) {
        const int n = end - b < B ? end - b : B;
"""
PROJECT_LISTED = """
        const float *R = table.rest.data, *K = table.stiffness.data;
        float L[B] = {};
        if (recalls) for (int t = 0; t < n; ++t) L[t] = M[b + t];
        EACH(n) { const int e = O[b + t]; answer(E[e][0], E[e][1], R[e], K[e], L[t]); }
        if (keeps) for (int t = 0; t < n; ++t) M[b + t] = L[t];
    }
"""
DAMP_LISTED = """
        const float *C = table.damping.data;
        EACH(n) { const int e = O[b + t]; answer(E[e][0], E[e][1], C[e]); }
    }
"""
# Springs of a sheet from points p, p + D, p + 2 D, … to those o further on, U next to each other at each of them. A kind that pulls
# nothing is left out here and in the plain kernels, for to add nothing to −0 is something.
PROJECT_SHEET = """
    const int N = sheet.nx * sheet.ny;
    const float *R = sheet.rest.data, *F = sheet.stiffness.data;
    auto answer_row = [&](auto pattern, int s, int p, int o, int count) {
        constexpr int D = decltype(pattern)::stride, U = decltype(pattern)::width;
        for (int b = 0; b < count; b += B) {
            const int n = count - b < B ? count - b : B, q = p + b * D;
            float L[U][B] = {}, *A = M + (size_t)s * N + q;
            if (recalls) for (int t = 0; t < n; ++t) for (int u = 0; u < U; ++u) L[u][t] = A[t * D + u];
            EACH(n) {
                answer(q + t * D, q + t * D + o, R[s], F[s], L[0][t]);
                if (U > 1) answer(q + t * D + 1, q + t * D + 1 + o, R[s], F[s], L[U - 1][t]);
            }
            if (keeps) for (int t = 0; t < n; ++t) for (int u = 0; u < U; ++u) A[t * D + u] = L[u][t];
        }
    };
    auto answer_one = [&](int s, int p, int o) {
        float *A = M + (size_t)s * N + p, l = recalls ? *A : 0.0f;
        answer(p, p + o, R[s], F[s], l);
        if (keeps) *A = l;
    };
"""
DAMP_SHEET = """
    const float *F = sheet.damping.data;
    auto answer_row = [&](auto pattern, int s, int p, int o, int count) {
        constexpr int D = decltype(pattern)::stride, U = decltype(pattern)::width;
        const float c = F[s];
        EACH(count) {
            answer(p + t * D, p + t * D + o, c);
            if (U > 1) answer(p + t * D + 1, p + t * D + 1 + o, c);
        }
    };
    auto answer_one = [&](int s, int p, int o) { answer(p, p + o, F[s]); };
"""
STRIPS = """
    struct Row { enum { stride = 1, width = 1 }; };
    struct Pairs { enum { stride = 2, width = 1 }; };
    struct Fours { enum { stride = 4, width = 2 }; };
    static const int CALLS[][5] = {TABLE};
    const int nx = sheet.nx, ny = sheet.ny, *from = CALLS[strip ? FIRST_COUNT : 0], *to = CALLS[strip ? ALL_COUNT : FIRST_COUNT];
    for (int q = begin; q < end; ++q) for (const int *call = from; call < to; call += 5) {
        const int s = call[0], j = 4 * q + call[1], i = call[2], di = call[3], dj = call[4], o = dj * nx + di;
        if (!(F[s] > 0.0f) || j + dj >= ny) continue;
        const int p = j * nx + i, left = nx - i;
        if (dj > 0) answer_row(Row(), s, p, o, di > 0 ? left - di : left);
        else if (di == 1) answer_row(Pairs(), s, p, o, left / 2);
        else {
            answer_row(Fours(), s, p, o, left / 4);
            if (left > 0 && left % 4 == 3) answer_one(s, p + left - 3, o);
        }
    }
"""


def strip_calls(colors) -> list[tuple[int, ...]]:
    """Return what takes a strip through colors: which of the sheet's springs, row of the strip, first i, and the step (di, dj)."""
    return [
        (s, row, remainders[0], *STEPS[s]) if axis == ALONG else (s, row, max(0, -STEPS[s][0]), *STEPS[s])
        for s, axis, remainders in colors
        for row in (range(4) if axis == ALONG else remainders)
    ]


CALLS = strip_calls(SHEET_COLORS)
TABLE = ", ".join("{" + ", ".join(map(str, call)) + "}" for call in CALLS)
for mark, word in {"FIRST_COUNT": len(strip_calls(SHEET_COLORS[:STRIP_COLORS])), "ALL_COUNT": len(CALLS), "TABLE": TABLE}.items():
    STRIPS = STRIPS.replace(mark, str(word))


def xpbd_snippet(*texts: str) -> str:
    """Return the loop put together of texts, as a snippet."""
    text = "".join(texts).replace("\n    #define", "\n#define")
    return snippet(text, spring_pull, damping_impulse) + "#undef EACH\n"


@wp.func_native(xpbd_snippet(POINTS, PROJECT, LISTED, PROJECT_LISTED))
def project_range(
    begin: int,
    end: int,
    turn: int,
    projection: Projection,
    table: SpringTable,
    multiplier: wp.array[float],
    particles: Particles,
):
    """Move the ends of the springs at a range of places, all of one color."""
    for place in range(begin, end):
        project_spring(place, turn, projection, table, multiplier, particles)


@wp.func_native(xpbd_snippet(POINTS, DAMP, LISTED, DAMP_LISTED))
def damp_range(begin: int, end: int, projection: Projection, table: SpringTable, particles: Particles):
    """Slow down the springs at a range of places, all of one color."""
    for place in range(begin, end):
        damp_spring(place, projection, table, particles)


@wp.kernel(enable_backward=False)
def project_springs(
    part: int,
    part_count: int,
    color: int,
    turn: int,
    projection: Projection,
    table: SpringTable,
    clock: wp.array[wp.int64],
    multiplier_inout: wp.array[float],
    particles_inout: Particles,
):
    """Move the ends of one part of the springs of one color."""
    begin = projection.begin[color]
    cut = share(part + wp.tid(), part_count, projection.begin[color + 1] - begin)
    if moves(projection, clock):
        project_range(begin + cut[0], begin + cut[1], turn, projection, table, multiplier_inout, particles_inout)


@wp.kernel(enable_backward=False)
def project_colors(
    first: int,
    color: int,
    end: int,
    turn: int,
    projection: Projection,
    table: SpringTable,
    clock: wp.array[wp.int64],
    multiplier_inout: wp.array[float],
    particles_inout: Particles,
):
    """Move the ends of the springs of a run of colors, one after the other."""
    if moves(projection, clock):
        for k in range(color + first, end):
            project_range(projection.begin[k], projection.begin[k + 1], turn, projection, table, multiplier_inout, particles_inout)


@wp.kernel(enable_backward=False)
def damp_springs(
    part: int,
    part_count: int,
    color: int,
    projection: Projection,
    table: SpringTable,
    clock: wp.array[wp.int64],
    particles_inout: Particles,
):
    """Slow down one part of the springs of one color."""
    begin = projection.begin[color]
    cut = share(part + wp.tid(), part_count, projection.begin[color + 1] - begin)
    if projection.damped[0] == 1 and moves(projection, clock):
        damp_range(begin + cut[0], begin + cut[1], projection, table, particles_inout)


@wp.kernel(enable_backward=False)
def damp_colors(
    first: int, color: int, end: int, projection: Projection, table: SpringTable, clock: wp.array[wp.int64], particles_inout: Particles
):
    """Slow down the springs of a run of colors, one after the other."""
    if projection.damped[0] == 1 and moves(projection, clock):
        for k in range(color + first, end):
            damp_range(projection.begin[k], projection.begin[k + 1], projection, table, particles_inout)


@wp.func_native(xpbd_snippet(POINTS, PROJECT, PROJECT_SHEET, STRIPS))
def project_strips(
    begin: int,
    end: int,
    strip: int,
    turn: int,
    projection: Projection,
    sheet: Sheet,
    multiplier: wp.array[float],
    particles: Particles,
):
    """Move the ends of the springs within strips of four rows, color by color; the formulas are those of any sheet's spring."""
    for p in range(begin, end):
        q = sheet_end(p, strip, ALONG, strip, sheet)
        project_pair(p, q, sheet.rest[strip], sheet.stiffness[strip], p, turn, projection, multiplier, particles)


@wp.func_native(xpbd_snippet(POINTS, DAMP, DAMP_SHEET, STRIPS))
def damp_strips(begin: int, end: int, strip: int, projection: Projection, sheet: Sheet, particles: Particles):
    """Slow down the springs within strips of four rows, color by color; the formulas are those of any sheet's spring."""
    for p in range(begin, end):
        damp_pair(p, sheet_end(p, strip, ALONG, strip, sheet), sheet.damping[strip], projection, particles)


@wp.func
def strip_share(part: int, part_count: int, sheet: Sheet) -> wp.vec2i:
    """Return the strips of four rows [begin, end) of one core's part."""
    strips = (sheet.ny + 3) // 4
    return wp.vec2i(strips * part // part_count, strips * (part + 1) // part_count)


@wp.kernel(enable_backward=False)
def project_sheet(
    part: int,
    part_count: int,
    strip: int,
    turn: int,
    projection: Projection,
    sheet: Sheet,
    clock: wp.array[wp.int64],
    multiplier_inout: wp.array[float],
    particles_inout: Particles,
):
    """Move the ends of the springs within one part of the strips: strip 0 are rows 4 q … 4 q + 3, strip 1 rows 4 q + 2 … 4 q + 5."""
    cut = strip_share(part + wp.tid(), part_count, sheet)
    if moves(projection, clock):
        project_strips(cut[0], cut[1], strip, turn, projection, sheet, multiplier_inout, particles_inout)


@wp.kernel(enable_backward=False)
def damp_sheet(
    part: int,
    part_count: int,
    strip: int,
    projection: Projection,
    sheet: Sheet,
    clock: wp.array[wp.int64],
    particles_inout: Particles,
):
    """Slow down the springs within one part of the strips."""
    cut = strip_share(part + wp.tid(), part_count, sheet)
    if moves(projection, clock):
        damp_strips(cut[0], cut[1], strip, projection, sheet, particles_inout)
