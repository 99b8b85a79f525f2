"""Strengths and expectations as numbers, in float64 on the host: nothing here goes through the kernels."""

import math
from collections.abc import Callable

import numpy as np

from warpsim.scene.expressions import OPERATIONS
from warpsim.scene.strengths import Formula, Keyframes, Sine


def _power(x: float, y: float) -> float:
    try:
        return math.pow(x, y)
    except (ValueError, OverflowError):
        return math.nan


def _smoothstep(a: float, b: float, x: float) -> float:
    s = min(max((x - a) / (b - a), 0.0), 1.0) if a != b else math.nan
    return s * s * (3.0 - 2.0 * s)


_MEANING: dict[str, Callable[..., float]] = {
    "add": lambda x, y: x + y,
    "subtract": lambda x, y: x - y,
    "multiply": lambda x, y: x * y,
    "divide": lambda x, y: x / y if y else math.nan,
    "power": _power,
    "negate": lambda x: -x,
    "sin": math.sin,
    "cos": math.cos,
    "tan": math.tan,
    "exp": lambda x: math.exp(min(x, 700.0)),
    "log": lambda x: math.log(x) if x > 0.0 else math.nan,
    "sqrt": lambda x: math.sqrt(x) if x >= 0.0 else math.nan,
    "abs": abs,
    "floor": lambda x: float(np.floor(x)),
    "min": min,
    "max": max,
    "tanh": math.tanh,
    "step": lambda edge, x: 0.0 if x < edge else 1.0,
    "smoothstep": _smoothstep,
    "clamp": lambda x, low, high: min(max(x, low), high),
    "mod": lambda a, b: a - b * float(np.floor(a / b)) if b else math.nan,
}


def value_at(strength, time: float) -> float:
    """Return a strength of the scene, a number, keyframes, a sine or an expression, at a time [s]."""
    if isinstance(strength, Keyframes):
        times, values = zip(*strength.keyframes, strict=True)
        return float(np.interp(time, times, values))
    if isinstance(strength, Sine):
        wave = strength.sine
        return wave.mean + wave.amplitude * math.sin(2.0 * math.pi * time / wave.period + wave.phase)
    if isinstance(strength, Formula):
        return _evaluated(strength.program, {"t": time})
    return float(strength)


def expected_at(expect, time: float) -> float | np.ndarray | None:
    """Return what an oracle expects: a number, a vector (3,), or None where the law says it."""
    if isinstance(expect, tuple):
        return np.array([value_at(component, time) for component in expect])
    return None if expect is None else value_at(expect, time)


def _evaluated(program: tuple[tuple[str, float], ...], variables: dict[str, float]) -> float:
    """Return the value of a postfix program; what is not defined is not a number."""
    stack: list[float] = []
    for name, operand in program:
        if name == "constant" or name in variables:
            stack.append(operand if name == "constant" else variables[name])
            continue
        count = OPERATIONS[name]
        arguments = stack[-count:]
        del stack[-count:]
        try:
            stack.append(_MEANING[name](*arguments))
        except (ValueError, OverflowError):  # of a sine without bound, say
            stack.append(math.nan)
    return stack[0]
