"""A real run seen through the viewer: the numbers of the simulation arrive, and watching changes none of them."""

import io
import threading
from contextlib import suppress

import numpy as np
import pytest
from PIL import Image
from websocket import WebSocketException

from tests.browser import Browser, find_chromium
from tests.viewer.watcher import Watcher, eventually
from warpsim import Simulation, load_scene
from warpsim.observers.viewer import Viewer


@pytest.fixture(scope="module")
def scene():
    return load_scene("campfire")


def quantum(positions: np.ndarray) -> np.ndarray:
    """Return half a step of the quantization [m], with the rounding of float32."""
    return 0.51 * np.ptp(positions, axis=0) / 65535 + 4 * np.spacing(np.abs(positions).max(axis=0, initial=1e-6))


def test_what_a_page_gets_is_what_the_simulation_holds(scene):
    simulation = Simulation(scene, device="cpu", threads=1)
    with Viewer(scene, port=0) as viewer, Watcher(viewer.url) as watcher:
        assert viewer.wait_for_client(30.0)
        for frame in simulation.frames(3):
            assert eventually(viewer.wants_frame)
            viewer.publish(frame)
            seen = watcher.read_frame()
            watcher.ack(seen.number)
            assert seen.time == frame.time
            for slot, name in enumerate(frame):
                system = frame[name]
                assert seen.blocks[slot, 7] == system.count == len(seen.blocks[slot, 0])
                assert (np.abs(seen.blocks[slot, 0][:, :3] - system.position) <= quantum(system.position)).all()
                stops = list(zip(*scene.systems[name].look.size.stops, strict=True))
                size = seen.blocks[slot, 0][:, 3] * seen.blocks[slot, 6][0, 0]
                # Size over life comes from a table of 256 steps, so it may be off by the table's steepest.
                steepest = np.abs(np.diff(np.interp(np.linspace(0, 1, 257), *stops))).max()
                np.testing.assert_allclose(size, np.interp(system.age / system.lifetime, *stops), rtol=0, atol=steepest + 1e-4)


def test_watching_changes_nothing(scene):
    alone = Simulation(scene, device="cpu")
    for _ in alone.frames(30):
        pass
    watched = Simulation(scene, device="cpu")
    stop = threading.Event()

    def come_and_go(url: str) -> None:
        while not stop.is_set():
            with suppress(WebSocketException, OSError), Watcher(url) as watcher:
                for _ in range(3):
                    watcher.ack(watcher.read_frame().number)
            with suppress(WebSocketException, OSError):
                Watcher(url).reset()

    with Viewer(scene, port=0) as viewer:
        visitor = threading.Thread(target=come_and_go, args=(viewer.url,))
        visitor.start()
        try:
            assert viewer.wait_for_client(30.0)
            for frame in watched.frames(30):
                assert eventually(viewer.wants_frame)
                viewer.publish(frame)
        finally:
            stop.set()
            viewer.close()
            visitor.join(30)
    assert watched.state_hash() == alone.state_hash()


@pytest.mark.skipif(find_chromium() is None, reason="no Chromium is installed")
def test_the_campfire_glows(scene):
    simulation = Simulation(scene, device="cpu")
    with Browser((480, 360)) as browser, Viewer(scene, port=0) as viewer:
        page = browser.open(viewer.url)
        assert viewer.wait_for_client(60.0)
        for frame in simulation.frames(60):
            if viewer.wants_frame():
                viewer.publish(frame)
        assert eventually(viewer.wants_frame)
        viewer.publish(simulation.frame())
        page.wait_for(f"stream.number === {viewer._hub.number} && stream.unanswered === null")
        assert page.run("stream.clouds.map(cloud => cloud.live)") == [simulation.frame()[name].count for name in scene.systems]
        assert page.complaints() == []
        shown = np.asarray(Image.open(io.BytesIO(page.picture())).convert("RGB")).astype(int)
    red, green, blue = np.moveaxis(shown, 2, 0)
    fire = (red > 150) & (red > green) & (green > blue)
    assert fire.mean() > 0.01, "no flames"
    assert np.median(shown) < 40, "not at night"
    # The hottest is yellow, the rim red: green over red falls from the heart outward.
    assert (green[fire] / red[fire]).max() > 0.6 and (green[fire] / red[fire]).min() < 0.45
