"""From the path of a pydantic error to the place in the text and in the format."""

from dataclasses import dataclass

from warpsim.scene.base import is_tag
from warpsim.scene.fields import Slot, child_of, has_free_keys, is_list, scene_slot, specs_of
from warpsim.scene.nodes import Mapping, Node, Scalar, Sequence


@dataclass(frozen=True)
class Place:
    """Where an error is: the deepest node of the text on its path, and the format's slot at the path's end."""

    node: Node
    key: Scalar | None
    """The node's key, where it is a mapping's value."""
    path: tuple[str | int, ...]
    """Path of the node in the tree."""
    dotted: str
    """The path as the user has it in the text."""
    slot: Slot
    owner: Slot
    """Slot of what holds the last part of the error's path."""
    removable: tuple[bool, ...]
    """For each part of `path`, whether the scene stays complete without it."""


def point_at(root: Node, location: tuple[str | int, ...]) -> Place:
    """Follow an error's path: union tags lead in the format only, keys that a bare value stands for lead nowhere in the text."""
    node, key, slot = root, None, scene_slot()
    owner = slot
    path: list[str | int] = []
    shown: list[str] = []
    removable: list[bool] = []
    for part in location:
        if isinstance(part, str) and is_tag(part):
            slot = child_of(slot, part) or slot
            continue
        if part == "[key]":
            break
        child = child_of(slot, part)
        below = _below(node, part)
        if below is not None:
            removable.append(_removable(slot, child))
            shown.append(str(node.number_of(part) if isinstance(node, Sequence) else part))
            key, node = below
            path.append(part)
        owner, slot = slot, child or slot
    if location and location[-1] == "[key]" and key is not None:
        node = key
    return Place(node, key, tuple(path), ".".join(shown), slot, owner, tuple(removable))


def _removable(slot: Slot, child: Slot | None) -> bool:
    if child is None or has_free_keys(slot):
        return True
    if is_list(slot):
        return bool(specs_of(child))  # an entry that is a mapping; numbers belong together
    return child.field not in (None, slot.field) and not child.required


def _below(node: Node, part: str | int) -> tuple[Scalar | None, Node] | None:
    if isinstance(node, Mapping) and isinstance(part, str):
        return node.entries.get(part)
    if isinstance(node, Sequence) and isinstance(part, int) and 0 <= part < len(node.items):
        return None, node.items[part]
    return None
