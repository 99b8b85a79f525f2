"""The JSON schema agrees with the loader, and the reference with the models."""

from pathlib import Path

import jsonschema
import pytest

from tests.scene.samples import EVERYTHING, FOLDER, sample_texts
from tests.scene.typing_mistakes import MISSPELLED_KEYS
from warpsim.scene import json_schema, load_text, resolved_yaml
from warpsim.scene.flow import FlowPrimitive
from warpsim.scene.reference import scene_reference
from warpsim.scene.yaml12 import parse

SCHEMA = json_schema()
VALIDATOR = jsonschema.Draft202012Validator(SCHEMA)


def complaints(text: str) -> list[str]:
    return [f"{error.json_path}: {error.message[:200]}" for error in VALIDATOR.iter_errors(parse(text, "s.yaml")[0].data())]


def test_the_schema_is_one():
    VALIDATOR.check_schema(SCHEMA)
    assert SCHEMA["type"] == "object" and SCHEMA["$schema"].endswith("2020-12/schema")


@pytest.mark.parametrize("name", sample_texts())
def test_scenes_fulfill_the_schema(name):
    text = sample_texts()[name]
    assert not complaints(text)
    assert not complaints(resolved_yaml(load_text(text, folder=FOLDER)))


@pytest.mark.parametrize("mistyped", MISSPELLED_KEYS, ids=lambda m: m.new.replace("\n", "⏎"))
def test_the_schema_refuses_misspelled_keys_too(mistyped):
    assert complaints(EVERYTHING.replace(mistyped.old, mistyped.new))


@pytest.mark.parametrize(
    ("line", "fits"),
    [
        ("flow: [{type: point_source, rate: 1}]", True),
        ("flow: [{type: point_source, rate: {expression: t}}]", True),
        ("flow: [{type: point_source, rate: text}]", False),
        ("flow: [{rate: 1}]", False),
        ("systems: {p: {type: particles, emitters: [{rate: {sine: {amplitude: 1, period: 1}}}]}}", True),
        ("systems: {p: {type: particles, emitters: [{burst: {count: 1}}]}}", True),
        ("systems: {p: {type: particles, emitters: [{burst: [{count: 1}, {count: 2, at: 1}]}]}}", True),
        ("systems: {p: {type: particles, emitters: [{rate: 1, lifetime: {mean: 1, law: normal}}]}}", True),
        ("systems: {p: {type: particles, look: {color: '#123', size: 1}}}", True),
        ("systems: {p: {type: particles, look: {color: {over_life: [[0, '#123456']]}, size: {over_life: [[0, 1]]}}}}", True),
        ("systems: {p: {type: particles, look: {color: '#12'}}}", False),
        ("systems: {p: {type: particles, look: {color: {over_life: '#123'}}}}", False),
        ("systems: {p: {type: particles, coupling: tracer}}", True),
        ("systems: {p: {type: particles, coupling: drag}}", False),
        ("systems: {p: {type: particles, feels: {flow: [0, swirl]}}}", None),
        ("systems: {'a b': {type: particles}}", False),
        ("seed: 1e3", True),
        ("seed: 1.5", False),
        ("seed: true", False),
        ("seed: '1'", False),
        ("gravity: [0, 0]", False),
    ],
)
def test_schema_and_loader_agree(line, fits):
    text = f"name: x\n{line}\n"
    if fits is None:  # a rule between fields, which a schema cannot hold
        assert not complaints(text)
        return
    assert bool(complaints(text)) is not fits
    if fits:
        load_text(text)


def test_descriptions_and_units_are_in_it():
    vortex = SCHEMA["$defs"]["Vortex"]
    assert "[m^2/s]" in vortex["properties"]["circulation"]["description"] and vortex["properties"]["type"]["const"] == "vortex"
    assert set(vortex["required"]) == {"type", "circulation"}
    listed = {ref["$ref"].rsplit("/", 1)[1] for ref in SCHEMA["properties"]["flow"]["items"]["oneOf"]}
    assert listed == {primitive.__name__ for primitive in FlowPrimitive.__subclasses__()}


def test_the_reference_is_current():
    committed = Path(__file__).resolve().parents[2] / "docs" / "scene.md"
    assert committed.read_text(encoding="utf-8") == scene_reference(), "python -m warpsim.scene.reference > docs/scene.md"
