"""What may happen to a run whose page has buttons: the browser is killed, the page vanishes, a wish ruins the scene, the scene is huge."""

import json
import os
import signal

import numpy as np
import pytest

from tests.browser import Browser, find_chromium
from tests.cli.controlled import SLIDING, Process, by_hand
from tests.command import SPARKS
from tests.reliability.run_folder import check_run_folder

HUGE = """\
name: Ten million
time: {fps: 60, substeps: 1, duration: 100}
gravity: [0, -1, 0]
systems:
  dust:
    type: particles
    capacity: 10000000
    emitters: [{shape: {type: box, center: [0, 1, 0], size: [2, 2, 2]}, burst: {count: 10000000}, lifetime: 1000}]
    look: {as: points, size: 0.002}
"""
FRAGILE = SPARKS.replace("duration: 0.5", "duration: 60").replace(
    "systems:", "forces: [{type: attractor, center: [9, 9, 9], law: spring, strength: 0}]\nsystems:"
)
FRAGILE += "controls: [{path: forces.0.strength, min: 0, max: 1.0e+12}]\n"


@pytest.fixture
def folder(tmp_path):
    for name, text in (("sliding", SLIDING), ("fragile", FRAGILE), ("huge", HUGE)):
        (tmp_path / f"{name}.yaml").write_text(text)
    return tmp_path


@pytest.mark.skipif(find_chromium() is None, reason="no Chromium is installed")
def test_a_browser_that_is_killed(folder):
    with Process("run", "sliding.yaml", "--port", "0", cwd=folder) as run:
        browser = Browser((320, 240))
        try:
            page = browser.open(run.url)
            page.wait_for("stream.frames > 5")
            os.killpg(browser.process.pid, signal.SIGKILL)
        finally:
            browser.close()
        assert run.end() == 0
        assert "frame 360/360" in run.words[-1]


def test_a_page_that_pauses_and_vanishes_does_not_hold_a_piped_run(folder):
    async def script(person):
        await person.ask("speed", value=0.1)
        await person.ask("pause")
        await person.until(lambda p: p.status.get("playing") is False)

    with Process("run", "sliding.yaml", "--port", "0", cwd=folder) as run:
        by_hand(run.url, script)
        run.hears("nobody watches any more: playing on")
        assert run.end() == 0 and "frame 360/360" in run.words[-1]


@pytest.mark.parametrize("out", [(), ("--out", "r")])
def test_a_change_that_ruins_the_scene(folder, out):
    async def script(person):
        await person.until(lambda p: p.status.get("index", 0) > 20)
        await person.ask("set", control=0, value=1e12)
        with pytest.raises(AssertionError, match="the run has gone"):
            await person.until(lambda p: False)

    with Process("run", "fragile.yaml", "--port", "0", *out, cwd=folder) as run:
        by_hand(run.url, script)
        assert run.end() == 4
        said = "".join(run.words)
    saved = folder / ("r/lastgood.npz" if out else "Sparks.lastgood.npz")
    assert "substeps" in said and saved.name in said and "Traceback" not in said
    with np.load(saved) as arrays:
        assert arrays["index"] > 20 and all(np.isfinite(arrays[name]).all() for name in arrays.files)
        last_good = int(arrays["index"])
    if out:
        change = json.loads((folder / "r" / "changes.jsonl").read_text())
        assert change["path"] == "forces.0.strength" and change["index"] <= last_good
        assert check_run_folder(folder / "r") == last_good + 1


def test_after_going_back_a_ruinous_change_still_leaves_the_last_good_state(folder):
    async def script(person):
        await person.until(lambda p: p.status.get("index", 0) > 80)
        await person.ask("seek", value=5)
        await person.ask("set", control=0, value=1e12)
        with pytest.raises(AssertionError, match="the run has gone"):
            await person.until(lambda p: False)

    with Process("run", "fragile.yaml", "--port", "0", cwd=folder) as run:
        by_hand(run.url, script)
        assert run.end() == 4
    with np.load(folder / "Sparks.lastgood.npz") as arrays:
        assert arrays["index"] < 80


def test_ten_million_points(folder):
    """The page gets a stable subset while it plays and as many as it can bear at rest; the run goes on."""

    async def script(person):
        await person.until(lambda p: p.frame is not None and p.status.get("index", 0) > 2)
        playing = len(person.frame.blocks[0, 0])
        assert playing <= 260_000 and person.status["live"] == {"dust": 10_000_000}
        await person.ask("pause")
        await person.until(lambda p: not p.status["playing"])
        await person.until(lambda p: len(p.frame.blocks[0, 0]) > 2_000_000)
        index = person.status["index"]
        await person.ask("play")
        await person.until(lambda p: p.status["index"] > index + 3 and len(p.frame.blocks[0, 0]) == playing)

    with Process("run", "huge.yaml", "--port", "0", cwd=folder) as run:
        by_hand(run.url, script)
        run.process.send_signal(signal.SIGINT)
        assert run.end() == 130  # half of a gigabyte is saved on the way
