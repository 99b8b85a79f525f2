"""What a system feels: gravity, flow and forces, as tables with a row per moment of the frame, and its coupling to the flow."""

import warp as wp

from warpsim.kernels.collider import Collider
from warpsim.kernels.flow import sample_flow
from warpsim.kernels.forces import ForceField, sample_acceleration
from warpsim.kernels.noise import noise_clock
from warpsim.kernels.planar import read3, write3
from warpsim.kernels.primitive import FlowPrimitive
from warpsim.kernels.signals import Signals, sample_signal

SIX_PI = wp.constant(18.849556)
STOP, RESET, KILL = range(3)
UNSTABLE_POLICIES = {"stop": STOP, "reset": RESET, "kill": KILL}


@wp.struct
class Environment:
    gravity: wp.vec3  # [m/s²]
    alpha: float  # drag per particle [kg/s]
    viscosity: float  # of the fluid [Pa·s]; Stokes drag adds 6πaη to alpha
    extent: float  # no particle leaves [-extent, extent]³ [m]
    policy: int  # what happens to one that does: STOP … KILL
    flow: wp.array2d[FlowPrimitive]  # (moments, primitives), moments half a substep apart
    forces: wp.array2d[ForceField]  # (moments, fields)
    colliders: wp.array2d[Collider]  # (moments, colliders), each where it is at the moment
    tracer: int  # 1: particles without inertia, which slide along colliders


@wp.func(inline=True)
def drag_rate(alpha: float, viscosity: float, radius: float, inverse_mass: float) -> float:
    """Return k = (α + 6πaη)/m [1/s], the inverse of the relaxation time.  Source: Stokes 1851."""
    return (alpha + SIX_PI * radius * viscosity) * inverse_mass


@wp.func
def sample_strength(signals: Signals, signal: wp.vec3i, t: wp.float64) -> wp.vec3:
    """Return the components of a strength at time t [s]; those without a signal are 0."""
    s = wp.vec3()
    for c in range(3):
        if signal[c] >= 0:
            s[c] = float(sample_signal(signals, signal[c], t))
    return s


@wp.func
def primitive_at(primitive: FlowPrimitive, signals: Signals, t: wp.float64) -> FlowPrimitive:
    """Return a primitive as it is at time t [s]: its strength, its place, its radius."""
    p = primitive
    p.time = t
    p.clock = noise_clock(primitive.frequency, t)
    p.strength = primitive.gain * sample_strength(signals, primitive.signal, t)
    p.center = primitive.center + primitive.turn * sample_strength(signals, primitive.travel, t)
    if primitive.radius_signal >= 0:
        p.radius = float(sample_signal(signals, primitive.radius_signal, t))
    return p


@wp.kernel(enable_backward=False)
def sample_moments(
    first: int,
    start_time: wp.array[wp.float64],
    spacing: wp.float64,
    signals: Signals,
    primitives: wp.array[FlowPrimitive],
    fields: wp.array[ForceField],
    flow_out: wp.array2d[FlowPrimitive],
    forces_out: wp.array2d[ForceField],
):
    """Fill the tables' rows of one moment t = start + j·spacing [s]: each primitive and field as it is at t."""
    j = first + wp.tid()
    t = start_time[0] + wp.float64(j) * spacing
    for k in range(primitives.shape[0]):
        flow_out[j, k] = primitive_at(primitives[k], signals, t)
    for k in range(fields.shape[0]):
        field = fields[k]
        field.strength = sample_strength(signals, field.signal, t)
        forces_out[j, k] = field


@wp.kernel(enable_backward=False, module="warpsim.kernels.environment.probe")
def sample_velocities(first: int, flow: wp.array2d[FlowPrimitive], points: wp.array2d[float], velocity_out: wp.array2d[float]):
    """Sample the flow at points, planar (3, count) [m] -> [m/s], through the functions that the particles feel."""
    i = first + wp.tid()
    write3(velocity_out, i, sample_flow(flow, 0, read3(points, i)))


@wp.func
def sample_felt_acceleration(environment: Environment, moment: int, inverse_mass: float, x: wp.vec3) -> wp.vec3:
    """Return gravity and the forces per mass at x [m/s²]."""
    return sample_acceleration(environment.forces, moment, environment.gravity, inverse_mass, x)
