"""Formulas on a block of particles: each instruction of a program at once for all of them, so that the interpreter's work is shared.

The values are those of evaluate_program (expressions.py) to the bit: the same functions in the same order, one particle beside the other.
"""

from warpsim.kernels.expressions import ARITIES, OPERATIONS, STACK_DEPTH, apply_binary, apply_ternary, apply_unary

BLOCK_FORMULAS = (apply_unary, apply_binary, apply_ternary)

LEAVES = {"constant": "o.operand", "t": "q.time", **{name: f"(double)X[{k}][i] - (double)q.center[{k}]" for k, name in enumerate("xyz")}}
APPLY = {
    1: "$apply_unary(@, T[top][i])",
    2: "$apply_binary(@, T[top][i], T[top + 1][i])",
    3: "$apply_ternary(@, T[top][i], T[top + 1][i], T[top + 2][i])",
}


def instruction_case(name: str) -> str:
    """Write the loop of one operation; its number is a constant there, so that only its own code is left of the function."""
    arity, number = ARITIES[name], str(OPERATIONS[name])
    value = LEAVES[name] if arity == 0 else APPLY[arity].replace("@", number)
    return f"case {number}: top += {1 - arity}; for (int i = 0; i < B; ++i) T[top][i] = {value}; break;\n"


EXPRESSION_BLOCK = f"""{{
    double T[{int(STACK_DEPTH)}][B];
    for (int c = 0; c < 3; ++c) {{
        int top = -1;
        for (int k = q.span[c]; k < q.span[c + 1]; ++k) {{
            const auto o = q.program.data[k];
            switch (o.operation) {{
                {"".join(map(instruction_case, OPERATIONS))}
            }}
        }}
        for (int i = 0; i < B; ++i) U[c][i] += (float)T[0][i];
    }}
}}"""
