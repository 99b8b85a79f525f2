"""The domain of a flock: a box that it fills at the start, and what its borders do.

Cells of a periodic domain lie in rows that close upon themselves; those of an endless one are hashed (grid.py). In both, a bucket is
cx + a cy + b cz mod 2^n; here a and b are the true strides of the rows, so that no two cells share a bucket.
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
    cells: wp.vec3i  # of a periodic domain, along each axis; x in fine ones (grid.py)
    per_meter: wp.vec3d  # cells per meter along each axis; 0 along an axis that does not exist


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


@wp.func
def cell_in(x: wp.vec3, domain: Domain, layout: Layout) -> wp.vec3i:
    """Return the cell of a place; x in fine cells."""
    if domain.boundary == PERIODIC:
        cells = domain.cells
        scale = domain.per_meter
        low = domain.low
        return wp.vec3i(
            slot_along(x[0], low[0], scale[0], cells[0]),
            slot_along(x[1], low[1], scale[1], cells[1]),
            slot_along(x[2], low[2], scale[2], cells[2]),
        )
    return wp.vec3i(cell_along(x[0], layout.edges * ALONG), cell_along(x[1], layout.edges), cell_along(x[2], layout.edges))


@wp.func
def layout_in(grid: Grid, count: int, domain: Domain) -> Layout:
    """Return the layout of a domain's cells: hashed, or row by row."""
    layout = layout_for(grid, count)
    if domain.boundary == PERIODIC:
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
    if domain.boundary != PERIODIC:
        bucket = bucket_of(cell[0] - FINE, cell[1] + row % 3 - 1, cell[2] + row // 3 - 1, layout)
        return run_ends(grid, bucket, length, layout, 1 - part)
    cells = domain.cells
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
