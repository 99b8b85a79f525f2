"""Native loops of flocks for the CPU, beside the plain kernels whose bits they share.

Up to 16 boids of one row of cells are lanes: the neighbors of all of them come one by one, and each lane meets its own in the order of
the plain kernel. Whoever is out of a lane's reach or view adds zero, which changes no bit, so neither the grouping into lanes nor the
parts do. As in pairwise_loops.py.
"""

import warp as wp

from warpsim.kernels.domain import PERIODIC, bucket_in, cell_around, cell_at, cell_in, cell_within, closes_upon, folded, layout_in, run_in
from warpsim.kernels.flock import (
    MOST_NEAREST,
    Crowd,
    Rules,
    attends,
    counts,
    crowding,
    everybody,
    first_alone,
    flock_force,
    no_company,
    part_coincident,
    steer_boid,
    view_limit,
    within_reach,
)
from warpsim.kernels.grid import FINE, LONGEST_RUN, Grid, bucket_of, finite
from warpsim.kernels.loops import share, snippet
from warpsim.kernels.planar import read3

LONGEST_SPAN = 32  # cells between the first and the last of the lanes
assert LONGEST_SPAN + 2 * FINE + 1 <= LONGEST_RUN

MARK = """
    const int S = position.shape[1];
    const float *P = position.data;
    const auto domain = crowd.domain.data[0];
    const auto layout = $layout_in(grid, crowd.count, domain);
    const int nobody = (int)layout.mask + 1;
    auto note = [&](auto cell_of) {  // a loop for each kind of cells, so that none of them decides boid by boid
        for (int i = begin; i < end; ++i) {
            const vec x(P[i], P[i + S], P[i + 2 * S]);
            const auto cell = cell_of(x);
            const int place = $bucket_of(cell[0], cell[1], cell[2], layout);
            bucket.data[i] = $finite(x) ? place : nobody;
        }
    };
    if (domain.boundary == @PERIODIC@) note([&](vec x) { return $cell_around(x, domain); });
    else if (domain.cells[0] > 0) note([&](vec x) { return $cell_within(x, domain, layout); });
    else note([&](vec x) { return $cell_at(x, layout); });
"""


@wp.func_native(snippet(MARK.replace("@PERIODIC@", str(PERIODIC)), layout_in, finite, bucket_of, cell_around, cell_within, cell_at))
def mark_flock_range(begin: int, end: int, crowd: Crowd, position: wp.array2d[float], grid: Grid, bucket: wp.array[int]):
    """Note the buckets of a range of boids."""
    layout = layout_in(grid, crowd.count, crowd.domain[0])
    for i in range(begin, end):
        x = read3(position, i)
        bucket[i] = int(layout.mask) + 1
        if finite(x) == 1:
            bucket[i] = bucket_in(x, crowd.domain[0], layout)


@wp.kernel(enable_backward=False)
def mark_flock(part: int, part_count: int, crowd: Crowd, position: wp.array2d[float], grid_out: Grid):
    """Note the buckets of one part of the boids."""
    cut = share(part + wp.tid(), part_count, crowd.count)
    mark_flock_range(cut[0], cut[1], crowd, position, grid_out, grid_out.bucket)


ACCUMULATE = """
    constexpr int B = 16, FINE = @FINE@, SPAN = @SPAN@;
    const int S = mine.sorted.shape[1], Q = theirs.sorted.shape[1], T = steering.shape[1];
    const float *MX = mine.sorted.data, *MY = MX + S, *MZ = MY + S, *MU = MZ + S, *MV = MU + S, *MW = MV + S;
    const float *PX = theirs.sorted.data, *PY = PX + Q, *PZ = PY + Q, *PU = PZ + Q, *PV = PU + Q, *PW = PV + Q;
    const auto rule = rules.data[0];
    const auto domain = theirs.domain.data[0];
    const auto layout = $layout_in(theirs.grid, theirs.count, domain);
    const int nobody = $first_alone(mine);
    const float reach2 = rule.reach2, sr2 = rule.separation_reach2, cr2 = rule.cohesion_reach2, ar2 = rule.alignment_reach2;
    const float closest = rule.closest, ex = domain.size[0], ey = domain.size[1], ez = domain.size[2];
    const float rx = domain.rate[0], ry = domain.rate[1], rz = domain.rate[2];
    const int *order = theirs.grid.order.data;
    float X[3][B], V[3][B], L[B], APART[3][B], WAY[3][B], COURSE[3][B], COHERENT[B], ALIGNED[B], COUNT[B], SAME[B];
    int K[B];
    wp::vec_t<3, int> C[B];
    #define LANES for (int l = 0; l < B; ++l)
    #define EACH(FOLD, LOAD, DO, AFTER) for (int j = from; j < to; ++j) { \\
        const float x = PX[j], y = PY[j], z = PZ[j]; \\
        LOAD \\
        LANES { \\
            float a = x - X[0][l], b = y - X[1][l], c = z - X[2][l]; \\
            FOLD \\
            const float d2 = a * a + b * b + c * c, q = a * V[0][l] + b * V[1][l] + c * V[2][l]; \\
            float m = $attends(d2, q, L[l], reach2) * (j == K[l] ? 0.0f : 1.0f); \\
            DO \\
        } \\
        AFTER }
    #define MEET \\
        const float g = m * $within_reach(d2, sr2) * $crowding(d2, closest); \\
        const float f = m * $within_reach(d2, cr2), h = m * $within_reach(d2, ar2); \\
        APART[0][l] -= a * g; APART[1][l] -= b * g; APART[2][l] -= c * g; \\
        WAY[0][l] += a * f; WAY[1][l] += b * f; WAY[2][l] += c * f; \\
        COURSE[0][l] += u * h; COURSE[1][l] += v * h; COURSE[2][l] += w * h; \\
        COHERENT[l] += f; ALIGNED[l] += h; COUNT[l] += m; \\
        SAME[l] += m * (d2 == 0.0f ? 1.0f : 0.0f);
    // Where every rule reaches as far as the eye, whoever is met counts for all three.
    #define MEET_ALIKE \\
        const float g = m * $crowding(d2, closest); \\
        APART[0][l] -= a * g; APART[1][l] -= b * g; APART[2][l] -= c * g; \\
        WAY[0][l] += a * m; WAY[1][l] += b * m; WAY[2][l] += c * m; \\
        COURSE[0][l] += u * m; COURSE[1][l] += v * m; COURSE[2][l] += w * m; \\
        COUNT[l] += m; SAME[l] += m * (d2 == 0.0f ? 1.0f : 0.0f);
    #define COURSES const float u = PU[j]; const float v = PV[j]; const float w = PW[j];
    #define NUMBER const int number = order[j];
    #define MEET_ALL(FOLD) EACH(FOLD, COURSES, MEET, )
    #define MEET_ALL_ALIKE(FOLD) EACH(FOLD, COURSES, MEET_ALIKE, )
    #define MEET_NEAREST(FOLD) EACH(FOLD, COURSES NUMBER, m *= $counts(d2, number, D[l], N[l]); MEET, )
    // Few are nearer than the last of those found so far: all lanes are asked at once, and one by one where any says so.
    #define FIND(FOLD) EACH(FOLD, NUMBER, S2[l] = d2; M[l] = m * $counts(d2, number, D[l], N[l]) > 0.0f;, file(number);)
    #define SCAN(KIND) for (int part = 0; part < 18; ++part) { \\
        const auto ends = $run_in(theirs.grid, C[0], part / 2, length, part % 2, domain, layout); \\
        const int from = ends[0], to = ends[1]; \\
        if (from >= to) continue; \\
        if ($closes_upon(C[0], part / 2, length, domain)) { \\
            KIND(a = $folded(a, ex, rx); b = $folded(b, ey, ry); c = $folded(c, ez, rz);) \\
        } else { \\
            KIND() \\
        } }
    // A key is the distance's bits above the number's, so that one comparison orders both; each lane keeps the least, after a 0.
    constexpr int WIDE = 8;
    const int kept = (rule.nearest + WIDE - 1) / WIDE * WIDE;
    const auto all = $everybody();
    const wp::uint64 last_key = (wp::uint64)wp::cast<wp::uint32>(all.d2) << 32 | (wp::uint32)all.number;
    wp::uint64 KEYS[B][1 + @MOST@];
    float D[B], S2[B];
    int N[B], M[B], n;
    auto file = [&](int number) {
        unsigned nearer = 0;
        LANES nearer |= (unsigned)M[l] << l;
        for (nearer &= (1u << n) - 1; nearer; nearer &= nearer - 1) {
            const int l = __builtin_ctz(nearer);
            const wp::uint64 key = (wp::uint64)wp::cast<wp::uint32>(S2[l]) << 32 | (wp::uint32)number;
            for (int p = kept - WIDE; p >= 0; p -= WIDE) {
                wp::uint64 row[WIDE];
                for (int c = 0; c < WIDE; ++c) {
                    const wp::uint64 before = KEYS[l][p + c], here = KEYS[l][p + c + 1], lesser = here < key ? here : key;
                    row[c] = before > lesser ? before : lesser;
                }
                for (int c = 0; c < WIDE; ++c) KEYS[l][p + c + 1] = row[c];
            }
            const wp::uint64 last = KEYS[l][rule.nearest];
            D[l] = wp::cast<float>((wp::uint32)(last >> 32)); N[l] = (int)(wp::uint32)last;
        }
    };
    int k = begin;
    for (const int stop = end < nobody ? end : nobody; k < stop;) {
        LANES {
            const int m = k + l < stop ? k + l : stop - 1;
            X[0][l] = MX[m]; X[1][l] = MY[m]; X[2][l] = MZ[m];
            V[0][l] = MU[m]; V[1][l] = MV[m]; V[2][l] = MW[m];
            L[l] = $view_limit(rule.cosine, MU[m] * MU[m] + MV[m] * MV[m] + MW[m] * MW[m]);
            C[l] = $cell_in(vec(MX[m], MY[m], MZ[m]), domain, layout);
            K[l] = own ? k + l : -1;
            for (int c = 0; c < 3; ++c) APART[c][l] = WAY[c][l] = COURSE[c][l] = 0.0f;
            COHERENT[l] = ALIGNED[l] = COUNT[l] = SAME[l] = 0.0f;
        }
        LANES {  // what will be stored lies anywhere in memory
            const int i = mine.grid.order.data[k + l < stop ? k + l : stop - 1];
            for (int c = 0; c < 3; ++c) __builtin_prefetch(steering.data + i + (size_t)c * T, 1);
            __builtin_prefetch(neighbors.data + i, 1);
        }
        n = 1;
        while (n < B && k + n < stop && (wp::uint32)C[n][0] - (wp::uint32)C[0][0] <= (wp::uint32)SPAN && C[n][1] == C[0][1]
               && C[n][2] == C[0][2]) ++n;
        for (int l = n; l < B; ++l) for (int c = 0; c < 3; ++c) { X[c][l] = X[c][0]; V[c][l] = V[c][0]; }
        int far = C[0][0];
        for (int l = 1; l < n; ++l) if ((wp::uint32)C[l][0] - (wp::uint32)C[0][0] > (wp::uint32)far - (wp::uint32)C[0][0]) far = C[l][0];
        const int length = (int)((wp::uint32)far - (wp::uint32)C[0][0]) + 2 * FINE + 1;
        LANES { D[l] = all.d2; N[l] = all.number; }
        if (rule.nearest > 0) {
            LANES { KEYS[l][0] = 0; for (int p = 1; p <= kept; ++p) KEYS[l][p] = last_key; }
            SCAN(FIND)
            SCAN(MEET_NEAREST)
        } else if (sr2 >= reach2 && cr2 >= reach2 && ar2 >= reach2) {
            SCAN(MEET_ALL_ALIKE)
            LANES COHERENT[l] = ALIGNED[l] = COUNT[l];
        } else {
            SCAN(MEET_ALL)
        }
        for (int l = 0; l < n; ++l) {
            const int i = mine.grid.order.data[k + l];
            auto company = $no_company();
            company.apart = vec(APART[0][l], APART[1][l], APART[2][l]);
            company.way = vec(WAY[0][l], WAY[1][l], WAY[2][l]);
            company.course = vec(COURSE[0][l], COURSE[1][l], COURSE[2][l]);
            company.coherent = COHERENT[l]; company.aligned = ALIGNED[l];
            auto last = all;
            last.d2 = D[l]; last.number = N[l];
            if (SAME[l] > 0.0f) company.apart = company.apart
                + $part_coincident(vec(X[0][l], X[1][l], X[2][l]), k + l, own, i, last, C[l], theirs, domain, layout, rule);
            const vec f = $flock_force(vec(V[0][l], V[1][l], V[2][l]), company, rule);
            for (int c = 0; c < 3; ++c) {
                float *sum = steering.data + i + (size_t)c * T;
                *sum = (own ? 0.0f : *sum) + f[c];
            }
            neighbors.data[i] = (own ? 0 : neighbors.data[i]) + (int)COUNT[l];
        }
        k += n;
    }
    if (own) for (; k < end; ++k) {
        const int i = mine.grid.order.data[k];
        for (int c = 0; c < 3; ++c) steering.data[i + (size_t)c * T] = 0.0f;
        neighbors.data[i] = 0;
    }
"""
FORMULAS = (attends, within_reach, crowding, view_limit, flock_force, folded, layout_in, cell_in, run_in, part_coincident, no_company)
FORMULAS += (counts, everybody, first_alone, closes_upon)
MACROS = ("LANES", "EACH", "MEET", "MEET_ALIKE", "COURSES", "NUMBER", "MEET_ALL", "MEET_ALL_ALIKE", "MEET_NEAREST", "FIND", "SCAN")
ACCUMULATE = ACCUMULATE.replace("@FINE@", str(FINE)).replace("@SPAN@", str(LONGEST_SPAN))
ACCUMULATE = ACCUMULATE.replace("@MOST@", str(MOST_NEAREST)).replace("\n    #define", "\n#define")


@wp.func_native(snippet(ACCUMULATE, *FORMULAS) + "".join(f"#undef {macro}\n" for macro in MACROS))
def accumulate_flock_range(
    begin: int,
    end: int,
    own: int,
    rules: wp.array[Rules],
    mine: Crowd,
    theirs: Crowd,
    steering: wp.array2d[float],
    neighbors: wp.array[int],
):
    """Add what their neighbors make the boids at the places begin … end − 1 do."""
    layout = layout_in(theirs.grid, theirs.count, theirs.domain[0])
    for k in range(begin, end):
        steer_boid(k, own, rules[0], mine, theirs, layout, first_alone(mine), steering, neighbors)


@wp.kernel(enable_backward=False)
def accumulate_flock(
    part: int,
    part_count: int,
    own: int,
    rules: wp.array[Rules],
    mine: Crowd,
    theirs: Crowd,
    steering_inout: wp.array2d[float],
    neighbors_inout: wp.array[int],
):
    """Add what their neighbors make one part of the boids do [N], and count them."""
    cut = share(part + wp.tid(), part_count, mine.count)
    accumulate_flock_range(cut[0], cut[1], own, rules, mine, theirs, steering_inout, neighbors_inout)
