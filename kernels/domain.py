"""The domain of a flock: a box that it fills at the start, and what its borders do.

Cells of a periodic domain lie in rows that close upon themselves; those of an endless one are hashed (grid.py). In both, a bucket is
cx + a cy + b cz mod 2^n; here a and b are the true strides of the rows, so that no two cells share a bucket. A box that keeps its boids
has the cells of an endless domain, in rows where there are buckets for all of them: in the same order, so that the bits are the same, but
no boid meets a stranger from far away, and rows that are side by side in space are near each other in memory (docs/adr/0037).
"""

import warp as wp

from warpsim.kernels.grid import ALONG, FINE, Grid, Layout, bucket_of, cell_along, layout_for, run_ends

NONE, CONTAIN, PERIODIC = range(3)
BOUNDARIES = {"none": NONE, "contain": CONTAIN, "periodic": PERIODIC}


@wp.struct
class Domain:
    boundary: int  # NONE, CONTAIN, PERIODIC
    low: wp.vec3  # corner [m]
    size: wp.vec3  # edges [m]; 0 along an axis that does not exist
    rate: wp.vec3  # 1/edge [1/m]; 0 along an axis that does not exist
    cells: wp.vec3i  # along each axis, x in fine ones (grid.py), of a domain whose cells are in rows; 0: they are hashed
    per_meter: wp.vec3d  # cells per meter along each axis; 0 along an axis that does not exist
    corner: wp.vec3d  # of a domain with walls: numbers of its first cells among those of the endless one


@wp.func(inline=True)
def folded(d: float, edge: float, rate: float) -> float:
    """Return the shortest way between two points of a periodic axis [m], d or d ± edge."""
    return d - edge * wp.floor(d * rate + 0.5)


@wp.func
def fold(d: wp.vec3, domain: Domain) -> wp.vec3:
    """Return the shortest way between two points [m]; as it is where the domain does not close upon itself."""
    if domain.boundary != PERIODIC:
        return d
    size = domain.size
    return wp.vec3(folded(d[0], size[0], domain.rate[0]), folded(d[1], size[1], domain.rate[1]), folded(d[2], size[2], domain.rate[2]))


@wp.func
def fold_if(crosses: int, d: wp.vec3, domain: Domain) -> wp.vec3:
    """Return the shortest way between two points [m], of which closes_upon() says whether it may cross the borders."""
    if crosses == 0:  # folded() would leave it as it is, to the bit: all are within the domain, project_domain sees to that
        return d
    return fold(d, domain)


@wp.func(inline=True)
def wrapped(x: float, low: float, edge: float, rate: float) -> float:
    """Return x within [low, low + edge) of a periodic axis [m]; rounding never puts it onto the far end."""
    y = x - edge * wp.floor((x - low) * rate)
    return wp.where(y - low < edge, wp.max(y, low), low)


@wp.func
def wrap(x: wp.vec3, domain: Domain) -> wp.vec3:
    """Return a place within a periodic domain [m]."""
    low = domain.low
    size = domain.size
    result = x
    for axis in range(3):
        if size[axis] > 0.0:
            result[axis] = wrapped(x[axis], low[axis], size[axis], domain.rate[axis])
    return result


@wp.func(inline=True)
def slot_along(x: float, low: float, per_meter: wp.float64, count: int) -> int:
    """Return the cell of a place along an axis with so many cells."""
    return wp.clamp(int(wp.floor((wp.float64(x) - wp.float64(low)) * per_meter)), 0, count - 1)


@wp.func(inline=True)
def slot_beside(x: float, per_meter: wp.float64, first: wp.float64, count: int) -> int:
    """Return the cell of a place along an axis with so many cells of the endless domain, from one on; who is beyond counts to the last."""
    return int(wp.clamp(wp.floor(wp.float64(x) * per_meter) - first, wp.float64(0.0), wp.float64(count - 1)))


@wp.func(inline=True)
def cell_around(x: wp.vec3, domain: Domain) -> wp.vec3i:
    """Return the cell of a place in a periodic domain."""
    a = slot_along(x[0], domain.low[0], domain.per_meter[0], domain.cells[0])
    b = slot_along(x[1], domain.low[1], domain.per_meter[1], domain.cells[1])
    return wp.vec3i(a, b, slot_along(x[2], domain.low[2], domain.per_meter[2], domain.cells[2]))


@wp.func(inline=True)
def cell_within(x: wp.vec3, domain: Domain, layout: Layout) -> wp.vec3i:
    """Return the cell of a place in a domain with walls and rows of cells."""
    a = slot_beside(x[0], layout.edges * ALONG, domain.corner[0], domain.cells[0])
    b = slot_beside(x[1], layout.edges, domain.corner[1], domain.cells[1])
    return wp.vec3i(a, b, slot_beside(x[2], layout.edges, domain.corner[2], domain.cells[2]))


@wp.func(inline=True)
def cell_at(x: wp.vec3, layout: Layout) -> wp.vec3i:
    """Return the cell of a place in the endless domain."""
    return wp.vec3i(cell_along(x[0], layout.edges * ALONG), cell_along(x[1], layout.edges), cell_along(x[2], layout.edges))


@wp.func
def cell_in(x: wp.vec3, domain: Domain, layout: Layout) -> wp.vec3i:
    """Return the cell of a place; x in fine cells."""
    if domain.boundary == PERIODIC:
        return cell_around(x, domain)
    if domain.cells[0] > 0:
        return cell_within(x, domain, layout)
    return cell_at(x, layout)


@wp.func
def layout_in(grid: Grid, count: int, domain: Domain) -> Layout:
    """Return the layout of a domain's cells: hashed, or row by row."""
    layout = layout_for(grid, count)
    if domain.cells[0] > 0:
        layout.up = wp.uint32(domain.cells[0])
        layout.over = wp.uint32(domain.cells[0] * domain.cells[1])
    return layout


@wp.func
def bucket_in(x: wp.vec3, domain: Domain, layout: Layout) -> int:
    """Return the bucket of the cell at x."""
    cell = cell_in(x, domain, layout)
    return bucket_of(cell[0], cell[1], cell[2], layout)


@wp.func
def run_in(grid: Grid, cell: wp.vec3i, row: int, length: int, part: int, domain: Domain, layout: Layout) -> wp.vec2i:
    """Return the places [begin, end) of one of the two parts of a run of cells, which begins FINE before `cell`, in one of nine rows."""
    cells = domain.cells
    if cells[0] == 0:
        bucket = bucket_of(cell[0] - FINE, cell[1] + row % 3 - 1, cell[2] + row // 3 - 1, layout)
        return run_ends(grid, bucket, length, layout, 1 - part)
    if domain.boundary != PERIODIC:
        y = cell[1] + row % 3 - 1
        z = cell[2] + row // 3 - 1
        if part == 0 or y < 0 or y >= cells[1] or z < 0 or z >= cells[2]:
            return wp.vec2i(0, 0)
        base = int(bucket_of(0, y, z, layout))
        return wp.vec2i(grid.begin[base + wp.max(cell[0] - FINE, 0)], grid.begin[base + wp.min(cell[0] - FINE + length, cells[0])])
    if row % 3 >= cells[1] or row // 3 >= cells[2]:  # so few cells that a row would come twice
        return wp.vec2i(0, 0)
    y = (cell[1] + row % 3 - 1 + cells[1]) % cells[1]
    z = (cell[2] + row // 3 - 1 + cells[2]) % cells[2]
    base = int(bucket_of(0, y, z, layout))
    begin = (cell[0] - FINE + FINE * cells[0]) % cells[0]
    end = begin + wp.min(length, cells[0])
    if part == 0:  # what lies beyond the end comes first: cells are met in the order of their numbers
        return wp.vec2i(grid.begin[base], grid.begin[base + wp.max(end - cells[0], 0)])
    return wp.vec2i(grid.begin[base + begin], grid.begin[base + wp.min(end, cells[0])])


@wp.func(inline=True)
def within_axis(first: int, last: int, cells: int, rate: float) -> int:
    """Return 1 if from a cell on to another the way across the borders of a periodic axis is no shorter, nor on one that does not exist."""
    inside = wp.where(first >= 0, 1, 0) * wp.where(last < cells, 1, 0) * wp.where(2 * (last - first + 2) <= cells, 1, 0)
    return wp.max(inside, wp.where(rate == 0.0, 1, 0))


@wp.func
def closes_upon(cell: wp.vec3i, row: int, length: int, domain: Domain) -> int:
    """Return 1 if from a cell, or later ones of its run, a way into one of nine rows may be shorter across the domain's borders."""
    if domain.boundary != PERIODIC:
        return 0
    y = cell[1] + row % 3 - 1
    z = cell[2] + row // 3 - 1
    inside = within_axis(cell[0] - FINE, cell[0] - FINE + length - 1, domain.cells[0], domain.rate[0])
    inside = inside * within_axis(wp.min(y, cell[1]), wp.max(y, cell[1]), domain.cells[1], domain.rate[1])
    inside = inside * within_axis(wp.min(z, cell[2]), wp.max(z, cell[2]), domain.cells[2], domain.rate[2])
    return 1 - inside
