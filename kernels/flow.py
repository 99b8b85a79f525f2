"""Formulas of the flow primitives, and their superposition [m/s].

Symbols: x point [m], d vector from the center or axis to x [m], r = |d|, U velocity [m/s], V′ rate of a source [m²/s] or
[m³/s], Γ circulation [m²/s], R core radius [m]. Each formula takes (primitive, x); the registry FLOWS at the end numbers them.
The longer ones have files of their own: vortices.py, noise.py.
"""

import warp as wp

from warpsim.kernels.elementary import mean_decay
from warpsim.kernels.expressions import evaluate_program
from warpsim.kernels.grids import sample_grid
from warpsim.kernels.noise import sample_curl_noise
from warpsim.kernels.primitive import INVERSE_FOUR_PI, INVERSE_TWO_PI, LAMB_OSEEN, RANKINE, SCULLY, SMALLEST_R2, FlowPrimitive, from_axis
from warpsim.kernels.vortices import sample_vortex_ring, sample_vortex_segment


@wp.func(inline=True)
def sample_uniform(p: FlowPrimitive, x: wp.vec3) -> wp.vec3:
    """Return v = U.  Source: linear flow, lecture."""
    return p.strength


@wp.func(inline=True)
def sample_source(p: FlowPrimitive, x: wp.vec3) -> wp.vec3:
    """Return v_r = V′/(2πr), a line source; V′ < 0 is a sink.  Source: Batchelor 1967, §2.5."""
    d = from_axis(p, x)
    return d * (p.strength[0] * INVERSE_TWO_PI / (wp.dot(d, d) + SMALLEST_R2))


@wp.func(inline=True)
def sample_point_source(p: FlowPrimitive, x: wp.vec3) -> wp.vec3:
    """Return v_r = V′/(4πr²).  Source: Batchelor 1967, §2.5."""
    d = x - p.center
    r2 = wp.dot(d, d) + SMALLEST_R2
    return d * (p.strength[0] * INVERSE_FOUR_PI / (r2 * wp.sqrt(r2)))


@wp.func(inline=True)
def sample_vortex(p: FlowPrimitive, x: wp.vec3) -> wp.vec3:
    """Return v_θ = Γ/(2πr) g, g = 1 | min(1, r²/R²) | 1 − e^{−r²/R²} | r²/(r² + R²) by core.  Source: Saffman 1992; Scully 1975."""
    d = from_axis(p, x)
    r2 = wp.dot(d, d) + SMALLEST_R2
    core2 = p.core_radius * p.core_radius
    g = float(1.0)
    if p.core == RANKINE:
        g = wp.min(1.0, r2 / core2)
    elif p.core == LAMB_OSEEN:
        q = r2 / core2
        g = q * mean_decay(q)
    elif p.core == SCULLY:
        g = r2 / (r2 + core2)
    return wp.cross(p.axis, d) * (g * p.strength[0] * INVERSE_TWO_PI / r2)


@wp.func(inline=True)
def sample_doublet(p: FlowPrimitive, x: wp.vec3) -> wp.vec3:
    """Return v = (m − 2 (m·r̂) r̂)/r² against a uniform U: with m = R² U no flow crosses r = R.  Source: Milne-Thomson 1968, §6.22."""
    d = from_axis(p, x)
    r2 = wp.dot(d, d) + SMALLEST_R2
    return (p.strength - d * (2.0 * wp.dot(d, p.strength) / r2)) / r2


@wp.func(inline=True)
def sample_rotation(p: FlowPrimitive, x: wp.vec3) -> wp.vec3:
    """Return v = ω × d, solid-body rotation.  Source: lecture."""
    return wp.cross(p.axis, x - p.center) * p.strength[0]


@wp.func(inline=True)
def place_of(p: FlowPrimitive, x: wp.vec3) -> wp.vec3d:
    """Return x from where the formulas' origin is, in float64 [m]."""
    d = wp.vec3d(wp.float64(x[0]), wp.float64(x[1]), wp.float64(x[2]))
    return d - wp.vec3d(wp.float64(p.center[0]), wp.float64(p.center[1]), wp.float64(p.center[2]))


@wp.func
def sample_expression(p: FlowPrimitive, x: wp.vec3) -> wp.vec3:
    """Return what three formulas of place and time say, worked out in float64; what is not finite stays so, and the run answers it."""
    place = place_of(p, x)
    u = evaluate_program(p.program, p.span[0], p.span[1], place, p.time)
    v = evaluate_program(p.program, p.span[1], p.span[2], place, p.time)
    w = evaluate_program(p.program, p.span[2], p.span[3], place, p.time)
    return wp.vec3(float(u), float(v), float(w))


FLOWS = {
    "uniform": sample_uniform,
    "source": sample_source,
    "point_source": sample_point_source,
    "vortex": sample_vortex,
    "doublet": sample_doublet,
    "rotation": sample_rotation,
    "vortex_segment": sample_vortex_segment,
    "vortex_ring": sample_vortex_ring,
    "curl_noise": sample_curl_noise,
    "expression": sample_expression,
    "grid": sample_grid,
}
LONG_FLOWS = ("curl_noise", "expression", "grid")  # two thirds of a native loop's code are theirs


@wp.func
def sample_primitive(p: FlowPrimitive, x: wp.vec3) -> wp.vec3:
    """Return zero: there is no such kind."""
    return wp.vec3()


def with_case(kind, formula, otherwise):
    """Chain one more kind: closures and not wp.static(table[k]), which Warp's hash of other modules misses."""

    @wp.func(name="sample_primitive")
    def sample_primitive(p: FlowPrimitive, x: wp.vec3) -> wp.vec3:
        """Return the velocity of one primitive at x."""
        if p.kind == kind:
            return formula(p, x)
        return otherwise(p, x)

    return sample_primitive


for _kind, _formula in enumerate(FLOWS.values()):
    sample_primitive = with_case(_kind, _formula, sample_primitive)


@wp.func
def sample_flow(flow: wp.array2d[FlowPrimitive], node: int, x: wp.vec3) -> wp.vec3:
    """Return the velocity of the superposition at x [m/s], by the table's row for one moment."""
    v = wp.vec3()
    for k in range(flow.shape[1]):
        v = v + sample_primitive(flow[node, k], x)
    return v
