"""Forces between the particles of one system, over the grid's neighbors: gathered by each, added in the grid's order.

Symbols: d = x_j − x_i [m], s = √(d² + ε²) with the softening ε [m], R radius [m], k strength; the force on i is
F = f(s) d/s where s < R, toward j for k > 0, the derivative of a potential U(s) with U' = f. d changes its sign with i and j
and nothing else does, so action is reaction to the last bit. Each formula takes (law, s²) and returns f(s)/s [N/m].
"""

import warp as wp

from warpsim.kernels.advance import living_step
from warpsim.kernels.elementary import cos_turns
from warpsim.kernels.emission import ACTIVE, Particles
from warpsim.kernels.environment import sample_strength
from warpsim.kernels.grid import ALONG, FINE, Grid, Layout, bucket_at, bucket_of, cell_along, finite, layout_for, run_ends
from warpsim.kernels.integration import Pace
from warpsim.kernels.lifetime import age_at
from warpsim.kernels.planar import read3, write3
from warpsim.kernels.signals import Signals

COINCIDENT = wp.constant(1.0e-17)  # [m²]: closer than 3e-9 m the force falls to zero like d; so 1e12 N m² stay finite without softening
WHOLE = wp.constant(0.999)  # share of a substep that counts as all of it


@wp.struct
class PairLaw:
    kind: int  # place in PAIR_LAWS
    radius: float  # R [m]
    inverse_radius: float  # 1/R [1/m]
    softening: float  # ε [m]
    signal: wp.vec3i  # row of the signals that gives the strength
    strength: wp.vec3  # (k [N | N·m² | N/m] by law, …) at the time of the table


@wp.func(inline=True)
def pair_constant(law: PairLaw, s2: float) -> float:
    """Return f/s for f = k.  Source: the lecture's attractor."""
    return law.strength[0] / wp.sqrt(s2)


@wp.func(inline=True)
def pair_inverse_square(law: PairLaw, s2: float) -> float:
    """Return f/s for f = k/s².  Source: Newton 1687; softening after Plummer 1911."""
    return law.strength[0] / (s2 * wp.sqrt(s2))


@wp.func(inline=True)
def pair_spring(law: PairLaw, s2: float) -> float:
    """Return f/s for f = k s.  Source: Hooke 1678, of no rest length."""
    return law.strength[0]


@wp.func(inline=True)
def pair_linear(law: PairLaw, s2: float) -> float:
    """Return f/s for f = k (1 − s/R), zero at the radius.  Source: Groot & Warren 1997, eq. 4 (there with −k)."""
    return law.strength[0] / wp.sqrt(s2) - law.strength[0] * law.inverse_radius


@wp.func(inline=True)
def pair_cosine(law: PairLaw, s2: float) -> float:
    """Return f/s for f = ½ k (1 + cos(π s/R)), at the radius zero with zero slope.  Source: Hann's window."""
    s = wp.sqrt(s2)
    return law.strength[0] * (0.5 + 0.5 * cos_turns(0.5 * s * law.inverse_radius)) / s


PAIR_LAWS = {
    "constant": pair_constant,
    "inverse_square": pair_inverse_square,
    "spring": pair_spring,
    "linear": pair_linear,
    "cosine": pair_cosine,
}


@wp.func(inline=True)
def softened(law: PairLaw, d2: float) -> float:
    """Return s² = d² + ε², never so small that its powers overflow."""
    return wp.max(d2 + law.softening * law.softening, COINCIDENT)


@wp.func(inline=True)
def within(law: PairLaw, s2: float, g: float) -> float:
    """Return g where s < R, else 0."""
    return wp.where(s2 < law.radius * law.radius, g, 0.0)


@wp.func
def sample_pair(law: PairLaw, s2: float) -> float:
    """Return zero: there is no such law."""
    return 0.0


def with_case(kind, formula, otherwise):
    """Chain one more law, as in flow.py."""

    @wp.func(name="sample_pair")
    def sample_pair(law: PairLaw, s2: float) -> float:
        """Return f/s of one law."""
        if law.kind == kind:
            return formula(law, s2)
        return otherwise(law, s2)

    return sample_pair


for _kind, _formula in enumerate(PAIR_LAWS.values()):
    sample_pair = with_case(_kind, _formula, sample_pair)


@wp.kernel(enable_backward=False)
def sample_pair_laws(
    first: int,
    start_time: wp.array[wp.float64],
    spacing: wp.float64,
    signals: Signals,
    laws: wp.array[PairLaw],
    laws_out: wp.array2d[PairLaw],
):
    """Fill the table's row of one substep, beginning at t = start + s·spacing [s]: each law with its strength at t."""
    s = first + wp.tid()
    for k in range(laws.shape[0]):
        law = laws[k]
        law.strength = sample_strength(signals, law.signal, start_time[0] + wp.float64(s) * spacing)
        laws_out[s, k] = law


@wp.func
def pair_bucket(i: int, frame: int, pace: Pace, moved: int, particles: Particles, layout: Layout) -> int:
    """Return the bucket of the particle in slot i; one that does not live through the whole of substep pace.first takes no part."""
    x = read3(particles.position, i)
    age = age_at(frame, particles.birth_frame[i], particles.birth_age[i], pace.fps)
    dead = int(0)
    if moved == 1:
        dead = 1 - particles.alive[i]
    h = living_step(age, particles.lifetime[i], dead, pace.first, pace)
    if h >= WHOLE * pace.dt and finite(x) == 1:
        return bucket_at(x, layout)
    return int(layout.mask) + 1


@wp.kernel(enable_backward=False)
def mark_buckets(
    first: int, pace: Pace, moved: int, clock: wp.array[wp.int64], particles: Particles, counters: wp.array[wp.int64], grid_out: Grid
):
    """Note every active particle's bucket; moved = 1: the frame has begun, and `alive` says who was killed in it."""
    i = first + wp.tid()
    active = int(counters[ACTIVE])
    if i < active:
        grid_out.bucket[i] = pair_bucket(i, int(clock[0]), pace, moved, particles, layout_for(grid_out, active))


@wp.func
def sum_pairs(k: int, s: int, laws: wp.array2d[PairLaw], grid: Grid, sorted: wp.array2d[float], layout: Layout) -> wp.vec3:
    """Return the force on the particle at place k, F = Σ_j Σ_law f(s)/s d [N], j in the grid's order, row by row."""
    x = read3(sorted, k)
    cx = cell_along(x[0], layout.edges * ALONG)
    cy = cell_along(x[1], layout.edges)
    cz = cell_along(x[2], layout.edges)
    force = wp.vec3()
    for part in range(18):  # nine rows, each in two parts where it passes the last bucket
        row = part // 2
        bucket = bucket_of(cx - FINE, cy + row % 3 - 1, cz + row // 3 - 1, layout)
        ends = run_ends(grid, bucket, 2 * FINE + 1, layout, 1 - part % 2)
        for j in range(ends[0], ends[1]):
            d = read3(sorted, j) - x
            d2 = wp.dot(d, d)
            g = float(0.0)
            for n in range(laws.shape[1]):
                s2 = softened(laws[s, n], d2)
                g = g + within(laws[s, n], s2, sample_pair(laws[s, n], s2))
            force = force + d * g
    return force


@wp.kernel(enable_backward=False)
def accumulate_pairs(
    first: int,
    s: int,
    counters: wp.array[wp.int64],
    laws: wp.array2d[PairLaw],
    grid: Grid,
    sorted: wp.array2d[float],
    mass: wp.array[float],
    internal_out: wp.array2d[float],
):
    """Store what its neighbors do to every active particle, a = F/m [m/s²]; zero for one that takes no part."""
    k = first + wp.tid()
    active = int(counters[ACTIVE])
    if k < active:
        layout = layout_for(grid, active)
        a = wp.vec3()
        if k < grid.begin[int(layout.mask) + 1]:
            a = sum_pairs(k, s, laws, grid, sorted, layout) * (1.0 / mass[grid.order[k]])
        write3(internal_out, grid.order[k], a)


@wp.kernel(enable_backward=False)
def kick_pairs(first: int, h: float, counters: wp.array[wp.int64], internal: wp.array2d[float], velocity_inout: wp.array2d[float]):
    """Let the neighbors act for a time h [s], v ← v + h a: half a kick of Verlet's, or the two halves that meet between substeps."""
    i = first + wp.tid()
    if wp.int64(i) < counters[ACTIVE]:
        write3(velocity_inout, i, read3(velocity_inout, i) + read3(internal, i) * h)
