"""Curl noise: turbulence that is free of divergence, because it is the curl of a vector potential.

Symbols: cells of edge L [m], d vector from a cell's corner to x [L], w the corner's weight there, ω the corner's own velocity.
The potential is Ψ = ½ Σ w ω × d over the eight corners of the cell, w the product of three fades 1 − s(|d_i|), s(u) = 6u⁵ − 15u⁴ + 10u³,
so that Ψ is twice continuously differentiable, and its curl, taken by hand, once: v = Σ (w + ½ ∇w·d) ω − ½ (∇w·ω) d. At a corner v
is the corner's ω = A cos θ + B sin θ, with A, B and the pace of θ from the hash of the corner. The paces spread from ½ to 3/2 of the
frequency, so that the whole never stands still, and comes again after 4096 periods only.
"""

import warp as wp

from warpsim.kernels.elementary import cos_turns, sin_turns
from warpsim.kernels.primitive import FlowPrimitive
from warpsim.kernels.random import FACTOR, INCREMENT, stir, uniform

SMALLEST_HALF = wp.constant(3.0517578e-05)  # 2^-15: what a step of 16 bits is of [-1, 1]
RMS_OF_UNIT_CORNERS = wp.constant(0.60481985)  # of |v| over a cell where A and B are uniform in [-1, 1]³; a test works it out
PERIOD = wp.constant(wp.float64(4096.0))


@wp.func
def noise_clock(frequency: float, t: wp.float64) -> wp.uint32:
    """Return the share of 4096 periods that has passed at time t [s], in units of 2^-32; float64, so that a late time is as fine."""
    periods = wp.float64(frequency) * t / PERIOD
    return wp.uint32((periods - wp.floor(periods)) * wp.float64(4294967296.0))


@wp.func(inline=True)
def signed_half(word: wp.uint32, shift: wp.uint32) -> float:
    """Return 16 bits of a word as a number uniform on (-1, 1)."""
    return (float(int((word >> shift) & wp.uint32(65535))) + 0.5) * SMALLEST_HALF - 1.0


@wp.func(inline=True)
def corner_velocity(x: wp.uint32, y: wp.uint32, z: wp.uint32, seed: wp.uint32, clock: wp.uint32) -> wp.vec3:
    """Return ω = A cos θ + B sin θ of a corner.  Source: pcg4d, Jarzynski & Olano 2020; flow noise, Perlin & Neyret 2001."""
    sixteen = wp.uint32(16)
    v = stir(wp.vec4ui(x * FACTOR + INCREMENT, y * FACTOR + INCREMENT, z * FACTOR + INCREMENT, seed * FACTOR + INCREMENT))
    v = stir(wp.vec4ui(v[0] ^ (v[0] >> sixteen), v[1] ^ (v[1] >> sixteen), v[2] ^ (v[2] >> sixteen), v[3] ^ (v[3] >> sixteen)))
    turn = uniform(((v[3] >> wp.uint32(20)) + wp.uint32(2048)) * clock)
    zero = wp.uint32(0)
    a = wp.vec3(signed_half(v[0], sixteen), signed_half(v[1], sixteen), signed_half(v[2], sixteen))
    b = wp.vec3(signed_half(v[0], zero), signed_half(v[1], zero), signed_half(v[2], zero))
    return a * cos_turns(turn) + b * sin_turns(turn)


@wp.func(inline=True)
def fades(u: float) -> wp.vec2:
    """Return the weights of the lower and the upper corner, u in [0, 1] between them.  Source: Perlin 2002."""
    s = u * u * u * (10.0 + u * (6.0 * u - 15.0))
    return wp.vec2(1.0 - s, s)


@wp.func(inline=True)
def slope(u: float) -> float:
    """Return the derivative of the upper corner's weight; the lower one's is its negative."""
    return 30.0 * u * u * (1.0 + u * (u - 2.0))


@wp.func(inline=True)
def sample_curl_noise(p: FlowPrimitive, x: wp.vec3) -> wp.vec3:
    """Return v = curl Ψ, of root mean square strength.  Source: Bridson, Houriham & Nordenstam 2007 (curl noise)."""
    d = (x - p.center) / p.length
    cx = wp.floor(d[0])
    cy = wp.floor(d[1])
    cz = wp.floor(d[2])
    ix = wp.uint32(int(wp.min(wp.max(cx, -1.0e9), 1.0e9)))
    iy = wp.uint32(int(wp.min(wp.max(cy, -1.0e9), 1.0e9)))
    iz = wp.uint32(int(wp.min(wp.max(cz, -1.0e9), 1.0e9)))
    u = wp.vec3(d[0] - cx, d[1] - cy, d[2] - cz)
    fx = fades(u[0])
    fy = fades(u[1])
    fz = fades(u[2])
    sx = slope(u[0])
    sy = slope(u[1])
    sz = slope(u[2])
    v = wp.vec3()
    for c in range(8):
        i = c & 1
        j = (c >> 1) & 1
        k = c >> 2
        w = fx[i] * fy[j] * fz[k]
        grad = wp.vec3(float(2 * i - 1) * sx * fy[j] * fz[k], float(2 * j - 1) * sy * fx[i] * fz[k], float(2 * k - 1) * sz * fx[i] * fy[j])
        away = u - wp.vec3(float(i), float(j), float(k))
        omega = corner_velocity(ix + wp.uint32(i), iy + wp.uint32(j), iz + wp.uint32(k), p.seed, p.clock)
        v = v + omega * (w + 0.5 * wp.dot(grad, away)) - away * (0.5 * wp.dot(grad, omega))
    return v * (p.strength[0] / RMS_OF_UNIT_CORNERS)
