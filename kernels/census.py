"""Census of a flock: how far each boid's nearest is, and in how many clusters they fly; asked for now and then, outside of the frame.

Two boids belong to one cluster where a chain of others leads from one to the other with links no longer than the reach.
"""

import warp as wp

from warpsim.kernels.domain import Domain, cell_in, closes_upon, fold_if, layout_in, run_in
from warpsim.kernels.flock import Crowd
from warpsim.kernels.grid import FINE, Layout
from warpsim.kernels.planar import read3

ALONE = wp.constant(1.0e30)  # [m]: the distance of who has nobody within reach


@wp.func
def nearest_to(k: int, crowd: Crowd, domain: Domain, layout: Layout, reach2: float) -> float:
    """Return the distance from the boid at place k to the nearest other within reach [m]."""
    x = read3(crowd.sorted, k)
    cell = cell_in(x, domain, layout)
    best = float(reach2)
    found = int(0)
    for part in range(18):
        ends = run_in(crowd.grid, cell, part // 2, 2 * FINE + 1, part % 2, domain, layout)
        crosses = closes_upon(cell, part // 2, 2 * FINE + 1, domain)
        for j in range(ends[0], ends[1]):
            d = fold_if(crosses, read3(crowd.sorted, j) - x, domain)
            d2 = wp.dot(d, d)
            if j != k and d2 < best:
                best = d2
                found = 1
    return wp.where(found == 1, wp.sqrt(best), ALONE)


@wp.kernel(enable_backward=False)
def sample_nearest(first: int, crowd: Crowd, reach2: float, nearest_out: wp.array[float]):
    """Store every boid's distance to its nearest [m], by number; ALONE where nobody is within reach."""
    k = first + wp.tid()
    if k < crowd.count:
        layout = layout_in(crowd.grid, crowd.count, crowd.domain[0])
        nearest = float(ALONE)
        if k < crowd.grid.begin[int(layout.mask) + 1]:
            nearest = nearest_to(k, crowd, crowd.domain[0], layout, reach2)
        nearest_out[crowd.grid.order[k]] = nearest


@wp.func
def root_of(parent_inout: wp.array[int], k: int) -> int:
    """Return the root of place k, halving the way to it.  Source: Tarjan & van Leeuwen 1984."""
    i = int(k)
    while parent_inout[i] != i:
        parent_inout[i] = parent_inout[parent_inout[i]]
        i = parent_inout[i]
    return i


@wp.func
def link_earlier(k: int, crowd: Crowd, domain: Domain, layout: Layout, reach2: float, parent_inout: wp.array[int]):
    """Join place k to the clusters of all earlier places within reach; the lower root wins."""
    x = read3(crowd.sorted, k)
    cell = cell_in(x, domain, layout)
    for part in range(18):
        ends = run_in(crowd.grid, cell, part // 2, 2 * FINE + 1, part % 2, domain, layout)
        crosses = closes_upon(cell, part // 2, 2 * FINE + 1, domain)
        for j in range(ends[0], wp.min(ends[1], k)):
            d = fold_if(crosses, read3(crowd.sorted, j) - x, domain)
            if wp.dot(d, d) < reach2:
                a = root_of(parent_inout, j)
                b = root_of(parent_inout, k)
                parent_inout[wp.max(a, b)] = wp.min(a, b)


@wp.kernel(enable_backward=False)
def mark_clusters(
    first: int, crowd: Crowd, reach2: float, parent_inout: wp.array[int], size_inout: wp.array[int], count_out: wp.array[int]
):
    """One thread. Count the clusters, and the boids of the largest; who is not finite belongs to none."""
    layout = layout_in(crowd.grid, crowd.count, crowd.domain[0])
    total = crowd.grid.begin[int(layout.mask) + 1]
    for k in range(total):
        parent_inout[k] = k
        size_inout[k] = 0
    for k in range(total):
        link_earlier(k, crowd, crowd.domain[0], layout, reach2, parent_inout)
    clusters = int(0)
    largest = int(0)
    for k in range(total):
        root = root_of(parent_inout, k)
        size_inout[root] = size_inout[root] + 1
        clusters = clusters + wp.where(root == k, 1, 0)
        largest = wp.max(largest, size_inout[root])
    count_out[0] = clusters
    count_out[1] = largest
