"""Native loops over the springs, kicks and pins of a network for the CPU, beside the plain kernels whose bits they share; see loops.py."""

import warp as wp

from warpsim.kernels.emission import Particles
from warpsim.kernels.environment import Environment
from warpsim.kernels.loops import share, snippet
from warpsim.kernels.planar import read3, write3
from warpsim.kernels.springs import Network, Pins, hold_pin, spring_force, sum_springs

SPRINGS = r"""
    constexpr int B = @BLOCK@, N = 16;
    #define PULL(other) _Pragma("clang loop vectorize_width(16) interleave_count(1)") for (int t = q; t < q + N; ++t) { \
        const int i = b + t, j = other; \
        const vec f = $spring_force(vec(X[i], Y[i], Z[i]), vec(VX[i], VY[i], VZ[i]), vec(X[j], Y[j], Z[j]), \
                                    vec(VX[j], VY[j], VZ[j]), R[t], K[t], C[t]); \
        FX[t] += f[0]; FY[t] += f[1]; FZ[t] += f[2]; }
    const int S = particles.position.shape[1];
    const float *X = particles.position.data, *Y = X + S, *Z = Y + S;
    const float *VX = particles.velocity.data, *VY = VX + S, *VZ = VY + S;
    float *A = internal.data;
    for (int b = begin; b < end; b += B) {
        float FX[B] = {}, FY[B] = {}, FZ[B] = {};
        const int last = network.begin.data[b / B + 1];
        for (int row = network.begin.data[b / B]; row < last; ++row) {
            const int* J = network.neighbor.data + (size_t)row * B;
            const float *R = network.rest.data + (size_t)row * B, *K = network.stiffness.data + (size_t)row * B;
            const float* C = network.damping.data + (size_t)row * B;
            for (int q = 0; q < B; q += N) {
                int apart = 0;
                for (int t = q; t < q + N; ++t) apart |= J[t] - J[q] - (t - q);
                const int step = J[q] - (b + q);
                if (apart) PULL(J[t]) else PULL(i + step)  // neighbors that lie in a row are loaded, others gathered: five times slower
            }
        }
        const int n = end - b < B ? end - b : B;
        for (int t = 0; t < n; ++t) {
            const float w = network.inverse_mass.data[b + t];
            A[b + t] = FX[t] * w; A[b + t + S] = FY[t] * w; A[b + t + 2 * S] = FZ[t] * w;
        }
    }
"""


@wp.func_native(snippet(SPRINGS.replace("\n    #define", "\n#define"), spring_force) + "#undef PULL\n")
def spring_range(begin: int, end: int, network: Network, particles: Particles, internal: wp.array2d[float]):
    """Sum the springs of a range of points."""
    for i in range(begin, end):
        write3(internal, i, sum_springs(i, network, particles.position, particles.velocity) * network.inverse_mass[i])


@wp.kernel(enable_backward=False)
def accumulate_springs(part: int, part_count: int, network: Network, particles: Particles, internal_out: wp.array2d[float]):
    """Store what the springs do to one part of the points."""
    cut = share(part + wp.tid(), part_count, network.point_count)
    spring_range(cut[0], cut[1], network, particles, internal_out)


KICK = """
    const int S = velocity.shape[1];
    for (int c = 0; c < 3; ++c) {
        float* V = velocity.data + c * S;
        const float* A = internal.data + c * S;
        for (int i = begin; i < end; ++i) V[i] += A[i] * h;
    }
"""


@wp.func_native(snippet(KICK))
def kick_range(begin: int, end: int, h: float, internal: wp.array2d[float], velocity: wp.array2d[float]):
    """Let the springs act on a range of points."""
    for i in range(begin, end):
        write3(velocity, i, read3(velocity, i) + read3(internal, i) * h)


@wp.kernel(enable_backward=False)
def kick_points(
    part: int,
    part_count: int,
    h: float,
    count: int,
    opening: int,
    clock: wp.array[wp.int64],
    internal: wp.array2d[float],
    velocity_inout: wp.array2d[float],
):
    """Let the springs act on one part of the points."""
    cut = share(part + wp.tid(), part_count, count)
    if int(clock[0]) > opening:
        kick_range(cut[0], cut[1], h, internal, velocity_inout)


@wp.kernel(enable_backward=False)
def project_pins(
    part: int,
    part_count: int,
    s: int,
    dt: wp.float64,
    pins: Pins,
    environment: wp.array[Environment],
    particles_inout: Particles,
    counters_inout: wp.array[wp.int64],
):
    """Put the pins among one part of the points where they are held."""
    cut = share(part + wp.tid(), part_count, pins.point_count)
    for p in range(pins.point.shape[0]):
        if pins.point[p] >= cut[0] and pins.point[p] < cut[1]:
            hold_pin(p, s, dt, pins, environment[0], particles_inout, counters_inout)
