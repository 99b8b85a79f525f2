"""Runs with a viewer where something is missing or taken: the port, the browser, the display."""

import os
import re
import signal
import subprocess
import urllib.request

import pytest

from tests.command import SPARKS, command, environment, warpsim
from tests.viewer.watcher import Watcher


@pytest.fixture
def folder(tmp_path):
    (tmp_path / "sparks.yaml").write_text(SPARKS.replace("duration: 0.5", "duration: 4"))
    return tmp_path


def test_many_runs_on_one_port(folder):
    """WARPSIM_RUNS=20 makes them twenty, as docs/reliability.md reports."""
    line = command("run", "sparks.yaml", "--port", "7461")
    count = int(os.environ.get("WARPSIM_RUNS", 3))
    runs = [subprocess.Popen(line, cwd=folder, env=environment(), stdout=subprocess.PIPE, text=True) for _ in range(count)]
    urls = set()
    for run in runs:
        words = iter(run.stdout.readline, "")
        url = next(match.group() for said in words if (match := re.search(r"http://127\.0\.0\.1:\d+/", said)))
        assert urllib.request.urlopen(url, timeout=60).status == 200
        urls.add(url)
    assert len(urls) == count
    assert [run.wait(timeout=120) for run in runs] == [0] * count
    for run in runs:
        run.stdout.close()


def test_no_browser_and_no_display(folder):
    more = {"DISPLAY": "", "WAYLAND_DISPLAY": "", "BROWSER": ""}
    done = warpsim("run", "sparks.yaml", "--frames", 5, "--open", cwd=folder, **more)
    assert done.returncode == 0 and "look at http://127.0.0.1:" in done.stdout and "--open: " in done.stdout, done.stderr


def test_the_viewer_does_not_change_the_run(folder):
    hashes = set()
    for viewer in ("none", "meshcat"):
        done = warpsim("run", "sparks.yaml", "--viewer", viewer, "--frames", 20, "--out", viewer, cwd=folder)
        assert done.returncode == 0
        hashes.add((folder / viewer / "frames.jsonl").read_text())
    assert len(hashes) == 1


def test_pages_early_and_late_see_the_last_frame(folder):
    """--watch keeps the run at its last frame although it is piped."""
    line = command("run", "sparks.yaml", "--port", "0", "--frames", "60", "--watch")
    run = subprocess.Popen(line, cwd=folder, env=environment(), stdout=subprocess.PIPE, text=True)
    try:
        url = run.stdout.readline().split()[-1]
        with Watcher(url) as early:
            while not early.frames or early.frames[-1].time < 1.0:
                early.ack(early.read_frame().number)
        times = [frame.time for frame in early.frames]
        assert times == sorted(times) and len(times) > 10
        with Watcher(url) as late:
            assert late.read_frame().time == 1.0
    finally:
        run.send_signal(signal.SIGINT)
        assert run.wait(timeout=60) == 0
        run.stdout.close()


def test_a_page_that_never_answers_does_not_hold_up_the_run(folder):
    line = command("run", "sparks.yaml", "--port", "0", "--frames", "60")
    run = subprocess.Popen(line, cwd=folder, env=environment(), stdout=subprocess.PIPE, text=True)
    with Watcher(run.stdout.readline().split()[-1]):
        assert run.wait(timeout=120) == 0
    assert float(re.search(r"([\d.]+)x real time", run.stdout.read().splitlines()[-1]).group(1)) > 1.0
    run.stdout.close()
