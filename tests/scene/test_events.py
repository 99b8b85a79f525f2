"""Mistakes in who listens to whom: at their line and column, with what is allowed and what was meant."""

import textwrap

import pytest

from warpsim.scene.events import in_order
from warpsim.scene.loader import load_text
from warpsim.scene.problems import SceneError

SCENE = """
name: t
systems:
  stars:
    type: particles
    emitters:
      - on: {event: death, of: rockets}
        burst: {count: 3}
  rockets:
    type: particles
    emitters: [{rate: 1}]
"""


def problem_of(text: str) -> str:
    with pytest.raises(SceneError) as caught:
        load_text(textwrap.dedent(text), "a.yaml")
    assert len(caught.value.problems) == 1, caught.value
    return str(caught.value.problems[0])


@pytest.mark.parametrize(
    ("old", "new", "place", "words"),
    [
        ("of: rockets", "of: rocket", "a.yaml:6:32: systems.stars.emitters.0.on.of", 'there is no system "rocket"'),
        ("of: rockets", "of: rocket", "6:32", "did you mean rockets?"),
        ("of: rockets", "of: stars", "6:32", "cannot listen to itself"),
        ("event: death", "event: deaht", "6:21", "did you mean death?"),
        ("burst: {count: 3}", "burst: {count: 3, at: 1}", "7:31", "leave out at"),
        ("burst: {count: 3}", "burst: [{count: 3}, {count: 2}]", "7:16", "has one burst"),
        ("burst: {count: 3}", "lifetime: 3", "6:9", "burst: {count: …} is missing"),
        ("burst: {count: 3}", "burst: {count: 3}\n        rate: 3", "8:15", "has no rate"),
        ("burst: {count: 3}", "burst: {count: 3}\n        stop: 3", "8:15", "has no stop"),
        ("burst: {count: 3}", "burst: {count: 3}\n        travel: [1, 0, 0]", "8:17", "does not travel"),
        ("of: rockets}", "of: rockets, inherit: {color: true}}", "6:58", '"rockets" has no colors of its own'),
        ("of: rockets}", "of: rockets, inherit: {velocity: 2}}", "6:61", "from 0 to 1"),
        ("emitters: [{rate: 1}]", "emitters: [{rate: 1, color: [[1, 0]]}]", "10:", "color"),
        ("emitters: [{rate: 1}]", "emitters: [{rate: 1, color: red}]", "10:", "#rrggbb"),
        ("event: death", "event: collision", "6:21", "the scene has no colliders"),
        ("event: death", "event: death, min_speed: 2", "6:39", "only collisions have a speed toward a surface, not a death"),
        ("event: death", "event: birth, axes: surface", "6:34", "only collisions happen on a surface, not a birth"),
        (
            "emitters: [{rate: 1}]",
            "emitters: [{on: {event: birth, of: stars}, burst: {count: 1}}]",
            "6:32",
            "in a circle: stars to rockets to stars",
        ),
    ],
)
def test_a_mistake_is_told_in_its_place(old, new, place, words):
    told = problem_of(SCENE.lstrip().replace(old, new))
    assert place in told and words in told, told


def test_systems_move_after_those_they_listen_to():
    scene = load_text(SCENE, "a.yaml")
    assert list(scene.systems) == ["stars", "rockets"] and in_order(scene.systems) == ["rockets", "stars"]
    assert scene.systems["stars"].emitters[0].on.inherit.velocity == 1.0


@pytest.mark.parametrize(("text", "count"), [('"#f00"', 1), ("[1, 0, 0]", 1), ('["#f00", [0, 1, 0]]', 2), ("[]", 0)])
def test_a_color_or_a_list_of_colors(text, count):
    scene = load_text(SCENE.replace("{rate: 1}", f"{{rate: 1, color: {text}}}"), "a.yaml")
    assert len(scene.systems["rockets"].emitters[0].color) == count


@pytest.mark.parametrize(
    ("keys", "words"),
    [
        ("motion: ballistic\n    feels: {colliders: false}", "meets no collider: take motion: dynamic"),
        ("feels: {colliders: []}", "feels no colliders"),
    ],
)
def test_a_system_that_meets_no_collider_has_no_collisions(keys, words):
    text = SCENE.lstrip().replace("event: death", "event: collision").replace("  rockets:\n", f"  rockets:\n    {keys}\n")
    told = problem_of(text.replace("systems:", "colliders: [{type: plane}]\nsystems:"))
    assert "7:21: systems.stars.emitters.0.on.event" in told and words in told, told


def test_what_is_no_particle_system_has_no_events():
    text = (
        SCENE.lstrip().replace("of: rockets", "of: net") + "  net: {type: springs, points: [[0, 0, 0], [1, 0, 0]], mass: 1, stiffness: 1}\n"
    )
    told = problem_of(text)
    assert "6:32" in told and 'nothing is born or dies in "net", which is of type springs (other particle systems: rockets)' in told, told
