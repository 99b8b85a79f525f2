"""A flow primitive as a row of a table, with what the formulas of several files share.

Symbols: d vector from the center to x [m], r = |d|, R core radius [m].
"""

import warp as wp

from warpsim.kernels.expressions import Instruction

IDEAL, RANKINE, LAMB_OSEEN, SCULLY = range(4)
CORES = {"ideal": IDEAL, "rankine": RANKINE, "lamb_oseen": LAMB_OSEEN, "scully": SCULLY}

INVERSE_TWO_PI = wp.constant(0.15915494)
INVERSE_FOUR_PI = wp.constant(0.079577472)
SMALLEST_R2 = wp.constant(1.0e-12)  # [m²]: on an ideal singularity the formula stays finite


@wp.struct
class FlowPrimitive:
    kind: int  # place in FLOWS
    core: int  # IDEAL … SCULLY
    center: wp.vec3  # [m]
    axis: wp.vec3  # unit vector
    direction: wp.vec3  # unit vector
    core_radius: float  # [m]
    half_length: float  # of a segment [m]
    radius: float  # of a ring [m], at the time of the table
    signal: wp.vec3i  # rows of the signals that give the strength; -1: zero
    gain: wp.mat33  # strength = gain · signals: an image's share of what it answers, a doublet's direction
    strength: wp.vec3  # (U [m/s] | V′ | Γ | ω [rad/s], …) or a doublet's moment [m³/s] at the time of the table
    travel: wp.vec3i  # rows of the signals that displace the center [m]; -1: zero
    turn: wp.mat33  # displacement = turn · signals: an image travels the mirrored way
    radius_signal: int  # row of the signal that is the radius; -1: it stays
    program: wp.array[Instruction]  # of an expression: three programs, one after the other
    span: wp.vec4i  # where they begin in the program, and where the last one ends
    time: wp.float64  # of the table [s]
    length: float  # of a noise's cells [m]
    frequency: float  # of a noise [1/s]
    seed: wp.uint32  # of a noise
    clock: wp.uint32  # of a noise at the time of the table: periods passed, in units of 2^-20
    values: wp.array[float]  # of a grid: velocities at its nodes [m/s], flat: x, y, z of each, k fastest; the first is at the center
    nodes: wp.vec3i  # of a grid along x, y and z, 2 at least
    inverse_spacing: wp.vec3  # of a grid's nodes [1/m]; 0 along an axis with one node
    outside: int  # of a grid's box: ZERO, CLAMP


@wp.func(inline=True)
def from_axis(p: FlowPrimitive, x: wp.vec3) -> wp.vec3:
    """Return the vector from the primitive's axis to x [m]."""
    d = x - p.center
    return d - p.axis * wp.dot(d, p.axis)
