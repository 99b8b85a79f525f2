"""Bending of cloth: what a sheet of points (i, j), number j·nx + i, with cells a × b does against being curved, M = B κ.

Symbols: B stiffness [N·m], C damping [N·m·s], κ curvature [1/m], m the sum of four or three places whose weights add up to nothing,
which is what a hinge sees of a curvature. Hinges lie along both edges, m = x₋ − 2x + x₊ = a² κ_aa (two neighboring cells folded by θ
have |m| = 2a sin(θ/2)), and across the diagonal of each cell, m = x₀₀ + x₁₁ − x₁₀ − x₀₁ = a b κ_ab. The energy of a flat sheet that
has been bent,
½ B ∫ (κ_aa² + κ_bb² + 2 κ_ab²) dA = Σ ½ k m², k = B b/a³, B a/b³ (half of it along a rim) and 2 B/(a b),
is the same for every direction in which it is rolled up. It is quadratic in the places, so that the force is linear: F = k m on each
point, times its weight. The weights add up to nothing and F lies along m, so that momentum and angular momentum stay; damping acts
along m as well, on the rate at which |m| grows, and takes nothing from a sheet that falls or turns.
Source: Bergou et al. 2006, A quadratic bending model for inextensible surfaces; the weights are those of a plate without Poisson's effect.
"""

import warp as wp

from warpsim.kernels.emission import Particles
from warpsim.kernels.planar import read3, write3
from warpsim.kernels.tearing import cell_intact, intact

FLATTEST = wp.constant(1.0e-30)  # [m²]: a hinge that is flat to 1e-15 m has no direction in which it could be damped
ALONG = wp.constant(0)  # places in `stiffness` and `damping`
DOWN = wp.constant(1)
ACROSS = wp.constant(2)


@wp.struct
class Bending:
    nx: int
    ny: int
    stiffness: wp.array[float]  # (3): k of a hinge along i, along j, and across a cell [N/m]
    damping: wp.array[float]  # (3): the same of C [N·s/m]
    inverse_mass: wp.array[float]  # (capacity) [1/kg]; 0 for a point that is pinned
    torn: wp.array[int]  # (springs): 1 where a spring is torn, in the order of networks.py; empty where none can be


@wp.func(inline=True)
def hinge_sum(a: wp.vec3, b: wp.vec3, c: wp.vec3, d: wp.vec3) -> wp.vec3:
    """Return m = (a − b) + (c − d), of places [m] or of velocities [m/s]; for three points b = d."""
    return (a - b) + (c - d)


@wp.func(inline=True)
def hinge_force(m: wp.vec3, rate: wp.vec3, k: float, c: float) -> wp.vec3:
    """Return F = k m + c (m̂·ṁ) m̂ [N], which acts on each point against its weight in m; a flat hinge is not damped."""
    return m * (k + c * wp.dot(m, rate) / wp.max(wp.dot(m, m), FLATTEST))


@wp.func(inline=True)
def line_share(force: wp.vec3, before: wp.vec3, middle: wp.vec3, after: wp.vec3) -> wp.vec3:
    """Return a force and what three hinges along a line add to it: those before, at and after the point, whose weights are 1, −2, 1."""
    return force + (middle + middle - before - after)


@wp.func(inline=True)
def cell_share(force: wp.vec3, nw: wp.vec3, ne: wp.vec3, sw: wp.vec3, se: wp.vec3) -> wp.vec3:
    """Return a force and what the hinges across the four cells round a point add to it; in its own cell's order its weight is 1 or −1."""
    return force + ((ne - nw) + (sw - se))


@wp.func(inline=True)
def with_force(a: wp.vec3, force: wp.vec3, inverse_mass: float) -> wp.vec3:
    """Return an acceleration and what a force adds to it, a + F/m [m/s²]."""
    return a + force * inverse_mass


@wp.func
def along_at(i: int, j: int, bending: Bending, position: wp.array2d[float], velocity: wp.array2d[float]) -> wp.vec3:
    """Return the force F of the hinge along i whose middle is point (i, j) [N]; none on the rim or beside a torn spring."""
    if i < 1 or i > bending.nx - 2:
        return wp.vec3()
    e = j * (bending.nx - 1) + i
    if not intact(bending.torn, e - 1, e):
        return wp.vec3()
    p = j * bending.nx + i
    share = wp.where(j == 0 or j == bending.ny - 1, 0.5, 1.0)
    x = read3(position, p)
    v = read3(velocity, p)
    m = hinge_sum(read3(position, p - 1), x, read3(position, p + 1), x)
    rate = hinge_sum(read3(velocity, p - 1), v, read3(velocity, p + 1), v)
    return hinge_force(m, rate, share * bending.stiffness[ALONG], share * bending.damping[ALONG])


@wp.func
def down_at(i: int, j: int, bending: Bending, position: wp.array2d[float], velocity: wp.array2d[float]) -> wp.vec3:
    """Return the force F of the hinge along j whose middle is point (i, j) [N]; none on the rim or beside a torn spring."""
    if j < 1 or j > bending.ny - 2:
        return wp.vec3()
    p = j * bending.nx + i
    e = (bending.nx - 1) * bending.ny + p
    if not intact(bending.torn, e - bending.nx, e):
        return wp.vec3()
    share = wp.where(i == 0 or i == bending.nx - 1, 0.5, 1.0)
    x = read3(position, p)
    v = read3(velocity, p)
    m = hinge_sum(read3(position, p - bending.nx), x, read3(position, p + bending.nx), x)
    rate = hinge_sum(read3(velocity, p - bending.nx), v, read3(velocity, p + bending.nx), v)
    return hinge_force(m, rate, share * bending.stiffness[DOWN], share * bending.damping[DOWN])


@wp.func
def cell_at(i: int, j: int, bending: Bending, position: wp.array2d[float], velocity: wp.array2d[float]) -> wp.vec3:
    """Return the force F of the hinge across the cell whose first point is (i, j) [N]; none beside a torn edge."""
    if i < 0 or i > bending.nx - 2 or j < 0 or j > bending.ny - 2:
        return wp.vec3()
    p = j * bending.nx + i
    q = p + bending.nx
    if not cell_intact(bending.torn, i, j, bending.nx, bending.ny):
        return wp.vec3()
    m = hinge_sum(read3(position, p), read3(position, p + 1), read3(position, q + 1), read3(position, q))
    rate = hinge_sum(read3(velocity, p), read3(velocity, p + 1), read3(velocity, q + 1), read3(velocity, q))
    return hinge_force(m, rate, bending.stiffness[ACROSS], bending.damping[ACROSS])


@wp.func
def sum_hinges(i: int, j: int, bending: Bending, x: wp.array2d[float], v: wp.array2d[float]) -> wp.vec3:
    """Return the sum of the forces of all hinges of point (i, j) [N], in a fixed order."""
    along = line_share(wp.vec3(), along_at(i - 1, j, bending, x, v), along_at(i, j, bending, x, v), along_at(i + 1, j, bending, x, v))
    both = line_share(along, down_at(i, j - 1, bending, x, v), down_at(i, j, bending, x, v), down_at(i, j + 1, bending, x, v))
    nw = cell_at(i - 1, j - 1, bending, x, v)
    ne = cell_at(i, j - 1, bending, x, v)
    return cell_share(both, nw, ne, cell_at(i - 1, j, bending, x, v), cell_at(i, j, bending, x, v))


@wp.kernel(enable_backward=False)
def accumulate_bending(first: int, bending: Bending, particles: Particles, internal_inout: wp.array2d[float]):
    """Add what the hinges do to every point, a = F/m [m/s²]."""
    p = first + wp.tid()
    if p < bending.nx * bending.ny:
        force = sum_hinges(p % bending.nx, p // bending.nx, bending, particles.position, particles.velocity)
        write3(internal_inout, p, with_force(read3(internal_inout, p), force, bending.inverse_mass[p]))
