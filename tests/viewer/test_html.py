"""A recording in one HTML file, opened from disk in a real browser: what was recorded is what it shows."""

import errno
import os
from pathlib import Path

import numpy as np
import pytest

from tests.browser import Browser, find_chromium
from tests.viewer.fake_run import DUST, FakeFrame, dust, fake_scene
from tests.viewer.page import read_positions
from warpsim.observers.html import HtmlRecording


def record(path: Path, scene, frames) -> None:
    with HtmlRecording(path, scene, 60.0) as recording:
        for frame in frames:
            recording.add(frame)


@pytest.mark.skipif(find_chromium() is None, reason="no Chromium is installed")
def test_a_recording_plays_from_a_file_and_holds_what_was_recorded(tmp_path):
    path = tmp_path / "a b #1.html"
    frames = [dust(index, count) for index, count in enumerate((500, 800, 10, 0, 700, 300))]
    record(path, DUST, frames)
    with Browser((640, 480)) as browser:
        page = browser.open(path.as_uri())
        page.wait_for("typeof player !== 'undefined' && player.shown === 5 && !player.playing")  # it plays by itself, to the end
        assert page.run("controls.parts.record.hidden && controls.parts.panel.hidden && !controls.parts.bar.hidden")
        for number in (0, 4, 1, 3, 5, 2):
            page.run(f"(() => {{ const s = document.getElementById('seek'); s.value = {number}; s.dispatchEvent(new Event('input')); }})()")
            page.wait_for(f"player.shown === {number}")
            recorded = frames[number]["dust"]
            assert page.run("stream.clouds[0].count") == recorded.count
            quantum = np.ptp(recorded.position, axis=0) / 65535 if recorded.count else np.ones(3)
            assert np.abs(read_positions(page) - recorded.position).max(initial=0.0) <= (quantum + 1e-6).max()
            color = page.run(f"Array.from(stream.clouds[0].points.geometry.attributes.color.array.slice(0, {4 * recorded.count}))")
            np.testing.assert_array_equal(np.reshape(color, (-1, 4)), recorded.color)
        page.run("document.dispatchEvent(new KeyboardEvent('keydown', {key: '.', bubbles: true}))")
        page.wait_for("player.shown === 3 && !player.playing")
        page.run("document.dispatchEvent(new KeyboardEvent('keydown', {key: 'r', bubbles: true}))")
        page.wait_for("player.shown === 0 && controls.index === 0")
        page.run("player.ask({type: 'speed', value: 0.1}), player.ask({type: 'play'})")
        page.wait_for("player.shown === 1 && player.playing")
        assert page.run("viewer.renderer.getContext().getError()") == 0
        assert page.complaints() == []


@pytest.mark.skipif(find_chromium() is None, reason="no Chromium is installed")
def test_names_in_a_recording_are_words(tmp_path):
    name = "</script><script>window.broken = 1</script><img src=x onerror='window.broken = 2'>"
    record(tmp_path / "x.html", fake_scene({"dust": ("points", "alpha")}, name=name), [dust(0)])
    with Browser((320, 240)) as browser:
        page = browser.open((tmp_path / "x.html").as_uri())
        page.wait_for("player.shown === 0")
        assert page.run("window.broken") is None and name in page.run("document.getElementById('hud').textContent")


def test_frames_are_written_as_they_come_and_the_file_appears_when_whole(tmp_path):
    path = tmp_path / "x.html"
    path.write_text("before")
    recording = HtmlRecording(path, DUST, 60.0)
    [partial] = [p for p in tmp_path.iterdir() if p != path]
    sizes = []
    for index in range(4):
        recording.add(dust(index, 20_000))
        sizes.append(partial.stat().st_size)
    assert sizes == sorted(set(sizes)) and path.read_text() == "before"
    recording.close()
    recording.close()
    assert path.stat().st_size > sizes[-1] and not partial.exists() and b"src=" not in path.read_bytes()[:200_000].split(b"<script>")[0]


def test_a_failed_recording_leaves_what_was_there_and_does_not_stop_the_run(tmp_path, monkeypatch):
    path = tmp_path / "x.html"
    path.write_text("before")
    recording = HtmlRecording(path, DUST, 60.0)

    def full(*arguments):
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(os, "write", full)
    for index in range(3):
        recording.add(dust(index, 20_000))
    with pytest.raises(OSError, match="No space") as failed:
        recording.close()
    monkeypatch.undo()
    assert failed.value.filename == str(path) and path.read_text() == "before" and list(tmp_path.iterdir()) == [path]


def test_an_exception_in_the_run_leaves_no_file(tmp_path):
    with pytest.raises(ZeroDivisionError):
        with HtmlRecording(tmp_path / "x.html", DUST, 60.0) as recording:
            recording.add(FakeFrame(0, dust(0)))
            raise ZeroDivisionError
    assert list(tmp_path.iterdir()) == []
    with pytest.raises(OSError):
        HtmlRecording(tmp_path / "no" / "x.html", DUST, 60.0)
