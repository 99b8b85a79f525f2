"""Vortex lines of finite length by the law of Biot and Savart: a straight segment and a ring.

A core replaces the square of the distance between x and a point of the line by D = |x − x′|² + P(s²) − s², s being the distance
from the segment, or from the circle, and P(s²) what makes the profile across the line that of the line vortex with this core:
d ln P / d ln s² = g(s²), so that v_θ = Γ/(2πs) g near a long or wide line. P is s² (ideal), s² + R² (Scully; that is Rosenhead's
kernel), R² e^{q − 1} inside and s² outside (Rankine), R² e^{Ein(q) − γ} (Lamb–Oseen), q = s²/R². The velocity is the curl of
A = Γ/(4π) ∮ dl/√D, so its divergence is zero for every core.
"""

import warp as wp

from warpsim.kernels.elementary import exp_negative, exponential_integral, mean_decay
from warpsim.kernels.primitive import INVERSE_FOUR_PI, LAMB_OSEEN, RANKINE, SCULLY, SMALLEST_R2, FlowPrimitive


@wp.func(inline=True)
def soften(p: FlowPrimitive, s2: float) -> wp.vec2:
    """Return P(s²) − s² [m²] and dP/ds².  Source: Rosenhead 1930; the other profiles from those of the line vortex."""
    core2 = p.core_radius * p.core_radius
    excess = float(SMALLEST_R2)
    slope = float(1.0)
    if p.core == RANKINE:
        slope = exp_negative(wp.min(s2 / core2, 1.0) - 1.0)
        excess = wp.where(s2 < core2, core2 * slope - s2, SMALLEST_R2)
    elif p.core == LAMB_OSEEN:
        q = s2 / core2
        P = wp.max(core2, s2) * exp_negative(exponential_integral(q))
        excess = P - s2
        slope = mean_decay(q) * (P / core2)
    elif p.core == SCULLY:
        excess = core2
    return wp.vec2(excess, slope)


@wp.func(inline=True)
def sample_vortex_segment(p: FlowPrimitive, x: wp.vec3) -> wp.vec3:
    """Return v_θ = Γ/(4π) ρ P′/σ² (cos θ₁ − cos θ₂), σ² = ρ² + P − s², the angles being those at the ends.  Source: Saffman 1992, §2.3."""
    d = x - p.center
    z = wp.dot(d, p.axis)
    d = d - p.axis * z
    rho2 = wp.dot(d, d)
    end = wp.max(wp.abs(z) - p.half_length, 0.0)
    soft = soften(p, rho2 + end * end)
    sigma2 = rho2 + soft[0]
    z1 = z + p.half_length
    z2 = z - p.half_length
    r1 = wp.sqrt(sigma2 + z1 * z1)
    r2 = wp.sqrt(sigma2 + z2 * z2)
    # Beside the segment the cosines have opposite signs; beyond its ends they nearly cancel, and the difference is written out.
    beside = (z1 * r2 - z2 * r1) / (sigma2 * r1 * r2)
    beyond = 4.0 * p.half_length * wp.abs(z) / (r1 * r2 * (wp.abs(z1) * r2 + wp.abs(z2) * r1))
    return wp.cross(p.axis, d) * (p.strength[0] * INVERSE_FOUR_PI * soft[1] * wp.where(z1 * z2 < 0.0, beside, beyond))


@wp.func(inline=True)
def sample_vortex_ring(p: FlowPrimitive, x: wp.vec3) -> wp.vec3:
    """Return v = curl (Γ/(4π) ∮ dl/√D) by complete elliptic integrals, these by the AGM.  Source: Lamb 1932, §161; DLMF §19.8."""
    R = wp.where(p.radius < 0.0, 0.0, p.radius)
    d = x - p.center
    z = wp.dot(d, p.axis)
    d = d - p.axis * z
    rho = wp.sqrt(wp.dot(d, d))
    s2 = (rho - R) * (rho - R) + z * z
    soft = soften(p, s2)
    P = s2 + soft[0]
    Q = P + 4.0 * R * rho
    k2 = 4.0 * R * rho / Q
    # K = π/(2a), K − E = K k² (½ + k² τ), τ = Σ 2^{n−1} e_n²: k² e_n is half the difference of the means. By e_{n+1} = k² e_n²/(4 a_{n+1})
    # and with k² in front nothing cancels, neither on the axis nor far away.
    b = wp.sqrt(P / Q)
    a = 0.5 + 0.5 * b
    b = wp.sqrt(b)
    e = 0.25 / a
    tau = e * e
    weight = float(1.0)
    for _n in range(4):
        mean = 0.5 * (a + b)
        b = wp.sqrt(a * b)
        a = mean
        e = 0.25 * k2 * e * e / a
        weight = 2.0 * weight
        tau = tau + weight * e * e
    common = p.strength[0] * R / ((a + b) * wp.sqrt(Q))
    across = soft[1] * 4.0 * R * (0.5 - (2.0 - k2) * tau) / (P * Q)  # of ∮ cos φ dφ/D^{3/2}
    along = R * (1.0 + 2.0 * k2 * tau) / Q - (rho - R) * rho * across
    return (d * (z * across) + p.axis * along) * common
