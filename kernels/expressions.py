"""Formulas of t, and of a place x, y, z, as postfix programs, run by a small stack machine on the device: no eval, no generated code.

The scene's parser (warpsim/scene/expressions.py) writes the programs; a test holds its names equal to these.
"""

import warp as wp

from warpsim.kernels.elementary import cos64, exp64, log64, power64, sin64

ARITIES = {
    **dict.fromkeys(("constant", "t", "x", "y", "z"), 0),
    **dict.fromkeys(("add", "subtract", "multiply", "divide", "power"), 2),
    **dict.fromkeys(("negate", "sin", "cos", "tan", "exp", "log", "sqrt", "abs", "floor"), 1),
    **{"min": 2, "max": 2, "tanh": 1, "step": 2, "smoothstep": 3, "clamp": 3, "mod": 2},
}
OPERATIONS = {name: number for number, name in enumerate(ARITIES)}  # what an Instruction's operation holds

CONSTANT, T, X, Y, Z, ADD, SUBTRACT, MULTIPLY, DIVIDE, POWER, NEGATE, SIN, COS, TAN, EXP, LOG, SQRT = range(17)
ABS, FLOOR, MIN, MAX, TANH, STEP, SMOOTHSTEP, CLAMP, MOD = range(17, 26)
STACK_DEPTH = wp.constant(16)
Stack = wp.types.vector(length=16, dtype=wp.float64)


@wp.struct
class Instruction:
    operation: int  # place in ARITIES
    operand: wp.float64  # the value of a constant


@wp.func(inline=True)
def tanh64(x: wp.float64) -> wp.float64:
    """Return tanh x = 1 − 2/(e^{2x} + 1)."""
    return wp.float64(1.0) - wp.float64(2.0) / (exp64(wp.float64(2.0) * x) + wp.float64(1.0))


@wp.func(inline=True)
def smoothstep64(a: wp.float64, b: wp.float64, x: wp.float64) -> wp.float64:
    """Return 3s² − 2s³ with s = (x − a)/(b − a) held to [0, 1]."""
    s = (x - a) / (b - a)
    if s == s:  # a clamped NaN would be a number
        s = wp.min(wp.max(s, wp.float64(0.0)), wp.float64(1.0))
    return s * s * (wp.float64(3.0) - wp.float64(2.0) * s)


@wp.func(inline=True)
def apply_unary(operation: int, x: wp.float64) -> wp.float64:
    """Return the operation of one operand."""
    if operation == NEGATE:
        return -x
    elif operation == SIN:
        return sin64(x)
    elif operation == COS:
        return cos64(x)
    elif operation == TAN:
        return sin64(x) / cos64(x)
    elif operation == EXP:
        return exp64(x)
    elif operation == LOG:
        return log64(x)
    elif operation == SQRT:
        return wp.sqrt(x)
    elif operation == ABS:
        return wp.abs(x)
    elif operation == FLOOR:
        return wp.floor(x)
    return tanh64(x)


@wp.func(inline=True)
def apply_binary(operation: int, x: wp.float64, y: wp.float64) -> wp.float64:
    """Return the operation of two operands; `mod` has the sign of y, `step` is 1 from its first operand on."""
    if operation == ADD:
        return x + y
    elif operation == SUBTRACT:
        return x - y
    elif operation == MULTIPLY:
        return x * y
    elif operation == DIVIDE:
        return x / y
    elif operation == POWER:
        return power64(x, y)
    elif operation == MIN:
        return wp.min(x, y)
    elif operation == MAX:
        return wp.max(x, y)
    elif operation == MOD:
        return x - y * wp.floor(x / y)
    return wp.where(y < x, wp.float64(0.0), wp.float64(1.0))


@wp.func(inline=True)
def apply_ternary(operation: int, x: wp.float64, y: wp.float64, z: wp.float64) -> wp.float64:
    """Return the operation of three operands; `clamp` holds the first between the others."""
    if operation == CLAMP:
        return wp.min(wp.max(x, y), z)
    return smoothstep64(x, y, z)


@wp.func(inline=False)
def evaluate_program(program: wp.array[Instruction], begin: int, end: int, place: wp.vec3d, t: wp.float64) -> wp.float64:
    """Return the value of the postfix program program[begin:end] at a place [m] and time t [s]."""
    stack = Stack()
    top = int(-1)
    for k in range(begin, end):
        operation = program[k].operation
        if operation <= Z:
            top = top + 1
            stack[top] = program[k].operand
            if operation == T:
                stack[top] = t
            elif operation >= X:
                stack[top] = place[operation - X]
        elif operation == SMOOTHSTEP or operation == CLAMP:
            top = top - 2
            stack[top] = apply_ternary(operation, stack[top], stack[top + 1], stack[top + 2])
        elif operation == NEGATE or (operation >= SIN and operation <= FLOOR) or operation == TANH:
            stack[top] = apply_unary(operation, stack[top])
        else:
            top = top - 1
            stack[top] = apply_binary(operation, stack[top], stack[top + 1])
    return stack[0]
