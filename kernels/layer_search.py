"""Layer search: who of a sheet may touch whom, as lists that serve for many substeps.

Symbols: x0 a place at a substep's beginning, x one later in it, x* the one when the lists were made [m]. A list holds everybody within the
reach d + 2 (drift + stride + push) of x*. As long as all x0 − x* are in a box whose half diagonal is less
than the drift, nobody who can touch within the substep is missing; and whoever does not touch changes nothing, so that no bit
depends on when the lists were made. Points that are neighbors at rest, and pairs of pins, are in no list.
"""

import warp as wp

from warpsim.kernels.emission import ACTIVE, Particles
from warpsim.kernels.grid import ALONG, FINE, Grid, Layout, bucket_at, bucket_of, cell_along, finite, layout_for, run_ends
from warpsim.kernels.layers import (
    ALARM,
    BRAKES,
    BRISK,
    CROWDED,
    DISTANCE,
    DRIFT,
    FOLLOWS,
    LANES,
    REACH,
    SEARCH,
    SEARCHES,
    STRIDE,
    Layers,
    entry_of,
    start_at,
)
from warpsim.kernels.planar import read3

NEIGHBORLY = wp.constant(1.5625)  # 1.25²: pairs whose distance at rest is less than 1.25 d are neighbors


@wp.func
def read_box(layers: Layers, row: int, b: int) -> wp.vec3:
    """Return three rows of the boxes."""
    return wp.vec3(layers.boxes[row, b], layers.boxes[row + 1, b], layers.boxes[row + 2, b])


@wp.kernel(enable_backward=False)
def measure_motion(first: int, layers_inout: Layers, particles: Particles):
    """Store the boxes of one slice's x0 − x* and x − x0 [m], and the largest |x − x0|² [m²]."""
    b = first + wp.tid()
    farthest = float(0.0)
    for i in range(b * LANES, wp.min((b + 1) * LANES, layers_inout.point_count)):
        farthest = wp.max(farthest, wp.length_sq(read3(particles.position, i) - start_at(layers_inout, i)))
    layers_inout.boxes[12, b] = farthest
    for axis in range(3):
        drift = wp.vec2(1.0e30, -1.0e30)
        step = wp.vec2(1.0e30, -1.0e30)
        for i in range(b * LANES, wp.min((b + 1) * LANES, layers_inout.point_count)):
            x0 = layers_inout.start[axis, i]
            away = x0 - layers_inout.reference[axis, i]
            moved = particles.position[axis, i] - x0
            drift = wp.vec2(wp.min(drift[0], away), wp.max(drift[1], away))
            step = wp.vec2(wp.min(step[0], moved), wp.max(step[1], moved))
        layers_inout.boxes[axis, b] = drift[0]
        layers_inout.boxes[3 + axis, b] = drift[1]
        layers_inout.boxes[6 + axis, b] = step[0]
        layers_inout.boxes[9 + axis, b] = step[1]


@wp.kernel(enable_backward=False)
def decide_search(first: int, s: int, layers_inout: Layers, counters_out: wp.array[wp.int64]):
    """Decide whether substep s makes the lists anew; store the common motion, and whether anybody goes farther than a stride beside it."""
    low = read_box(layers_inout, 0, 0)
    high = read_box(layers_inout, 3, 0)
    least = read_box(layers_inout, 6, 0)
    most = read_box(layers_inout, 9, 0)
    farthest = layers_inout.boxes[12, 0]
    for b in range(1, layers_inout.boxes.shape[1]):
        low = wp.min(low, read_box(layers_inout, 0, b))
        high = wp.max(high, read_box(layers_inout, 3, b))
        least = wp.min(least, read_box(layers_inout, 6, b))
        most = wp.max(most, read_box(layers_inout, 9, b))
        farthest = wp.max(farthest, layers_inout.boxes[12, b])
    drift = (high - low) * 0.5
    brisk = wp.where(farthest <= layers_inout.numbers[STRIDE] * layers_inout.numbers[STRIDE], 0, 1)  # not a number: 1
    middle = (most + least) * (0.5 * layers_inout.numbers[FOLLOWS] * float(brisk))
    middle = wp.where(2.0 * wp.length(middle) > layers_inout.numbers[STRIDE], middle, wp.vec3())
    search = wp.where(wp.length(drift) <= layers_inout.numbers[DRIFT] and layers_inout.flags[CROWDED] == 0, 0, 1)  # not a number: 1
    brakes = layers_inout.flags[BRAKES] + layers_inout.flags[ALARM]
    layers_inout.flags[BRAKES] = wp.where(s == 0, 0, brakes)
    layers_inout.flags[SEARCHES] = wp.where(s == 0, 0, layers_inout.flags[SEARCHES]) + search
    layers_inout.flags[SEARCH] = search
    layers_inout.flags[BRISK] = brisk
    layers_inout.flags[ALARM] = 0
    layers_inout.flags[CROWDED] = 0
    for axis in range(3):
        layers_inout.middle[axis] = middle[axis] + 0.0  # never −0, which would depend on an order
    counters_out[ACTIVE] = wp.int64(wp.where(search == 1, layers_inout.point_count, 0))


@wp.kernel(enable_backward=False)
def mark_points(first: int, counters: wp.array[wp.int64], layers: Layers, grid_out: Grid):
    """Note every point's bucket at the substep's beginning, if there is a search."""
    i = first + wp.tid()
    active = int(counters[ACTIVE])
    if i < active:
        layout = layout_for(grid_out, active)
        x = start_at(layers, i)
        grid_out.bucket[i] = int(layout.mask) + 1
        if finite(x) == 1:
            grid_out.bucket[i] = bucket_at(x, layout)


@wp.func
def meets(i: int, j: int, layers: Layers) -> int:
    """Return 1 for two points that must not touch: not the same, no neighbors at rest, not both pinned."""
    across = layers.place[j][0] - layers.place[i][0]
    down = layers.place[j][1] - layers.place[i][1]
    edges = layers.rest[0]
    rest = edges[0] * float(across * across) + edges[1] * (2.0 * float(across * down)) + edges[2] * float(down * down)
    apart = rest > NEIGHBORLY * layers.numbers[DISTANCE] * layers.numbers[DISTANCE] and wp.max(wp.abs(across), wp.abs(down)) > 1
    return wp.where(apart and layers.inverse_mass[i] + layers.inverse_mass[j] > 0.0, 1, 0)


@wp.func
def insert_near(i: int, j: int, count: int, layers_inout: Layers) -> int:
    """Put j into the list of i in the order of numbers; return how many it holds now."""
    row = int(count)
    while row > 0 and layers_inout.near[entry_of(i, wp.max(row - 1, 0), layers_inout.rows)] > j:
        layers_inout.near[entry_of(i, row, layers_inout.rows)] = layers_inout.near[entry_of(i, row - 1, layers_inout.rows)]
        row = row - 1
    layers_inout.near[entry_of(i, row, layers_inout.rows)] = j
    return count + 1


@wp.func
def replace_farthest(i: int, j: int, layers_inout: Layers):
    """Put j into the full list of i instead of the farthest in it, unless j is farther still."""
    x = start_at(layers_inout, i)
    worst = int(-1)
    far = wp.length_sq(start_at(layers_inout, j) - x)
    for row in range(layers_inout.rows):
        square = wp.length_sq(start_at(layers_inout, layers_inout.near[entry_of(i, row, layers_inout.rows)]) - x)
        if square > far:
            far = square
            worst = row
    if worst >= 0:
        for row in range(worst, layers_inout.rows - 1):
            layers_inout.near[entry_of(i, row, layers_inout.rows)] = layers_inout.near[entry_of(i, row + 1, layers_inout.rows)]
        insert_near(i, j, layers_inout.rows - 1, layers_inout)


@wp.func
def fill_list(k: int, grid: Grid, sorted: wp.array2d[float], layout: Layout, layers_inout: Layers) -> int:
    """List everybody within the reach of the point at place k of the grid's order; return how many they are."""
    i = grid.order[k]
    x = read3(sorted, k)
    cx = cell_along(x[0], layout.edges * ALONG)
    cy = cell_along(x[1], layout.edges)
    cz = cell_along(x[2], layout.edges)
    square = layers_inout.numbers[REACH] * layers_inout.numbers[REACH]
    count = int(0)
    for part in range(18):  # nine rows, each in two parts where it passes the last bucket
        row = part // 2
        bucket = bucket_of(cx - FINE, cy + row % 3 - 1, cz + row // 3 - 1, layout)
        ends = run_ends(grid, bucket, 2 * FINE + 1, layout, 1 - part % 2)
        for place in range(ends[0], ends[1]):
            r = read3(sorted, place) - x
            j = grid.order[place]
            if wp.dot(r, r) < square and meets(i, j, layers_inout) == 1:
                if count < layers_inout.rows:
                    count = insert_near(i, j, count, layers_inout)
                else:
                    layers_inout.flags[CROWDED] = 1
                    replace_farthest(i, j, layers_inout)
    return count


@wp.kernel(enable_backward=False)
def list_near(first: int, counters: wp.array[wp.int64], grid: Grid, sorted: wp.array2d[float], layers_inout: Layers):
    """Make every point's list, if there is a search."""
    k = first + wp.tid()
    active = int(counters[ACTIVE])
    if k < active:
        i = grid.order[k]
        layout = layout_for(grid, active)
        count = int(0)
        if k < grid.begin[int(layout.mask) + 1]:
            count = fill_list(k, grid, sorted, layout, layers_inout)
        layers_inout.count[i] = count
        for axis in range(3):
            layers_inout.reference[axis, i] = layers_inout.start[axis, i]
