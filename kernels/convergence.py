"""Convergence: one particle's path by any method, in float64 to measure the method's order and in float32 to see the floor of rounding.

The methods are those of integration.py, made anew in the other precision from the same source; what they feel is worked out in float64:
gravity, attractors, uniform flow and flow by formulas, with strengths that vary in time.
"""

import warp as wp

from warpsim.kernels.elementary import mean_decay
from warpsim.kernels.exponential import GLIDES32, GLIDES64, weights64
from warpsim.kernels.expressions import evaluate_program
from warpsim.kernels.forces import CONSTANT, INVERSE_SQUARE
from warpsim.kernels.integration import Kit, body_struct, formulas, methods
from warpsim.kernels.multistep import forms
from warpsim.kernels.signals import Signals, sample_signal


@wp.struct
class Pull:
    law: int  # CONSTANT … SPRING
    center: wp.vec3d  # [m]
    softening: wp.float64  # [m]
    signal: int  # row of the signals that is its strength


@wp.struct
class Setting:
    x: wp.vec3d  # at the beginning [m]
    v: wp.vec3d  # [m/s]
    inverse_mass: wp.float64  # [1/kg]
    k: wp.float64  # drag rate [1/s]
    gravity: wp.vec3d  # [m/s²]
    begin: wp.float64  # [s]
    spacing: wp.float64  # half a step [s]
    signals: Signals
    winds: wp.array2d[int]  # (uniform flows, 3) rows of the signals [m/s]
    spans: wp.array2d[int]  # (flows by formulas, 4) where each component's program begins, and where the last one ends
    gains: wp.array[int]  # rows of the signals that they are multiplied with; -1: 1
    pulls: wp.array[Pull]


@wp.func
def time_of(setting: Setting, moment: int) -> wp.float64:
    """Return the time of a moment [s]."""
    return setting.begin + wp.float64(moment) * setting.spacing


@wp.func
def sample_wind(setting: Setting, moment: int, x: wp.vec3d) -> wp.vec3d:
    """Return the flow at x [m/s]."""
    t = time_of(setting, moment)
    v = wp.vec3d()
    for j in range(setting.winds.shape[0]):
        for axis in range(3):
            v[axis] = v[axis] + sample_signal(setting.signals, setting.winds[j, axis], t)
    for j in range(setting.spans.shape[0]):
        gain = wp.float64(1.0)
        if setting.gains[j] >= 0:
            gain = sample_signal(setting.signals, setting.gains[j], t)
        for axis in range(3):
            begin = setting.spans[j, axis]
            v[axis] = v[axis] + gain * evaluate_program(setting.signals.program, begin, setting.spans[j, axis + 1], x, t)
    return v


@wp.func
def sample_pulls(setting: Setting, moment: int, x: wp.vec3d) -> wp.vec3d:
    """Return gravity and the attractors' forces per mass at x [m/s²], as in forces.py."""
    t = time_of(setting, moment)
    a = setting.gravity
    for j in range(setting.pulls.shape[0]):
        pull = setting.pulls[j]
        d = pull.center - x
        s2 = wp.dot(d, d) + pull.softening * pull.softening
        g = wp.float64(1.0)
        if pull.law == CONSTANT:
            g = wp.float64(1.0) / wp.sqrt(s2)
        elif pull.law == INVERSE_SQUARE:
            g = wp.float64(1.0) / (s2 * wp.sqrt(s2))
        a = a + d * (g * sample_signal(setting.signals, pull.signal, t) * setting.inverse_mass)
    return a


@wp.func
def mean_decay64(z: wp.float64) -> wp.float64:
    """Return φ(z) = (1 − e^{−z})/z, as elementary.mean_decay.  Source: Hochbruck & Ostermann 2010, §2.1."""
    return weights64(z)[1]


def kit(real, vec, decay, glides):
    """Make what methods are made of for a Setting in one precision; the body's type comes with it."""
    Body = body_struct(real, vec)

    @wp.func
    def flow_at(setting: Setting, moment: int, x: vec) -> vec:
        """Return the flow at x, rounded to the precision [m/s]."""
        u = sample_wind(setting, moment, wp.vec3d(wp.float64(x[0]), wp.float64(x[1]), wp.float64(x[2])))
        return vec(real(u[0]), real(u[1]), real(u[2]))

    @wp.func
    def acceleration_at(setting: Setting, moment: int, body: Body, x: vec) -> vec:
        """Return gravity and forces per mass at x, rounded to the precision [m/s²]."""
        a = sample_pulls(setting, moment, wp.vec3d(wp.float64(x[0]), wp.float64(x[1]), wp.float64(x[2])))
        return vec(real(a[0]), real(a[1]), real(a[2]))

    return Kit(real, vec, Body, Setting, formulas(real, vec, decay)[:2], glides, flow_at, acceleration_at)


def trace_kernel(kit, name: str, bits: int, feel, step):
    """Make the kernel that follows one particle by one method in one precision."""
    real, vec, Body = kit.real, kit.vec, kit.Body
    form = "tracer" if name.startswith("tracer_") else "inertial"

    @wp.kernel(name=f"trace_{name}_{bits}", module=f"warpsim.kernels.convergence.{form}{bits}", enable_backward=False)
    def trace_path(
        first: int,
        setting: Setting,
        h: wp.float64,
        position_out: wp.array[wp.vec3d],
        velocity_out: wp.array[wp.vec3d],
        error_out: wp.array[wp.vec2d],
    ):
        """One thread. Write the path, (steps + 1) positions [m] and velocities [m/s], and (position, velocity) error estimates of steps."""
        paced = setting
        paced.spacing = wp.float64(0.5) * h
        body = Body()
        body.x = vec(real(setting.x[0]), real(setting.x[1]), real(setting.x[2]))
        body.v = vec(real(setting.v[0]), real(setting.v[1]), real(setting.v[2]))
        body.inverse_mass = real(setting.inverse_mass)
        body.k = real(setting.k)
        body.dt = real(h)
        body.stride = 1
        body = feel(body, 0, paced)
        position_out[0] = setting.x
        velocity_out[0] = setting.v
        for s in range(position_out.shape[0] - 1):
            body = step(body, s, real(h), paced)
            position_out[s + 1] = wp.vec3d(wp.float64(body.x[0]), wp.float64(body.x[1]), wp.float64(body.x[2]))
            velocity_out[s + 1] = wp.vec3d(wp.float64(body.v[0]), wp.float64(body.v[1]), wp.float64(body.v[2]))
            error_out[s + 1] = wp.vec2d(wp.float64(body.position_error), wp.float64(body.velocity_error))

    return trace_path


def traces(kit, bits: int) -> dict:
    """Make the kernels of all methods in one precision."""
    return {name: trace_kernel(kit, name, bits, feel, step) for name, (feel, step) in methods(kit, forms(kit)).items()}


TRACES = {  # by bits, by method
    64: traces(kit(wp.float64, wp.vec3d, mean_decay64, GLIDES64), 64),
    32: traces(kit(wp.float32, wp.vec3, mean_decay, GLIDES32), 32),
}
