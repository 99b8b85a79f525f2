"""Native loop shapes of the pair forces on the CPU, beside the plain kernels whose bits they share.

Up to 16 particles of one row of cells are lanes: the neighbors of all of them come one by one, and each lane adds its own in
the order in which the plain kernel meets them. A neighbor out of a lane's reach adds zero, which changes no bit, so neither
the grouping into lanes nor the parts do.
"""

import warp as wp

from warpsim.kernels.advance import living_step
from warpsim.kernels.emission import ACTIVE, Particles
from warpsim.kernels.grid import FINE, LONGEST_RUN, Grid, Layout, bucket_at, bucket_of, cell_along, finite, layout_for
from warpsim.kernels.integration import Pace
from warpsim.kernels.lifetime import age_at
from warpsim.kernels.loops import share, snippet
from warpsim.kernels.pairwise import PAIR_LAWS, WHOLE, PairLaw, pair_bucket, softened, sum_pairs, within
from warpsim.kernels.planar import write3

LONGEST_SPAN = 32  # cells between the first and the last of the lanes
assert LONGEST_SPAN + 2 * FINE + 1 <= LONGEST_RUN

MARK = """
    const int S = particles.position.shape[1], nobody = (int)layout.mask + 1;
    const float *P = particles.position.data, *birth_age = particles.birth_age.data, *L = particles.lifetime.data;
    const int *birth_frame = particles.birth_frame.data, *alive = particles.alive.data;
    int* out = bucket.data;
    #pragma clang loop vectorize(assume_safety)
    for (int i = begin; i < end; ++i) {
        const vec x(P[i], P[i + S], P[i + 2 * S]);
        const int dead = moved ? 1 - alive[i] : 0;
        const float h = $living_step($age_at(frame, birth_frame[i], birth_age[i], pace.fps), L[i], dead, pace.first, pace);
        const int takes_part = (h >= @WHOLE@ * pace.dt) & $finite(x);
        const vec y(takes_part ? x[0] : 0.0f, takes_part ? x[1] : 0.0f, takes_part ? x[2] : 0.0f);
        const int b = $bucket_at(y, layout);
        out[i] = takes_part ? b : nobody;
    }
""".replace("@WHOLE@", f"{WHOLE}f")


@wp.func_native(snippet(MARK, age_at, living_step, finite, bucket_at))
def mark_range(begin: int, end: int, frame: int, pace: Pace, moved: int, particles: Particles, layout: Layout, bucket: wp.array[int]):
    """Note the buckets of the particles in the slots begin … end − 1."""
    for i in range(begin, end):
        bucket[i] = pair_bucket(i, frame, pace, moved, particles, layout)


@wp.kernel(enable_backward=False)
def mark_buckets(
    part: int,
    part_count: int,
    pace: Pace,
    moved: int,
    clock: wp.array[wp.int64],
    particles: Particles,
    counters: wp.array[wp.int64],
    grid_out: Grid,
):
    """Note the buckets of one part of the active particles."""
    active = int(counters[ACTIVE])
    cut = share(part + wp.tid(), part_count, active)
    mark_range(cut[0], cut[1], int(clock[0]), pace, moved, particles, layout_for(grid_out, active), grid_out.bucket)


ACCUMULATE = """
    constexpr int B = 16, FINE = @FINE@, SPAN = @SPAN@;
    const int S = sorted.shape[1], T = internal.shape[1], total = (int)layout.mask + 1, law_count = laws.shape[1];
    const float *PX = sorted.data, *PY = PX + S, *PZ = PY + S;
    const auto* law = laws.data + (size_t)laws.shape[1] * s;
    const int *start = grid.begin.data, nobody = start[total];
    const double across = layout.edges, along = layout.edges * (double)FINE;
    float X[3][B], F[3][B], D[3][B], D2[B], G[B];
    int C[B];
    #define LANES for (int l = 0; l < B; ++l)
    #define LAW(formula) LANES { const float s2 = $softened(q, D2[l]); G[l] += $within(q, s2, formula); }
    auto scan = [&](int from, int to) {
        for (int j = from; j < to; ++j) {
            const float x = PX[j], y = PY[j], z = PZ[j];
            LANES {
                D[0][l] = x - X[0][l]; D[1][l] = y - X[1][l]; D[2][l] = z - X[2][l];
                D2[l] = D[0][l] * D[0][l] + D[1][l] * D[1][l] + D[2][l] * D[2][l];
                G[l] = 0.0f;
            }
            for (int n = 0; n < law_count; ++n) {
                const auto& q = law[n];
                switch (q.kind) { LAW_CASES }
            }
            LANES { F[0][l] += D[0][l] * G[l]; F[1][l] += D[1][l] * G[l]; F[2][l] += D[2][l] * G[l]; }
        }
    };
    int k = begin;
    for (const int stop = end < nobody ? end : nobody; k < stop;) {
        LANES {
            const int m = k + l < stop ? k + l : stop - 1;
            X[0][l] = PX[m]; X[1][l] = PY[m]; X[2][l] = PZ[m];
            F[0][l] = F[1][l] = F[2][l] = 0.0f;
            C[l] = $cell_along(X[0][l], along);
        }
        const int cx = C[0], cy = $cell_along(X[1][0], across), cz = $cell_along(X[2][0], across);
        int n = 1;
        while (n < B && k + n < stop && (wp::uint32)C[n] - (wp::uint32)cx <= (wp::uint32)SPAN && $cell_along(X[1][n], across) == cy
               && $cell_along(X[2][n], across) == cz) ++n;
        for (int l = n; l < B; ++l) for (int c = 0; c < 3; ++c) X[c][l] = X[c][0];
        const int length = C[n - 1] - cx + 2 * FINE + 1;
        for (int row = 0; row < 9; ++row) {
            const int b = $bucket_of(cx - FINE, cy + row % 3 - 1, cz + row / 3 - 1, layout), e = b + length;
            scan(start[b], start[e < total ? e : total]);
            if (e > total) scan(0, start[e - total]);
        }
        for (int l = 0; l < n; ++l) {
            const int i = grid.order.data[k + l];
            const float w = 1.0f / mass.data[i];
            for (int c = 0; c < 3; ++c) internal.data[i + (size_t)c * T] = F[c][l] * w;
        }
        k += n;
    }
    for (; k < end; ++k) for (int c = 0; c < 3; ++c) internal.data[grid.order.data[k] + (size_t)c * T] = 0.0f;
"""


def accumulate_text() -> str:
    """Assemble the loop, with a switch over the laws outside the lanes."""
    laws = " ".join(f"case {kind}: LAW(${law.func.__name__}(q, s2)) break;" for kind, law in enumerate(PAIR_LAWS.values()))
    text = ACCUMULATE.replace("LAW_CASES", laws).replace("@FINE@", str(FINE)).replace("@SPAN@", str(LONGEST_SPAN))
    text = snippet(text.replace("\n    #define", "\n#define"), *PAIR_LAWS.values(), softened, within, cell_along, bucket_of)
    return text + "#undef LANES\n#undef LAW\n"


@wp.func_native(accumulate_text())
def accumulate_range(
    begin: int,
    end: int,
    s: int,
    laws: wp.array2d[PairLaw],
    grid: Grid,
    sorted: wp.array2d[float],
    mass: wp.array[float],
    layout: Layout,
    internal: wp.array2d[float],
):
    """Store what their neighbors do to the particles at the places begin … end − 1."""
    for k in range(begin, end):
        a = wp.vec3()
        if k < grid.begin[int(layout.mask) + 1]:
            a = sum_pairs(k, s, laws, grid, sorted, layout) * (1.0 / mass[grid.order[k]])
        write3(internal, grid.order[k], a)


@wp.kernel(enable_backward=False)
def accumulate_pairs(
    part: int,
    part_count: int,
    s: int,
    counters: wp.array[wp.int64],
    laws: wp.array2d[PairLaw],
    grid: Grid,
    sorted: wp.array2d[float],
    mass: wp.array[float],
    internal_out: wp.array2d[float],
):
    """Store what its neighbors do to every particle of one part."""
    active = int(counters[ACTIVE])
    cut = share(part + wp.tid(), part_count, active)
    accumulate_range(cut[0], cut[1], s, laws, grid, sorted, mass, layout_for(grid, active), internal_out)
