"""Flocks: what the neighbors of a boid make it do, gathered by each over the cells round it in a fixed order.

Symbols: d = P_j − P_i [m], v velocity [m/s], over the neighbors j that are within reach and in view:
F = w_s Σ (P_i − P_j)/|d|² + w_c (centroid − P_i) + w_a (mean v − v_i).  Source: Reynolds 1987; the lecture's formulas and weights.

A neighbor is in view where the angle between v_i and d is at most half the field of view, d·v_i ≥ cos(½ view) |d| |v_i|: compared by
squares that keep their sign, for roots cost as much as all the rest. Who stands still sees all round. Of those within reach and in view
all count, or the nearest k (Ballerini et al. 2008): a first pass finds the last of them, a second adds up who is no farther.
"""

import warp as wp

from warpsim.kernels.domain import Domain, bucket_in, cell_in, closes_upon, fold_if, layout_in, run_in
from warpsim.kernels.grid import FINE, Grid, Layout, finite
from warpsim.kernels.planar import read3, write3
from warpsim.kernels.random import random_words, uniform_signed

EVERYTHING = -2.0  # cosine below any: a field of view of 360 degrees
MOST_NEAREST = 64  # that a boid may keep count of
Distances = wp.types.vector(length=MOST_NEAREST, dtype=float)
Numbers = wp.types.vector(length=MOST_NEAREST, dtype=int)
LAST_NUMBER = 2**31 - 1
BEYOND = 3.0e38  # [m²]: farther than anybody
PUSH = 9  # channel of the random direction in which two boids at one place part (random.py has the others)


@wp.struct
class Crowd:
    count: int
    grid: Grid
    sorted: wp.array2d[float]  # (6, capacity) in the grid's order: x [m], v [m/s]
    domain: wp.array[Domain]  # (1)


@wp.struct
class Rules:
    reach2: float  # the farthest neighbor's distance, squared [m²]
    cosine: float  # of half the field of view; EVERYTHING
    separation: float  # weights
    cohesion: float
    alignment: float
    separation_reach2: float  # within which each counts [m²]
    cohesion_reach2: float
    alignment_reach2: float
    closest: float  # [m]: nearer ones count as so near
    nearest: int  # how many of those within reach and in view count, the nearest; 0: all
    key: wp.vec2ui  # of the random numbers


@wp.struct
class Horizon:
    d2: float  # the farthest neighbor that counts is so far away, squared [m²]
    number: int  # of it: among those at the same distance the lower numbers come first


@wp.struct
class Company:
    apart: wp.vec3  # Σ (P_i − P_j)/|d|² [1/m]
    way: wp.vec3  # Σ (P_j − P_i) over those that count for cohesion [m]
    course: wp.vec3  # Σ v_j over those that count for alignment [m/s]
    coherent: float  # how many count for cohesion
    aligned: float
    count: float  # neighbors in all
    coincident: float  # of them at the boid's very place


@wp.func(inline=True)
def view_limit(cosine: float, v2: float) -> float:
    """Return cos|cos| v², with which the squares d·v |d·v| are compared; below everything without a limit."""
    return wp.where(cosine < -1.0, -1.0e37, cosine * wp.abs(cosine) * v2)


@wp.func(inline=True)
def attends(d2: float, q: float, limit: float, reach2: float) -> float:
    """Return 1 for a neighbor within reach and in view, q = d·v, else 0."""
    return wp.where(d2 < reach2, 1.0, 0.0) * wp.where(q * wp.abs(q) >= limit * d2, 1.0, 0.0)


@wp.func(inline=True)
def within_reach(d2: float, reach2: float) -> float:
    """Return 1 within a rule's reach, else 0."""
    return wp.where(d2 < reach2, 1.0, 0.0)


@wp.func(inline=True)
def counts(d2: float, number: int, d2_last: float, number_last: int) -> float:
    """Return 1 for who is no farther than the last that counts; at the same distance, whose number is no higher; else 0."""
    return wp.where(d2 < d2_last, 1.0, 0.0) + wp.where(d2 == d2_last, 1.0, 0.0) * wp.where(number <= number_last, 1.0, 0.0)


@wp.func(inline=True)
def crowding(d2: float, closest: float) -> float:
    """Return 1/|d|², no more than that of the closest that counts [1/m²]."""
    return 1.0 / wp.max(d2, closest * closest)


@wp.func(inline=True)
def flock_force(v: wp.vec3, company: Company, rules: Rules) -> wp.vec3:
    """Return F = w_s Σ (P_i − P_j)/|d|² + w_c (centroid − P_i) + w_a (mean v − v_i) [N].  Source: Reynolds 1987."""
    coherent = wp.max(company.coherent, 1.0)
    aligned = wp.max(company.aligned, 1.0)
    turn = company.course / aligned - v * wp.where(company.aligned > 0.0, 1.0, 0.0)
    return company.apart * rules.separation + company.way / coherent * rules.cohesion + turn * rules.alignment


@wp.func
def push_apart(i: int, j: int, domain: Domain, rules: Rules) -> wp.vec3:
    """Return (P_i − P_j)/|d|² of two boids at one place [1/m]: as if they were the closest that counts, i and j in opposite directions."""
    words = random_words(rules.key, wp.int64(wp.min(i, j)) << wp.int64(32) | wp.int64(wp.max(i, j)), PUSH)
    rate = domain.rate
    n = wp.vec3(uniform_signed(words[0]), uniform_signed(words[1]), uniform_signed(words[2]))
    if domain.boundary > 0:
        for axis in range(3):
            n[axis] = n[axis] * wp.where(rate[axis] > 0.0, 1.0, 0.0)
    length = wp.sqrt(wp.dot(n, n))
    if length < 1.0e-3:
        return wp.vec3()
    return n * (wp.where(i < j, 1.0, -1.0) / (length * rules.closest))


@wp.kernel(enable_backward=False)
def mark_flock(first: int, crowd: Crowd, position: wp.array2d[float], grid_out: Grid):
    """Note every boid's bucket."""
    i = first + wp.tid()
    if i < crowd.count:
        x = read3(position, i)
        layout = layout_in(grid_out, crowd.count, crowd.domain[0])
        bucket = int(layout.mask) + 1
        if finite(x) == 1:
            bucket = bucket_in(x, crowd.domain[0], layout)
        grid_out.bucket[i] = bucket


@wp.func
def no_company() -> Company:
    """Return the company of who is alone."""
    return Company()


@wp.func
def meet(company: Company, d: wp.vec3, vj: wp.vec3, m: float, rules: Rules) -> Company:
    """Return the company with one more neighbor, m = 1, or none, m = 0."""
    d2 = wp.dot(d, d)
    company.apart = company.apart - d * (m * within_reach(d2, rules.separation_reach2) * crowding(d2, rules.closest))
    coherent = m * within_reach(d2, rules.cohesion_reach2)
    aligned = m * within_reach(d2, rules.alignment_reach2)
    company.way = company.way + d * coherent
    company.course = company.course + vj * aligned
    company.coherent = company.coherent + coherent
    company.aligned = company.aligned + aligned
    company.count = company.count + m
    company.coincident = company.coincident + m * wp.where(d2 == 0.0, 1.0, 0.0)
    return company


@wp.func
def part_coincident(
    x: wp.vec3, k: int, own: int, slot: int, last: Horizon, cell: wp.vec3i, theirs: Crowd, domain: Domain, layout: Layout, rules: Rules
) -> wp.vec3:
    """Return what drives a boid at place k from those at its very place that count [1/m]; it is number `slot` of its flock."""
    apart = wp.vec3()
    for part in range(18):
        ends = run_in(theirs.grid, cell, part // 2, 2 * FINE + 1, part % 2, domain, layout)
        crosses = closes_upon(cell, part // 2, 2 * FINE + 1, domain)
        for j in range(ends[0], ends[1]):
            d = fold_if(crosses, read3(theirs.sorted, j) - x, domain)
            d2 = wp.dot(d, d)
            if d2 == 0.0 and (own == 0 or j != k) and counts(d2, theirs.grid.order[j], last.d2, last.number) > 0.0:
                apart = apart + push_apart(slot, theirs.grid.order[j], domain, rules)
    return apart


@wp.func
def everybody() -> Horizon:
    """Return the horizon within which all count."""
    last = Horizon()
    last.d2 = BEYOND
    last.number = LAST_NUMBER
    return last


@wp.func
def find_horizon(k: int, own: int, rules: Rules, mine: Crowd, theirs: Crowd, cell: wp.vec3i, layout: Layout) -> Horizon:
    """Return the last of the nearest neighbors that count of the boid at place k of its crowd; everybody while they are fewer."""
    domain = theirs.domain[0]
    x = read3(mine.sorted, k)
    v = wp.vec3(mine.sorted[3, k], mine.sorted[4, k], mine.sorted[5, k])
    limit = view_limit(rules.cosine, wp.dot(v, v))
    last = everybody()
    distances = Distances(last.d2)
    numbers = Numbers(last.number)
    for part in range(18):
        ends = run_in(theirs.grid, cell, part // 2, 2 * FINE + 1, part % 2, domain, layout)
        crosses = closes_upon(cell, part // 2, 2 * FINE + 1, domain)
        for j in range(ends[0], ends[1]):
            d = fold_if(crosses, read3(theirs.sorted, j) - x, domain)
            d2 = wp.dot(d, d)
            number = theirs.grid.order[j]
            m = attends(d2, wp.dot(d, v), limit, rules.reach2) * wp.where(own == 1 and j == k, 0.0, 1.0)
            if m * counts(d2, number, last.d2, last.number) > 0.0:
                place = rules.nearest - 1
                while place > 0 and counts(distances[place - 1], numbers[place - 1], d2, number) == 0.0:
                    distances[place] = distances[place - 1]
                    numbers[place] = numbers[place - 1]
                    place = place - 1
                distances[place] = d2
                numbers[place] = number
                last.d2 = distances[rules.nearest - 1]
                last.number = numbers[rules.nearest - 1]
    return last


@wp.func
def gather_company(k: int, slot: int, own: int, rules: Rules, mine: Crowd, theirs: Crowd, layout: Layout) -> Company:
    """Return the company of the boid at place k of its crowd among another, or its own: row by row, in the grid's order."""
    domain = theirs.domain[0]
    x = read3(mine.sorted, k)
    v = wp.vec3(mine.sorted[3, k], mine.sorted[4, k], mine.sorted[5, k])
    limit = view_limit(rules.cosine, wp.dot(v, v))
    cell = cell_in(x, domain, layout)
    last = everybody()
    if rules.nearest > 0:
        last = find_horizon(k, own, rules, mine, theirs, cell, layout)
    company = no_company()
    for part in range(18):
        ends = run_in(theirs.grid, cell, part // 2, 2 * FINE + 1, part % 2, domain, layout)
        crosses = closes_upon(cell, part // 2, 2 * FINE + 1, domain)
        for j in range(ends[0], ends[1]):
            d = fold_if(crosses, read3(theirs.sorted, j) - x, domain)
            m = attends(wp.dot(d, d), wp.dot(d, v), limit, rules.reach2) * wp.where(own == 1 and j == k, 0.0, 1.0)
            m = m * counts(wp.dot(d, d), theirs.grid.order[j], last.d2, last.number)
            vj = wp.vec3(theirs.sorted[3, j], theirs.sorted[4, j], theirs.sorted[5, j])
            company = meet(company, d, vj, m, rules)
    if company.coincident > 0.0:
        company.apart = company.apart + part_coincident(x, k, own, slot, last, cell, theirs, domain, layout, rules)
    return company


@wp.func
def steer_boid(
    k: int,
    own: int,
    rules: Rules,
    mine: Crowd,
    theirs: Crowd,
    layout: Layout,
    nobody: int,
    steering_inout: wp.array2d[float],
    neighbors_inout: wp.array[int],
):
    """Add what its neighbors make the boid at place k do [N], and count them; from place `nobody` on nobody is near; own = 1: begin."""
    i = mine.grid.order[k]
    f = wp.vec3()
    count = int(0)
    if own == 0:
        f = read3(steering_inout, i)
        count = neighbors_inout[i]
    if k < nobody:
        company = gather_company(k, i, own, rules, mine, theirs, layout)
        v = wp.vec3(mine.sorted[3, k], mine.sorted[4, k], mine.sorted[5, k])
        f = f + flock_force(v, company, rules)
        count = count + int(company.count)
    write3(steering_inout, i, f)
    neighbors_inout[i] = count


@wp.func
def first_alone(crowd: Crowd) -> int:
    """Return the place from which on a crowd has those that nobody is near to: who is not finite."""
    return crowd.grid.begin[int(layout_in(crowd.grid, crowd.count, crowd.domain[0]).mask) + 1]


@wp.kernel(enable_backward=False)
def accumulate_flock(
    first: int,
    own: int,
    rules: wp.array[Rules],
    mine: Crowd,
    theirs: Crowd,
    steering_inout: wp.array2d[float],
    neighbors_inout: wp.array[int],
):
    """Add what their neighbors among a crowd make the boids of another do [N], and count them; own = 1: begin anew."""
    k = first + wp.tid()
    if k < mine.count:
        layout = layout_in(theirs.grid, theirs.count, theirs.domain[0])
        steer_boid(k, own, rules[0], mine, theirs, layout, first_alone(mine), steering_inout, neighbors_inout)
