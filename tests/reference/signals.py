"""Twin of kernels/signals.py: a strength, as the scene says it, at a time."""

import math

from tests.reference.programs import evaluate
from warpsim.scene.expressions import compile_expression


def keyframes(knots, t: float) -> float:
    if t <= knots[0][0]:
        return knots[0][1]
    for (t0, v0), (t1, v1) in zip(knots, knots[1:], strict=False):
        if t0 <= t < t1:
            return v0 + (v1 - v0) * (t - t0) / (t1 - t0)
    return knots[-1][1]


def sine(wave, t: float) -> float:
    return wave.get("mean", 0.0) + wave["amplitude"] * math.sin(2.0 * math.pi * t / wave["period"] + wave.get("phase", 0.0))


SIGNALS = {
    "keyframes": keyframes,
    "sine": sine,
    "expression": lambda text, t: evaluate(compile_expression(text), t),
}


def sample(strength, t: float) -> float:
    """Return a number, or {keyframes: …}, {sine: …}, {expression: …} at time t [s]."""
    if isinstance(strength, dict):
        ((form, value),) = strength.items()
        return SIGNALS[form](value, t)
    return float(strength)
