"""`--set path=value`: changes to a scene before it is validated, with mistakes named by the argument they are in."""

from dataclasses import replace

from warpsim.scene.base import ShortSpec, tag
from warpsim.scene.fields import Slot, child_of, forms, has_free_keys, is_list, item_of, keys_of, scene_slot, specs_of, types_of
from warpsim.scene.nearest import listed, nearest
from warpsim.scene.nodes import Mapping, Node, Scalar, Sequence, Source, edited
from warpsim.scene.problems import Problem, SceneError
from warpsim.scene.yaml12 import parse

OVERRIDE = "--set "


def apply_overrides(root: Mapping, overrides: list[str]) -> tuple[Mapping, list[Problem]]:
    """Return the tree with each "path=value" applied, and the mistakes in the paths.

    A path goes by keys, names of list entries, or numbers from 0: `systems.sparks.capacity`, `flow.swirl.circulation`, `flow.2.rate`. The
    value is YAML: `3`, `[0, 1, 0]`, `{mean: 2, spread: 1}`. Messages name the argument: `--set 2:1:5` is column 5 of the second one.
    """
    problems: list[Problem] = []
    for number, text in enumerate(overrides, 1):
        try:
            root = _apply(root, text, f"{OVERRIDE}{number}")
        except SceneError as error:
            problems += error.problems
    return root, problems


def _apply(root: Mapping, text: str, name: str) -> Mapping:
    line = " ".join(text.splitlines()) if len(text) < 100_000 else text[:100] + "…"
    source = Source(name, (line,))
    path, equals, _ = text.partition("=")
    if not equals or not path.strip():
        raise SceneError([source.problem(0, len(line), "expected path=value, e.g. systems.sparks.capacity=1000")])
    value = _value(text, len(path) + 1, source)
    return _Change(source, value).at(root, scene_slot(), path.split("."), 0, [])


def _value(text: str, start: int, source: Source) -> Node:
    """Parse the value; its nodes point into the whole argument."""
    written = text[start:]
    if not written.strip():
        raise SceneError([source.problem(0, start, "a value is missing after the =")])
    # Blanks in place of the path keep the columns right.
    try:
        node, problems = parse(" " * start + written, source.name)
    except SceneError as error:
        problems = error.problems
    if problems:
        raise SceneError([replace(problem, source_line=source.lines[0]) for problem in problems])
    return _in(node, source)


def _in(node: Node, source: Source) -> Node:
    if isinstance(node, Sequence):
        return replace(node, source=source, items=[_in(item, source) for item in node.items])
    if isinstance(node, Mapping):
        entries = {key: (replace(at, source=source), _in(value, source)) for key, (at, value) in node.entries.items()}
        return replace(node, source=source, entries=entries)
    return replace(node, source=source)


class _Change:
    """Walks tree and format side by side and sets the value at the end of the path."""

    def __init__(self, source: Source, value: Node):
        self.source, self.value = source, value

    def at(self, node: Node | None, slot: Slot, parts: list[str], column: int, walked: list[str]) -> Node:
        """Return `node` with the value set below it; `node` is None where the text has nothing yet."""
        if not parts:
            return self.value
        part, rest = parts[0].strip(), parts[1:]
        after = column + len(parts[0]) + 1
        node = self._spelled_out(node, slot, part, column)
        if isinstance(node, Sequence):
            index = self._entry(node, slot, part, column, walked)
            item = self.at(node.items[index], item_of(slot, index) or slot, rest, after, [*walked, part])
            return edited(node, (index,), lambda _: item)
        if isinstance(node, Mapping) and is_list(slot) and not specs_of(slot):  # one entry for a list of one: `burst: {count: 3}`
            slot = item_of(slot) or slot
        if not isinstance(node, Mapping):
            self._fail(part, column, walked, [], "is a plain value and has nothing below it")
        chosen = _chosen(slot, node)
        known = list(node.entries) if has_free_keys(chosen) else [key for spec in specs_of(chosen) for key in keys_of(spec)]
        if part not in known:
            self._fail(part, column, walked, known, "has no key")
        key = Scalar(self.source, 0, column, max(1, len(parts[0])), value=part, text=part)
        below = self.at(node.get(part), child_of(chosen, part) or chosen, rest, after, [*walked, part])
        entries = _without_other_forms(node.entries, chosen, part)
        return replace(node, entries={**entries, part: (entries[part][0] if part in entries else key, below)})

    def _spelled_out(self, node: Node | None, slot: Slot, part: str, column: int) -> Node:
        """Return what the path can go into: a new mapping, the long form of a bare value, a list round a single mapping."""
        if node is None or isinstance(node, Scalar) and node.value is None:
            if is_list(slot) and not specs_of(slot):
                return Sequence(self.source, 0, column)
            return Mapping(self.source, 0, column)
        for spec in specs_of(slot):
            if not issubclass(spec, ShortSpec) or part not in keys_of(spec) or is_list(keys_of(spec)[spec.shorthand]):
                continue
            if spec.is_short(node.data()):
                key = Scalar(node.source, node.line, node.column, value=spec.shorthand, text=spec.shorthand)
                return Mapping(node.source, node.line, node.column, entries={spec.shorthand: (key, node)})
        if isinstance(node, Mapping) and is_list(slot) and part.isdigit():
            return Sequence(node.source, node.line, node.column, items=[node])
        return node

    def _entry(self, node: Sequence, slot: Slot, part: str, column: int, walked: list[str]) -> int:
        if part.isdigit() and len(part) < 10:
            if int(part) < len(node.items):
                return int(part)
            count = len(node.items)
            message = f"{'.'.join(walked)} has no entry {part} (it has {count}, counted from 0)"
            raise SceneError([self._problem(column, part, message, walked)])
        names = {}
        for index, item in enumerate(node.items):
            name = item.get("name") if isinstance(item, Mapping) else None
            if isinstance(name, Scalar) and isinstance(name.value, str):
                names.setdefault(name.value, index)
        if part not in names:
            self._fail(part, column, walked, list(names), "has no entry named")
        return names[part]

    def _fail(self, part: str, column: int, walked: list[str], known: list[str], what: str) -> None:
        where = ".".join(walked) or "a scene"
        allowed = f" (known: {listed(known)})" if known else ""
        message = f'{where} {what} "{part}"{allowed}' if what.startswith("has") else f"{where} {what}"
        raise SceneError([self._problem(column, part, message, walked, nearest(part, known))])

    def _problem(self, column: int, part: str, message: str, walked: list[str], guess: str | None = None) -> Problem:
        path = ".".join([*walked, part])
        return self.source.problem(0, column, message, path=path, suggestion=guess, width=max(1, len(part)))


def _without_other_forms(entries: dict, slot: Slot, key: str) -> dict:
    """Return a mapping's entries beside a key: `circulation.sine.period` where keyframes stood puts a sine in their place."""
    specs = specs_of(slot)
    if len(specs) < 2 or key in entries:
        return entries
    beside = next(keys_of(spec) for spec in specs if key in keys_of(spec))
    return {word: entry for word, entry in entries.items() if word in beside}


def _chosen(slot: Slot, node: Mapping) -> Slot:
    """Return the member of a union that a mapping's type, or else its keys, stands for; the slot itself where that is open."""
    kind = node.get("type")
    if types_of(slot) and isinstance(kind, Scalar):
        return next((form for word, form in forms(slot) if word == tag(str(kind.value))), slot)
    return slot
