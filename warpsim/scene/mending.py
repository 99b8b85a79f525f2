"""Mends a scene with mistakes just enough that validation can look further. What comes out is never run."""

from dataclasses import replace
from typing import Any

from warpsim.scene.fields import types_of
from warpsim.scene.nearest import nearest
from warpsim.scene.nodes import Mapping, Node, Scalar, edited
from warpsim.scene.pointing import Place, point_at
from warpsim.scene.wording import meant_key


def mend(root: Node, errors: list[dict[str, Any]], places: list[Place], dropped: set[tuple[str | int, ...]]) -> Node:
    """Return a tree without the errors: misspelled words set right, wrong values left to their defaults (their paths go to `dropped`).

    Returns `root` itself where nothing can be mended.
    """
    for error, place in zip(errors, places, strict=True):
        if error["type"] == "extra_forbidden":
            root = _without_unknown_key(root, place, dropped)
        elif error["type"] == "union_tag_invalid" and (guess := _meant_type(place)):
            root = edited(root, (*place.path, "type"), lambda node, guess=guess: replace(node, value=guess, text=guess))
        elif error["type"] == "rule":
            for mistake in error["ctx"]["found"]:
                root = _dropped(root, point_at(root, (*error["loc"], *mistake.path)), dropped)
        else:
            root = _dropped(root, place, dropped)
    return root


def _without_unknown_key(root: Node, place: Place, dropped: set) -> Node:
    *parent, word = place.path
    guess = meant_key(place, root)

    def change(node: Node) -> Node:
        if not isinstance(node, Mapping) or word not in node.entries:
            return node
        entries = dict(node.entries)
        key, value = entries.pop(word)
        if guess and guess not in entries:
            entries[guess] = (key, value)
        return replace(node, entries=entries)

    if guess is None:
        dropped.add(place.path)
    return edited(root, tuple(parent), change)


def _meant_type(place: Place) -> str | None:
    given = place.node.get("type") if isinstance(place.node, Mapping) else None
    return nearest(given.value, types_of(place.slot)) if isinstance(given, Scalar) and isinstance(given.value, str) else None


def _dropped(root: Node, place: Place, dropped: set) -> Node:
    for length in range(len(place.path), 0, -1):
        if place.removable[length - 1]:
            path = place.path[:length]
            dropped.add(path)
            return edited(root, path, lambda node: None)
    return root
