"""Mistakes in a scene: where, what, what was probably meant; and the report a user reads."""

from collections.abc import Iterable
from dataclasses import dataclass

WIDEST_LINE = 100
MOST_REPORTED = 50


@dataclass(frozen=True)
class Problem:
    """One mistake. Line and column count from 1; 0 where there is no text (a scene built in Python)."""

    message: str
    file: str = ""
    line: int = 0
    column: int = 0
    path: str = ""
    suggestion: str | None = None
    source_line: str = ""
    width: int = 1
    """Characters the caret underlines."""

    @property
    def headline(self) -> str:
        """`file:line:col: path: what is wrong (did you mean …?)` on one line."""
        place = ":".join(str(part) for part in (self.file, self.line, self.column) if part)
        message = self.message
        if self.suggestion:
            hint = f"did you mean {self.suggestion}?"
            message = f"{message[:-1]}; {hint})" if message.endswith(")") else f"{message} ({hint})"
        return ": ".join(part for part in (place, self.path, message) if part)

    def __str__(self) -> str:
        if not self.source_line.strip():
            return self.headline
        text, column = _trimmed(self.source_line, self.column - 1)
        number = f"{self.line:>5} | "
        width = max(1, min(self.width, len(text) - column))
        return f"{self.headline}\n{number}{text}\n{' ' * (len(number) - 2)}| {' ' * column}{'^' * width}"


def _trimmed(line: str, column: int) -> tuple[str, int]:
    """Cut a long line to what stands round the column; a tab becomes one space so that the caret stays in place."""
    line = line.replace("\t", " ").rstrip()
    column = min(column, len(line))
    if len(line) <= WIDEST_LINE:
        return line, column
    first = max(0, min(column - WIDEST_LINE // 2, len(line) - WIDEST_LINE))
    cut = line[first : first + WIDEST_LINE]
    if first:
        cut = "…" + cut[1:]
    if first + WIDEST_LINE < len(line):
        cut = cut[:-1] + "…"
    return cut, column - first


class SceneError(Exception):
    """A scene cannot be used. `problems` lists every mistake found; str() is the report with source lines and carets."""

    def __init__(self, problems: Iterable[Problem] | str):
        self.problems = [Problem(problems)] if isinstance(problems, str) else list(problems)
        super().__init__(self.problems)

    def __str__(self) -> str:
        shown = "\n".join(map(str, self.problems[:MOST_REPORTED]))
        left = len(self.problems) - MOST_REPORTED
        return f"{shown}\n… and {left} more mistakes" if left > 0 else shown


class UnknownSceneError(SceneError):
    """No shipped scene has that name."""


class UnknownFieldError(SceneError):
    """No scene field has that path."""
