"""Twin of kernels/muscles.py: how long the springs of a muscle want to be, in float64, from the words of the scene format."""

import math

import numpy as np


def factor(time: float, rest: float = 1.0, activation: float = 1.0, wave: tuple[float, float, float, float] | None = None) -> float:
    """Factor of a rest length; `wave` is its amplitude [1], period [s], way along it in wavelengths [1], phase [rad]."""
    if wave is not None:
        amplitude, period, turns, phase = wave
        rest = 1.0 + amplitude * math.sin(2.0 * math.pi * (time / period - turns) + phase)
    return max(1.0 + max(activation, 0.0) * (rest - 1.0), 0.0)


def forced(time: np.ndarray, r0: float, amplitude: float, omega: float, drive: float) -> np.ndarray:
    """Length of an undamped spring with a mass that starts at r0 at rest, its rest length being r0 (1 + A sin Ωt) [m].

    x'' = −ω² (x − r0 (1 + A sin Ωt)): the forced oscillation of amplitude A r0 ω²/(ω² − Ω²), and the free one that cancels its speed at 0.
    """
    swing = amplitude * r0 * omega**2 / (omega**2 - drive**2)
    return r0 + swing * (np.sin(drive * time) - drive / omega * np.sin(omega * time))
