"""Mends a scene with mistakes just enough that validation can look further. What comes out is never run."""

from dataclasses import replace
from typing import Any

from warpsim.scene.fields import types_of
from warpsim.scene.nearest import nearest
from warpsim.scene.nodes import Mapping, Node, Scalar, edited
from warpsim.scene.pointing import Place, point_at
from warpsim.scene.wording import is_misspelled, meant_key


def mend(root: Node, errors: list[dict[str, Any]], places: list[Place], dropped: set[tuple[str | int, ...]]) -> Node:
    """Return a tree without the errors: misspelled words set right, wrong values left to their defaults (their paths go to `dropped`).

    Returns `root` itself where nothing can be mended.
    """
    wrong: set[tuple[str | int, ...]] = set()
    before = root
    for error, place in zip(errors, places, strict=True):
        if error["type"] == "extra_forbidden":
            root = _without_unknown_key(root, place, wrong)
        elif error["type"] == "union_tag_invalid" and (guess := _meant_type(place)):
            root = edited(root, (*place.path, "type"), lambda node, guess=guess: replace(node, value=guess, text=guess))
        elif error["type"] == "rule":
            for mistake in error["ctx"]["found"]:
                _drop(point_at(root, (*error["loc"], *mistake.path)), wrong)
        elif error["type"] != "missing" or not is_misspelled(error["loc"], place, before):
            _drop(place, wrong)
    # Later entries of a list first, so that the places of the earlier ones still hold.
    for path in sorted(wrong, key=lambda path: [(isinstance(part, int), part) for part in path], reverse=True):
        root = edited(root, path, lambda node: None)
    dropped |= wrong
    return root


def _without_unknown_key(root: Node, place: Place, wrong: set) -> Node:
    *parent, word = place.path
    guess = meant_key(place, root)

    def change(node: Node) -> Node:
        if not isinstance(node, Mapping) or word not in node.entries:
            return node
        entries = dict(node.entries)
        key, value = entries.pop(word)
        if guess not in entries:
            entries[guess] = (key, value)
        return replace(node, entries=entries)

    if guess is None:
        wrong.add(place.path)
        return root
    return edited(root, tuple(parent), change)


def _meant_type(place: Place) -> str | None:
    given = place.node.get("type") if isinstance(place.node, Mapping) else None
    return nearest(given.value, types_of(place.slot)) if isinstance(given, Scalar) and isinstance(given.value, str) else None


def _drop(place: Place, wrong: set) -> None:
    for length in range(len(place.path), 0, -1):
        if place.removable[length - 1]:
            wrong.add(place.path[:length])
            return
