"""One pydantic error in words that a technical artist understands, with what was probably meant."""

from typing import Any

from warpsim.scene.fields import (
    Slot,
    choices_of,
    fixed_length,
    forms,
    has_free_keys,
    is_list,
    item_of,
    keys_of,
    scene_slot,
    specs_of,
    types_of,
)
from warpsim.scene.nearest import likeness, nearest
from warpsim.scene.nodes import Mapping, Node, Scalar, Sequence
from warpsim.scene.phrases import found_in_words, in_words, mended, range_in_words, shortened, unit_in_words
from warpsim.scene.pointing import Place, point_at
from warpsim.scene.problems import Problem

_NAMES = "a name is made of letters, digits, _ and -, begins with a letter or _ and has at most 64 characters"
_SURE = 0.7


def word(error: dict[str, Any], place: Place, root: Node, dropped: set[tuple[str | int, ...]]) -> list[Problem]:
    """Return the problems of one pydantic error; none where it only follows from another mistake."""
    if place.node.reported or (place.key is not None and place.key.reported):
        return []
    kind = error["type"]
    if kind == "rule":
        return _rule(error, place, root, dropped)
    words = _WORDS.get(kind)
    if words:
        problem = words(error, place, root)
        return [problem] if problem else []
    if kind in _KINDS_OF_VALUE:
        return [_wrong_kind(place)]
    if kind in ("greater_than", "greater_than_equal", "less_than", "less_than_equal"):
        return [_problem(place, f"must be {range_in_words(place.slot, kind)}, got {found_in_words(place.node)}")]
    return [_problem(place, error["msg"])]


_KINDS_OF_VALUE = {
    *("float_type", "int_type", "string_type", "bool_type", "tuple_type", "dict_type", "mapping_type", "list_type"),
    *("model_type", "model_attributes_type", "int_from_float", "finite_number"),
}


def _problem(place: Place, message: str, suggestion: str | None = None) -> Problem:
    return place.node.problem(message, path=place.dotted, suggestion=suggestion)


def _wrong_kind(place: Place) -> Problem:
    slot = place.slot
    if has_free_keys(place.owner) and place.path and place.path[-1] in _keys(slot):
        return place.key.problem(
            f'"{place.path[-1]}" belongs to an entry of {place.path[-2]}; indent it below the entry\'s name', path=place.dotted
        )
    return _problem(place, f"expected {in_words(slot, with_unit=True)}, got {found_in_words(place.node)}", mended(place.node, slot))


def _rule(error: dict[str, Any], place: Place, root: Node, dropped: set) -> list[Problem]:
    problems = []
    for mistake in error["ctx"]["found"]:
        reads = [(*place.path, *((key,) if isinstance(key, str) else key)) for key in mistake.depends]
        if any(_spoils(path, read) for path in dropped for read in reads):
            continue
        at = point_at(root, (*error["loc"], *mistake.path))
        if not at.node.reported:
            problems.append(_problem(at, mistake.message, mistake.suggestion))
    return problems


def _spoils(path: tuple[str | int, ...], read: tuple[str | int, ...]) -> bool:
    """Tell whether leaving out `path` changes what a rule reads at `read`: the value, an entry of the list, or an entry's name."""
    return path[: len(read)] == read and (len(path) - len(read) <= 1 or path[-1] == "name")


def _unknown_key(error: dict[str, Any], place: Place, root: Node) -> Problem:
    given = str(place.path[-1]) if place.path else ""
    at = place.key or place.node
    guess = meant_key(place, root)
    elsewhere = None if guess and likeness(given, guess) >= _SURE else _elsewhere(given, place, root)
    allowed = _keys(place.owner)
    message = f'unknown key "{shortened(given)}"'
    if elsewhere and elsewhere[1]:
        message += f", which belongs to {elsewhere[0]}; check the indentation"
        guess = None
    elif elsewhere:
        guess = elsewhere[0]
    elif not guess:
        message += f" (allowed: {', '.join(allowed)})"
    return at.problem(message, path=place.dotted, suggestion=guess)


def _keys(slot: Slot) -> list[str]:
    return list(dict.fromkeys(key for spec in specs_of(slot) for key in keys_of(spec)))


def meant_key(place: Place, root: Node) -> str | None:
    """Return the key that an unknown key was probably meant to be: one not yet given rather than one that is."""
    allowed = _keys(place.owner)
    mapping = _node_at(root, place.path[:-1])
    given = set(mapping.entries) if isinstance(mapping, Mapping) else set()
    return nearest(str(place.path[-1]), [key for key in allowed if key not in given]) if place.path else None


def _node_at(root: Node, path: tuple[str | int, ...]) -> Node | None:
    node: Node | None = root
    for part in path:
        node = node.get(part) if isinstance(node, Mapping) else node.items[part] if isinstance(node, Sequence) else None
    return node


def _elsewhere(word: str, place: Place, root: Node) -> tuple[str, bool] | None:
    """Return where an unknown key would be at home, one level down ("core.radius") or further up, and whether it is further up."""
    for spec in specs_of(place.owner):
        for key, slot in keys_of(spec).items():
            if any(word in keys_of(inner) for inner in specs_of(slot)):
                return f"{key}.{word}", False
    for length in range(len(place.path) - 2, -1, -1):
        above = point_at(root, place.path[:length])
        mapping = above.node
        if isinstance(mapping, Mapping) and word in _keys(above.slot) and word not in mapping.entries:
            return above.dotted or "the scene itself", True
    top = keys_of(specs_of(scene_slot())[0])
    home = next((key for key, slot in top.items() if not is_list(slot) and word in _keys(slot)), None)
    return (home, True) if home else None


def is_misspelled(location: tuple[str | int, ...], place: Place, root: Node) -> bool:
    """Tell whether the key that is missing at the end of an error's path is there under a misspelled name."""
    for other in place.node.entries if isinstance(place.node, Mapping) else ():
        at = point_at(root, (*location[:-1], other))
        if other not in _keys(at.owner) and meant_key(at, root) == location[-1]:
            return True
    return False


def _missing(error: dict[str, Any], place: Place, root: Node) -> Problem | None:
    part = error["loc"][-1]
    if isinstance(part, int):
        return _wrong_length(place)
    if is_misspelled(error["loc"], place, root):
        return None  # the misspelled key is reported
    if isinstance(place.node, Scalar) and place.node.value is None:
        return _problem(place, f"expected {in_words(place.owner)}, got nothing")
    described = f": {place.slot.prose.rstrip('.')}" if place.slot.prose else ""
    unit = f" [{place.slot.unit}]" if unit_in_words(place.slot) else ""
    return _problem(place, f'the key "{part}" is missing{described}{unit}')


def _wrong_length(place: Place) -> Problem:
    slot = place.owner if fixed_length(place.owner) else place.slot
    count = len(place.node.items) if isinstance(place.node, Sequence) else 0
    return _problem(place, f"expected {in_words(slot)}, got {count}")


def _too_long(error: dict[str, Any], place: Place, root: Node) -> Problem:
    if fixed_length(place.slot):
        return _wrong_length(place)
    return _problem(place, f"at most {error['ctx']['max_length']} entries, got {found_in_words(place.node)}")


def _too_short(error: dict[str, Any], place: Place, root: Node) -> Problem | None:
    if isinstance(place.node, Sequence) and len(place.node.items) >= error["ctx"]["min_length"] or isinstance(place.node, Scalar):
        return None  # its entries are wrong, and that is reported
    return _problem(place, "needs at least one entry")


def _unknown_type(error: dict[str, Any], place: Place, root: Node) -> Problem:
    kinds = types_of(place.slot)
    given = place.node.get("type") if isinstance(place.node, Mapping) else None
    if not kinds or given is None:
        return _wrong_kind(place)
    if given.reported:
        return None
    path = f"{place.dotted}.type"
    if not isinstance(given, Scalar) or not isinstance(given.value, str):
        return given.problem(f"expected one of {', '.join(kinds)}, got {found_in_words(given)}", path=path)
    home = _home_of_type(given.value)
    message = f'unknown type "{shortened(given.value)}" (one of {", ".join(kinds)})'
    if home:
        message = f'the type "{given.value}" belongs to {home}, not here (here: {", ".join(kinds)})'
    return given.problem(message, path=path, suggestion=None if home else nearest(given.value, kinds))


def _home_of_type(word: str) -> str | None:
    for key, slot in keys_of(specs_of(scene_slot())[0]).items():
        item = item_of(slot)
        if item and word in types_of(item):
            return key
    return None


def _no_type(error: dict[str, Any], place: Place, root: Node) -> Problem:
    kinds = types_of(place.slot)
    if not kinds or not isinstance(place.node, Mapping):
        return _wrong_kind(place)
    if place.node.get("type") is not None:
        return _unknown_type(error, place, root)
    near = next((key for key in place.node.entries if nearest(key, ["type"])), None)
    if near:
        return place.node.entries[near][0].problem(f'unknown key "{near}"', path=f"{place.dotted}.{near}", suggestion="type")
    return _problem(place, f'the key "type" is missing (one of {", ".join(kinds)})')


def _wrong_word(error: dict[str, Any], place: Place, root: Node) -> Problem:
    words = [word for _, form in forms(place.slot) for word in choices_of(form)]
    node = place.node
    if not isinstance(node, Scalar) or not isinstance(node.value, str):
        return _problem(place, f"expected one of {', '.join(words)}, got {found_in_words(node)}")
    many = specs_of(place.slot) or len(words) == 1
    expected = in_words(place.slot) if many else f"one of {', '.join(words)}"
    return _problem(place, f"expected {expected}, got {found_in_words(node)}", nearest(node.value, words))


def _name(error: dict[str, Any], place: Place, root: Node) -> Problem:
    text = place.node.text if isinstance(place.node, Scalar) else ""
    if error["type"] == "string_pattern_mismatch":
        allowed = "".join(c if c.isascii() and (c.isalnum() or c in "_-") else "_" for c in text.strip())[:64].lstrip("-0123456789")
        return _problem(place, _NAMES, allowed if allowed.strip("_") else None)
    limit = error["ctx"].get("max_length")
    return _problem(place, f"at most {limit} characters, got {len(text)}" if limit else "must not be empty")


def _asset(error: dict[str, Any], place: Place, root: Node) -> Problem:
    return _problem(place, error["ctx"]["what"], error["ctx"]["suggestion"] or None)


def _expression(error: dict[str, Any], place: Place, root: Node) -> Problem:
    context = error["ctx"]
    node = place.node
    offset = context["offset"]
    if not isinstance(node, Scalar):
        return _problem(place, context["what"])
    start = node.column + node.quoted
    if node.source.lines[node.line][start : start + len(node.text)] != node.text:
        where = f" (at character {offset + 1} of the expression)" if offset else ""
        return _problem(place, context["what"] + where, context["suggestion"] or None)
    line = node.source
    return line.problem(node.line, start + offset, context["what"], path=place.dotted, suggestion=context["suggestion"] or None)


_WORDS = {
    "extra_forbidden": _unknown_key,
    "missing": _missing,
    "too_long": _too_long,
    "too_short": _too_short,
    "union_tag_invalid": _unknown_type,
    "union_tag_not_found": _no_type,
    "literal_error": _wrong_word,
    "string_too_short": _name,
    "string_too_long": _name,
    "string_pattern_mismatch": _name,
    "expression": _expression,
    "asset": _asset,
}
