"""What the page draws of networks: a surface shaded from both sides, springs as ribbons, both moving with the points."""

import numpy as np
import pytest

from tests.browser import Browser, find_chromium
from tests.simulation.networks import simulate
from tests.viewer.page import picture
from tests.viewer.test_browser import show
from warpsim import Scene, Simulation
from warpsim.observers.html import HtmlRecording
from warpsim.observers.recorder import Recorder
from warpsim.observers.viewer import Viewer
from warpsim.replay import Recording
from warpsim.scene.resolved import resolved_yaml

pytestmark = pytest.mark.skipif(find_chromium() is None, reason="no Chromium is installed")
CLOTH = {"type": "cloth", "resolution": [5, 5], "corner": [-1, 1, 0], "edges": [[2, 0, 0], [0, -2, 0]], "structural": {"stiffness": 10}}
STAGE = {"viewer": {"sky": "night", "ground": False}}


@pytest.fixture(scope="module")
def browser():
    with Browser((400, 300)) as browser:
        yield browser


def seen(browser, side: float, move: float, fold: float = 0.0, **look) -> np.ndarray:
    """Return the picture of a red cloth seen from z = 5 or from behind, moved to the right, folded so that z = fold |x|."""
    camera = {"eye": [0, 0, 5 * side], "target": [0, 0, 0], "field_of_view": 40}
    sim = simulate(**CLOTH, look={"color": "#ff0000", **look}, more={**STAGE, "camera": camera})
    with Viewer(sim.scene, port=0) as viewer:
        page = browser.open(viewer.url)
        assert viewer.wait_for_client(60.0)
        show(viewer, page, sim.frame())
        if move or fold:
            field = sim.systems["s"].population.field("position")
            array = field.numpy()
            array[0] += np.float32(move)
            array[2] += np.float32(fold) * np.abs(array[0])
            field.assign(array)
            sim.step_frame()
            show(viewer, page, sim.frame())
        page.run("document.body.classList.add('bare')")  # no words, no boxes
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


@pytest.mark.parametrize("side", [1, -1], ids=["front", "back"])
def test_a_fold_is_seen_by_its_shade(browser, side):
    """A ridge toward the eye; the sun stands before it, on the left. Its left half is the brighter one by more than a tenth: from the front
    it faces the sun, and from behind, where left is right, the sun shines through it more straightly."""
    shown = seen(browser, side, 0.0, fold=-0.8 * side)[..., 0]
    left, right = shown[120:180, 130:180].mean(), shown[120:180, 220:270].mean()
    assert right > 60 and left > 1.1 * right


def test_springs_are_lines_with_holes_between(browser):
    shown = red(seen(browser, 1, 0.0, show=["springs"], width=0.03))
    assert 0.01 < shown.mean() < 0.15 and shown[:, 190:210].any()


def test_a_film_holds_what_joins_the_points(tmp_path):
    sim = simulate(**CLOTH)
    with HtmlRecording(tmp_path / "x.html", sim.scene, 60.0) as film:
        film.add(sim.frame())
    text = (tmp_path / "x.html").read_text()
    assert text.count('class="commands"') == 2 and text.count('class="frame"') == 1 and "class Net" in text


S = "document.dispatchEvent(new KeyboardEvent('keydown', {key: 's', bubbles: true}))"
BOXES = "[...document.querySelectorAll('#panel .check')].map((l) => [l.textContent, l.firstChild.checked, l.firstChild.indeterminate])"
RIBBONS = "stream.clouds.map((cloud) => cloud.net.ribbons.visible && cloud.net.ribbons.geometry.instanceCount)"


def test_springs_are_drawn_on_the_surface_by_a_key_and_by_a_box(browser):
    """The sheet stays; dark lines come upon it and go. Its 5 x 5 points have 40 + 32 springs, and 30 to the next but one."""
    camera = {"eye": [0, 0, 5], "target": [0, 0, 0], "field_of_view": 40}
    sim = simulate(**CLOTH, look={"color": "#ff0000"}, more={**STAGE, "camera": camera})
    with Viewer(sim.scene, port=0) as viewer:
        page = browser.open(viewer.url)
        assert viewer.wait_for_client(60.0)
        show(viewer, page, sim.frame())
        assert page.run(BOXES) == [["points", False, False], ["springs", False, False], ["surface", True, False]]
        page.run("document.body.classList.add('bare')")
        bare = picture(page)
        page.run(S)
        assert page.run(RIBBONS) == [102] and page.run(BOXES)[1] == ["springs", True, False]
        lined = picture(page)
        darker = red(bare) & (lined[..., 0] < 0.7 * bare[..., 0])
        assert 0.05 < darker.sum() / red(bare).sum() < 0.4 and red(lined).sum() > 0.7 * red(bare).sum()
        sim.step_frame()
        show(viewer, page, sim.frame())
        assert page.run(RIBBONS) == [102]
        page.reload()  # its own wishes are a page's own
        show(viewer, page, sim.frame())
        page.wait_for("stream.clouds.length === 1 && stream.clouds[0].net !== null")
        assert page.run(RIBBONS) == [False]
        page.run("document.querySelectorAll('#panel .check input')[1].click()")
        assert page.run(RIBBONS) == [102]
        page.run("document.querySelectorAll('#panel .check input')[2].click(), document.body.classList.add('bare')")
        assert page.run(BOXES)[2] == ["surface", False, False] and red(picture(page)).mean() < 0.5 * red(bare).mean()
        page.run(S)
        assert page.run(RIBBONS) == [False]
        assert page.complaints() == []


def test_a_key_goes_to_and_fro_between_the_scene_and_all_or_none(browser):
    """A rope shows its springs, a cloth does not: all of them, then each as the scene has it. A rope alone: none, then its own."""
    rope = {"type": "springs", "points": [[0, 0, 0], [1, 0, 0]], "springs": [[0, 1]], "stiffness": 1.0}
    for systems, seen in ((dict(cloth=CLOTH, rope=rope), ([False, 1], [102, 1])), (dict(rope=rope), ([1], [False]))):
        sim = Simulation(Scene.model_validate({"name": "two", "systems": systems, **STAGE}), device="cpu", threads=1)
        with Viewer(sim.scene, port=0) as viewer:
            page = browser.open(viewer.url)
            assert viewer.wait_for_client(60.0)
            show(viewer, page, sim.frame())
            assert page.run(RIBBONS) == seen[0] and page.run(BOXES)[1][2] == (len(systems) == 2)
            for turn in (1, 0, 1):
                page.run(S)
                assert page.run(RIBBONS) == seen[turn]


def test_springs_of_a_film_are_drawn_on_demand(browser, tmp_path):
    sim = simulate(**CLOTH)
    with HtmlRecording(tmp_path / "x.html", sim.scene, 60.0) as film:
        for frame in sim.frames(3):
            film.add(frame)
    page = browser.open((tmp_path / "x.html").as_uri())
    page.wait_for("typeof player !== 'undefined' && player.shown === 2 && !player.playing")
    assert page.run(RIBBONS) == [False]
    page.run(S)
    assert page.run(RIBBONS) == [102]
    page.run("player.ask({type: 'seek', value: 0})")
    page.wait_for("player.shown === 0")
    assert page.run(RIBBONS) == [102] and page.complaints() == []


def test_what_is_torn_is_no_longer_drawn(browser, tmp_path):
    """The left half of a sheet loses its springs: it is gone, live and for a page that comes later; a film that goes back has it again."""
    camera = {"eye": [0, 0, 5], "target": [0, 0, 0], "field_of_view": 40}
    sim = simulate(**CLOTH, tear=10.0, look={"color": "#ff0000"}, more={**STAGE, "camera": camera})
    system = sim.systems["s"]
    with Viewer(sim.scene, port=0) as viewer, HtmlRecording(tmp_path / "x.html", sim.scene, 60.0) as film:
        page = browser.open(viewer.url)
        assert viewer.wait_for_client(60.0)
        show(viewer, page, sim.frame())
        film.add(sim.frame())
        page.run("document.body.classList.add('bare')")
        whole = red(picture(page))
        system.torn_springs.assign((system.net.points[system.net.springs][..., 0].min(axis=1) < 0.0).astype(np.int32))
        sim.step_frame()
        show(viewer, page, sim.frame())
        film.add(sim.frame())
        half = red(picture(page))
        assert half[:, 200:].sum() == pytest.approx(whole[:, 200:].sum(), rel=0.02) and half[:, :195].sum() < 0.02 * whole[:, :195].sum()
        page.run(S)
        left = (~sim.frame()["s"].torn).sum()
        assert page.run(RIBBONS) == [left] and 0 < left < 102
        page.reload()
        show(viewer, page, sim.frame())
        page.wait_for("stream.clouds.length === 1 && stream.clouds[0].net !== null && stream.clouds[0].last !== null")
        assert page.run("stream.clouds[0].net.triangles.length / 3") == 16 and page.complaints() == []
    page = browser.open((tmp_path / "x.html").as_uri())
    page.wait_for("typeof player !== 'undefined' && player.shown === 1 && !player.playing")
    assert page.run("stream.clouds[0].net.triangles.length / 3") == 16
    page.run("player.ask({type: 'seek', value: 0})")
    page.wait_for("player.shown === 0")
    assert page.run("stream.clouds[0].net.triangles.length / 3") == 32 and page.complaints() == []


def test_springs_of_a_recorded_run_are_drawn_on_demand(browser, tmp_path):
    """`view RUN`: the topology comes from the folder, the places from its frames; the wish outlasts going to and fro between them."""
    sim, recorder = simulate(**CLOTH), Recorder(tmp_path / "run")
    recorder.begin(resolved_yaml(sim.scene))
    for frame in (sim.frame(), *sim.frames(3)):
        recorder.record(frame, sim.statistics(), "0" * 32)
    recorder.close()
    recording = Recording(tmp_path / "run")
    with Viewer(recording.scene, port=0) as viewer:
        page = browser.open(viewer.url)
        assert viewer.wait_for_client(60.0)
        show(viewer, page, recording.frame(0))
        assert page.run(RIBBONS) == [False]
        page.run(S)
        for index in (3, 1):
            show(viewer, page, recording.frame(index))
            assert page.run(RIBBONS) == [102] and page.run(BOXES)[1] == ["springs", True, False]
        assert page.complaints() == []
