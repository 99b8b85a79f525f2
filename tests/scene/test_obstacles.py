"""Obstacles that cannot answer what they are asked to: told where it stands, with the way out."""

import pytest

from warpsim.scene import SceneError, load_text

HEAD = "name: x\nflow:\n"


def told(flow: str, obstacles: str) -> list[tuple[str, str]]:
    """Return path and message of each mistake; each is in the right line of the two lists."""
    with pytest.raises(SceneError) as refused:
        load_text(f"{HEAD}{flow}obstacles:\n{obstacles}", "x.yaml")
    lines = f"{HEAD}{flow}obstacles:\n{obstacles}".splitlines()
    for problem in refused.value.problems:
        family, place, *_ = problem.path.split(".")
        first = lines.index(f"{family}:") + 1
        assert problem.line == first + int(place) + 1, problem
    return [(problem.path, problem.message) for problem in refused.value.problems]


CYLINDER = "  - {type: cylinder, axis: [0, 0, 1], radius: 0.5}\n"
FLOOR = "  - {type: wall, normal: [0, 1, 0]}\n"


@pytest.mark.parametrize(
    ("flow", "obstacles", "path", "words"),
    [
        ("  - {type: rotation, angular_velocity: 1}\n", CYLINDER, "flow.0.type", '"rotation" has no exact image at a cylinder'),
        ("  - {type: rotation, angular_velocity: 1}\n", FLOOR, "flow.0.type", '"rotation" has no exact image at a wall'),
        ("  - {type: point_source, center: [2, 0, 0], rate: 1}\n", CYLINDER, "flow.0.type", "answers doublet, source, uniform, vortex"),
        ("  - {type: vortex, center: [2, 0, 0], axis: [0, 1, 5], circulation: 1}\n", CYLINDER, "flow.0.axis", "must be parallel"),
        (
            "  - {type: source, center: [0.3, 0, 0], axis: [0, 0, 1], rate: 1}\n",
            CYLINDER,
            "flow.0.center",
            "0.3 m from the cylinder's axis",
        ),
        ("  - {type: source, center: [0, -2, 0], axis: [0, 0, 1], rate: 1}\n", FLOOR, "flow.0.center", "comes 2 m behind the wall"),
        ("  - {type: source, center: [0, 0, 0], axis: [0, 0, 1], rate: 1}\n", FLOOR, "flow.0.center", "on the wall"),
        ("  - {type: source, center: [0, 2, 0], axis: [0, 1, 1], rate: 1}\n", FLOOR, "flow.0.axis", "parallel or perpendicular"),
        (
            "  - {type: vortex_segment, start: [0, 1, 0], end: [0, -1, 0], circulation: 1}\n",
            FLOOR,
            "flow.0.end",
            "comes 1 m behind the wall",
        ),
        ("  - {type: vortex_ring, center: [0, 1, 0], normal: [1, 0, 0], radius: 3, circulation: 1}\n", FLOOR, "flow.0.center", "comes 2 m"),
        (
            "  - {type: vortex, center: [2, 0, 0], axis: [0, 0, 1], circulation: 1, travel: [1, 0, 0]}\n",
            CYLINDER,
            "flow.0.travel",
            "would not travel like what it answers",
        ),
        (
            "  - {type: vortex, center: [0, 1, 0], axis: [0, 0, 1], circulation: 1, travel: [0, -2, 0]}\n",
            FLOOR,
            "flow.0.center",
            "comes 1 m behind",
        ),
        ("  - {type: uniform, velocity: [1, 0, 0]}\n", CYLINDER + CYLINDER, "obstacles.1.type", "where it is alone"),
        (
            "  - {type: uniform, velocity: [1, 0, 0]}\n",
            FLOOR + CYLINDER,
            "obstacles.1.type",
            "obstacles.0 and obstacles.1 both answer flow.0",
        ),
        (
            "  - {type: uniform, velocity: [1, 0, 0]}\n",
            FLOOR + "  - {type: wall, center: [0, 2, 0], normal: [0, -1, 0]}\n",
            "obstacles.1.normal",
            "perpendicular to that of obstacles.0",
        ),
    ],
)
def test_what_has_no_exact_image_is_refused_in_its_place(flow, obstacles, path, words):
    ((where, message),) = told(flow, obstacles)
    assert where == path and words in message


def test_the_message_says_how_to_leave_it_alone():
    flow = "  - {name: wind, type: uniform, velocity: [1, 0, 0]}\n  - {type: rotation, angular_velocity: 1}\n"
    ((_, message),) = told(flow, CYLINDER)
    assert "answers: [wind]" in message
    load_text(f"{HEAD}{flow}obstacles:\n{CYLINDER.replace('radius: 0.5', 'radius: 0.5, answers: [wind]')}", "x.yaml")


def test_several_obstacles_share_a_flow_by_name():
    flow = "  - {name: a, type: source, center: [2, 1, 0], axis: [0, 0, 1], rate: 1}\n  - {name: b, type: uniform, velocity: [1, 0, 0]}\n"
    obstacles = CYLINDER.replace("}", ", answers: [b]}") + FLOOR.replace("}", ", answers: [a]}")
    load_text(f"{HEAD}{flow}obstacles:\n{obstacles}", "x.yaml")


def test_an_unknown_name_is_told_with_a_suggestion():
    flow = "  - {name: wind, type: uniform, velocity: [1, 0, 0]}\n"
    with pytest.raises(SceneError) as refused:
        load_text(f"{HEAD}{flow}obstacles:\n{CYLINDER.replace('}', ', answers: [wnd, 7]}')}", "x.yaml")
    first, second = refused.value.problems
    assert first.path == "obstacles.0.answers.0" and first.suggestion == "wind" and "there is no flow.7" in second.message


def test_feels_knows_obstacles_by_name():
    system = "systems: {p: {type: particles, coupling: tracer, feels: {flow: [wind, mast, maast, 1]}}}\n"
    flow = "  - {name: wind, type: uniform, velocity: [1, 0, 0]}\n"
    with pytest.raises(SceneError) as refused:
        load_text(f"{HEAD}{flow}obstacles:\n{CYLINDER.replace('{', '{name: mast, ')}{system}", "x.yaml")
    guess, number = refused.value.problems
    assert guess.suggestion == "mast" and "there is no flow.1" in number.message


def test_a_name_is_a_primitives_or_an_obstacles():
    flow = "  - {name: mast, type: uniform, velocity: [1, 0, 0]}\n"
    ((where, message),) = told(flow, CYLINDER.replace("{", "{name: mast, "))
    assert where == "obstacles.0.name" and "taken by flow.0" in message


def test_many_mistakes_are_told_once_each_and_soon():
    flow = "".join(f"  - {{type: uniform, velocity: [{k}, 0, 0]}}\n" for k in range(300))
    ((where, _),) = told(flow, CYLINDER + CYLINDER)
    assert where == "obstacles.1.type"


def test_a_cylinder_needs_a_radius():
    ((where, message),) = told("  - {type: uniform, velocity: [1, 0, 0]}\n", "  - {type: cylinder, axis: [0, 0, 1]}\n")
    assert where.startswith("obstacles.0") and "radius" in where + message
