"""Expressions of the time t, and in a flow of a place x, y, z: own tokenizer and precedence parser, compiled to a postfix program.

Nothing is ever executed as code.

Grammar, loosest first: sum of products of signed powers; `^` (or `**`) binds tightest and to the right, so -t^2 is -(t^2).
"""

import math
import re
from functools import lru_cache

from warpsim.scene.nearest import nearest

OPERATIONS: dict[str, int] = {
    "constant": 0,
    "t": 0,
    "x": 0,
    "y": 0,
    "z": 0,
    "add": 2,
    "subtract": 2,
    "multiply": 2,
    "divide": 2,
    "power": 2,
    "negate": 1,
    "sin": 1,
    "cos": 1,
    "tan": 1,
    "exp": 1,
    "log": 1,
    "sqrt": 1,
    "abs": 1,
    "floor": 1,
    "min": 2,
    "max": 2,
    "tanh": 1,
    "step": 2,
    "smoothstep": 3,
    "clamp": 3,
    "mod": 2,
}
"""Every operation of a program and how many values it takes from the stack. The kernels number the same names."""

FUNCTIONS: dict[str, str] = {
    "sin": "sin(x), x in radians",
    "cos": "cos(x), x in radians",
    "tan": "tan(x), x in radians",
    "exp": "exp(x), e to the power x",
    "log": "log(x), natural logarithm",
    "sqrt": "sqrt(x), square root",
    "abs": "abs(x), without the sign",
    "floor": "floor(x), rounded down",
    "min": "min(a, b), the smaller",
    "max": "max(a, b), the larger",
    "tanh": "tanh(x), from -1 to 1",
    "step": "step(edge, x), 0 where x < edge, else 1",
    "smoothstep": "smoothstep(a, b, x), 0 below a, 1 above b, smooth between",
    "clamp": "clamp(x, low, high), x kept between low and high",
    "mod": "mod(a, b), a - b floor(a / b)",
}
"""The functions a user may call, with their meaning."""

TIME = ("t",)
PLACE = ("x", "y", "z", "t")
"""What a formula may be of: a strength of the time [s], a flow of a place [m], too."""

CONSTANTS = {"pi": math.pi, "e": math.e}
LONGEST_PROGRAM = 256
DEEPEST_STACK = 16
DEEPEST_NESTING = 40

_TOKEN = re.compile(r"(?P<number>(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][-+]?[0-9]+)?)|(?P<name>[^\W\d]\w*)|(?P<sign>\*\*|[-+*/^(),])")
_SUMS = {"+": "add", "-": "subtract"}
_PRODUCTS = {"*": "multiply", "/": "divide"}
_POWERS = ("^", "**")


class ExpressionError(ValueError):
    """A mistake in an expression: what is wrong, at which character (from 0), and what was probably meant."""

    def __init__(self, message: str, offset: int, suggestion: str | None = None):
        self.message, self.offset, self.suggestion = message, offset, suggestion
        super().__init__(message)


class _Parser:
    """One pass over the tokens; instructions come out in postfix order."""

    def __init__(self, text: str, variables: tuple[str, ...]):
        self.text, self.variables = text, variables
        self.tokens = list(self._tokens())
        self.place = 0
        self.nesting = 0
        self.program: list[tuple[str, float]] = []
        self.depth = 0

    def _tokens(self):
        at = 0
        while at < len(self.text):
            if self.text[at].isspace():
                at += 1
                continue
            match = _TOKEN.match(self.text, at)
            if match is None:
                raise ExpressionError(f'"{self.text[at]}" has no meaning in an expression', at)
            yield match.lastgroup, match.group(), at
            at = match.end()
        yield "end", "", len(self.text.rstrip())

    def _next(self) -> tuple[str, str, int]:
        token = self.tokens[self.place]
        self.place += token[0] != "end"
        return token

    def _sees(self, words) -> bool:
        kind, word, _ = self.tokens[self.place]
        return kind == "sign" and word in words

    def _put(self, name: str, operand: float, offset: int) -> None:
        self.program.append((name, operand))
        self.depth += 1 - OPERATIONS[name]
        if len(self.program) > LONGEST_PROGRAM:
            raise ExpressionError(f"the expression is too long (at most {LONGEST_PROGRAM} numbers, names and operations)", offset)
        if self.depth > DEEPEST_STACK:
            raise ExpressionError(f"the expression keeps more than {DEEPEST_STACK} values waiting; write it in simpler steps", offset)

    def parse(self) -> tuple[tuple[str, float], ...]:
        self._sum()
        kind, word, offset = self.tokens[self.place]
        if kind == "end":
            return tuple(self.program)
        if word in (")", ","):
            raise ExpressionError(f'"{word}" without an opening parenthesis before it', offset)
        before = self.text[:offset].rstrip()
        raise ExpressionError(f'expected an operation such as * before "{word}"', offset, f"{before}*{self.text[offset:]}")

    def _sum(self) -> None:
        self._chain(_SUMS, self._product)

    def _product(self) -> None:
        self._chain(_PRODUCTS, self._signed)

    def _chain(self, words: dict[str, str], operand) -> None:
        operand()
        while self._sees(words):
            _, word, offset = self._next()
            operand()
            self._put(words[word], 0.0, offset)

    def _signed(self) -> None:
        if self._sees("+-"):
            _, word, offset = self._next()
            self._deeper(self._signed, offset)
            if word == "-":
                self._put("negate", 0.0, offset)
        else:
            self._power()

    def _power(self) -> None:
        self._atom()
        if self._sees(_POWERS):
            _, _, offset = self._next()
            self._deeper(self._signed, offset)
            self._put("power", 0.0, offset)

    def _deeper(self, rule, offset: int) -> None:
        self.nesting += 1
        if self.nesting > DEEPEST_NESTING:
            raise ExpressionError(f"nested deeper than {DEEPEST_NESTING}", offset)
        rule()
        self.nesting -= 1

    def _atom(self) -> None:
        kind, word, offset = self._next()
        if kind == "number":
            value = float(word)
            if math.isinf(value):
                raise ExpressionError("the number is too large", offset)
            self._put("constant", value, offset)
        elif kind == "name":
            self._named(word, offset)
        elif word == "(":
            self._deeper(self._sum, offset)
            self._close(offset)
        elif kind == "end":
            raise ExpressionError("the expression ends where a number, a name or a function is expected", offset)
        else:
            raise ExpressionError(f'expected a number, a name or a function before "{word}"', offset)

    def _named(self, word: str, offset: int) -> None:
        if word in FUNCTIONS:
            self._call(word, offset)
        elif word in CONSTANTS:
            self._put("constant", CONSTANTS[word], offset)
        elif word in self.variables:
            self._put(word, 0.0, offset)
        else:
            self._unknown(word, offset)

    def _unknown(self, word: str, offset: int) -> None:
        called = self._sees("(")
        if word in PLACE and not called:
            message = f'unknown name "{word}": a strength varies in t alone; x, y and z are for flows of type expression'
            raise ExpressionError(message, offset, "t")
        allowed = [*FUNCTIONS] if called else [*self.variables, *CONSTANTS, *FUNCTIONS]
        known = ", ".join(FUNCTIONS) if called else f"{', '.join(self.variables)}, pi, e and functions"
        guess = nearest(word, allowed) or ("t" if word.lower() in ("time", "s") and not called else None)
        raise ExpressionError(f'unknown {"function" if called else "name"} "{word}" (known: {known})', offset, guess)

    def _call(self, word: str, offset: int) -> None:
        wanted = OPERATIONS[word]
        if not self._sees("("):
            raise ExpressionError(f'"{word}" is a function: write {FUNCTIONS[word].split(",")[0] if wanted == 1 else word + "(…)"}', offset)
        opening = self._next()[2]
        count = 0
        if not self._sees(")"):
            self._deeper(self._sum, offset)
            count = 1
            while self._sees(","):
                self._next()
                self._deeper(self._sum, offset)
                count += 1
        self._close(opening)
        if count != wanted:
            raise ExpressionError(f"{word} takes {wanted} value{'s' * (wanted != 1)}, got {count}: {FUNCTIONS[word]}", offset)
        self._put(word, 0.0, offset)

    def _close(self, opening: int) -> None:
        kind, word, offset = self._next()
        if word != ")":
            found = f'before "{word}"' if kind != "end" else "at the end"
            raise ExpressionError(f'missing ")" {found} (opened at character {opening + 1})', offset)


@lru_cache(maxsize=1024)
def compile_expression(text: str, variables: tuple[str, ...] = TIME) -> tuple[tuple[str, float], ...]:
    """Compile an expression of t [s], or of other variables, to postfix (operation name, operand).

    Raises ExpressionError with the character where the mistake is. At most 256 instructions, at most 16 values waiting on the stack.
    Source: Dijkstra 1961 (shunting yard), written as recursive descent.
    """
    return _Parser(text, variables).parse()
