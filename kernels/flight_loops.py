"""Native loops of the flight of flocks for the CPU, beside the plain kernels whose bits they share; see loops.py."""

import warp as wp

from warpsim.kernels.domain import CONTAIN, PERIODIC, Domain, wrapped
from warpsim.kernels.emission import Particles
from warpsim.kernels.environment import Environment, drag_rate
from warpsim.kernels.flight import (
    NOISE,
    Limits,
    Vicsek,
    common_course,
    fly,
    limit_force,
    limit_speed,
    limit_turn,
    missing_axis,
    project_boid,
    reflected_place,
    reflected_speed,
    step_of,
    turned,
    wander,
)
from warpsim.kernels.flow import sample_flow
from warpsim.kernels.forces import sample_acceleration
from warpsim.kernels.integration import Pace, drift, kick
from warpsim.kernels.loops import share, snippet
from warpsim.kernels.points import started
from warpsim.kernels.random import random_words

ADVANCE = """
    constexpr int B = @BLOCK@;
    const int S = particles.position.shape[1], T = steering.shape[1], R = swimming.shape[1], moment = 2 * pace.first;
    const auto bounds = limits.data[0];
    const float *F = steering.data, *mass = particles.mass.data, *radius = particles.radius.data, h = pace.dt;
    const float share = R > 0 ? 1.0f : 0.0f;
    float *P = particles.position.data, *Q = particles.velocity.data, *swim = swimming.data;
    float U[3][B], A[3][B], X[3][B], V[3][B], G[3][B], I[B], K[B], W[3][B];
    for (int b = begin; b < end; b += B) {  // slots beyond the last boid are computed, never stored
        const int n = end - b < B ? end - b : B;
        for (int c = 0; c < 3; ++c) for (int t = 0; t < B; ++t) {
            X[c][t] = P[b + t + c * S]; V[c][t] = Q[b + t + c * S]; G[c][t] = F[b + t + c * T];
            A[c][t] = environment.gravity[c]; U[c][t] = 0.0f;
        }
        for (int t = 0; t < B; ++t) {
            I[t] = 1.0f / mass[b + t];
            K[t] = $drag_rate(environment.alpha, environment.viscosity, radius[b + t], I[t]);
        }
        if (environment.flow.shape[1] > 0) for (int t = 0; t < n; ++t) {
            const vec u = $sample_flow(environment.flow, moment, vec(X[0][t], X[1][t], X[2][t]));
            for (int c = 0; c < 3; ++c) U[c][t] = u[c];
        }
        if (environment.forces.shape[1] > 0) for (int t = 0; t < n; ++t) {
            const vec x(X[0][t], X[1][t], X[2][t]), a = $sample_acceleration(environment.forces, moment, environment.gravity, I[t], x);
            for (int c = 0; c < 3; ++c) A[c][t] = a[c];
        }
        for (int t = 0; t < B; ++t) {
            const vec x(X[0][t], X[1][t], X[2][t]), v0(V[0][t], V[1][t], V[2][t]), u(U[0][t], U[1][t], U[2][t]);
            const vec f = $limit_force(vec(G[0][t], G[1][t], G[2][t]), bounds.strongest);
            const vec a(A[0][t] + f[0] * I[t], A[1][t] + f[1] * I[t], A[2][t] + f[2] * I[t]);
            const vec carried(u[0] * share, u[1] * share, u[2] * share);
            const vec v = $kick(v0, u, a, K[t], h);
            const vec before(v0[0] - carried[0], v0[1] - carried[1], v0[2] - carried[2]);
            vec w(v[0] - carried[0], v[1] - carried[1], v[2] - carried[2]);
            w = $limit_turn(before, w, bounds.turn_cosine, bounds.turn_sine);
            w = $limit_speed(before, w, bounds.slowest, bounds.fastest);
            const vec y(w[0] + carried[0], w[1] + carried[1], w[2] + carried[2]), z = $drift(x, y, h);
            for (int c = 0; c < 3; ++c) { W[c][t] = w[c]; V[c][t] = y[c]; X[c][t] = z[c]; }
        }
        for (int c = 0; c < 3; ++c) for (int t = 0; t < n; ++t) { P[b + t + c * S] = X[c][t]; Q[b + t + c * S] = V[c][t]; }
        if (R > 0) for (int c = 0; c < 3; ++c) for (int t = 0; t < n; ++t) swim[b + t + c * R] = W[c][t];
    }
"""


@wp.func_native(snippet(ADVANCE, drag_rate, sample_flow, sample_acceleration, limit_force, limit_turn, limit_speed, kick, drift))
def advance_flock_range(
    begin: int,
    end: int,
    pace: Pace,
    environment: Environment,
    limits: wp.array[Limits],
    steering: wp.array2d[float],
    particles: Particles,
    swimming: wp.array2d[float],
):
    """Move a range of boids through substep pace.first."""
    for i in range(begin, end):
        fly(i, pace, environment, limits[0], steering, particles, swimming)


@wp.kernel(enable_backward=False)
def advance_flock(
    part: int,
    part_count: int,
    count: int,
    opening: int,
    pace: Pace,
    clock: wp.array[wp.int64],
    environment: wp.array[Environment],
    limits: wp.array[Limits],
    steering: wp.array2d[float],
    particles_inout: Particles,
    swimming_out: wp.array2d[float],
):
    """Move one part of the boids through substep pace.first."""
    if started(clock, opening):
        cut = share(part + wp.tid(), part_count, count)
        advance_flock_range(cut[0], cut[1], pace, environment[0], limits, steering, particles_inout, swimming_out)


WANDER = """
    const int S = particles.position.shape[1], T = steering.shape[1];
    float *P = particles.position.data, *Q = particles.velocity.data;
    const float *F = steering.data;
    const auto key = mode.key;
    const float noise = mode.noise, speed = mode.speed;
    _Pragma("clang loop vectorize(assume_safety)") for (int i = begin; i < end; ++i) {
        const vec v(Q[i], Q[i + S], Q[i + 2 * S]), x = $drift(vec(P[i], P[i + S], P[i + 2 * S]), v, h);
        const vec n = $common_course(v, vec(F[i], F[i + T], F[i + 2 * T]), neighbors.data[i]);
        const vec w = $turned(n, $random_words(key, step | (wp::int64)i, @NOISE@), noise, flat);
        for (int c = 0; c < 3; ++c) { P[i + c * S] = x[c]; Q[i + c * S] = w[c] * speed; }
    }
""".replace("@NOISE@", str(NOISE))


@wp.func_native(snippet(WANDER, drift, common_course, turned, random_words))
def wander_range(
    begin: int,
    end: int,
    step: wp.int64,
    h: float,
    mode: Vicsek,
    flat: wp.vec3,
    steering: wp.array2d[float],
    neighbors: wp.array[int],
    particles: Particles,
):
    """Move a range of Vicsek's boids."""
    for i in range(begin, end):
        wander(i, step, h, mode, flat, steering, neighbors, particles)


@wp.kernel(enable_backward=False)
def advance_vicsek(
    part: int,
    part_count: int,
    count: int,
    opening: int,
    pace: Pace,
    clock: wp.array[wp.int64],
    domain: wp.array[Domain],
    mode: wp.array[Vicsek],
    steering: wp.array2d[float],
    neighbors: wp.array[int],
    particles_inout: Particles,
):
    """Move one part of Vicsek's flock."""
    if started(clock, opening):
        cut = share(part + wp.tid(), part_count, count)
        flat = missing_axis(domain[0])
        wander_range(cut[0], cut[1], step_of(clock[0], pace), pace.dt, mode[0], flat, steering, neighbors, particles_inout)


PROJECT = """
    const int S = particles.position.shape[1];
    for (int c = 0; c < 3; ++c) {
        const float low = domain.low[c], edge = domain.size[c], rate = domain.rate[c];
        float *P = particles.position.data + (size_t)c * S, *Q = particles.velocity.data + (size_t)c * S;
        if (!(edge > 0.0f)) continue;
        if (domain.boundary == @PERIODIC@) {
            for (int i = begin; i < end; ++i) P[i] = $wrapped(P[i], low, edge, rate);
        } else if (domain.boundary == @CONTAIN@) {
            _Pragma("clang loop vectorize(assume_safety)") for (int i = begin; i < end; ++i) {
                const float x = P[i], v = Q[i];
                P[i] = $reflected_place(x, low, edge); Q[i] = $reflected_speed(x, v, low, edge);
            }
        }
    }
""".replace("@PERIODIC@", str(PERIODIC)).replace("@CONTAIN@", str(CONTAIN))


@wp.func_native(snippet(PROJECT, wrapped, reflected_place, reflected_speed))
def project_domain_range(begin: int, end: int, domain: Domain, particles: Particles):
    """Keep a range of boids in the domain."""
    for i in range(begin, end):
        project_boid(i, domain, particles)


@wp.kernel(enable_backward=False)
def project_domain(part: int, part_count: int, count: int, domain: wp.array[Domain], particles_inout: Particles):
    """Keep one part of the boids in the domain."""
    if domain[0].boundary > 0:
        cut = share(part + wp.tid(), part_count, count)
        project_domain_range(cut[0], cut[1], domain[0], particles_inout)
