"""Mistakes in networks: each named where it stands, with what is allowed."""

import pytest

from warpsim import SceneError
from warpsim.scene import load_text

HEAD = "name: x\nsystems:\n  s:\n    type: springs\n"
PAIR = HEAD + "    points: [[0, 0, 0], [1, 0, 0], [2, 0, 0]]\n    springs: [[0, 1], [1, 2]]\n    stiffness: 5\n"
CLOTH = (
    "name: x\nsystems:\n  s:\n    type: cloth\n    resolution: [5, 4]\n    edges: [[1, 0, 0], [0, -1, 0]]\n    structural: {stiffness: 9}\n"
)
CHAIN = HEAD + "    generator: {type: chain, count: 4, start: [0, 0, 0], end: [1, 0, 0]}\n    stiffness: 5\n"
GRID = HEAD + "    generator: {type: grid, resolution: [3, 4], edges: [[1, 0, 0], [0, 0, 1]]}\n    stiffness: 5\n"


@pytest.mark.parametrize(
    ("text", "line", "says", "suggestion"),
    [
        (PAIR.replace("[1, 2]]", "[1, 3]]"), 6, "there is no point 3: there are 3", None),
        (PAIR.replace("[1, 2]]", "[2, 2]]"), 6, "not point 2 with itself", None),
        (PAIR.replace("[1, 2]]", "[1, 0]]"), 6, "joined by springs.0 already", None),
        (PAIR.replace("[1, 2]]", "[1, -1]]"), 6, "0", None),
        (PAIR.replace("stiffness: 5", "stiffness: [5, 6, 7]"), 7, "3 values for 2 springs", None),
        (PAIR.replace("stiffness: 5", "stiffness: -5"), 7, "0", None),
        (PAIR + "    mass: [1, 2]\n", 8, "2 values for 3 points", None),
        (PAIR + "    mass: 0\n", 8, "1e-12", None),
        (PAIR + "    rest_length: [1]\n", 8, "1 values for 2 springs", None),
        (PAIR + "    pins: [3]\n", 8, "there is no point 3", None),
        (PAIR + "    pins: [left]\n", 8, "its points have numbers only", None),
        (PAIR + "    pins: [0]\n    pin_motion: [{pins: [1], keyframes: [[0, [0, 0, 0]]]}]\n", 9, "point 1 is not pinned", None),
        (PAIR + "    pin_motion: [{keyframes: [[0, [0, 0, 0]]]}]\n", 8, "no pins to move", None),
        (PAIR + "    pins: [0]\n    pin_motion: [{}]\n", 9, "either keyframes or displacement", None),
        (PAIR + "    pins: [0]\n    pin_motion: [{keyframes: [[0, [0, 0, 0]]], displacement: [0, 0, 0]}]\n", 9, "not both", None),
        (PAIR + "    pins: [0]\n    pin_motion: [{keyframes: [[1, [0, 0, 0]], [1, [0, 0, 1]]]}]\n", 9, "times must rise", None),
        (
            PAIR + "    pins: [0]\n    pin_motion: [{displacement: [1, 0, 0]}, {displacement: [0, 0, 0]}]\n",
            9,
            "moved by pin_motion.0",
            None,
        ),
        (PAIR + "    coupling: tracer\n", 8, "alpha", None),
        (PAIR + "    solver: rk5\n", 8, "verlet", "rk4"),
        (PAIR + "    solver: xpbd\n    iterations: 101\n", 9, "at most 100 passes per substep", None),
        (PAIR + "    solver: xpbd\n    tolerance: 0.1\n", 9, "tolerance is for implicit_euler, not xpbd", None),
        (PAIR + "    iterations: 2\n", 8, "iterations is for implicit_euler and xpbd", None),
        (PAIR + "    generator: {type: chain, count: 4, start: [0, 0, 0], end: [1, 0, 0]}\n", 5, "the generator makes the points", None),
        (HEAD + "    stiffness: 1\n", 4, "needs points and springs, or a generator", None),
        (CHAIN.replace("chain", "chian"), 5, "chian", "chain"),
        (CHAIN.replace("count: 4", "count: 1"), 5, "2", None),
        (CHAIN + "    pins: [strat]\n", 7, "groups: start, end", "start"),
        (CHAIN.replace("stiffness", "stifness"), 6, "stifness", "stiffness"),
        (CHAIN + "    pins: [4]\n", 7, "there is no point 4", None),
        (CHAIN.replace("    stiffness: 5\n", ""), 4, "stiffness", None),
        (PAIR + "    pins: [[0, 0]]\n", 8, "here a point is one number", None),
        (CLOTH + "    pins: [[5, 0]]\n", 8, "i goes to 4 and j to 3", None),
        (CLOTH + "    pins: [[0, 4]]\n", 8, "i goes to 4 and j to 3", None),
        (CLOTH + "    pins: [lft]\n", 8, "groups: left, right", "left"),
        (CLOTH + "    pins: [20]\n", 8, "there is no point 20", None),
        (CLOTH + "    pins: [left]\n    pin_motion: [{pins: [[1, 0]], keyframes: [[0, [0, 0, 0]]]}]\n", 9, "point 1 is not pinned", None),
        (CLOTH.replace("[0, -1, 0]", "[2, 0, 0]"), 6, "parallel", None),
        (CLOTH.replace("[0, -1, 0]", "[0.1, -1, 0]") + "    bending: {stiffness: 1e-3}\n", 6, "right angles", None),
        (CLOTH + "    tear: 0\n", 8, "0", None),
        (CLOTH + "    tear: 0.5\n    strain_limit: 0.1\n", 9, "give either", None),
        (PAIR + "    strain_limit: 0.1\n    tear: 0.5\n", 8, "give either", None),
        (PAIR + "    strain_limit: 0\n", 8, "0.001", None),
        (CHAIN + "    taer: 0.5\n", 7, "taer", "tear"),
        (CLOTH + "    bending: {stiffness: -1}\n", 8, "0", None),
        (CLOTH + "    bending: {stifness: 1}\n", 8, "stifness", "stiffness"),
        (CLOTH.replace("[5, 4]", "[1, 4]"), 5, "2", None),
        (CLOTH + "    drag: 1\n    coupling: {alpha: 1}\n", 8, "either drag or coupling", None),
        (CLOTH + "    density: 0\n", 8, "1e-09", None),
        (CLOTH + "    sheer: {stiffness: 1}\n", 8, "sheer", "shear"),
        (CLOTH.replace("    structural: {stiffness: 9}\n", ""), 4, "structural", None),
        (PAIR.replace("[1, 0, 0]", "[0, 0, 0]") + "    rest_length: 1\n", 6, "points 0 and 1 start at the same place", None),
        (PAIR.replace("[1, 0, 0]", "[0, 0, 0]") + "    rest_length: [0.5, 0]\n", 6, "a spring of 0.5 m has no direction to push in", None),
        (CHAIN.replace("end: [1, 0, 0]", "end: [0, 0, 0]"), 5, "start and end are the same place", None),
        (GRID.replace("[0, 0, 1]", "[-2, 0, 0]"), 5, "the edges are parallel", None),
        (GRID.replace("[0, 0, 1]", "[0, 0, 0]"), 5, "must not be zero", None),
        (GRID + "    pins: [[3, 0]]\n", 7, "i goes to 2 and j to 3", None),
        (GRID + "    pins: [[0, 0], 12]\n", 7, "there is no point 12", None),
        (CHAIN + "    look: {show: [spring]}\n", 7, "spring", "springs"),
    ],
)
def test_a_mistake_is_named_where_it_stands(text, line, says, suggestion):
    with pytest.raises(SceneError) as refused:
        load_text(text, "x.yaml")
    problem = refused.value.problems[0]
    assert says in problem.message and problem.suggestion == suggestion and problem.line == line, str(refused.value)


def test_nothing_is_born_in_a_network():
    text = PAIR + "  p:\n    type: particles\n    emitters: [{on: {event: death, of: s}, burst: {count: 1}}]\n"
    with pytest.raises(SceneError, match="nothing is born or dies in"):
        load_text(text, "x.yaml")


def test_all_mistakes_come_at_once():
    with pytest.raises(SceneError) as refused:
        load_text(PAIR.replace("[1, 2]]", "[1, 7]]") + "    mass: [1]\n    pins: [9]\n", "x.yaml")
    assert {problem.line for problem in refused.value.problems} == {6, 8, 9}


@pytest.mark.parametrize("text", [
    PAIR.replace("[1, 0, 0]", "[0, 0, 0]"),  # rest length as it starts: zero, and it only pulls
    PAIR.replace("[1, 0, 0]", "[0, 0, 0]") + "    rest_length: [0, 1]\n",
    PAIR + "    pins: [0, 1]\n",  # both ends of a spring
])  # fmt: skip
def test_what_has_a_result_is_no_mistake(text):
    load_text(text, "x.yaml")
