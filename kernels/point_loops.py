"""Native loops over the points of lasting systems for the CPU, beside the plain kernels whose bits they share; see loops.py."""

import warp as wp

from warpsim.kernels.clearance import CLEARANCES
from warpsim.kernels.collider import into_frame
from warpsim.kernels.contact import path_reach
from warpsim.kernels.emission import Particles
from warpsim.kernels.environment import Environment
from warpsim.kernels.integration import Pace
from warpsim.kernels.loops import cases, share, snippet
from warpsim.kernels.points import approaches_colliders, lead_past, started

RESOLVE = """
    constexpr int B = @BLOCK@;
    const int S = particles.position.shape[1], T = start.shape[1], count = environment.colliders.shape[1];
    const float *P = particles.position.data, *Q = particles.velocity.data, *P0 = start.data, *Q0 = start.data + 3 * (size_t)T;
    #define AT(F, k, stride) vec(F[k], F[k + stride], F[k + 2 * stride])
    #define NEAR(formula) for (int t = 0; t < n; ++t) { \\
        const int i = b + t; \\
        const vec x0 = AT(P0, i, T), v0 = AT(Q0, i, T); \\
        const float reach = $path_reach(c, half, whole, x0, v0, AT(P, i, S), AT(Q, i, S), pace.dt, pace.dt); \\
        const vec x = $into_frame(c.center, c.rotation, x0); near[t] |= !(formula > reach); }
    for (int b = begin; b < end; b += B) {
        const int n = end - b < B ? end - b : B;
        int near[B] = {};
        for (int j = 0; j < count; ++j) {
            const auto *q = environment.colliders.data + 2 * pace.first * count + j;
            const auto c = q[0], half = q[count], whole = q[2 * count];
            switch (c.kind) { NEAR_CASES }
        }
        for (int t = 0; t < n; ++t) if (near[t]) $lead_past(b + t, frame, pace, environment, start, particles, counters);
    }
"""
RESOLVE = RESOLVE.replace("NEAR_CASES", cases(CLEARANCES.values(), "NEAR", "c")).replace("\n    #define", "\n#define")


@wp.func_native(snippet(RESOLVE, *CLEARANCES.values(), path_reach, into_frame, lead_past) + "#undef AT\n#undef NEAR\n")
def resolve_range(
    begin: int,
    end: int,
    frame: int,
    pace: Pace,
    environment: Environment,
    start: wp.array2d[float],
    particles: Particles,
    counters: wp.array[wp.int64],
):
    """Lead the points of a range past the colliders."""
    for i in range(begin, end):
        if approaches_colliders(i, pace, environment, start, particles) == 1:
            lead_past(i, frame, pace, environment, start, particles, counters)


# Apart, because contact takes longer to compile than all the rest.
@wp.kernel(enable_backward=False, module="warpsim.kernels.point_loops.contacts")
def resolve_points(
    part: int,
    part_count: int,
    count: int,
    opening: int,
    pace: Pace,
    clock: wp.array[wp.int64],
    environment: wp.array[Environment],
    start: wp.array2d[float],
    asked: wp.array[int],
    particles_inout: Particles,
    counters_inout: wp.array[wp.int64],
):
    """Lead the ways of one part of the points past the colliders, if that is asked for (1)."""
    if asked[0] == 1 and started(clock, opening):
        cut = share(part + wp.tid(), part_count, count)
        resolve_range(cut[0], cut[1], int(clock[0]), pace, environment[0], start, particles_inout, counters_inout)
