"""Outlines: what moves the air is drawn where it is."""

import numpy as np
import pytest

from tests.physics.scenes import scene
from warpsim.observers.viewer.outlines import scene_outlines


def points_of(**flow) -> np.ndarray:
    return np.array(scene_outlines(scene(flow=[flow]))["flow"]).reshape(-1, 3)


@pytest.mark.parametrize("radius", [0.7, {"keyframes": [[0, 0.7], [1, 2.0]]}, {"sine": {"mean": 0.7, "amplitude": 0.1, "period": 1}}])
def test_a_ring_is_a_circle_across_its_normal(radius):
    points = points_of(type="vortex_ring", center=[1, 2, 3], normal=[0, 3, 0], radius=radius, circulation=1.0) - [1, 2, 3]
    rim = points[np.abs(points[:, 1]) < 1e-9]
    assert len(rim) > 90 and np.linalg.norm(rim, axis=1).max() == pytest.approx(0.7) and points[:, 1].max() == pytest.approx(0.35)


def test_a_ring_whose_radius_is_a_formula_is_drawn_at_some_size():
    points = points_of(type="vortex_ring", radius={"expression": "1 + t"}, circulation=1.0)
    assert len(points) > 90 and np.isfinite(points).all()


def test_a_segment_goes_from_its_start_to_its_end():
    points = points_of(type="vortex_segment", start=[0, 0, 1], end=[2, 0, 1], circulation=1.0, core={"model": "scully", "radius": 0.2})
    assert (points[0] == [0, 0, 1]).all() and (points[1] == [2, 0, 1]).all()
    around = points[np.abs(points[:, 0] - 1.0) < 1e-9]
    assert np.linalg.norm(around - [1, 0, 1], axis=1) == pytest.approx(np.full(len(around), 0.2)), "its core, round its middle"


def test_what_is_everywhere_has_no_outline():
    assert len(points_of(type="curl_noise", amplitude=1.0, length=1.0)) == len(points_of(type="expression", velocity=["0", "0", "0"])) == 0
