"""Facets: what a fluid does to the surface of a body of springs. It resists what moves into it, and does not pull at what moves away.

Symbols: a facet is a triangle or a quadrangle; S its area vector, ½ (x_c − x_a) × (x_d − x_b), of a triangle x_d = x_c [m²], A = |S|,
n = S/A outward; v̄ the mean velocity of its N corners, u the flow at their middle, w = n·(v̄ − u) how fast it moves into the fluid [m/s];
c the fluid's resistance [kg/(m²·s)]. The force is −c A max(0, w) n, an N-th of it on each corner.  Source: Tu & Terzopoulos 1994, §3.3.

Within a substep h the force is scaled by (1 − e^(−κh))/(κh), κ = c A/N² Σ d/m over the corners, each with its mass m shared among its d
facets. A facet alone, with its share of the masses, would come to rest exactly like this; as the shares add up to the masses, all
facets together take from the motion against the fluid at most all of it: no h is too long.
"""

import warp as wp

from warpsim.kernels.elementary import mean_decay
from warpsim.kernels.emission import Particles
from warpsim.kernels.flow import sample_flow
from warpsim.kernels.planar import read3, write3
from warpsim.kernels.primitive import FlowPrimitive
from warpsim.kernels.springs import SLICE

FLATTEST = wp.constant(1.0e-30)  # [m⁴]: a facet without area has no normal, and feels nothing


@wp.struct
class Surface:
    corner: wp.array[wp.vec4i]  # (facets): the points of each, counterclockwise from outside; the last of a triangle: −1
    looseness: wp.array[float]  # (facets): Σ d/(m N²) over the corners [1/kg], 0 of a pinned one
    begin: wp.array[int]  # (slices + 1): first row of each slice of 64 points
    facet: wp.array[int]  # (rows · 64): a facet of the point; −1: none
    resistance: wp.array[float]  # (1): c [kg/(m²·s)]
    flow: wp.array2d[FlowPrimitive]  # (moments, primitives): the fluid's motion


@wp.func(inline=True)
def facet_force(s: wp.vec3, w: wp.vec3, c: float, looseness: float, h: float) -> wp.vec3:
    """Return −c A max(0, n·w) n φ(κh) [N], κ = c A Σ d/(m N²), from the area vector S and the velocity w in the fluid.  Source: above."""
    square = wp.dot(s, s)
    into = wp.max(wp.dot(s, w), 0.0)
    kappa = c * wp.sqrt(square) * looseness
    return s * (-c * into * mean_decay(kappa * h) / wp.sqrt(wp.max(square, FLATTEST)))


@wp.kernel(enable_backward=False)
def sample_facets(first: int, moment: int, h: float, surface: Surface, particles: Particles, share_out: wp.array2d[float]):
    """Store the share of each corner in what the fluid does to every facet within a substep h [N]."""
    k = first + wp.tid()
    t = surface.corner[k]
    share = wp.where(t[3] < 0, 0.33333333, 0.25)
    a = read3(particles.position, t[0])
    b = read3(particles.position, t[1])
    c = read3(particles.position, t[2])
    sum = a + b + c
    v = read3(particles.velocity, t[0]) + read3(particles.velocity, t[1]) + read3(particles.velocity, t[2])
    d = c
    if t[3] >= 0:
        d = read3(particles.position, t[3])
        sum = sum + d
        v = v + read3(particles.velocity, t[3])
    u = sample_flow(surface.flow, moment, sum * share)
    area = wp.cross(c - a, d - b) * 0.5
    write3(share_out, k, facet_force(area, v * share - u, surface.resistance[0], surface.looseness[k], h) * share)


@wp.kernel(enable_backward=False)
def accumulate_facets(
    first: int,
    point_count: int,
    surface: Surface,
    share: wp.array2d[float],
    inverse_mass: wp.array[float],
    internal_inout: wp.array2d[float],
):
    """Add to every point its share of the force on each of its facets, over its mass [m/s²], in their order."""
    i = first + wp.tid()
    if i < point_count:
        sum = wp.vec3()
        for row in range(surface.begin[i // SLICE], surface.begin[i // SLICE + 1]):
            k = surface.facet[row * SLICE + i % SLICE]
            if k >= 0:
                sum = sum + read3(share, k)
        write3(internal_inout, i, read3(internal_inout, i) + sum * inverse_mass[i])
