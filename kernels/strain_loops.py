"""Native loops of the strain limit for the CPU, beside the plain kernels whose bits they share; see loops.py.

No two springs of a color share a point: which of them act can be told for a whole block before any of them does. Most do not.
"""

import warp as wp

from warpsim.kernels.emission import Particles
from warpsim.kernels.loops import share, snippet
from warpsim.kernels.planar import read3
from warpsim.kernels.springs import SpringTable
from warpsim.kernels.strain import PATIENCE, StrainLimit, known_pull, limit_pull, longest, project_place, remembered, stretched_beyond

POINTS = """
    constexpr int B = @BLOCK@;
    const int S = particles.position.shape[1], *O = limit.order.data;
    float *X = particles.position.data, *Y = X + S, *Z = Y + S;
    const auto *E = table.ends.data;
    const float *R = table.rest.data, strain = limit.strain.data[0], target = strain * limit.aim.data[0];
"""
LOOK = """
    for (int b = begin; b < end; b += B) {
        const int n = end - b < B ? end - b : B;
        int found = 0;
        for (int t = 0; t < n; ++t) {
            const int e = O[b + t], i = E[e][0], j = E[e][1];
            found |= $stretched_beyond(vec(X[i], Y[i], Z[i]), vec(X[j], Y[j], Z[j]), $longest(R[e], strain));
        }
        if (!found) continue;
        __atomic_store_n(limit.over.data, 1, __ATOMIC_RELAXED);
        return;
    }
"""
PULL = """
    float *VX = particles.velocity.data, *VY = VX + S, *VZ = VY + S, *M = limit.multiplier.data;
    const float* W = limit.inverse_mass.data;
    const bool late = !begins && limit.turn.data[0] >= @PATIENCE@;
    const float rate = late ? 0.0f : 1.0f / limit.h, bound = late ? strain : target;
    auto pull_ends = [&](int i, int j, float fx, float fy, float fz) {
        const float ax = fx * W[i], ay = fy * W[i], az = fz * W[i], bx = fx * W[j], by = fy * W[j], bz = fz * W[j];
        const float cx = ax * rate, cy = ay * rate, cz = az * rate, dx = bx * rate, dy = by * rate, dz = bz * rate;
        X[i] += ax; Y[i] += ay; Z[i] += az; X[j] -= bx; Y[j] -= by; Z[j] -= bz;
        VX[i] += cx; VY[i] += cy; VZ[i] += cz; VX[j] -= dx; VY[j] -= dy; VZ[j] -= dz;
    };
    for (int b = begin; b < end; b += B) {
        const int n = end - b < B ? end - b : B;
        int acts[B], any = 0;
        for (int t = 0; t < n; ++t) acts[t] = !late && M[b + t] > 0.0f;
        if (!begins) for (int t = 0; t < n; ++t) {
            const int e = O[b + t], i = E[e][0], j = E[e][1];
            acts[t] |= $stretched_beyond(vec(X[i], Y[i], Z[i]), vec(X[j], Y[j], Z[j]), $longest(R[e], bound));
        }
        for (int t = 0; t < n; ++t) any |= acts[t];
        if (any) for (int t = 0; t < n; ++t) if (acts[t]) {
            const int e = O[b + t], i = E[e][0], j = E[e][1];
            const vec xi(X[i], Y[i], Z[i]), xj(X[j], Y[j], Z[j]);
            const float known = late ? 0.0f : M[b + t];
            if (begins) {
                const float kept = $remembered(known, limit.kept.data[0]);
                const vec f = $known_pull(xi, xj, kept);
                M[b + t] = kept;
                pull_ends(i, j, f[0], f[1], f[2]);
                continue;
            }
            const auto f = $limit_pull(xi, xj, $longest(R[e], target), W[i] + W[j], known);
            pull_ends(i, j, f[0], f[1], f[2]);
            if (!late) M[b + t] = known + f[3];
        }
    }
""".replace("@PATIENCE@", str(int(PATIENCE)))
FORMULAS = (longest, stretched_beyond, limit_pull, known_pull, remembered)


@wp.func_native(snippet(POINTS + LOOK, *FORMULAS))
def look_range(begin: int, end: int, limit: StrainLimit, table: SpringTable, particles: Particles):
    """Note whether any spring at a range of places is too long."""
    for place in range(begin, end):
        e = limit.order[place]
        xi = read3(particles.position, table.ends[e][0])
        xj = read3(particles.position, table.ends[e][1])
        if stretched_beyond(xi, xj, longest(table.rest[e], limit.strain[0])):
            limit.over[0] = 1


@wp.func_native(snippet(POINTS + PULL, *FORMULAS))
def pull_range(begin: int, end: int, begins: int, limit: StrainLimit, table: SpringTable, particles: Particles):
    """Pull at the ends of the springs at a range of places, all of one color."""
    for place in range(begin, end):
        project_place(place, begins, limit, table, particles)


@wp.kernel(enable_backward=False)
def mark_overlong(part: int, part_count: int, limit_inout: StrainLimit, table: SpringTable, particles: Particles):
    """Note whether any of one part of the springs is longer than it may be."""
    cut = share(part + wp.tid(), part_count, limit_inout.order.shape[0])
    look_range(cut[0], cut[1], limit_inout, table, particles)


@wp.kernel(enable_backward=False)
def project_springs(
    part: int, part_count: int, color: int, begins: int, limit_inout: StrainLimit, table: SpringTable, particles_inout: Particles
):
    """Pull at the ends of one part of the springs of one color."""
    begin = limit_inout.begin[color]
    cut = share(part + wp.tid(), part_count, limit_inout.begin[color + 1] - begin)
    if limit_inout.going[0] == 1:
        pull_range(begin + cut[0], begin + cut[1], begins, limit_inout, table, particles_inout)


@wp.kernel(enable_backward=False)
def project_colors(first: int, color: int, end: int, begins: int, limit_inout: StrainLimit, table: SpringTable, particles_inout: Particles):
    """Pull at the ends of the springs of a run of colors, one after the other."""
    if limit_inout.going[0] == 1:
        for k in range(color + first, end):
            pull_range(limit_inout.begin[k], limit_inout.begin[k + 1], begins, limit_inout, table, particles_inout)
