"""Expressions: whatever tree is printed is parsed back to what it means; mistakes name their column."""

import math
from dataclasses import dataclass

import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from tests.reference.programs import evaluate
from warpsim.scene import OPERATIONS
from warpsim.scene.expressions import DEEPEST_STACK, FUNCTIONS, LONGEST_PROGRAM, ExpressionError, compile_expression

SIGNS = {"add": "+", "subtract": "-", "multiply": "*", "divide": "/", "power": "^"}
TIGHTNESS = {"add": 1, "subtract": 1, "multiply": 2, "divide": 2, "negate": 3, "power": 4}


@dataclass(frozen=True)
class Tree:
    """An expression as a tree, the third opinion beside parser and interpreter."""

    operation: str
    parts: tuple["Tree", ...] = ()
    operand: float = 0.0

    def text(self, outer: int = 0, wide: bool = False) -> str:
        """Print with the fewest parentheses that keep the meaning (or, `wide`, with all)."""
        if self.operation == "constant":
            return repr(self.operand)
        if self.operation == "t":
            return "t"
        if self.operation in FUNCTIONS:
            return f"{self.operation}({', '.join(part.text(0, wide) for part in self.parts)})"
        own = TIGHTNESS[self.operation]
        if self.operation == "negate":
            text = f"-{self.parts[0].text(own, wide)}"
        elif self.operation == "power":
            # The base must be an atom, the exponent may be signed or another power.
            text = f"{self.parts[0].text(5, wide)}^{self.parts[1].text(3, wide)}"
        else:
            text = f"{self.parts[0].text(own, wide)} {SIGNS[self.operation]} {self.parts[1].text(own + 1, wide)}"
        return f"({text})" if wide or own < outer else text

    def value(self, t: float) -> float:
        """Evaluate by recursion on the tree with Python's own arithmetic. Raises ArithmeticError where a part is not a finite number."""
        if self.operation == "constant":
            return self.operand
        if self.operation == "t":
            return t
        try:
            value = _PYTHON[self.operation](*(part.value(t) for part in self.parts))
        except (ValueError, OverflowError, ZeroDivisionError) as error:
            raise ArithmeticError from error
        if isinstance(value, complex) or not math.isfinite(value):
            raise ArithmeticError
        return float(value)


_PYTHON = {
    "add": lambda a, b: a + b,
    "subtract": lambda a, b: a - b,
    "multiply": lambda a, b: a * b,
    "divide": lambda a, b: a / b,
    "power": lambda a, b: a**b,
    "negate": lambda a: -a,
    "min": min,
    "max": max,
    "abs": abs,
    "step": lambda edge, x: 0.0 if x < edge else 1.0,
    "clamp": lambda x, low, high: min(max(x, low), high),
    "floor": math.floor,
    "sqrt": math.sqrt,
    "sin": math.sin,
    "cos": math.cos,
    "tanh": math.tanh,
    "mod": lambda a, b: a - b * math.floor(a / b),
}

NUMBERS = st.one_of(st.floats(0.0, 1e3, allow_nan=False).map(lambda x: round(x, 6)), st.integers(0, 9).map(float))
LEAVES = st.one_of(st.just(Tree("t")), NUMBERS.map(lambda x: Tree("constant", (), x)))


def _grow(smaller):
    def node(name):
        return st.tuples(*[smaller] * OPERATIONS[name]).map(lambda parts: Tree(name, parts))

    return st.sampled_from(sorted(_PYTHON)).flatmap(node)


TREES = st.recursive(LEAVES, _grow, max_leaves=10)


@settings(max_examples=400, deadline=None)
@given(tree=TREES, t=st.floats(-20, 20), wide=st.booleans())
def test_printed_trees_mean_the_same(tree, t, wide):
    try:
        expected = tree.value(t)
    except ArithmeticError:
        assume(False)
    assert evaluate(compile_expression(tree.text(wide=wide)), t) == expected


@settings(max_examples=200, deadline=None)
@given(tree=TREES, wide=st.booleans())
def test_postfix_is_the_tree_read_from_the_leaves(tree, wide):
    def postfix(node):
        return [instruction for part in node.parts for instruction in postfix(part)] + [(node.operation, node.operand)]

    assert list(compile_expression(tree.text(wide=wide))) == postfix(tree)


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("-2^2", -4.0),
        ("2^3^2", 512.0),
        ("2**-1", 0.5),
        ("1 - 2 - 3", -4.0),
        ("8/4/2", 1.0),
        ("--3", 3.0),
        ("+3", 3.0),
        ("2*-3", -6.0),
        ("1e-3", 1e-3),
        (".5 + 1.", 1.5),
        ("pi", math.pi),
        ("log(e)", 1.0),
        ("mod(-1, 3)", 2.0),
        ("clamp(5, 0, 1)", 1.0),
        ("step(1, 1)", 1.0),
        ("smoothstep(0, 2, 1)", 0.5),
        ("max(1, min(2, 3))", 2.0),
        ("tan(0)", 0.0),
        ("exp(0)", 1.0),
    ],
)
def test_rules_of_precedence(text, value):
    assert evaluate(compile_expression(text), 0.0) == pytest.approx(value, rel=1e-15)


@pytest.mark.parametrize(
    ("text", "offset", "suggestion", "words"),
    [
        ("2*sn(t)", 2, "sin", "unknown function"),
        ("2t", 1, "2*t", "expected an operation"),
        ("sin t", 0, None, "is a function"),
        ("sin(t", 5, None, 'missing ")" at the end'),
        ("(1 + 2", 6, None, "opened at character 1"),
        ("1 +", 3, None, "ends where"),
        ("", 0, None, "ends where"),
        ("1 + * 2", 4, None, "expected a number"),
        ("max(1)", 0, None, "takes 2 values, got 1"),
        ("sin(1, 2)", 0, None, "takes 1 value, got 2"),
        ("sin()", 0, None, "takes 1 value, got 0"),
        ("1)", 1, None, "without an opening"),
        ("time", 0, "t", "unknown name"),
        ("x + 1", 0, "t", "unknown name"),
        ("PI", 0, "pi", "unknown name"),
        ("1 $ 2", 2, None, "has no meaning"),
        ("__import__('os')", 0, None, "has no meaning"),
        ("1e999", 0, None, "too large"),
        ("t.real", 1, None, "has no meaning"),
    ],
)
def test_mistakes_name_their_column(text, offset, suggestion, words):
    with pytest.raises(ExpressionError) as error:
        compile_expression(text)
    assert words in error.value.message
    assert suggestion is None or error.value.suggestion == suggestion
    if "os" not in text:
        assert error.value.offset == offset


def test_limits():
    assert len(compile_expression("+".join(["t"] * 128))) == LONGEST_PROGRAM - 1
    for text, words in (
        ("+".join(["t"] * 130), "too long"),
        ("(" * 100 + "t" + ")" * 100, "nested"),
        ("-" * 100 + "t", "nested"),
        ("^".join(["t"] * 100), "nested|waiting"),
        ("(t+" * DEEPEST_STACK + "t" + ")" * DEEPEST_STACK, "values waiting"),
    ):
        with pytest.raises(ExpressionError, match=words):
            compile_expression(text)
    assert len(compile_expression("(t+" * (DEEPEST_STACK - 1) + "t" + ")" * (DEEPEST_STACK - 1))) == 2 * DEEPEST_STACK - 1


def test_every_operation_is_known_to_the_reference():
    for name, count in OPERATIONS.items():
        program = [("constant", 0.5)] * count + [(name, 0.5)]
        assert math.isfinite(evaluate(program, 1.0)) or name == "smoothstep"  # of equal edges: undefined
    assert set(FUNCTIONS) < set(OPERATIONS)
