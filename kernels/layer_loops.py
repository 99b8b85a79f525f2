"""Native loops over the points of a sheet that meets itself, for the CPU, beside the plain kernels whose bits they share; see loops.py."""

import warp as wp

from warpsim.kernels.emission import ACTIVE, Particles
from warpsim.kernels.grid import FINE, Grid, Layout, bucket_of, cell_along, layout_for
from warpsim.kernels.layer_search import fill_list, insert_near, meets, replace_farthest
from warpsim.kernels.layers import ALARM, CORE, CROWDED, DISTANCE, REACH, STRIDE, Layers, alarm_at, collides, count_near
from warpsim.kernels.loops import share, snippet


def numbered(text: str) -> str:
    """Put the places of flags and numbers into a text."""
    places = {"ALARM": ALARM, "CORE": CORE, "CROWDED": CROWDED, "DISTANCE": DISTANCE, "REACH": REACH, "STRIDE": STRIDE, "FINE": FINE}
    for name, place in places.items():
        text = text.replace(f"@{name}@", str(place))
    return text


MEASURE = """
    constexpr int B = @BLOCK@, L = 8;
    const int S = particles.position.shape[1], T = layers.start.shape[1], R = layers.reference.shape[1], slices = layers.boxes.shape[1];
    for (int b = begin; b < end; b += B) {
        const int n = end - b < B ? end - b : B;
        float farthest = 0.0f;
        for (int t = 0; t < n; ++t) {
            const float *X = particles.position.data + b + t, *X0 = layers.start.data + b + t;
            const vec way(X[0] - X0[0], X[S] - X0[T], X[2 * S] - X0[2 * (size_t)T]);
            const float square = wp::dot(way, way);
            farthest = square > farthest ? square : farthest;
        }
        layers.boxes.data[(size_t)12 * slices + b / B] = farthest;
        for (int c = 0; c < 3; ++c) {
            const float *X = particles.position.data + (size_t)c * S + b, *X0 = layers.start.data + (size_t)c * T + b;
            const float *XR = layers.reference.data + (size_t)c * R + b;
            float box[4][L];
            for (int l = 0; l < L; ++l) { box[0][l] = box[2][l] = 1.0e30f; box[1][l] = box[3][l] = -1.0e30f; }
            int t = 0;
            #define WIDEN(l) { const float away = X0[t + l] - XR[t + l], moved = X[t + l] - X0[t + l]; \\
                box[0][l] = away < box[0][l] ? away : box[0][l]; box[1][l] = away > box[1][l] ? away : box[1][l]; \\
                box[2][l] = moved < box[2][l] ? moved : box[2][l]; box[3][l] = moved > box[3][l] ? moved : box[3][l]; }
            for (; t + L <= n; t += L) for (int l = 0; l < L; ++l) WIDEN(l)
            for (; t < n; ++t) WIDEN(0)
            for (int k = 0; k < 4; ++k) {
                float edge = box[k][0];
                for (int l = 1; l < L; ++l) edge = (k & 1) ? (box[k][l] > edge ? box[k][l] : edge) : (box[k][l] < edge ? box[k][l] : edge);
                layers.boxes.data[(size_t)(3 * k + c) * slices + b / B] = edge;
            }
        }
    }
"""


@wp.func_native(snippet(MEASURE.replace("\n            #define", "\n#define")) + "#undef WIDEN\n")
def measure_range(begin: int, end: int, layers: Layers, particles: Particles):
    """Store the boxes of the slices of a range of points."""
    for i in range(begin, end):
        layers.boxes[0, i // 64] = layers.start[0, i] - layers.reference[0, i]
        layers.boxes[6, i // 64] = particles.position[0, i]


@wp.kernel(enable_backward=False)
def measure_motion(part: int, part_count: int, layers_inout: Layers, particles: Particles):
    """Store the boxes of one part of the slices."""
    cut = share(part + wp.tid(), part_count, layers_inout.point_count)
    measure_range(cut[0], cut[1], layers_inout, particles)


COUNT = """
    constexpr int B = @BLOCK@;
    const int S = particles.position.shape[1], rows = layers.rows;
    const float *X = particles.position.data, *Y = X + S, *Z = Y + S, d = layers.numbers.data[@DISTANCE@], square = d * d;
    for (int b = begin; b < end; b += B) {
        const int n = end - b < B ? end - b : B;
        const int *count = layers.count.data + b, *near = layers.near.data + (size_t)(b / B) * rows * B;
        int most = 0, total[B] = {};
        for (int t = 0; t < n; ++t) most = count[t] > most ? count[t] : most;
        for (int row = 0; row < most; ++row) {
            const int* J = near + row * B;
            for (int t = 0; t < B; ++t) {
                const int listed = row < count[t], j = listed ? J[t] : b + t;
                const vec r(X[b + t] - X[j], Y[b + t] - Y[j], Z[b + t] - Z[j]);
                total[t] += listed & (wp::dot(r, r) < square);
            }
        }
        for (int t = 0; t < n; ++t) layers.touches.data[b + t] = total[t];
    }
"""


@wp.func_native(snippet(numbered(COUNT)))
def count_range(begin: int, end: int, layers: Layers, particles: Particles):
    """Count who touches the points of a range."""
    for i in range(begin, end):
        layers.touches[i] = count_near(i, layers, particles)


@wp.kernel(enable_backward=False)
def count_touches(part: int, part_count: int, layers_inout: Layers, particles: Particles):
    """Count who touches each point of one part."""
    cut = share(part + wp.tid(), part_count, layers_inout.point_count)
    count_range(cut[0], cut[1], layers_inout, particles)


WATCH = """
    constexpr int B = @BLOCK@;
    const int S = particles.position.shape[1], T = layers.start.shape[1], rows = layers.rows;
    const float *X = particles.position.data, *Y = X + S, *Z = Y + S, *X0 = layers.start.data, *Y0 = X0 + T, *Z0 = Y0 + T;
    const float core = layers.numbers.data[@CORE@], stride = layers.numbers.data[@STRIDE@] * 1.0001f;
    const vec middle(layers.middle.data[0], layers.middle.data[1], layers.middle.data[2]);
    int alarm = 0;
    for (int b = begin; b < end; b += B) {
        const int n = end - b < B ? end - b : B;
        const int *count = layers.count.data + b, *near = layers.near.data + (size_t)(b / B) * rows * B;
        int most = 0, found = 0;
        for (int t = 0; t < n; ++t) {
            const vec x0(X0[b + t], Y0[b + t], Z0[b + t]), x1(X[b + t], Y[b + t], Z[b + t]), beside = wp::sub(wp::sub(x1, x0), middle);
            found |= layers.inverse_mass.data[b + t] > 0.0f && wp::dot(beside, beside) > stride * stride;
            most = count[t] > most ? count[t] : most;
        }
        for (int row = 0; row < most; ++row) {
            const int* J = near + row * B;
            for (int t = 0; t < B; ++t) {
                const int listed = row < count[t], i = b + t, j = listed ? J[t] : i;
                const vec r0(X0[i] - X0[j], Y0[i] - Y0[j], Z0[i] - Z0[j]), r1(X[i] - X[j], Y[i] - Y[j], Z[i] - Z[j]);
                found |= listed & $collides(r0, r1, core);
            }
        }
        alarm |= found;
    }
    if (alarm) __atomic_store_n(layers.flags.data + @ALARM@, 1, __ATOMIC_RELAXED);
"""


@wp.func_native(snippet(numbered(WATCH), collides))
def watch_range(begin: int, end: int, layers: Layers, particles: Particles):
    """Note whether any point of a range went too far."""
    for i in range(begin, end):
        if alarm_at(i, layers, particles) == 1:
            layers.flags[ALARM] = 1


@wp.kernel(enable_backward=False)
def mark_alarm(part: int, part_count: int, layers_inout: Layers, particles: Particles):
    """Note whether any point of one part went too far."""
    cut = share(part + wp.tid(), part_count, layers_inout.point_count)
    watch_range(cut[0], cut[1], layers_inout, particles)


LIST = """
    constexpr int FINE = @FINE@, length = 2 * FINE + 1;
    const int S = sorted.shape[1], R = layers.reference.shape[1], total = (int)layout.mask + 1, T = layers.start.shape[1];
    const float *PX = sorted.data, *PY = PX + S, *PZ = PY + S, reach = layers.numbers.data[@REACH@], square = reach * reach;
    const int *start = grid.begin.data, *order = grid.order.data, nobody = start[total];
    const double across = layout.edges, along = layout.edges * (double)FINE;
    for (int k = begin; k < end; ++k) {
        const int i = order[k];
        const float x = PX[k], y = PY[k], z = PZ[k];
        int count = 0;
        auto scan = [&](int from, int to) {
            for (int place = from; place < to; ++place) {
                const vec r(PX[place] - x, PY[place] - y, PZ[place] - z);
                if (!(wp::dot(r, r) < square)) continue;
                const int j = order[place];
                if (!$meets(i, j, layers)) continue;
                if (count < layers.rows) count = $insert_near(i, j, count, layers);
                else {
                    __atomic_store_n(layers.flags.data + @CROWDED@, 1, __ATOMIC_RELAXED);
                    $replace_farthest(i, j, layers);
                }
            }
        };
        const int cx = $cell_along(x, along), cy = $cell_along(y, across), cz = $cell_along(z, across);
        for (int row = 0; k < nobody && row < 9; ++row) {
            const int b = $bucket_of(cx - FINE, cy + row % 3 - 1, cz + row / 3 - 1, layout), e = b + length;
            scan(start[b], start[e < total ? e : total]);
            if (e > total) scan(0, start[e - total]);
        }
        layers.count.data[i] = count;
        for (int c = 0; c < 3; ++c) layers.reference.data[i + (size_t)c * R] = layers.start.data[i + (size_t)c * T];
    }
"""


@wp.func_native(snippet(numbered(LIST), meets, insert_near, replace_farthest, cell_along, bucket_of))
def list_range(begin: int, end: int, grid: Grid, sorted: wp.array2d[float], layout: Layout, layers: Layers):
    """Make the lists of the points at the places begin … end − 1."""
    for k in range(begin, end):
        layers.count[grid.order[k]] = fill_list(k, grid, sorted, layout, layers)


@wp.kernel(enable_backward=False)
def list_near(part: int, part_count: int, counters: wp.array[wp.int64], grid: Grid, sorted: wp.array2d[float], layers_inout: Layers):
    """Make the lists of one part of the points, if there is a search."""
    active = int(counters[ACTIVE])
    cut = share(part + wp.tid(), part_count, active)
    list_range(cut[0], cut[1], grid, sorted, layout_for(grid, active), layers_inout)
