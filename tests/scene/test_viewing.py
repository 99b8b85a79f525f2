"""Controls, trails and color maps: what they resolve to, and how their mistakes are told."""

import pytest

from warpsim.scene import Scene, SceneError, load_text

TEXT = """\
name: c
controls: [gravity, {path: flow.swirl.circulation, min: -5, max: 5, label: swirl}, systems.p.emitters.0.rate, systems.p.coupling.alpha]
flow: [{name: swirl, type: vortex, circulation: {keyframes: [[0, 0], [1, 2]]}}]
systems:
  p:
    type: particles
    coupling: {alpha: 0.1}
    emitters: [{rate: 100}]
    look: {color: {by: speed, range: [0, 5], map: inferno}, trail: {duration: 1}}
"""


def test_controls_become_sliders_within_the_bounds_of_their_fields():
    sliders = {slider.path: slider for slider in load_text(TEXT).sliders}
    assert list(sliders) == [
        *("gravity.0", "gravity.1", "gravity.2"),
        *("flow.swirl.circulation", "systems.p.emitters.0.rate", "systems.p.coupling.alpha"),
    ]
    assert sliders["gravity.1"][2:] == (pytest.approx(-29.43), pytest.approx(9.81), -9.81)
    assert sliders["flow.swirl.circulation"] == ("flow.swirl.circulation", "swirl", -5.0, 5.0, None)
    assert sliders["systems.p.emitters.0.rate"][2:] == (0.0, 300.0, 100.0)
    assert sliders["systems.p.coupling.alpha"].min == 0.0


def test_a_number_that_may_be_a_list_keeps_its_bounds():
    net = "{type: springs, points: [[0, 0, 0], [1, 0, 0]], springs: [[0, 1]], stiffness: 40}"
    (slider,) = load_text(f"name: n\ncontrols: [systems.net.stiffness]\nsystems: {{net: {net}}}\n").sliders
    assert (slider.min, slider.max) == (0.0, 120.0)


@pytest.mark.parametrize(
    ("wrong", "told"),
    [
        ("flow.swrl.circulation", '2:12: controls.0: flow has nothing called "swrl" (did you mean swirl?)'),
        ("name", "controls.0: name is not a number"),
        ("systems.p.look", "is not a number"),
        ("{path: gravity.1, min: 3, max: 2}", "must be greater than min"),
    ],
)
def test_a_control_that_moves_no_number_is_a_mistake(wrong, told):
    text = TEXT.replace(TEXT.splitlines()[1], f"controls: [{wrong}]")
    with pytest.raises(SceneError) as caught:
        load_text(text)
    assert told in str(caught.value)


def test_a_color_by_a_quantity_has_the_map_s_colors():
    color = load_text(TEXT).systems["p"].look.color
    assert color.stops[0][1] == (0.0, 0.0, 4 / 255, 1.0) and color.stops[-1][0] == 1.0
    with pytest.raises(SceneError, match="did you mean speed"):
        load_text(TEXT.replace("by: speed", "by: sped"))
    with pytest.raises(SceneError, match="range must rise"):
        load_text(TEXT.replace("range: [0, 5]", "range: [5, 0]"))


def test_looks_survive_the_round_trip():
    scene = load_text(TEXT)
    assert Scene.model_validate(scene.model_dump(by_alias=True)) == scene
