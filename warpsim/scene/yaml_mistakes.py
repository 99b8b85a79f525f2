"""Syntax errors of YAML in plain words, at the place where the mistake was most likely made."""

import yaml

from warpsim.scene.nodes import Source
from warpsim.scene.problems import Problem
from warpsim.scene.unclosed import find_unclosed

_QUOTES = "\"'"

# libyaml's words -> (ours, whether the beginning of the enclosing thing is the likelier place than where the parser gave up).
_WORDS = {
    "mapping values are not allowed in this context": (
        'a second ":" in one line, or wrong indentation; put text that contains ": " in quotes',
        False,
    ),
    "could not find expected ':'": ('expected "key: value"; is a ":" missing, or a quote or bracket not closed?', True),
    "did not find expected key": (
        "expected a key here: align it with the keys of its mapping, and close brackets and quotes before it",
        False,
    ),
    "did not find expected '-' indicator": ('expected "- " here: align it with the entries of its list', False),
    "did not find expected ',' or ']'": ('this "[" is not closed, or a comma is missing in the list', True),
    "did not find expected ',' or '}'": ('this "{" is not closed, or a comma is missing in the mapping', True),
    "found unexpected end of stream": ("this quote is never closed", True),
    "found unexpected document indicator": ("this quote is never closed", True),
    "did not find expected alphabetic or numeric character": (
        'a name is expected after "*" or "&"; put text that begins so in quotes',
        False,
    ),
    "found unknown escape character": (r"unknown escape in double quotes: write \\ for a backslash, or use single quotes", False),
    "did not find expected hexdecimal number": (r"expected hexadecimal digits after \x or \u; write \\ for a backslash", False),
    "found invalid Unicode character escape code": ("the escape is no valid character", False),
    "block sequence entries are not allowed in this context": ('"- " cannot begin a list here; put it on a line of its own', False),
    "block mapping entries are not allowed in this context": ('"? " cannot stand here; put text that begins so in quotes', False),
    "mapping keys are not allowed in this context": ('"? " cannot stand here; put text that begins so in quotes', False),
    "did not find expected node content": ("a value is missing here", False),
    "did not find expected <document start>": ('expected "key: value" here; the file must be one mapping', False),
    "did not find expected comment or line break": (
        'expected the end of the line after "|" or ">"; put text that begins so in quotes',
        False,
    ),
    "found a tab character where an indentation space is expected": ("a tab cannot indent; use spaces", False),
    "found a tab character that violate indentation": ("a tab cannot indent; use spaces", False),
    "found a tab character that violates indentation": ("a tab cannot indent; use spaces", False),
}


def explain(error: yaml.YAMLError, source: Source) -> Problem:
    """Turn the parser's error into a Problem inside the text."""
    problem = getattr(error, "problem", None) or str(error).splitlines()[0]
    mark = getattr(error, "problem_mark", None)
    context = getattr(error, "context_mark", None)
    unclosed = find_unclosed(source.lines, mark.line) if mark is not None else None
    if unclosed:
        line, column, sign = unclosed
        return source.problem(line, column, "this quote is not closed" if sign in _QUOTES else f'this "{sign}" is not closed')
    if problem == "found character that cannot start any token":
        return _at(source, mark, _cannot_start(source, mark))
    message, begins = _WORDS.get(problem, (f"this is not YAML: {problem}", False))
    if problem == "did not find expected key" and "flow" in (error.context or ""):
        begins = True
    return _at(source, context if begins and context is not None else mark, message)


def _at(source: Source, mark, message: str) -> Problem:
    if mark is None:
        return source.problem(0, 0, message)
    line, column = mark.line, mark.column
    if line >= len(source.lines) or (not source.lines[line].strip() and line == len(source.lines) - 1):
        # The parser gave up at the end of the text: point at its last words.
        line = max((k for k, text in enumerate(source.lines) if text.strip()), default=0)
        column = len(source.lines[line].rstrip())
    return source.problem(line, column, message)


def _cannot_start(source: Source, mark) -> str:
    text = source.lines[mark.line] if mark.line < len(source.lines) else ""
    found = text[mark.column : mark.column + 1]
    if found == "\t":
        return "a tab cannot indent; use spaces"
    return f'"{found}" cannot begin a value; put it in quotes' if found else "a value cannot begin here"
