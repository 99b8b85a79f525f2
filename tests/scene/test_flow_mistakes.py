"""Mistakes in the flow: formulas at their column in the right text, vortex lines without length, noises without size."""

import pytest

from warpsim.scene import SceneError, load_text

HEAD = "name: a\nflow:\n"


def problems_of(*lines: str) -> list:
    with pytest.raises(SceneError) as error:
        load_text(HEAD + "".join(f"  - {line}\n" for line in lines), "scene.yaml")
    return error.value.problems


@pytest.mark.parametrize(
    ("texts", "pointed", "says", "suggestion"),
    [
        (["y", "2*w + x", "0"], "w", "(known: x, y, z, t, pi, e and functions)", None),
        (["y", "0", "1 + Z"], "Z", "unknown name", "z"),
        (["sn(x)", "0", "0"], "sn", "unknown function", "sin"),
        (["x", "x + 3 y", "0"], "y", "expected an operation", "x + 3*y"),
        (["(x + y", "0", "0"], None, 'missing ")" at the end', None),
        (["x", "min(x)", "0"], "min", "takes 2 values, got 1", None),
        (["x", "y; z", "0"], ";", "has no meaning", None),
        (["x", "y", "__import__('os')"], "'", "has no meaning", None),
    ],
)
def test_formula_is_pointed_at_in_its_text(texts, pointed, says, suggestion):
    line = f'{{type: expression, velocity: ["{texts[0]}", "{texts[1]}", "{texts[2]}"]}}'
    (problem,) = problems_of(line)
    assert says in problem.message and problem.suggestion == suggestion and problem.line == 3
    if pointed:
        assert (HEAD + "  - " + line).splitlines()[2][problem.column - 1 :].startswith(pointed)


def test_every_formula_is_told_at_once():
    problems = problems_of('{type: expression, velocity: ["a", "b", "c"]}')
    assert [problem.path for problem in problems] == [f"flow.0.velocity.{k}" for k in range(3)]


@pytest.mark.parametrize("word", ["x", "y", "z"])
def test_a_strength_has_no_place(word):
    (problem,) = problems_of(f'{{type: vortex, circulation: {{expression: "1 + {word}"}}}}')
    assert "a strength varies in t alone" in problem.message and "expression" in problem.message and problem.column == 51


@pytest.mark.parametrize(
    ("line", "path", "says"),
    [
        ("{type: expression, velocity: [x, y]}", "flow.0.velocity", "list of 3"),
        ("{type: expression, velocity: [x, y, [0]]}", "flow.0.velocity.2", "expected text"),
        ("{type: expression, velocity: x}", "flow.0.velocity", "list of 3"),
        ("{type: vortex_segment, start: [0, 0, 0], end: [0, 0, 0], circulation: 1}", "flow.0.end", "needs a length"),
        ("{type: vortex_segment, start: [1e6, 0, 0], end: [1000000.1, 0, 0], circulation: 1}", "flow.0.end", "needs a length"),
        ("{type: vortex_segment, start: [0, 0, 0], circulation: 1}", "flow.0", '"end" is missing'),
        ("{type: vortex_ring, radius: 0, circulation: 1}", "flow.0.radius", "at least 1e-06 m"),
        ("{type: vortex_ring, radius: -1, circulation: 1}", "flow.0.radius", "must not be negative"),
        (
            "{type: vortex_ring, radius: {keyframes: [[0, 1], [1, -1]]}, circulation: 1}",
            "flow.0.radius.keyframes.1.1",
            "must not be negative",
        ),
        ("{type: vortex_ring, radius: 1, normal: [0, 0, 0], circulation: 1}", "flow.0.normal", "must not be zero"),
        ("{type: vortex_ring, radius: 1, circulation: 1, core: {model: scully}}", "flow.0.core", "needs a radius"),
        ("{type: curl_noise, amplitude: 1, length: 0}", "flow.0.length", "0.001"),
        ("{type: curl_noise, amplitude: 1, length: 1, octaves: 9}", "flow.0.octaves", "8"),
        ("{type: curl_noise, amplitude: 1, length: 1, octaves: 1.5}", "flow.0.octaves", "whole number"),
        ("{type: curl_noise, amplitude: 1, length: 1, frequency: -1}", "flow.0.frequency", "0"),
        ("{type: curl_noise, amplitude: 1, length: 1, seed: -1}", "flow.0.seed", "0"),
        ("{type: uniform, velocity: [0, 0, 0], travel: [1, 0, 0]}", "flow.0.travel", "unknown key"),
        ("{type: vortex, circulation: 1, travel: 3}", "flow.0.travel", "list of 3"),
    ],
)
def test_mistake_is_told_at_its_place(line, path, says):
    problems = problems_of(line)
    assert any(problem.path == path and says in problem.message for problem in problems), problems
