"""Exponential integrals: the exact motion x' = v, v' = −k v + N(t) where N is a cubic in time, in one precision or the other.

Symbols: h step [s], k drag rate [1/s], z = kh, N drive [m/s²] (acceleration plus k times the flow), s = (t − t₀)/h; on the step
N = N₀ + n₁ s + n₂ s²/2 + n₃ s³/6; g = N₀ − k v the whole acceleration at its beginning.
"""

import warp as wp

from warpsim.kernels.elementary import exp64, exp_negative

THIRD, SIXTH, INVERSE_24, INVERSE_120 = 1.0 / 3.0, 1.0 / 6.0, 1.0 / 24.0, 1.0 / 120.0  # here: on the device 1.0 is a float32


def weights(real, terms: int, exponential):
    """Make the φ-functions in one precision; the series' terms are as many as its rounding asks for at z = 1."""
    six = wp.types.vector(length=6, dtype=real)

    @wp.func(inline=True)
    def exponential_weights(z: real) -> six:
        """Return φ_0 … φ_5 of −z <= 0, φ_{j+1} = ∫₀¹ e^{−z(1−s)} s^j/j! ds.  Source: Hochbruck & Ostermann 2010, §2.1."""
        # Below 1 the series of φ_5 and the recurrence downward, above the recurrence upward: each damps its rounding there.
        y = wp.min(z, real(1.0))
        p = real(1.0)
        for j in range(terms):
            p = real(1.0) - p * y / real(5 + terms - j)
        p5 = p * real(INVERSE_120)
        p4 = real(INVERSE_24) - y * p5
        p3 = real(SIXTH) - y * p4
        p2 = real(0.5) - y * p3
        p1 = real(1.0) - y * p2
        r = real(1.0) / wp.max(z, real(1.0))
        q0 = exponential(-wp.max(z, real(1.0)))
        q1 = (real(1.0) - q0) * r
        q2 = (real(1.0) - q1) * r
        q3 = (real(0.5) - q2) * r
        q4 = (real(SIXTH) - q3) * r
        q5 = (real(INVERSE_24) - q4) * r
        small = z < real(1.0)
        w = six()
        w[0] = wp.where(small, real(1.0) - y * p1, q0)
        w[1] = wp.where(small, p1, q1)
        w[2] = wp.where(small, p2, q2)
        w[3] = wp.where(small, p3, q3)
        w[4] = wp.where(small, p4, q4)
        w[5] = wp.where(small, p5, q5)
        return w

    return exponential_weights


class Glides:
    """The motion under a cubic drive, and the derivatives of the cubic through its values, in one precision."""

    def __init__(self, real, vec, weights):
        self.exponential_weights = weights
        self.driven, self.pull, self.glide_velocity, self.glide_position, self.follow = moves(real, vec)
        self.first_difference, self.second_difference, self.third_difference = differences(vec)
        self.first_slope, self.second_slope, self.middle_slope, self.middle_bend = slopes(real, vec)


def moves(real, vec):
    """Make the motion under a cubic drive in one precision."""
    six = wp.types.vector(length=6, dtype=real)

    @wp.func(inline=True)
    def driven(a: vec, u: vec, k: real) -> vec:
        """Return N = a + k u, what drives a body but its own velocity [m/s²].  Source: Stokes 1851."""
        return a + u * k

    @wp.func(inline=True)
    def pull(n: vec, v: vec, k: real) -> vec:
        """Return g = N − k v, the whole acceleration [m/s²].  Source: Stokes 1851."""
        return n - v * k

    @wp.func(inline=True)
    def glide_velocity(v: vec, g: vec, n1: vec, n2: vec, n3: vec, w: six, h: real) -> vec:
        """Return v + h (φ_1 g + φ_2 n₁ + φ_3 n₂ + φ_4 n₃), w = φ(−kh).  Source: Cox & Matthews 2002, §2."""
        return v + (g * w[1] + n1 * w[2] + n2 * w[3] + n3 * w[4]) * h

    @wp.func(inline=True)
    def glide_position(x: vec, v: vec, g: vec, n1: vec, n2: vec, n3: vec, w: six, h: real) -> vec:
        """Return x + h v + h² (φ_2 g + φ_3 n₁ + φ_4 n₂ + φ_5 n₃), the velocity's integral.  Source: for k = 0 Falkner 1936."""
        return x + (v + (g * w[2] + n1 * w[3] + n2 * w[4] + n3 * w[5]) * h) * h

    @wp.func(inline=True)
    def follow(x: vec, n0: vec, n1: vec, n2: vec, n3: vec, h: real) -> vec:
        """Return x + h (N₀ + n₁/2 + n₂/6 + n₃/24), which solves x' = N, the first-order form."""
        return x + (n0 + n1 * real(0.5) + n2 * real(SIXTH) + n3 * real(INVERSE_24)) * h

    return driven, pull, glide_velocity, glide_position, follow


def differences(vec):
    """Make backward differences in one precision."""

    @wp.func(inline=True)
    def first_difference(a: vec, b: vec) -> vec:
        """Return a − b."""
        return a - b

    @wp.func(inline=True)
    def second_difference(a: vec, b: vec, c: vec) -> vec:
        """Return a − 2b + c."""
        return (a - b) - (b - c)

    @wp.func(inline=True)
    def third_difference(a: vec, b: vec, c: vec, d: vec) -> vec:
        """Return a − 3b + 3c − d."""
        return ((a - b) - (b - c)) - ((b - c) - (c - d))

    return first_difference, second_difference, third_difference


def slopes(real, vec):
    """Make the derivatives of the polynomial through given values in one precision."""

    @wp.func(inline=True)
    def first_slope(d1: vec, d2: vec, d3: vec) -> vec:
        """Return n₁ = ∇ + ∇²/2 + ∇³/3 of the backward differences.  Source: Hairer, Nørsett & Wanner 1993, III.1."""
        return d1 + d2 * real(0.5) + d3 * real(THIRD)

    @wp.func(inline=True)
    def second_slope(d2: vec, d3: vec) -> vec:
        """Return n₂ = ∇² + ∇³; n₃ is ∇³.  Source: the same."""
        return d2 + d3

    @wp.func(inline=True)
    def middle_slope(n: vec, half: vec, end: vec) -> vec:
        """Return −3N + 4N_½ − N_1, n₁ of the parabola through a step's beginning, middle and end."""
        return (half - n) * real(3.0) - (end - half)

    @wp.func(inline=True)
    def middle_bend(n: vec, half: vec, end: vec) -> vec:
        """Return 4 (N − 2N_½ + N_1), n₂ of the same parabola."""
        return ((end - half) - (half - n)) * real(4.0)

    return first_slope, second_slope, middle_slope, middle_bend


weights32, weights64 = weights(wp.float32, 8, exp_negative), weights(wp.float64, 15, exp64)
GLIDES32, GLIDES64 = Glides(wp.float32, wp.vec3, weights32), Glides(wp.float64, wp.vec3d, weights64)
