"""Bodies: where they point and how they roll, packed on the device, kept in a run folder, and drawn by a real browser."""

import numpy as np
import pytest

from tests.browser import Browser, find_chromium
from tests.kernels.flocks import flock
from tests.reference import render as twin
from tests.viewer.page import picture
from tests.viewer.test_browser import show
from warpsim import Scene, Simulation
from warpsim.observers.recorder import Recorder
from warpsim.observers.viewer import Viewer
from warpsim.replay import Recording
from warpsim.scene.resolved import resolved_yaml

SILENT = {"separation": 0, "cohesion": 0, "alignment": 0}
STAGE = {"viewer": {"sky": "night", "ground": False}, "camera": {"eye": [0, 0, 5], "target": [0, 0, 0], "field_of_view": 40}}


def test_headings_and_rolls_equal_the_twin(tmp_path, device, rng):
    """Steps of 1/127; float32 may round a half to the other side."""
    x, v = rng.normal(size=(200, 3)), rng.normal(size=(200, 3))
    steering = [{"type": "seek", "target": [9, 3, 1], "speed": 5, "weight": 3}]
    sim = Simulation(flock(tmp_path, x, v, steering=steering, mass=2.0, **SILENT), device=device)
    packed = sim.frame()["f"].packed()
    force = sim.systems["f"].steering.numpy()[:, :200].T.astype(float)
    expected = twin.headings(v.astype(np.float32).astype(float), force, 2.0)
    assert np.abs(packed.heading.astype(int) - expected).max() <= 1 and (packed.heading == expected).mean() > 0.99
    assert np.abs(expected[:, 3]).max() > 20


def test_a_carried_body_points_where_it_swims_also_in_a_replay(tmp_path):
    fish = {"type": "flock", "count": 3, "domain": {"min": [0, 0, 0], "max": [9, 9, 9]}, "perception": {"radius": 0.01}}
    fish |= {"coupling": {"alpha": 0.1}, "steering": [{"type": "seek", "target": [0, 99, 0]}], **SILENT}
    scene = {"name": "fish", "flow": [{"type": "uniform", "velocity": [2, 0, 0]}], "systems": {"f": fish}}
    sim = Simulation(Scene.model_validate(scene))
    recorder = Recorder(tmp_path / "run")
    recorder.begin(resolved_yaml(sim.scene))
    for _ in range(5):
        sim.step_frame()
        recorder.record(sim.frame(), sim.statistics(), sim.state_hash())
    recorder.close()
    fish = sim.frame()["f"]
    assert np.abs(fish.velocity - fish.swimming - [2, 0, 0]).max() < 1e-6 and np.abs(fish.swimming).max() > 0.5
    again = Recording(tmp_path / "run").frame(5)["f"]
    assert (again.swimming == fish.swimming).all() and (again.neighbors == fish.neighbors).all() and fish.neighbors.tolist() == [0, 0, 0]
    for packed in (fish.packed(), again.packed()):
        assert np.abs(packed.heading[:, :3].astype(int) - twin.headings(fish.swimming.astype(float), None, 1.0)[:, :3]).max() <= 1


@pytest.fixture(scope="module")
def browser():
    with Browser() as browser:
        yield browser


@pytest.mark.skipif(find_chromium() is None, reason="no Chromium is installed")
@pytest.mark.parametrize("kind", ["arrows", "birds", "fish"])
def test_bodies_are_drawn_along_their_headings(kind, browser, tmp_path):
    """One red body to the right, then one upward: what is drawn is longer along the heading than across it, but for wings, which span."""
    spans = []
    for course in ([1, 0, 0], [0, 0.999, 0.04]):
        look = {"as": kind, "size": 1.5, "color": "#ff2020"}
        sim = Simulation(flock(tmp_path, np.zeros((1, 3)), np.array([course]) * 1e-3, more=STAGE, look=look))
        with Viewer(sim.scene, port=0) as viewer:
            page = browser.open(viewer.url)
            assert viewer.wait_for_client(60.0)
            show(viewer, page, sim.frame())
            page.run("document.body.classList.add('bare')")
            red = picture(page)[..., 0].astype(int) - picture(page)[..., 2] > 40
            assert page.run("viewer.renderer.getContext().getError()") == 0 and page.complaints() == []
        rows, columns = np.flatnonzero(red.any(axis=1)), np.flatnonzero(red.any(axis=0))
        spans.append((np.ptp(columns), np.ptp(rows)))
    (wide, high), (across, tall) = spans
    assert wide > 1.3 * high and wide > 60 and tall > 60
    assert tall > 1.3 * across if kind != "birds" else across > tall
