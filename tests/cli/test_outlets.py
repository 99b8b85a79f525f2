"""--record and --snapshot: one file of what was shown, or one word about why not."""

import re
import signal
import time

import numpy as np
import pytest
from PIL import Image

from tests.browser import find_chromium
from tests.cli.controlled import SLIDING, Process, by_hand
from tests.command import SPARKS, warpsim

needs_browser = pytest.mark.skipif(find_chromium() is None, reason="no Chromium here")


@pytest.fixture
def folder(tmp_path):
    (tmp_path / "sparks.yaml").write_text(SPARKS)
    (tmp_path / "sliding.yaml").write_text(SLIDING)
    return tmp_path


def frames_in(path) -> list[float]:
    """Times of the frames in an HTML recording [s]."""
    return [float(time) for time in re.findall(r'<script type="text/plain" class="frame" data-time="([\d.e+-]+)"', path.read_text())]


def test_a_run_and_its_replay_are_recorded(folder):
    done = warpsim("run", "sparks.yaml", "--viewer", "none", "--frames", 6, "--record", "a.html", "--out", "r", cwd=folder)
    assert done.returncode == 0 and re.search(r"7 frames are in a.html, [\d.]+ MB", done.stdout), done.stderr + done.stdout
    assert frames_in(folder / "a.html") == pytest.approx([k / 60 for k in range(7)])
    again = warpsim("view", "r", "--viewer", "none", "--record", "b.html", cwd=folder)
    assert again.returncode == 0 and (folder / "a.html").read_bytes() == (folder / "b.html").read_bytes(), again.stderr


def test_an_interrupted_run_leaves_a_whole_recording(folder):
    async def script(person):
        await person.until(lambda p: p.status.get("index", 0) > 60)

    with Process("run", "sliding.yaml", "--port", "0", "--record", "a.html", cwd=folder) as run:
        by_hand(run.url, script)
        run.process.send_signal(signal.SIGINT)
        assert run.end() == 130
    times = frames_in(folder / "a.html")
    assert len(times) > 20 and (folder / "a.html").read_text().endswith("</html>\n")


def test_the_button_of_the_page_records(folder):
    async def script(person):
        await person.until(lambda p: p.status.get("index", 0) > 3)
        await person.ask("record")
        await person.until(lambda p: p.status["recording"])
        first = person.status["index"]
        await person.until(lambda p: p.status["index"] > first + 20)
        await person.ask("record")
        await person.until(lambda p: not p.status["recording"])
        await person.ask("record")  # a second one, still under way at the end
        await person.until(lambda p: p.status["recording"])
        await person.ask("speed", value=8)
        await person.until(lambda p: p.status["index"] > 200)

    with Process("run", "sliding.yaml", "--port", "0", cwd=folder) as run:
        by_hand(run.url, script)
        assert run.end() == 0
        assert len(re.findall("frames are in", "".join(run.words))) == 2
    first, second = frames_in(folder / "Sliding.html"), frames_in(folder / "Sliding-2.html")
    assert len(first) >= 20 and np.allclose(np.diff(first), 1 / 60) and second[-1] == 6.0


@pytest.mark.parametrize("option", [("--record", "no/such/folder.html"), ("--record", "."), ("--snapshot", "no/such/folder.png")])
def test_a_place_that_is_none_is_told_before_the_run(folder, option):
    done = warpsim("run", "sparks.yaml", "--viewer", "none", *option, cwd=folder)
    assert done.returncode == 5 and option[1] in done.stderr and "frame" not in done.stdout and "Traceback" not in done.stderr


@pytest.mark.parametrize("option", [("--size", "12"), ("--size", "0x9"), ("--size", "99999x10")])
def test_sizes_that_are_none(folder, option):
    assert warpsim("run", "sparks.yaml", "--snapshot", "a.png", *option, cwd=folder).returncode == 2


@needs_browser
def test_pictures_of_a_run_and_of_its_replay(folder):
    done = warpsim("run", "sparks.yaml", "--frames", 20, "--snapshot", "a.png", "--size", "400x300", "--out", "r", cwd=folder)
    assert done.returncode == 0 and "frame 20 is pictured in a.png" in done.stdout, done.stderr
    assert warpsim("view", "r", "--frames", 20, "--snapshot", "b.png", "--size", "400x300", cwd=folder).returncode == 0
    first, second = (np.asarray(Image.open(folder / name).convert("RGB")).astype(int) for name in ("a.png", "b.png"))
    assert first.shape == second.shape == (300, 400, 3) and first.std() > 2.0
    assert np.abs(first - second).mean() < 1.0, "a recorded frame looks as it did"


@pytest.mark.parametrize("verb", [("run", "sparks.yaml"), ("view", "r")])
def test_without_a_browser_it_is_told_before_the_run(folder, verb):
    assert warpsim("run", "sparks.yaml", "--viewer", "none", "--frames", 2, "--out", "r", cwd=folder).returncode == 0
    done = warpsim(*verb, "--snapshot", "a.png", cwd=folder, PATH="")
    assert done.returncode == 5 and len(done.stderr.splitlines()) == 1 and "--snapshot needs Chromium" in done.stderr
    assert done.stdout == "" and not (folder / "a.png").exists()


def fake_browser(folder, script: str) -> str:
    """Put a program that is called as a browser is into a folder of its own and return that folder."""
    (folder / "bin").mkdir()
    (folder / "bin" / "chromium").write_text(f"#!/bin/sh\n{script}\n")
    (folder / "bin" / "chromium").chmod(0o755)
    return f"{folder / 'bin'}:/usr/bin:/bin"


def test_a_browser_that_does_not_start(folder):
    done = warpsim("run", "sparks.yaml", "--snapshot", "a.png", cwd=folder, PATH=fake_browser(folder, "exit 9"))
    assert done.returncode == 5 and "ended at once, with code 9" in done.stderr and len(done.stderr.splitlines()) == 1


def test_ctrl_c_while_the_browser_starts(folder, monkeypatch):
    monkeypatch.setenv("PATH", fake_browser(folder, f"echo $$ > {folder}/id; exec sleep 60"))
    with Process("run", "sparks.yaml", "--snapshot", "a.png", cwd=folder) as run:
        run.hears("frame 30/30")
        while not (folder / "id").exists():
            time.sleep(0.02)
        run.process.send_signal(signal.SIGINT)
        assert run.end() == 130, run.words
    assert not (folder / "a.png").exists()
