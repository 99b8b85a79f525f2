"""Finds the bracket or quote that was not closed. YAML's parser notices it lines later, where something else does not fit."""

import re

_BLOCK_TEXT = re.compile(r"(?:^|[\s:-])[|>][-+0-9]*\s*(?:#.*)?$")
_CLOSING = {"]": "[", "}": "{"}


def find_unclosed(lines: tuple[str, ...], until: int) -> tuple[int, int, str] | None:
    """Return line, column (both from 0) and sign of the bracket or quote left open before line `until`, where the parser gave up."""
    opened: list[tuple[int, int, str]] = []
    quote: tuple[int, int, str] | None = None
    text_indent: int | None = None
    for number, line in enumerate(lines[: until + 1]):
        indent = len(line) - len(line.lstrip(" "))
        if quote is None and line.strip() and not line.lstrip().startswith("#"):
            if text_indent is not None and indent > text_indent:
                continue
            text_indent = None
            if opened and indent <= _indent(lines[opened[0][0]]):
                return opened[-1]  # this line begins a new entry, so what is open should have ended before
            if not opened and _BLOCK_TEXT.search(line):
                text_indent = indent
        ended, quote, wrong = _scan(number, line, opened, quote)
        if wrong:
            return wrong
        if ended is not None and number == until:
            return ended
    return quote or (opened[-1] if opened and opened[-1][0] < until else None)


def _indent(line: str) -> int:
    return len(line) - len(line.lstrip(" "))


def _scan(number: int, line: str, opened: list, quote: tuple | None) -> tuple[tuple | None, tuple | None, tuple | None]:
    """Follow brackets and quotes through one line: (quote of an earlier line that ends here, quote still open, bracket closed wrongly)."""
    ended = None
    before = " "
    skip = False
    for column, sign in enumerate(line):
        if skip:
            skip = False
        elif quote:
            if sign == "\\" and quote[2] == '"':
                skip = True
            elif sign == quote[2]:
                ended = quote if quote[0] < number else ended
                quote = None
        elif sign == "#" and before.isspace():
            break
        elif sign in "\"'" and (before.isspace() or before in "[{,:"):
            quote = (number, column, sign)
        elif sign in "[{" and (opened or before.isspace()):
            opened.append((number, column, sign))
        elif sign in "]}" and opened:
            if opened[-1][2] != _CLOSING[sign]:
                return None, None, opened[-1]
            opened.pop()
        before = sign
    return ended, quote, None
