"""Sheets that meet themselves: the distance of their layers, and mistakes in it."""

import math

import pytest

from tests.scene.test_networks import CLOTH
from warpsim import SceneError
from warpsim.scene import load_text
from warpsim.scene.layers import SPARE, layers_of, least_core

DEFAULT = SPARE * math.hypot(1 / 4, 1 / 3) / math.sqrt(2)
KEY = CLOTH + "    self_collision: "


@pytest.mark.parametrize(
    ("value", "says", "suggestion"),
    [
        ("{distance: 0.1}", "slip between the points of another (allowed: 0.325 to 1.17 m; with more points less)", None),
        ("{distance: 2}", "no fold would be so wide (allowed: 0.325 to 1.17 m", None),
        ("{distance: 0}", "greater than 0", None),
        ("{distanc: 0.4}", "distanc", "distance"),
        ("{friction: -1}", "from 0", None),
        ("yes", "true or false or a mapping {distance, friction}", "true"),
        ("0.4", "true or false or a mapping {distance, friction}", None),
    ],
)
def test_a_mistake_is_named_where_it_stands(value, says, suggestion):
    with pytest.raises(SceneError) as refused:
        load_text(KEY + value + "\n", "x.yaml")
    problem = refused.value.problems[0]
    assert says in problem.message and problem.suggestion == suggestion and problem.line == 8, str(refused.value)


@pytest.mark.parametrize(("value", "distance", "friction"), [
    ("false", None, None), ("true", DEFAULT, 0.3), ("{}", DEFAULT, 0.3),
    ("{distance: 0.325}", 0.325, 0.3), ("{distance: 1.17, friction: 2}", 1.17, 2.0),
])  # fmt: skip
def test_layers_are_as_far_apart_as_is_asked_or_needed(value, distance, friction):
    layers = load_text(KEY + value + "\n", "x.yaml").systems["s"].layers
    assert (layers is None) == (distance is None)
    assert layers is None or (layers.distance, layers.friction) == pytest.approx((distance, friction))


def test_the_least_core_is_that_of_the_worst_edge_and_triangle():
    """Squares: an edge as long as a diagonal across the middle of another diagonal, both halved by the crossing: c = a."""
    assert least_core([[1, 0, 0], [0, 0, 2]], (6, 11)) == pytest.approx(0.2)
    assert least_core([[3, 0, 0], [0, 1, 0]], (4, 2)) == pytest.approx(1.0)
    assert least_core([[1, 0, 0], [0, 3, 0]], (2, 2)) == pytest.approx(math.sqrt(10) / math.sqrt(2))
    rhombus = least_core([[1, 0, 0], [0.5, math.sqrt(0.75), 0]], (2, 2))  # its short diagonal makes triangles of equal sides
    assert rhombus == pytest.approx(math.hypot(math.sqrt(3) / 2, math.sqrt(3) / 2))
    assert layers_of(False, [[1, 0, 0], [0, 1, 0]], (3, 3)) is None
