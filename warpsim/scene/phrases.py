"""What a place expects and what was found there, in words."""

import re
from typing import Literal, get_args, get_origin

from warpsim.scene.base import ShortSpec
from warpsim.scene.expressions import ExpressionError, compile_expression
from warpsim.scene.fields import Slot, bounds_of, fixed_length, forms, has_free_keys, is_list, item_of, keys_of, spec_of, specs_of, types_of
from warpsim.scene.nodes import Mapping, Node, Scalar, Sequence

_SHORT = 60
_FAR_OUT = 1e9


def in_words(slot: Slot, with_unit: bool = False) -> str:
    """Say what may stand at a slot: "a number", "a list of 3 numbers", "a number [s] or a mapping {mean, spread, law}"."""
    words: list[str] = []
    kinds = types_of(slot)
    if kinds:
        words.append(f"a mapping with type: {', '.join(kinds)}")
    for _, form in forms(slot):
        if spec_of(form) is None or not kinds:
            words += _form_in_words(form)
    unit = f" [{slot.unit}]" if with_unit and unit_in_words(slot) else ""
    return _any_of([word + unit if word.endswith(("number", "numbers", "strengths")) else word for word in dict.fromkeys(words)])


def _any_of(words: list[str]) -> str:
    return words[0] if len(words) == 1 else f"{', '.join(words[:-1])} or {words[-1]}"


def _form_in_words(form: Slot) -> list[str]:
    spec = spec_of(form)
    if spec is not None:
        bare = _bare_in_words(spec) if issubclass(spec, ShortSpec) else []
        keys = list(keys_of(spec))
        return [*bare, f"{{{keys[0]}: …}}" if len(keys) == 1 else f"a mapping {{{', '.join(keys)}}}"]
    origin = get_origin(form.annotation)
    if origin is Literal:
        return [f'"{word}"' for word in get_args(form.annotation)]
    if origin is tuple:
        return [_list_in_words(form)]
    if origin is dict:
        return ["a mapping of names"]
    plain = {float: "a number", int: "a whole number", bool: "true or false", str: "text"}
    return [plain.get(form.annotation, "a value")]


def _bare_in_words(spec: type[ShortSpec]) -> list[str]:
    slot = keys_of(spec)[spec.shorthand]
    if is_list(slot):
        return [_item_in_words(item_of(item_of(slot), 1))]
    return [word for _, form in forms(slot) for word in _form_in_words(form) if spec_of(form) is None]


def _item_in_words(item: Slot) -> str:
    inner = [form for _, form in forms(item)]
    return "a color" if fixed_length(item) == 4 else _form_in_words(inner[0])[0]


def _list_in_words(form: Slot) -> str:
    length = fixed_length(form)
    kinds = {in_words(item_of(form, k)) for k in range(length or 1)}
    plural = {"a number": "numbers", "a whole number": "whole numbers", "text": "texts"}
    entry = kinds.pop() if len(kinds) == 1 else ""
    if length:
        noun = plural.get(entry, "strengths" if entry.startswith("a number,") else "values")
        return f"a list of {length} {noun}"
    return f"a list of {plural[entry]}" if entry in plural else "a list"


def found_in_words(node: Node) -> str:
    """Say what was found: "the text "fast"", "a list of 2", "nothing"."""
    if isinstance(node, Sequence):
        return f"a list of {len(node.items)}"
    if isinstance(node, Mapping):
        return f"a mapping with {', '.join(list(node.entries)[:4])}" if node.entries else "an empty mapping"
    if node.value is None:
        return "nothing"
    if isinstance(node.value, str):
        return f'the text "{shortened(node.value)}"'
    return shortened(node.text)


def shortened(text: str) -> str:
    """Cut a long text and make it one line."""
    text = " ".join(text.split())
    return text if len(text) <= _SHORT else text[: _SHORT - 1] + "…"


def number(value: float) -> str:
    """Write a number as a user would."""
    short = f"{value:g}"
    exact = abs(value) < 1e6 or (abs(value) < 1e12 and float(short) != value)  # 16777216, but 1e+09
    return str(int(value)) if float(value).is_integer() and exact else short


def range_in_words(slot: Slot, broken: str = "") -> str:
    """Say the range of a number: "from 1 to 100", "greater than 0 s". A bound far out is left out unless it is the broken one."""
    kinds = {"greater_than": "gt", "greater_than_equal": "ge", "less_than": "lt", "less_than_equal": "le"}
    bounds = next((found for _, form in forms(slot) if (found := bounds_of(form))), {})
    bounds = {word: bound for word, bound in bounds.items() if abs(bound) < _FAR_OUT or word == kinds.get(broken)}
    if "ge" in bounds and "le" in bounds:
        words = f"from {number(bounds['ge'])} to {number(bounds['le'])}"
    else:
        names = {"gt": "greater than", "ge": "at least", "lt": "less than", "le": "at most"}
        words = " and ".join(f"{names[word]} {number(bounds[word])}" for word in ("gt", "ge", "lt", "le") if word in bounds)
    return words + unit_in_words(slot)


def unit_in_words(slot: Slot) -> str:
    """Return " m/s", or nothing for what has no unit."""
    return f" {slot.unit}" if slot.unit and slot.unit != "1" else ""


def mended(node: Node, slot: Slot) -> str | None:
    """Return what was probably meant where the kind of value is wrong: a number without quotes, false for no, a list round one name."""
    kinds = {form.annotation for _, form in forms(slot)}
    specs = specs_of(slot)
    wants_number = bool(kinds & {float, int}) or any(issubclass(spec, ShortSpec) for spec in specs)
    if isinstance(node, Scalar) and node.value is None:
        return None if slot.required or slot.field is None else "to leave the key out"
    if isinstance(node, Scalar) and isinstance(node.value, str):
        return _mended_text(node, slot, wants_number)
    if isinstance(node, Scalar) and node.value is not None and str in kinds and not has_free_keys(slot):
        return f'"{node.text}" in quotes'
    if isinstance(node, Mapping) and list(node.entries) == ["x", "y", "z"] and fixed_length(slot) == 3:
        parts = [value.text if isinstance(value, Scalar) else "…" for _, value in node.entries.values()]
        return f"[{', '.join(parts)}]"
    if isinstance(node, Mapping) and is_list(slot):
        return 'a list, each entry beginning with "- "'
    if isinstance(node, Sequence) and has_free_keys(slot):
        return 'a name as key for each entry instead of "- "'
    return None


def _mended_text(node: Scalar, slot: Slot, wants_number: bool) -> str | None:
    text = node.value.strip()
    if text in types_of(slot):
        return f"{{type: {text}, …}}"
    if wants_number:
        if re.fullmatch(r"[-+]?(\d+\.?\d*|\.\d+)([eE][-+]?\d+)?", text):
            return f"{text} without quotes"
        if re.fullmatch(r"[-+]?\d+,\d+", text):
            return text.replace(",", ".")
        if re.fullmatch(r"[-+]?\d{1,3}(_\d{3})+(\.\d+)?", text):
            return text.replace("_", "")
        measured = re.fullmatch(r"([-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)\s*[A-Za-zµ°%][-0-9/*^A-Za-z²³ ]*", text)
        if measured:
            return f"{measured.group(1)}, without the unit"
    if any("expression" in keys_of(spec) for spec in specs_of(slot)) and _is_expression(text):
        return f'{{expression: "{text}"}}'
    if any(form.annotation is bool for _, form in forms(slot)) and text.lower() in ("yes", "no", "on", "off"):
        return "true" if text.lower() in ("yes", "on") else "false"
    if is_list(slot) and not has_free_keys(slot) and any(form.annotation is str for _, form in forms(item_of(slot))):
        return f"[{text}]"
    return None


def _is_expression(text: str) -> bool:
    try:
        compile_expression(text)
    except ExpressionError:
        return False
    return True
