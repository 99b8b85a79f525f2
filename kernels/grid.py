"""A hashed grid without bounds: who is near whom, in an order that depends on the state alone.

Space is cut into cells as long as the reach across rows and a quarter of it along them (x). A cell (cx, cy, cz) of whole
numbers goes to the bucket cx + a cy + b cz mod 2^n: a row of cells is a run of buckets, so a particle finds all others
within the reach in nine runs. a and b make a good lattice: the nine runs never meet, so that nothing is counted twice, and
cells that share a bucket are far apart (at least 0.83 of what is possible, in space and in each plane of axes).
Sorted stably by bucket, particles of a bucket stay in the order of their slots.  Source: Teschner et al. 2003 for hashed
grids; Knuth, TAOCP 2, 3.3.4, for lattices mod 2^n.
"""

import warp as wp

from warpsim.kernels.emission import ACTIVE

FINE = 4  # cells per reach along a row: a run is 2.25 reaches long, not 3
ALONG = wp.constant(wp.float64(FINE))  # Warp gives a constant one type per function
SLACK = 1.0 + 2.0**-16  # cells are longer than the reach by more than all roundings of distances and cells
FARTHEST = wp.constant(wp.float64(2.0**62))  # cells beyond this one count as the last [edges]
LEAST_BITS, MOST_BITS = 10, 28
LONGEST_RUN = 56  # buckets; the strides keep nine runs of this length apart
STRIDES = (  # (a, b) for 2^10 … 2^28 buckets; tests/kernels/test_grid.py holds them to what is said above
    *((59, 275), (87, 379), (167, 1665), (179, 1943), (277, 7743), (493, 5357), (487, 29737), (989, 44635), (1041, 50287)),
    *((1535, 85181), (2333, 376359), (3053, 784083), (6321, 1756215), (5511, 1264385), (7711, 7029787), (14467, 7786039)),
    *((21723, 17937321), (30163, 51987557), (45409, 53185969)),
)


@wp.struct
class Grid:
    edges: wp.array[wp.float64]  # (1) edges of a cell per meter across rows, 1/(reach · SLACK) [1/m]
    strides: wp.array[wp.vec2ui]  # STRIDES
    bucket: wp.array[int]  # (capacity) by slot; the number of buckets for whom nobody is near
    order: wp.array[int]  # slots, by bucket and then by slot
    begin: wp.array[int]  # (buckets + 2) place in order of each bucket's first; then of those whom nobody is near, then the end


@wp.struct
class Layout:
    bits: int  # 2^bits buckets
    mask: wp.uint32  # 2^bits − 1
    up: wp.uint32  # a: what the next row in y adds to a bucket
    over: wp.uint32  # b: what the next row in z adds
    edges: wp.float64  # per meter


@wp.func
def layout_for(grid: Grid, count: int) -> Layout:
    """Return the layout for so many particles: 2 to 4 buckets each, so that a sparse system does not pay for its capacity."""
    layout = Layout()
    layout.bits = LEAST_BITS
    while (1 << layout.bits) < 2 * count and layout.bits < MOST_BITS:
        layout.bits = layout.bits + 1
    layout.mask = wp.uint32((1 << layout.bits) - 1)
    layout.up = grid.strides[layout.bits - LEAST_BITS][0]
    layout.over = grid.strides[layout.bits - LEAST_BITS][1]
    layout.edges = grid.edges[0]
    return layout


@wp.func(inline=True)
def cell_along(x: float, edges: wp.float64) -> int:
    """Return the cell's number along one axis, ⌊x·edges⌋ mod 2^32, in float64, so that far from the origin no neighbor is lost."""
    return int(wp.int64(wp.clamp(wp.floor(wp.float64(x) * edges), -FARTHEST, FARTHEST)))


@wp.func(inline=True)
def bucket_of(cx: int, cy: int, cz: int, layout: Layout) -> int:
    """Return the bucket of a cell, cx + a cy + b cz mod 2^bits."""
    return int((wp.uint32(cx) + layout.up * wp.uint32(cy) + layout.over * wp.uint32(cz)) & layout.mask)


@wp.func(inline=True)
def bucket_at(x: wp.vec3, layout: Layout) -> int:
    """Return the bucket of the cell at x."""
    cx = cell_along(x[0], layout.edges * ALONG)
    return bucket_of(cx, cell_along(x[1], layout.edges), cell_along(x[2], layout.edges), layout)


@wp.func(inline=True)
def finite(x: wp.vec3) -> int:
    """Return 1 for a point that can be near another, 0 if it is not finite or so far that squares overflow."""
    return wp.where(wp.abs(x[0]) + wp.abs(x[1]) + wp.abs(x[2]) < 1.0e18, 1, 0)


@wp.kernel(enable_backward=False)
def clear_tallies(first: int, tally_out: wp.array[int]):
    """Begin to count: nobody is in any bucket yet."""
    tally_out[first + wp.tid()] = 0


@wp.kernel(enable_backward=False)
def mark_arrivals(first: int, counters: wp.array[wp.int64], bucket: wp.array[int], tally_inout: wp.array[int], arrival_out: wp.array[int]):
    """Count the members of every bucket; in which order they arrive is chance, and nothing depends on it in the end."""
    i = first + wp.tid()
    if wp.int64(i) < counters[ACTIVE]:
        arrival_out[i] = wp.atomic_add(tally_inout, bucket[i], 1)


@wp.kernel(enable_backward=False)
def scatter_arrivals(first: int, counters: wp.array[wp.int64], grid: Grid, arrival: wp.array[int], loose_out: wp.array[int]):
    """Put every slot into its bucket, as it arrived."""
    i = first + wp.tid()
    if wp.int64(i) < counters[ACTIVE]:
        loose_out[grid.begin[grid.bucket[i]] + arrival[i]] = i


@wp.kernel(enable_backward=False)
def scatter_in_order(first: int, counters: wp.array[wp.int64], loose: wp.array[int], grid_out: Grid):
    """Give every slot its place among the members of its bucket, by counting those before it; of no use where nobody is near."""
    k = first + wp.tid()
    active = int(counters[ACTIVE])
    if k < active:
        slot = loose[k]
        bucket = grid_out.bucket[slot]
        place = int(k)
        if bucket <= int(layout_for(grid_out, active).mask):
            place = grid_out.begin[bucket]
            for j in range(grid_out.begin[bucket], grid_out.begin[bucket + 1]):
                place = place + wp.where(loose[j] < slot, 1, 0)
        grid_out.order[place] = slot


@wp.kernel(enable_backward=False)
def gather_rows(first: int, counters: wp.array[wp.int64], grid: Grid, rows: wp.array2d[float], sorted_out: wp.array2d[float]):
    """Copy a planar field into the grid's order, so that neighbors lie together."""
    k = first + wp.tid()
    if wp.int64(k) < counters[ACTIVE]:
        for row in range(rows.shape[0]):
            sorted_out[row, k] = rows[row, grid.order[k]]


@wp.func
def run_ends(grid: Grid, bucket: int, length: int, layout: Layout, before: int) -> wp.vec2i:
    """Return the places [begin, end) of a run of buckets; one that passes the last bucket is in two parts, `before` it and after."""
    total = int(layout.mask) + 1
    if before == 1:
        return wp.vec2i(grid.begin[bucket], grid.begin[wp.min(bucket + length, total)])
    return wp.vec2i(0, grid.begin[wp.max(bucket + length - total, 0)])
