"""Muscles: springs whose rest lengths follow the time, all alike or as a wave that travels along them.

Symbols: t time [s], T period [s], φ a phase lag [rad], A amplitude [1]; a rest length is r(t) = r0 f(t) with the factor
f = 1 + a (p − 1 + A sin(2πt/T + φ)), where p is the muscle's own factor in time, 1 of a wave, and a its activation, both strengths.
Factors are worked out in float64, one for each place of a muscle, before the forces of a moment are asked for.
"""

import warp as wp

from warpsim.kernels.elementary import sin64
from warpsim.kernels.signals import TWO_PI64, Signals, sample_signal


@wp.struct
class Drive:
    rest: int  # signal of the factor p; −1: 1
    activation: int  # signal of a
    amplitude: wp.float64  # A of a wave
    period: wp.float64  # T [s]
    lag: wp.float64  # φ at its place [rad]


@wp.struct
class Fibers:
    drive: wp.array[int]  # (fibers): which factor each follows
    spring: wp.array[int]  # (fibers): its spring
    entry: wp.array[wp.vec2i]  # (fibers): where the packed network has it, once for each end
    length: wp.array[float]  # (fibers): r0 [m]


@wp.func
def rest_factor(p: wp.float64, a: wp.float64, amplitude: wp.float64, period: wp.float64, lag: wp.float64, t: wp.float64) -> wp.float64:
    """Return f = 1 + a (p − 1 + A sin(2πt/T + φ)), never below 0.  Source: Tu & Terzopoulos 1994, §3.2."""
    wave = amplitude * sin64(TWO_PI64 * (t / period) + lag)
    return wp.max(wp.float64(1.0) + a * (p - wp.float64(1.0) + wave), wp.float64(0.0))


@wp.kernel(enable_backward=False)
def sample_drives(
    first: int,
    moment: int,
    half: wp.float64,
    start_time: wp.array[wp.float64],
    signals: Signals,
    drives: wp.array[Drive],
    factor_out: wp.array[float],
):
    """Store every factor f at a moment of the frame, counted in halves of a substep [s]."""
    k = first + wp.tid()
    d = drives[k]
    t = start_time[0] + wp.float64(moment) * half
    p = wp.float64(1.0)
    if d.rest >= 0:
        p = sample_signal(signals, d.rest, t)
    a = wp.max(sample_signal(signals, d.activation, t), wp.float64(0.0))
    factor_out[k] = float(rest_factor(p, a, d.amplitude, d.period, d.lag, t))


@wp.kernel(enable_backward=False)
def scatter_lengths(first: int, fibers: Fibers, factor: wp.array[float], table_out: wp.array[float], packed_out: wp.array[float]):
    """Store the rest length r0 f [m] of every fiber wherever it is read: by springs, and by the points at its ends."""
    k = first + wp.tid()
    r = fibers.length[k] * factor[fibers.drive[k]]
    table_out[fibers.spring[k]] = r
    packed_out[fibers.entry[k][0]] = r
    packed_out[fibers.entry[k][1]] = r
