"""What the page draws of networks: a surface shaded from both sides, springs as ribbons, both moving with the points."""

import numpy as np
import pytest

from tests.browser import Browser, find_chromium
from tests.simulation.networks import simulate
from tests.viewer.page import picture
from tests.viewer.test_browser import show
from warpsim.observers.html import HtmlRecording
from warpsim.observers.viewer import Viewer

pytestmark = pytest.mark.skipif(find_chromium() is None, reason="no Chromium is installed")
CLOTH = {"type": "cloth", "resolution": [5, 5], "corner": [-1, 1, 0], "edges": [[2, 0, 0], [0, -2, 0]], "structural": {"stiffness": 10}}
STAGE = {"viewer": {"sky": "night", "ground": False}}


@pytest.fixture(scope="module")
def browser():
    with Browser((400, 300)) as browser:
        yield browser


def seen(browser, side: float, move: float, **look) -> np.ndarray:
    """Return the picture of a red cloth seen from z = 5 or from behind, moved to the right."""
    camera = {"eye": [0, 0, 5 * side], "target": [0, 0, 0], "field_of_view": 40}
    sim = simulate(**CLOTH, look={"color": "#ff0000", **look}, more={**STAGE, "camera": camera})
    with Viewer(sim.scene, port=0) as viewer:
        page = browser.open(viewer.url)
        assert viewer.wait_for_client(60.0)
        show(viewer, page, sim.frame())
        if move:
            field = sim.systems["s"].population.field("position")
            array = field.numpy()
            array[0] += np.float32(move)
            field.assign(array)
            sim.step_frame()
            show(viewer, page, sim.frame())
        shown = picture(page).astype(int)
        assert page.complaints() == []
    return shown


def red(shown: np.ndarray) -> np.ndarray:
    return (shown[..., 0] > 60) & (shown[..., 0] > 2 * shown[..., 1])


@pytest.mark.parametrize("side", [1, -1], ids=["front", "back"])
def test_a_surface_is_seen_from_both_sides(browser, side):
    shown = red(seen(browser, side, 0.0))
    assert shown[150, 200] and shown[100, 150] and not shown[20, 20] and shown.mean() > 0.2


def test_a_surface_moves_with_its_points(browser):
    here, there = red(seen(browser, 1, 0.0)), red(seen(browser, 1, 1.2))
    middle = [np.nonzero(shown)[1].mean() for shown in (here, there)]
    assert middle[1] > middle[0] + 40


def test_springs_are_lines_with_holes_between(browser):
    shown = red(seen(browser, 1, 0.0, show=["springs"], width=0.03))
    assert 0.01 < shown.mean() < 0.15 and shown[:, 190:210].any()


def test_a_film_holds_what_joins_the_points(tmp_path):
    sim = simulate(**CLOTH)
    with HtmlRecording(tmp_path / "x.html", sim.scene, 60.0) as film:
        film.add(sim.frame())
    text = (tmp_path / "x.html").read_text()
    assert text.count('class="commands"') == 2 and text.count('class="frame"') == 1 and "class Net" in text
