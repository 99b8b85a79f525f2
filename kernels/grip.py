"""Headings: where the head of a body lies for each of its points, along a chain of points from head to tail."""

import warp as wp

from warpsim.kernels.planar import read3, write3

SHORTEST = wp.constant(1.0e-30)  # [m²]: neighbors as near as this lie nowhere from each other, and the heading is none


@wp.kernel(enable_backward=False)
def sample_headings(first: int, links: wp.array[wp.vec3i], position: wp.array2d[float], heading_out: wp.array2d[float]):
    """Store the unit vector from behind a point to ahead of it [1]; a link is a point, the one ahead and the one behind on its chain."""
    k = first + wp.tid()
    d = read3(position, links[k][1]) - read3(position, links[k][2])
    square = wp.dot(d, d)
    write3(heading_out, links[k][0], wp.where(square > SHORTEST, d / wp.sqrt(wp.max(square, SHORTEST)), wp.vec3()))
