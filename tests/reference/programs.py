"""Twin of kernels/expressions.py: the stack machine over postfix programs, with Python's own functions."""

import math

from warpsim.scene.expressions import OPERATIONS as ARITY


def power(x: float, y: float) -> float:
    """Return x^y; not a number where it is not real, infinite where IEEE's is."""
    if x == 0.0 and y < 0.0:
        return math.inf
    try:
        return math.pow(x, y)
    except ValueError:
        return math.nan


def smoothstep(a: float, b: float, x: float) -> float:
    s = min(max((x - a) / (b - a), 0.0), 1.0) if a != b else math.nan
    return s * s * (3.0 - 2.0 * s)


OPERATIONS = {
    "add": lambda x, y: x + y,
    "subtract": lambda x, y: x - y,
    "multiply": lambda x, y: x * y,
    "divide": lambda x, y: x / y if y else math.nan,
    "power": power,
    "negate": lambda x: -x,
    "sin": math.sin,
    "cos": math.cos,
    "tan": math.tan,
    "exp": lambda x: math.exp(min(x, 709.0)),
    "log": lambda x: math.log(x) if x > 0.0 else math.nan,
    "sqrt": lambda x: math.sqrt(x) if x >= 0.0 else math.nan,
    "abs": abs,
    "floor": lambda x: float(math.floor(x)),
    "min": min,
    "max": max,
    "tanh": math.tanh,
    "step": lambda edge, x: 0.0 if x < edge else 1.0,
    "smoothstep": smoothstep,
    "clamp": lambda x, low, high: min(max(x, low), high),
    "mod": lambda a, b: a - b * math.floor(a / b) if b else math.nan,
}


def evaluate(program, t: float, place=(0.0, 0.0, 0.0)) -> float:
    """Return the value of [(operation name, operand), …] at time t [s] and a place [m]."""
    variables = {"t": t, **dict(zip("xyz", map(float, place), strict=True))}
    stack: list[float] = []
    for name, operand in program:
        if ARITY[name] == 0:
            stack.append(variables.get(name, operand))
            continue
        arguments = stack[-ARITY[name] :]
        del stack[-ARITY[name] :]
        stack.append(OPERATIONS[name](*arguments))
    return stack[0]
