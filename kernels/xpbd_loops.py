"""Native loops of XPBD for the CPU, beside the plain kernels whose bits they share; see loops.py.

No two springs of a color share a point, so that the compiler may take their ends all at once: what a pragma promises it. Another asks it
to mask what is beyond the end of a line, for lines are short, and the last fifteen one by one would take as long as the rest.
"""

import warp as wp

from warpsim.kernels.cloth import STEPS, Sheet
from warpsim.kernels.emission import Particles
from warpsim.kernels.loops import snippet
from warpsim.kernels.springs import SpringTable
from warpsim.kernels.xpbd import (
    ALONG,
    COLUMNS,
    DOWN,
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
    struct Points { float *X, *Y, *Z, *VX, *VY, *VZ; const float *W; };
    float *X = particles.position.data, *V = particles.velocity.data;
    const float h = projection.h;
    #define EACH(count) _Pragma("clang loop vectorize(assume_safety) vectorize_predicate(enable)") for (int t = 0; t < count; ++t)
    #define EVERY(count) _Pragma("clang loop vectorize(assume_safety)") for (int t = 0; t < count; ++t)
"""
PROJECT = """
    const Points all = {X, X + S, X + 2 * S, V, V + S, V + 2 * S, projection.response.data};
    float *M = multiplier.data;
    const float hh = h * h, rate = 1.0f / h;
    const bool recalls = turn > 0, keeps = projection.turns > 1;
    auto answer = [&](const Points &q, int i, int j, float r, float k, float &l) {
        const float a = q.W[i], b = q.W[j];
        const auto f = $spring_pull(vec(q.X[i], q.Y[i], q.Z[i]), vec(q.X[j], q.Y[j], q.Z[j]), r, k * hh, a + b, l);
        l += f[3];
        q.X[i] += f[0] * a; q.Y[i] += f[1] * a; q.Z[i] += f[2] * a;
        q.X[j] -= f[0] * b; q.Y[j] -= f[1] * b; q.Z[j] -= f[2] * b;
        q.VX[i] += (f[0] * a) * rate; q.VY[i] += (f[1] * a) * rate; q.VZ[i] += (f[2] * a) * rate;
        q.VX[j] -= (f[0] * b) * rate; q.VY[j] -= (f[1] * b) * rate; q.VZ[j] -= (f[2] * b) * rate;
    };
"""
DAMP = """
    const Points all = {X, X + S, X + 2 * S, V, V + S, V + 2 * S, projection.inverse_mass.data};
    auto answer = [&](const Points &q, int i, int j, float c) {
        const float a = q.W[i], b = q.W[j];
        const vec f = $damping_impulse(vec(q.X[i], q.Y[i], q.Z[i]), vec(q.VX[i], q.VY[i], q.VZ[i]),
                                       vec(q.X[j], q.Y[j], q.Z[j]), vec(q.VX[j], q.VY[j], q.VZ[j]), c * h, a + b);
        q.VX[i] += f[0] * a; q.VY[i] += f[1] * a; q.VZ[i] += f[2] * a;
        q.VX[j] -= f[0] * b; q.VY[j] -= f[1] * b; q.VZ[j] -= f[2] * b;
    };
"""
LISTED = """
    const int *O = projection.order.data;
    const auto *E = table.ends.data;
    for (int q = begin; q < end; ++q) {
        const int place = projection.piece.data[q][0], count = projection.piece.data[q][1], n = count < 0 ? -count : count;
        const int s = O[place], i = E[s][0], j = E[s][1];
"""
PROJECT_LISTED = """
        const float *R = table.rest.data, *K = table.stiffness.data;
        float L[B] = {};
        if (recalls) for (int t = 0; t < n; ++t) L[t] = M[place + t];
        if (count > 0) EACH(n) answer(all, i + t, j + t, R[s + t], K[s + t], L[t]);
        else EACH(n) { const int e = O[place + t]; answer(all, E[e][0], E[e][1], R[e], K[e], L[t]); }
        if (keeps) for (int t = 0; t < n; ++t) M[place + t] = L[t];
    }
"""
DAMP_LISTED = """
        const float *C = table.damping.data;
        if (count > 0) EACH(n) answer(all, i + t, j + t, C[s + t]);
        else EACH(n) { const int e = O[place + t]; answer(all, E[e][0], E[e][1], C[e]); }
    }
"""
# Springs s of a sheet from points i, i + 1, … to j, j + 1, …; the multipliers lie from `place` on, `stride` apart. A kind that pulls
# nothing is left out here and in the plain kernels, for to add nothing to −0 is something.
PROJECT_SHEET = """
    const int N = sheet.nx * sheet.ny;
    const float *R = sheet.rest.data, *F = sheet.stiffness.data;
    auto answer_line = [&](const Points &q, int s, int i, int j, int count, int place, int stride) {
        for (int b = 0; b < count; b += B) {
            const int n = count - b < B ? count - b : B;
            float L[B] = {}, *A = M + (size_t)s * N + place + b * stride;
            if (recalls) for (int t = 0; t < n; ++t) L[t] = A[t * stride];
            EACH(n) answer(q, i + b + t, j + b + t, R[s], F[s], L[t]);
            if (keeps) for (int t = 0; t < n; ++t) A[t * stride] = L[t];
        }
    };
    auto answer_one = [&](int s, int i, int j) {
        float *A = M + (size_t)s * N + i, l = recalls ? *A : 0.0f;
        answer(all, i, j, R[s], F[s], l);
        if (keeps) *A = l;
    };
"""
DAMP_SHEET = """
    const float *F = sheet.damping.data;
    auto answer_line = [&](const Points &q, int s, int i, int j, int count, int place, int stride) {
        const float c = F[s];
        EACH(count) answer(q, i + t, j + t, c);
    };
    auto answer_one = [&](int s, int i, int j) { answer(all, i, j, F[s]); };
"""
# Along a row every other point is another color's. A block of columns is unfolded into four lines, of the points 4 t, 4 t + 1, … each,
# between which all springs run side by side, and folded again when all colors have had it: in a quarter of the
# time that it takes to skip points.
BLOCKS = """
    constexpr int T = @COLUMNS@ / 4;
    const int nx = sheet.nx, ny = sheet.ny;
    static const int LINES[][3] = {@LINES@};
    float D[7][4 * T];
    const Points lines = {D[0], D[1], D[2], D[3], D[4], D[5], D[6]};
    auto unfold = [&](const float *from, float *to, int n) {
        EVERY(n / 4) { to[t] = from[4 * t]; to[T + t] = from[4 * t + 1]; to[2 * T + t] = from[4 * t + 2]; to[3 * T + t] = from[4 * t + 3]; }
        for (int i = n / 4 * 4; i < n; ++i) to[i % 4 * T + i / 4] = from[i];
    };
    auto fold = [&](const float *from, float *to, int n) {
        EVERY(n / 4) { to[4 * t] = from[t]; to[4 * t + 1] = from[T + t]; to[4 * t + 2] = from[2 * T + t]; to[4 * t + 3] = from[3 * T + t]; }
        for (int i = n / 4 * 4; i < n; ++i) to[i] = from[i % 4 * T + i / 4];
    };
    auto along = [&](int j) {
        if (!(F[@NEXT@] > 0.0f) && !(F[@SECOND@] > 0.0f)) return;
        for (int b = 0; b < nx; b += 4 * T) {
            const int p = j * nx + b, n = nx - b < 4 * T ? nx - b : 4 * T;
            for (int c = 0; c < 3; ++c) { unfold(X + c * S + p, D[c], n); unfold(V + c * S + p, D[3 + c], n); }
            unfold(all.W + p, D[6], n);
            for (const auto &line : LINES) {
                const int s = line[0], i = line[1], j = i + line[2], count = (n - j + 3) / 4;
                if (F[s] > 0.0f) answer_line(lines, s, i * T, j % 4 * T + j / 4, count, p + i, 4);
            }
            for (int c = 0; c < 3; ++c) { if (@MOVES@) fold(D[c], X + c * S + p, n); fold(D[3 + c], V + c * S + p, n); }
        }
        for (int p = j * nx + 4 * T - 1; F[@NEXT@] > 0.0f && p < (j + 1) * nx - 1; p += 4 * T) answer_one(@NEXT@, p, p + 1);
        for (int p = j * nx + 4 * T - 2; F[@SECOND@] > 0.0f && p < (j + 1) * nx - 2; p += 4 * T) {
            answer_one(@SECOND@, p, p + 2);
            if (p < (j + 1) * nx - 3) answer_one(@SECOND@, p + 1, p + 3);
        }
    };
"""
STRIPS = """
    static const int CALLS[][4] = {@CALLS@};
    const int *from = CALLS[strip ? @FIRST@ : 0], *to = CALLS[strip ? @ALL@ : @FIRST@];
    for (int q = begin; q < end; ++q) {
        if (strip == 0) for (int j = 4 * q; j < ny && j < 4 * q + 4; ++j) along(j);
        for (const int *call = from; call < to; call += 4) {
            const int s = call[0], j = 4 * q + call[1], di = call[2], dj = call[3], p = j * nx + (di < 0 ? -di : 0);
            if (F[s] > 0.0f && j + dj < ny) answer_line(all, s, p, p + dj * nx + di, nx - (di < 0 ? -di : di), p, 1);
        }
    }
"""


def listed(rows) -> str:
    """Write rows of numbers as C++ does."""
    return ", ".join("{" + ", ".join(map(str, row)) + "}" for row in rows)


def strip_calls(colors) -> list[tuple[int, ...]]:
    """Return what takes a strip through the colors down: which of the sheet's springs, from which row of the strip, the step (di, dj)."""
    return [(s, row, *STEPS[s]) for s, direction, rows in colors if direction == DOWN for row in rows]


MARKS = {
    "COLUMNS": COLUMNS,
    "NEXT": STEPS.index((1, 0)),
    "SECOND": STEPS.index((2, 0)),
    "LINES": listed((s, i, STEPS[s][0]) for s, direction, remainders in SHEET_COLORS if direction == ALONG for i in remainders),
    "CALLS": listed(strip_calls(SHEET_COLORS)),
    "FIRST": len(strip_calls(SHEET_COLORS[:STRIP_COLORS])),
    "ALL": len(strip_calls(SHEET_COLORS)),
}
for mark, word in MARKS.items():
    BLOCKS, STRIPS = (text.replace(f"@{mark}@", str(word)) for text in (BLOCKS, STRIPS))


def xpbd_snippet(*texts: str) -> str:
    """Return the loop put together of texts, as a snippet."""
    text = "".join(texts).replace("\n    #define", "\n#define")
    return snippet(text, spring_pull, damping_impulse) + "#undef EACH\n#undef EVERY\n"


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
    """Move the ends of the springs of a range of pieces, all of one color."""
    for q in range(begin, end):
        for place in range(projection.piece[q][0], projection.piece[q][0] + wp.abs(projection.piece[q][1])):
            project_spring(place, turn, projection, table, multiplier, particles)


@wp.func_native(xpbd_snippet(POINTS, DAMP, LISTED, DAMP_LISTED))
def damp_range(begin: int, end: int, projection: Projection, table: SpringTable, particles: Particles):
    """Slow down the springs of a range of pieces, all of one color."""
    for q in range(begin, end):
        for place in range(projection.piece[q][0], projection.piece[q][0] + wp.abs(projection.piece[q][1])):
            damp_spring(place, projection, table, particles)


@wp.func
def part_of(part: int, part_count: int, begin: int, end: int) -> wp.vec2i:
    """Return one core's part of a range."""
    return wp.vec2i(begin + (end - begin) * part // part_count, begin + (end - begin) * (part + 1) // part_count)


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
    cut = part_of(part + wp.tid(), part_count, projection.first_piece[color], projection.first_piece[color + 1])
    if moves(projection, clock):
        project_range(cut[0], cut[1], turn, projection, table, multiplier_inout, particles_inout)


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
            project_range(
                projection.first_piece[k], projection.first_piece[k + 1], turn, projection, table, multiplier_inout, particles_inout
            )


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
    cut = part_of(part + wp.tid(), part_count, projection.first_piece[color], projection.first_piece[color + 1])
    if projection.damped[0] == 1 and moves(projection, clock):
        damp_range(cut[0], cut[1], projection, table, particles_inout)


@wp.kernel(enable_backward=False)
def damp_colors(
    first: int, color: int, end: int, projection: Projection, table: SpringTable, clock: wp.array[wp.int64], particles_inout: Particles
):
    """Slow down the springs of a run of colors, one after the other."""
    if projection.damped[0] == 1 and moves(projection, clock):
        for k in range(color + first, end):
            damp_range(projection.first_piece[k], projection.first_piece[k + 1], projection, table, particles_inout)


# Apart, so that who has no sheet need not wait for its loops.
@wp.func_native(xpbd_snippet(POINTS, PROJECT, PROJECT_SHEET, BLOCKS.replace("@MOVES@", "true"), STRIPS))
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


@wp.func_native(xpbd_snippet(POINTS, DAMP, DAMP_SHEET, BLOCKS.replace("@MOVES@", "false"), STRIPS))
def damp_strips(begin: int, end: int, strip: int, projection: Projection, sheet: Sheet, particles: Particles):
    """Slow down the springs within strips of four rows, color by color; the formulas are those of any sheet's spring."""
    for p in range(begin, end):
        damp_pair(p, sheet_end(p, strip, ALONG, strip, sheet), sheet.damping[strip], projection, particles)


@wp.kernel(enable_backward=False, module="warpsim.kernels.xpbd_loops.sheets")
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
    cut = part_of(part + wp.tid(), part_count, 0, (sheet.ny + 3) // 4)
    if moves(projection, clock):
        project_strips(cut[0], cut[1], strip, turn, projection, sheet, multiplier_inout, particles_inout)


@wp.kernel(enable_backward=False, module="warpsim.kernels.xpbd_loops.sheets")
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
    cut = part_of(part + wp.tid(), part_count, 0, (sheet.ny + 3) // 4)
    if moves(projection, clock):
        damp_strips(cut[0], cut[1], strip, projection, sheet, particles_inout)
