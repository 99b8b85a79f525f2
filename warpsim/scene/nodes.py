"""The tree of a YAML text: plain values that know where they stand."""

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import Any

from warpsim.scene.problems import Problem


@dataclass(frozen=True)
class Source:
    """A text with a name: a file, or one `--set` argument."""

    name: str
    lines: tuple[str, ...]

    def problem(self, line: int, column: int, message: str, *, path: str = "", suggestion: str | None = None, width: int = 1) -> Problem:
        """Build a Problem at a line and column that count from 0, kept inside the text."""
        line = max(0, min(line, len(self.lines) - 1))
        text = self.lines[line]
        column = max(0, min(column, len(text)))
        return Problem(message, self.name, line + 1, column + 1, path, suggestion, text, max(1, min(width, len(text) - column)))


@dataclass(eq=False)
class Node:
    """A scalar, a list or a mapping, with the place of its first character (line and column from 0)."""

    source: Source
    line: int
    column: int
    width: int = 1
    size: int = 1
    """Nodes in it, aliases spelled out."""
    height: int = 1
    """Levels in it, aliases spelled out."""
    reported: bool = False
    """Whether a mistake in it has been reported already, so that its stand-in value is not reported again."""

    def problem(self, message: str, *, path: str = "", suggestion: str | None = None, offset: int = 0) -> Problem:
        """Build a Problem that points here."""
        width = self.width if not offset else 1
        return self.source.problem(self.line, self.column + offset, message, path=path, suggestion=suggestion, width=width)

    def data(self) -> Any:
        """The plain Python value."""
        return _data(self, {})


@dataclass(eq=False)
class Scalar(Node):
    """A number, true, false, null or text."""

    value: Any = None
    text: str = ""
    quoted: bool = False
    """Whether it is text by its quotes (or by being a block of lines)."""


@dataclass(eq=False)
class Sequence(Node):
    """A list."""

    items: list[Node] = field(default_factory=list)
    numbers: list[int] | None = None
    """Number of each entry in the text, where entries have been taken out."""

    def number_of(self, index: int) -> int:
        """Return the number that an entry has in the text."""
        return self.numbers[index] if self.numbers else index


@dataclass(eq=False)
class Mapping(Node):
    """Keys, each with its own place, and their values, in the order of the text."""

    entries: dict[str, tuple[Scalar, Node]] = field(default_factory=dict)

    def get(self, key: str) -> Node | None:
        """Return the value of a key, or None."""
        entry = self.entries.get(key)
        return entry[1] if entry else None


def _data(node: Node, known: dict[int, Any]) -> Any:
    if isinstance(node, Scalar):
        return node.value
    if id(node) not in known:
        if isinstance(node, Sequence):
            known[id(node)] = [_data(item, known) for item in node.items]
        else:
            known[id(node)] = {key: _data(value, known) for key, (_, value) in node.entries.items()}
    return known[id(node)]


def edited(root: Node, path: tuple[str | int, ...], change: Callable[[Node], Node | None]) -> Node:
    """Return the tree with the node at a path changed, or taken out where `change` returns None; the given tree stays as it is.

    A path that leads nowhere changes nothing.
    """
    if not path:
        return change(root) or root
    part, rest = path[0], path[1:]
    if isinstance(root, Mapping) and part in root.entries:
        key, value = root.entries[part]
        new = edited(value, rest, change) if rest else change(value)
        if new is value:
            return root
        entries = dict(root.entries)
        if new is None:
            del entries[part]
        else:
            entries[part] = (key, new)
        return replace(root, entries=entries)
    if isinstance(root, Sequence) and isinstance(part, int) and 0 <= part < len(root.items):
        new = edited(root.items[part], rest, change) if rest else change(root.items[part])
        if new is root.items[part]:
            return root
        if new is not None:
            return replace(root, items=[*root.items[:part], new, *root.items[part + 1 :]])
        left = [index for index in range(len(root.items)) if index != part]
        return replace(root, items=[root.items[index] for index in left], numbers=[root.number_of(index) for index in left])
    return root
