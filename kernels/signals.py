"""Signals: strengths that vary in time, as rows of a table, evaluated in float64 a few times per frame."""

import warp as wp

from warpsim.kernels.elementary import sin64
from warpsim.kernels.expressions import Instruction, evaluate_program

CONSTANT, KEYFRAMES, SINE, FORMULA = range(4)
TWO_PI64 = wp.constant(wp.float64(6.283185307179586))


@wp.struct
class Signal:
    kind: int  # CONSTANT … FORMULA
    begin: int  # first knot or instruction
    end: int  # one past the last
    mean: wp.float64  # the value of a constant; the mean of a sine
    amplitude: wp.float64
    period: wp.float64  # [s]
    phase: wp.float64  # [rad]


@wp.struct
class Signals:
    rows: wp.array[Signal]
    knots: wp.array[wp.vec2d]  # (time [s], value), times rising
    program: wp.array[Instruction]


@wp.func
def sample_keyframes(knots: wp.array[wp.vec2d], begin: int, end: int, t: wp.float64) -> wp.float64:
    """Return the piecewise linear curve through the knots, held constant outside them."""
    k = int(begin)
    while k < end and knots[k][0] <= t:
        k = k + 1
    if k == begin:
        return knots[begin][1]
    if k == end:
        return knots[end - 1][1]
    a = knots[k - 1]
    b = knots[k]
    return a[1] + (b[1] - a[1]) * ((t - a[0]) / (b[0] - a[0]))


@wp.func(inline=False)
def sample_signal(signals: Signals, index: int, t: wp.float64) -> wp.float64:
    """Return the value of one signal at time t [s]."""
    s = signals.rows[index]
    if s.kind == KEYFRAMES:
        return sample_keyframes(signals.knots, s.begin, s.end, t)
    elif s.kind == SINE:
        return s.mean + s.amplitude * sin64(TWO_PI64 * (t / s.period) + s.phase)
    elif s.kind == FORMULA:
        return evaluate_program(signals.program, s.begin, s.end, wp.vec3d(), t)  # a strength has no place: the parser sees to it
    return s.mean
