"""YAML 1.2 text to a tree of nodes: PyYAML's C parser for the syntax, own rules for everything it leaves open.

The core schema of YAML 1.2 (1e-3 is a number, `no` is text, 010 is ten), one document, no tags, no duplicate keys, nothing non-finite, and
limits that hold before anything is built: libyaml's own composer recurses per level and crashes on 100 kB of "[".
"""

import math
import re

import yaml

from warpsim.scene.nodes import Mapping, Node, Scalar, Sequence, Source
from warpsim.scene.problems import Problem, SceneError
from warpsim.scene.yaml_mistakes import explain

LARGEST_FILE = 1 << 20
DEEPEST = 64
MOST_NODES = 200_000
MOST_ENTRIES = 10_000
MOST_ALIASES = 1000
MOST_DIGITS = 40

_PARSER = getattr(yaml, "CSafeLoader", yaml.SafeLoader)
_LINE_BREAK = re.compile(r"\r\n|\r|\n")
_UNWANTED = re.compile("[\x00-\x08\x0b\x0c\x0e-\x1f\x7f-\x9f\u2028\u2029\ufeff\ufffe\uffff\ud800-\udfff]")
_UNWANTED_VALUE = re.compile("[\x00-\x08\x0b-\x1f\x7f-\x9f\ud800-\udfff]")
_INTEGER = re.compile(r"[-+]?[0-9]+\Z")
_OTHER_BASE = re.compile(r"0o[0-7]+\Z|0x[0-9a-fA-F]+\Z")
_FLOAT = re.compile(r"[-+]?(?:\.[0-9]+|[0-9]+(?:\.[0-9]*)?)(?:[eE][-+]?[0-9]+)?\Z")
_NOT_FINITE = re.compile(r"[-+]?\.(?:inf|Inf|INF)\Z|\.(?:nan|NaN|NAN)\Z")
_WORDS = {
    word: value
    for value, forms in ((None, "~ null Null NULL"), (True, "true True TRUE"), (False, "false False FALSE"))
    for word in forms.split()
}
_WORDS[""] = None

SCALAR_FORMS = {
    "int": re.compile(f"{_INTEGER.pattern}|{_OTHER_BASE.pattern}"),
    "float": re.compile(f"{_FLOAT.pattern}|{_NOT_FINITE.pattern}"),
    "bool": re.compile(r"(?:true|True|TRUE|false|False|FALSE)\Z"),
    "null": re.compile(r"(?:~|null|Null|NULL|)\Z"),
}
"""How the plain scalars of YAML 1.2 that are no text look."""


def decode(raw: bytes, name: str) -> str:
    """Return the text of a file's bytes. Raises SceneError with line and column for anything that is not UTF-8 text of at most 1 MiB."""
    if len(raw) > LARGEST_FILE:
        raise SceneError([Problem(f"the file is larger than {LARGEST_FILE >> 20} MiB; a scene is text, not data", name, 1, 1)])
    if raw[:2] in (b"\xff\xfe", b"\xfe\xff"):
        raise SceneError([Problem("the file is UTF-16; save it as UTF-8", name, 1, 1)])
    try:
        text = raw.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        before = raw[: error.start].decode("utf-8-sig", "replace")
        lines = tuple(_LINE_BREAK.split(raw.decode("utf-8-sig", "replace")))
        behind = _LINE_BREAK.split(before)
        message = f"byte 0x{raw[error.start]:02x} is not UTF-8 text; save the file as UTF-8"
        raise SceneError([Source(name, lines).problem(len(behind) - 1, len(behind[-1]), message)]) from None
    return text


def parse(text: str, name: str) -> tuple[Node, list[Problem]]:
    """Parse one YAML document into nodes, with the mistakes that did not stop it (duplicate keys, tags, …).

    Raises SceneError for syntax errors and exceeded limits.
    """
    source = Source(name, tuple(_LINE_BREAK.split(text)))
    if len(text) > LARGEST_FILE or len(text.encode("utf-8", "surrogatepass")) > LARGEST_FILE:
        raise SceneError([source.problem(0, 0, f"the text is larger than {LARGEST_FILE >> 20} MiB")])
    unwanted = _UNWANTED.search(text)
    if unwanted:
        before = _LINE_BREAK.split(text[: unwanted.start()])
        code = ord(unwanted.group())
        what = "a NUL byte" if code == 0 else f"the invisible character U+{code:04X}"
        raise SceneError([source.problem(len(before) - 1, len(before[-1]), f"{what} does not belong in a scene; delete it")])
    tree = _Tree(source)
    parser = _PARSER(text)
    try:
        while not tree.finished:
            tree.take(parser.get_event())
    except yaml.YAMLError as error:
        raise SceneError([*tree.problems, explain(error, source)]) from None
    finally:
        parser.dispose()
    return tree.root, tree.problems


class _Tree:
    """Builds nodes from the parser's events, one by one, and stops at the first exceeded limit."""

    def __init__(self, source: Source):
        self.source = source
        self.problems: list[Problem] = []
        self.root: Node | None = None
        self.finished = False
        self._open: list[tuple[Sequence | Mapping, str | None]] = []
        self._keys: list[Scalar | None] = []
        self._anchors: dict[str, Node] = {}
        self._unfinished: set[str] = set()
        self._documents = self._aliases = self._events = self._expanded = 0

    def take(self, event) -> None:
        self._events += 1
        if self._events > MOST_NODES:
            self._stop(event, f"more than {MOST_NODES} values; a scene is text, not data")
        if isinstance(event, yaml.ScalarEvent):
            self._place(self._scalar(event), event.anchor)
        elif isinstance(event, yaml.AliasEvent):
            self._place_alias(event)
        elif isinstance(event, yaml.CollectionStartEvent):
            self._begin(event)
        elif isinstance(event, yaml.CollectionEndEvent):
            self._end()
        elif isinstance(event, yaml.DocumentStartEvent):
            self._documents += 1
            if self._documents > 1:
                self._stop(event, 'a second document begins here ("---"); a scene file holds one')
            if event.tags:
                self._stop(event, "%TAG directives are refused: a scene is plain data")
        elif isinstance(event, yaml.StreamEndEvent):
            self.finished = True
            if self.root is None:
                self._stop(event, 'the file is empty; a scene needs at least "name: …"', line=0)

    def _stop(self, event, message: str, line: int | None = None) -> None:
        mark = event.start_mark
        at = (mark.line, mark.column) if line is None else (line, 0)
        raise SceneError([*self.problems, self.source.problem(*at, message)])

    def _note(self, node: Node, message: str, suggestion: str | None = None) -> None:
        node.reported = True
        self.problems.append(node.problem(message, suggestion=suggestion))
        if len(self.problems) >= 1000:
            raise SceneError(self.problems)

    def _where(self, event) -> dict:
        start, end = event.start_mark, event.end_mark
        width = (
            end.column - start.column
            if end.line == start.line
            else len(self.source.lines[min(start.line, len(self.source.lines) - 1)]) - start.column
        )
        return {"source": self.source, "line": start.line, "column": start.column, "width": max(1, width)}

    def _begin(self, event) -> None:
        if len(self._open) >= DEEPEST:
            self._stop(event, f"nested deeper than {DEEPEST} levels")
        kind = Mapping if isinstance(event, yaml.MappingStartEvent) else Sequence
        node = kind(**self._where(event))
        if event.tag is not None:
            self._note(node, f"tags such as {event.tag} are refused: a scene is plain data")
        if self._open and isinstance(self._open[-1][0], Mapping) and self._keys[-1] is None:
            self._stop(event, "a key must be one word, not a list or mapping")
        self._open.append((node, event.anchor))
        self._keys.append(None)
        if event.anchor:
            self._anchors[event.anchor] = node
            self._unfinished.add(event.anchor)

    def _end(self) -> None:
        node, anchor = self._open.pop()
        self._keys.pop()
        if anchor:
            self._unfinished.discard(anchor)
        children = node.items if isinstance(node, Sequence) else [value for _, value in node.entries.values()]
        node.size += sum(child.size for child in children)
        node.height += max((child.height for child in children), default=0)
        self._place(node, None)

    def _place_alias(self, event) -> None:
        self._aliases += 1
        if self._aliases > MOST_ALIASES:
            self._stop(event, f"more than {MOST_ALIASES} aliases")
        if event.anchor in self._unfinished:
            self._stop(event, f"*{event.anchor} stands inside of what it repeats")
        node = self._anchors.get(event.anchor)
        if node is None:
            at = Scalar(**self._where(event))
            known = ", ".join(f"*{name}" for name in list(self._anchors)[:8]) or "none"
            self._note(at, f"nothing is marked &{event.anchor} above (known: {known}); for text that begins with * use quotes")
            node = at
        if len(self._open) + node.height > DEEPEST:
            self._stop(event, f"nested deeper than {DEEPEST} levels once *{event.anchor} is spelled out")
        self._expanded += node.size
        if self._expanded > MOST_NODES:
            self._stop(event, f"more than {MOST_NODES} values once the aliases are spelled out")
        self._place(node, None)

    def _place(self, node: Node, anchor: str | None) -> None:
        if anchor:
            self._anchors[anchor] = node
        if not self._open:
            self.root = node
            return
        parent = self._open[-1][0]
        if isinstance(parent, Sequence):
            self._count(parent, len(parent.items), node)
            parent.items.append(node)
        elif self._keys[-1] is None:
            self._key(node)
        else:
            key = self._keys[-1]
            self._keys[-1] = None
            earlier = parent.entries.get(key.text)
            if earlier is not None:
                self._note(key, f'"{key.text}" is given twice (first in line {earlier[0].line + 1}); keep one')
            else:
                self._count(parent, len(parent.entries), key)
                parent.entries[key.text] = (key, node)

    def _count(self, parent: Node, count: int, node: Node) -> None:
        if count >= MOST_ENTRIES:
            message = f"more than {MOST_ENTRIES} entries in what begins in line {parent.line + 1}; a scene is text, not data"
            raise SceneError([*self.problems, node.problem(message)])

    def _key(self, node: Node) -> None:
        if not isinstance(node, Scalar):
            raise SceneError([*self.problems, node.problem("a key must be one word, not a list or mapping")])
        if node.text == "<<" and not node.quoted:
            self._note(node, 'merge keys ("<<") are not part of YAML 1.2; repeat the keys')
        self._keys[-1] = node

    def _scalar(self, event) -> Scalar:
        quoted = bool(event.style)
        node = Scalar(**self._where(event), value=event.value, text=event.value, quoted=quoted)
        if event.tag is not None:
            self._note(node, f"tags such as {event.tag} are refused: a scene is plain data")
        elif quoted:
            if _UNWANTED_VALUE.search(event.value):
                self._note(node, "the text contains an invisible control character")
        else:
            self._resolve(node)
        return node

    def _resolve(self, node: Scalar) -> None:
        text = node.text
        if text in _WORDS:
            node.value = _WORDS[text]
        elif len(text) > MOST_DIGITS and (_INTEGER.match(text) or _OTHER_BASE.match(text)):
            self._note(node, f"a number of {len(text)} digits is too large")
            node.value = 1
        elif _INTEGER.match(text):
            node.value = int(text)
        elif _OTHER_BASE.match(text):
            node.value = int(text[2:], 8 if text[1] == "o" else 16)
        elif _FLOAT.match(text):
            node.value = float(text)
            if math.isinf(node.value):
                self._note(node, "the number is too large (the largest is about 1e308)")
                node.value = 1.0
        elif _NOT_FINITE.match(text):
            self._note(node, f"{text} is not a finite number")
            node.value = 1.0
