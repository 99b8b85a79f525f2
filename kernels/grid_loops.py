"""Native loop shapes of the grid on the CPU: a stable sort by bucket in three passes, each of them split over the cores.

The leading half of a bucket's bits makes a group: groups are counted by part (tally), filled by part in order (scatter), and
each is then sorted by its own core in its cache, where its buckets begin falls out (sort). A stable sort has one result, so
the bits do not depend on the parts. As in loops.py: the Python body of each native function says what it stands for.
"""

import warp as wp

from warpsim.kernels.emission import ACTIVE
from warpsim.kernels.grid import Grid, layout_for
from warpsim.kernels.loops import share, snippet

MOST_DIGITS = 1 << 14  # of the leading, and of the trailing half of MOST_BITS


@wp.struct
class Sorting:
    tally: wp.array2d[int]  # (parts, groups + 1) members of each group in each part
    loose: wp.array[wp.vec2i]  # (capacity) (bucket, slot) by group


TALLY = """
    int* mine = tally.data + (size_t)tally.shape[1] * part;
    const int low = bits - bits / 2, groups = (1 << (bits / 2)) + 1;
    for (int g = 0; g < groups; ++g) mine[g] = 0;
    for (int i = begin; i < end; ++i) ++mine[bucket.data[i] >> low];
"""


@wp.func_native(snippet(TALLY))
def tally_range(begin: int, end: int, part: int, bits: int, bucket: wp.array[int], tally: wp.array2d[int]):
    """Count the members of each group among the slots begin … end − 1."""
    low = bits - bits // 2
    for g in range((1 << (bits // 2)) + 1):
        tally[part, g] = 0
    for i in range(begin, end):
        tally[part, bucket[i] >> low] = tally[part, bucket[i] >> low] + 1


@wp.kernel(enable_backward=False)
def tally_groups(part: int, part_count: int, counters: wp.array[wp.int64], grid: Grid, sorting_out: Sorting):
    """Count the groups' members in one part of the active slots."""
    mine = part + wp.tid()
    active = int(counters[ACTIVE])
    cut = share(mine, part_count, active)
    tally_range(cut[0], cut[1], mine, layout_for(grid, active).bits, grid.bucket, sorting_out.tally)


SCATTER = """
    int place[@DIGITS@ + 1];
    const int low = bits - bits / 2, groups = (1 << (bits / 2)) + 1, stride = tally.shape[1];
    int sum = 0;
    for (int g = 0; g < groups; ++g) {
        for (int p = 0; p < part; ++p) sum += tally.data[(size_t)stride * p + g];
        place[g] = sum;
        for (int p = part; p < part_count; ++p) sum += tally.data[(size_t)stride * p + g];
    }
    for (int i = begin; i < end; ++i) {
        const int b = bucket.data[i];
        loose.data[place[b >> low]++] = wp::vec_t<2, int>(b, i);
    }
""".replace("@DIGITS@", str(MOST_DIGITS))


@wp.func_native(snippet(SCATTER))
def scatter_range(
    begin: int,
    end: int,
    part: int,
    part_count: int,
    bits: int,
    bucket: wp.array[int],
    tally: wp.array2d[int],
    loose: wp.array[wp.vec2i],
):
    """Put (bucket, slot) of the slots begin … end − 1 behind the earlier members of their groups, in order."""
    low = bits - bits // 2
    for i in range(begin, end):
        place = int(0)
        for g in range((bucket[i] >> low) + 1):
            for p in range(part_count):
                place = place + wp.where(g < bucket[i] >> low or p < part, tally[p, g], 0)
        for j in range(begin, i):
            place = place + wp.where(bucket[j] >> low == bucket[i] >> low, 1, 0)
        loose[place] = wp.vec2i(bucket[i], i)


@wp.kernel(enable_backward=False)
def scatter_groups(part: int, part_count: int, counters: wp.array[wp.int64], grid: Grid, sorting_inout: Sorting):
    """Bring one part of the active slots into the order of the groups."""
    mine = part + wp.tid()
    active = int(counters[ACTIVE])
    cut = share(mine, part_count, active)
    bits = layout_for(grid, active).bits
    scatter_range(cut[0], cut[1], mine, part_count, bits, grid.bucket, sorting_inout.tally, sorting_inout.loose)


SORT = """
    int place[@DIGITS@];
    const int low = bits - bits / 2, groups = (1 << (bits / 2)) + 1, stride = tally.shape[1];
    int from = 0;
    for (int g = 0; g < groups; ++g) {
        int to = from;
        for (int p = 0; p < part_count; ++p) to += tally.data[(size_t)stride * p + g];
        if (from >= begin && (from < end || last)) {
            const int buckets = g + 1 < groups ? 1 << low : 1, base = g << low;
            for (int b = 0; b < buckets; ++b) place[b] = 0;
            for (int k = from; k < to; ++k) ++place[loose.data[k][0] - base];
            int sum = from;
            for (int b = 0; b < buckets; ++b) {
                const int count = place[b];
                starts.data[base + b] = place[b] = sum;
                sum += count;
            }
            for (int k = from; k < to; ++k) order.data[place[loose.data[k][0] - base]++] = loose.data[k][1];
            if (g + 1 == groups) starts.data[base + 1] = to;
        }
        from = to;
    }
""".replace("@DIGITS@", str(MOST_DIGITS))


@wp.func_native(snippet(SORT))
def sort_range(
    begin: int,
    end: int,
    last: int,
    part_count: int,
    bits: int,
    tally: wp.array2d[int],
    loose: wp.array[wp.vec2i],
    starts: wp.array[int],
    order: wp.array[int],
):
    """Sort the groups that begin at the places begin … end − 1 by bucket, and note where each bucket begins; the last part has the tail."""
    low = bits - bits // 2
    first = int(0)
    for g in range((1 << (bits // 2)) + 1):
        after = int(first)
        for p in range(part_count):
            after = after + tally[p, g]
        if first >= begin and (first < end or last == 1):
            for b in range(wp.where(g < 1 << (bits // 2), 1 << low, 2)):  # of those whom nobody is near: where they begin and end
                starts[(g << low) + b] = first
                for k in range(first, after):
                    starts[(g << low) + b] = starts[(g << low) + b] + wp.where(loose[k][0] < (g << low) + b, 1, 0)
            for k in range(first, after):
                place = int(first)
                for j in range(first, after):
                    place = place + wp.where(loose[j][0] < loose[k][0] or (loose[j][0] == loose[k][0] and j < k), 1, 0)
                order[place] = loose[k][1]
        first = after


@wp.kernel(enable_backward=False)
def sort_groups(part: int, part_count: int, counters: wp.array[wp.int64], grid_out: Grid, sorting: Sorting):
    """Sort one part of the groups."""
    mine = part + wp.tid()
    active = int(counters[ACTIVE])
    cut = share(mine, part_count, active)
    last = wp.where(mine + 1 == part_count, 1, 0)
    bits = layout_for(grid_out, active).bits
    sort_range(cut[0], cut[1], last, part_count, bits, sorting.tally, sorting.loose, grid_out.begin, grid_out.order)


GATHER = """
    for (int row = 0; row < rows.shape[0]; ++row) {
        const float* __restrict from = rows.data + (size_t)rows.shape[1] * row;
        float* __restrict to = sorted.data + (size_t)sorted.shape[1] * row;
        for (int k = begin; k < end; ++k) to[k] = from[order.data[k]];
    }
"""


@wp.func_native(snippet(GATHER))
def gather_range(begin: int, end: int, order: wp.array[int], rows: wp.array2d[float], sorted: wp.array2d[float]):
    """Copy the columns of a planar field to the places begin … end − 1."""
    for k in range(begin, end):
        for row in range(rows.shape[0]):
            sorted[row, k] = rows[row, order[k]]


@wp.kernel(enable_backward=False)
def gather_rows(
    part: int, part_count: int, counters: wp.array[wp.int64], grid: Grid, rows: wp.array2d[float], sorted_out: wp.array2d[float]
):
    """Copy one part of a planar field into the grid's order."""
    cut = share(part + wp.tid(), part_count, int(counters[ACTIVE]))
    gather_range(cut[0], cut[1], grid.order, rows, sorted_out)
