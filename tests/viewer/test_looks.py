"""What the page draws: near smoke over far smoke in any order, trails behind what moves, lines that come and go."""

from types import SimpleNamespace

import numpy as np
import pytest

from benchmarks import viewer as benchmark
from tests.browser import Browser, find_chromium
from tests.viewer.fake_run import FakeFrame, FakeSystem, fake_scene
from tests.viewer.page import picture
from tests.viewer.test_browser import CAMERA, show
from warpsim.observers.viewer import Viewer

pytestmark = pytest.mark.skipif(find_chromium() is None, reason="no Chromium is installed")


@pytest.fixture(scope="module")
def browser():
    with Browser((400, 300)) as browser:
        yield browser


def middle(page) -> np.ndarray:
    shown = picture(page)
    return shown[shown.shape[0] // 2, shown.shape[1] // 2]


@pytest.mark.parametrize("side", [1, -1], ids=["front", "back"])
def test_near_smoke_covers_far_smoke_whatever_the_order_of_birth(browser, side):
    depth = np.linspace(-1.0, 1.0, 200)
    color = np.zeros((200, 4), np.uint8)
    color[:, 3] = 60
    color[:, 0], color[:, 2] = np.where(depth > 0, 255, 0), np.where(depth > 0, 0, 255)  # red toward positive z
    camera = SimpleNamespace(eye=(0.0, 0.0, 4.0 * side), target=(0.0, 0.0, 0.0), field_of_view=40.0)
    shuffled = np.random.default_rng(1).permutation(200)
    with Viewer(fake_scene({"smoke": ("sprites", "alpha")}, camera), port=0) as viewer:
        page = browser.open(viewer.url)
        assert viewer.wait_for_client(60.0)
        seen = []
        for index, order in enumerate((np.arange(200), np.arange(200)[::-1], shuffled)):
            place = np.stack([np.zeros(200), np.zeros(200), depth[order]], axis=1)
            show(viewer, page, FakeFrame(index, {"smoke": FakeSystem(place, color[order], np.full(200, 0.5, np.float32))}))
            keys = page.run(
                "(() => { const c = stream.clouds[0], p = c.points.geometry; return Array.from(p.index.array.slice(0, c.count)); })()"
            )
            assert sorted(keys) == list(range(200))
            assert (np.diff(side * depth[order][keys]) >= 0).all()  # from far to near
            seen.append(middle(page))
        red, green, blue = np.transpose(seen)
        assert (red > 200).all() and (blue < 60).all() if side == 1 else (blue > 200).all() and (red < 60).all()
        assert np.ptp(seen, axis=0).max() <= 3
        # Turning round to the other side turns the order round, without a new frame.
        page.run(f"viewer.camera.position.set(0, 0, {-4 * side}), viewer.controls.update(), viewer.set_dirty(), viewer.render()")
        turned = middle(page)
        assert turned[0 if side == -1 else 2] > 200
        assert page.complaints() == []


@pytest.mark.parametrize("blend", ["alpha", "additive"])
def test_trails_follow_and_fade(browser, blend):
    points = 8
    ends = np.array([[-1.0, 0.5, 0.0], [1.0, 0.5, 0.0], [-1.0, -0.5, 0.0], [1.0, -0.5, 0.0]])
    color = np.array([[220, 40, 20, 255]] * 2, np.uint8)
    system = FakeSystem(ends, np.full((4, 4), 255, np.uint8), np.full(4, 0.05, np.float32))
    packed = system.packed()
    packed.trail = np.zeros((2, points, 4), np.uint16)
    packed.trail[:, :, 0] = np.linspace(0, 65535, points)  # from left to right, one above and one below
    packed.trail[0, :, 1] = 65535
    packed.trail_color = color
    system.packed = lambda limit=None: packed
    with Viewer(fake_scene({"s": ("sprites", blend)}, CAMERA, gray=0.2, ground=False), port=0) as viewer:
        page = browser.open(viewer.url)
        assert viewer.wait_for_client(60.0)
        show(viewer, page, FakeFrame(1, {"s": FakeSystem(ends)}))
        without = picture(page)
        show(viewer, page, FakeFrame(2, {"s": system}))
        shown = np.abs(picture(page) - without).sum(axis=2)
        assert page.run("viewer.renderer.getContext().getError()") == 0 and page.complaints() == []
    height, width = shown.shape
    scale = 0.5 * height / np.tan(np.radians(20.0)) / 4.0
    for sign in (1, -1):
        row = round(height / 2 - sign * 0.5 * scale)
        band = shown[row - 4 : row + 5].max(axis=0)
        line = [band[round(width / 2 + x * scale) - 3 : round(width / 2 + x * scale) + 4].mean() for x in (-0.6, 0.0, 0.6)]
        assert line[0] < line[1] < line[2] and line[2] > 60  # it fades toward where it was
    assert shown[height // 2 - 6 : height // 2 + 7].max() <= 12  # nothing between two trails


def test_lines_are_drawn_and_hidden_by_a_tick(browser):
    paths = np.zeros((3, 20, 3), np.float32)
    paths[:, :, 0] = np.linspace(-1, 1, 20)
    paths[:, :, 1] = np.array([-0.5, 0.0, 0.5])[:, None]
    with Viewer(fake_scene({"s": ("sprites", "additive")}, CAMERA, ground=False), port=0) as viewer:
        page = browser.open(viewer.url)
        assert viewer.wait_for_client(60.0)
        show(viewer, page, FakeFrame(1, {"s": FakeSystem(np.zeros((0, 3)))}))
        page.run("document.body.classList.add('bare')")
        dark = picture(page)
        viewer.show_lines(paths)
        page.wait_for("stream.lines.drawn.size === 1 && document.querySelector('#panel input[type=checkbox]') !== null")
        page.run("viewer.render()")
        assert np.abs(picture(page) - dark).sum() > 5000
        page.run("document.querySelector('#panel input[type=checkbox]').click(), viewer.render()")
        assert np.abs(picture(page) - dark).max() <= 3
        viewer.show_lines(paths[:1])  # a hidden kind stays hidden when it comes anew
        page.wait_for("stream.lines.drawn.get('streamlines').geometry.attributes.position.count === 38")
        assert page.run("stream.lines.drawn.get('streamlines').visible") is False


@pytest.mark.parametrize("sky", ["night", "dusk", "day"])
def test_the_scene_may_choose_its_sky(browser, sky):
    with Viewer(fake_scene({"s": ("points", "alpha")}, CAMERA, sky=sky), port=0) as viewer:
        page = browser.open(viewer.url)
        page.wait_for("stage.scene !== null")
        assert page.run("document.body.className") == sky and page.run("glow.on") is (sky == "night")
        page.run("viewer.render()")
        assert (np.median(picture(page)) > 128) is np.bool_(sky == "day")


def test_the_figures_can_be_measured(browser):
    rate, delay = benchmark.ours(browser, 2_000, 0.5)
    assert rate > 0.0 and delay > 0.0
    size, playing, cost = benchmark.recording(browser, 60, 500)
    assert 0.1 < size < 2.0 and playing > 0.0 and cost > 0.0
