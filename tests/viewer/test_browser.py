"""The page in a real headless Chromium: what was published is what it holds, draws and asks more of."""

import threading
import time
from types import SimpleNamespace
from urllib.parse import urlsplit

import numpy as np
import pytest
from PIL import Image

from tests.browser import Browser, find_chromium, screenshot
from tests.viewer.fake_run import DUST, FakeFrame, FakeSystem, dust, fake_scene
from tests.viewer.page import picture, read_positions
from tests.viewer.watcher import eventually
from warpsim.observers.viewer import Viewer

pytestmark = pytest.mark.skipif(find_chromium() is None, reason="no Chromium is installed")

CAMERA = SimpleNamespace(eye=(0.0, 0.0, 4.0), target=(0.0, 0.0, 0.0), field_of_view=40.0)


@pytest.fixture(scope="module")
def browser():
    with Browser((640, 480)) as browser:
        yield browser


def show(viewer: Viewer, page, frame) -> None:
    """Publish `frame` and wait until the page has drawn it."""
    assert eventually(viewer.wants_frame)
    viewer.publish(frame)
    page.wait_for(f"stream.number === {viewer._hub.number} && stream.unanswered === null")


def test_the_page_holds_what_was_published_and_asks_for_more(browser):
    with Viewer(DUST, port=0) as viewer:
        page = browser.open(viewer.url)
        assert viewer.wait_for_client(60.0)
        # Growing, shrinking, empty, and growing again within the buffers: the cases of a buffer kept in place.
        held = []
        for index, count in enumerate((1000, 3000, 10, 0, 2500, 4400)):
            frame = dust(index, count)
            show(viewer, page, frame)
            held.append(page.run("viewer.renderer.info.memory.geometries"))
            assert page.run("stream.clouds[0].points.geometry.drawRange.count") == count
            system = frame["dust"]
            quantum = np.ptp(system.position, axis=0) / 65535 if count else np.ones(3)
            assert np.abs(read_positions(page) - system.position).max(initial=0.0) <= (quantum + 1e-6).max()
            color = page.run(f"Array.from(stream.clouds[0].points.geometry.attributes.color.array.slice(0, {4 * count}))")
            np.testing.assert_array_equal(np.reshape(color, (-1, 4)), system.color)
        assert len(set(held)) == 1  # outgrown buffers are given back
        page.wait_for("document.getElementById('hud').textContent.includes('dust')")
        assert "Fake" in page.run("document.getElementById('hud').textContent")
        assert page.run("viewer.renderer.getContext().getError()") == 0
        assert page.complaints() == []


def test_a_reloaded_page_and_a_second_tab_see_the_latest_frame(browser):
    with Viewer(DUST, port=0) as viewer:
        page = browser.open(viewer.url)
        assert viewer.wait_for_client(60.0)
        show(viewer, page, dust(1, 500))
        page.reload()
        page.wait_for("typeof stream !== 'undefined' && stream.clouds.length === 1 && stream.clouds[0].count === 500")
        second = browser.open(viewer.url)
        second.wait_for("typeof stream !== 'undefined' && stream.clouds.length === 1 && stream.clouds[0].count === 500")
        assert page.complaints() == [] and second.complaints() == []


def test_the_page_waits_for_the_next_run_and_joins_it(browser):
    with Viewer(DUST, port=0) as viewer:
        page = browser.open(viewer.url)
        assert viewer.wait_for_client(60.0)
        show(viewer, page, dust(1, 50))
        page.run("viewer.camera.position.set(1, 2, 3), viewer.controls.dispatchEvent({type: 'start'})")
    page.wait_for("document.getElementById('hud').textContent.includes('ended') && stream.number === 0")
    with Viewer(DUST, port=urlsplit(viewer.url).port) as viewer:
        assert viewer.wait_for_client(60.0)
        show(viewer, page, dust(2, 60))
        assert page.run("stream.clouds[0].count") == 60
        assert page.run("viewer.camera.position.toArray()") == pytest.approx([1, 2, 3])  # where the person put it


def test_the_camera_of_the_scene_is_the_camera_of_the_page_and_y_is_up(browser):
    red, green = [255, 0, 0, 255], [0, 255, 0, 255]
    # One ball to the right, one above: as seen by a camera on the positive z axis.
    balls = FakeSystem([[0.8, 0, 0], [0, 0.8, 0]], np.array([red, green], np.uint8), np.full(2, 0.4, np.float32))
    with Viewer(fake_scene({"balls": ("points", "alpha")}, CAMERA), port=0) as viewer:
        page = browser.open(viewer.url)
        assert viewer.wait_for_client(60.0)
        show(viewer, page, FakeFrame(1, {"balls": balls}))
        shown = picture(page)
    height, width, _ = shown.shape
    scale = 0.5 * height / np.tan(np.radians(20.0)) / 4.0  # pixels per metre at the target
    for channel, other, place in ((0, 1, (0.8, 0.0)), (1, 0, (0.0, 0.8))):
        rows, columns = np.nonzero((shown[:, :, channel] > 90) & (shown[:, :, other] < 60))
        center = columns.mean() - width / 2, height / 2 - rows.mean()
        assert center == pytest.approx([place[0] * scale, place[1] * scale], abs=6)  # shading moves the middle of the bright part
        assert np.ptp(columns) == pytest.approx(0.4 * scale, rel=0.1)  # size is a diameter in metres


NO_FLOATS = """
    const get = WebGL2RenderingContext.prototype.getExtension;
    WebGL2RenderingContext.prototype.getExtension = function (name) {
        return name === "EXT_color_buffer_float" ? null : get.call(this, name);
    };
"""


@pytest.mark.parametrize("floats", [True, False], ids=["floats", "no floats"])
def test_light_adds_up_to_white_heat_on_any_graphics_card(browser, floats):
    orange = np.array([[255, 128, 20, 128]], np.uint8)
    with Viewer(fake_scene({"s": ("sprites", "additive")}, CAMERA), port=0) as viewer:
        page = browser.open("about:blank")
        if not floats:
            page.command("Page.addScriptToEvaluateOnNewDocument", source=NO_FLOATS)
        page.visit(viewer.url)
        assert viewer.wait_for_client(60.0)
        page.wait_for("stage.scene !== null")
        assert page.run("glow.on") is floats
        middle = []
        for index, layers in enumerate((1, 4, 40)):
            system = FakeSystem(np.zeros((layers, 3)), orange.repeat(layers, 0), np.full(layers, 0.5, np.float32))
            show(viewer, page, FakeFrame(index, {"s": system}))
            shown = picture(page)
            middle.append(shown[shown.shape[0] // 2, shown.shape[1] // 2])
    one, four, forty = middle
    assert (four >= one).all() and (forty >= four).all() and four.sum() > one.sum()
    assert one[0] > one[1] > one[2] and forty[0] > 250 and forty[1] > 200  # from orange to yellow
    assert page.complaints() == []


def test_the_camera_finds_the_cloud_when_the_scene_has_none(browser):
    with Viewer(DUST, port=0) as viewer:
        page = browser.open(viewer.url)
        assert viewer.wait_for_client(60.0)
        cloud = FakeSystem(np.random.default_rng(0).normal(size=(500, 3)) * 30 + [400, 1000, -50])
        show(viewer, page, FakeFrame(0, {"dust": FakeSystem(np.zeros((0, 3)))}))  # nothing to see yet
        for index in range(1, 12):
            show(viewer, page, FakeFrame(index, {"dust": cloud}))
        inside = page.run("""(() => {
            const camera = viewer.camera, box = stream.clouds[0].box(), at = box.getCenter(box.min.clone());
            camera.updateMatrixWorld();
            const seen = at.clone().project(camera);
            return [seen.x, seen.y, camera.position.distanceTo(at), camera.far];
        })()""")
    assert abs(inside[0]) < 0.2 and abs(inside[1]) < 0.2 and 60 < inside[2] < 1000 < inside[3]


def test_names_are_words_not_markup(browser):
    name = "<img src=x onerror=window.broken=1>"
    with Viewer(fake_scene({name: ("sprites", "additive"), "a/<object>/b": ("points", "alpha")}, None, name), port=0) as viewer:
        page = browser.open(viewer.url)
        assert viewer.wait_for_client(60.0)
        show(viewer, page, FakeFrame(1, {name: FakeSystem(np.zeros((1, 3))), "a/<object>/b": FakeSystem(np.ones((2, 3)))}))
        assert name in page.run("document.getElementById('hud').textContent")
        assert page.run("window.broken === undefined && document.images.length === 0")
        assert page.run("stream.clouds.map(c => c.count)") == [1, 2]


def test_screenshot_shows_the_particles(tmp_path):
    path, stop = tmp_path / "shot.png", threading.Event()
    with Viewer(fake_scene({"dust": ("sprites", "additive")}), port=0) as viewer:

        def play() -> None:
            index = 0
            while not stop.is_set():
                if viewer.wants_frame():
                    viewer.publish(dust(index := index + 1))
                time.sleep(0.01)

        player = threading.Thread(target=play)
        player.start()
        try:
            screenshot(viewer.url, path, seconds=0.5, size=(400, 300))
        finally:
            stop.set()
            player.join()
    shown = np.asarray(Image.open(path).convert("RGB")).astype(int)
    assert shown.shape == (300, 400, 3)
    assert (shown[100:200, 100:300].max(axis=2) > 128).sum() > 20 and np.median(shown) < 40
