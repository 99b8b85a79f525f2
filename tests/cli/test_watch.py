"""--watch: an edit starts the run again; a broken one is told and changes nothing."""

import os
import queue
import signal
import subprocess
import threading
import time

import pytest

from tests.command import SPARKS, command, environment

LONG = SPARKS.replace("duration: 0.5", "duration: 72000")


class Watched:
    """A watched run whose words can be waited for."""

    def __init__(self, folder, *arguments):
        line = command("run", "sparks.yaml", "--watch", *arguments)
        self.process = subprocess.Popen(
            line, cwd=folder, env=environment(), stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, start_new_session=True
        )
        self._lines: queue.Queue[str] = queue.Queue()
        threading.Thread(target=lambda: [self._lines.put(line) for line in self.process.stdout], daemon=True).start()

    def hears(self, words: str, timeout: float = 30.0) -> str:
        """Return the next line with these words; fails if none comes in time."""
        heard, end = [], time.monotonic() + timeout
        while time.monotonic() < end:
            try:
                heard.append(self._lines.get(timeout=0.1))
            except queue.Empty:
                continue
            if words in heard[-1]:
                return heard[-1]
        raise AssertionError(f"{words!r} was not said: {heard}")


@pytest.fixture
def watched(tmp_path):
    (tmp_path / "sparks.yaml").write_text(LONG)
    started = []

    def start(*arguments) -> Watched:
        started.append(Watched(tmp_path, *arguments))
        return started[-1]

    yield start
    for one in started:
        if one.process.poll() is None:
            one.process.kill()
        one.process.wait()


def save(folder, text):
    """Save as editors do: a new file in the place of the old."""
    (folder / "next.yaml").write_text(text)
    os.replace(folder / "next.yaml", folder / "sparks.yaml")


@pytest.mark.parametrize("viewer", [("--viewer", "none"), ("--port", "0")], ids=["full speed", "viewer"])
def test_edits(watched, tmp_path, viewer):
    run = watched(*viewer)
    run.hears("/4320000")
    save(tmp_path, LONG.replace("capacity", "capacty"))
    assert "sparks.yaml:7:" in run.hears("capacty")
    run.hears("the run goes on")
    run.hears("/4320000")
    save(tmp_path, LONG.replace("duration: 72000", "duration: 36000"))
    run.hears("starting again")
    run.hears("/2160000")
    run.process.send_signal(signal.SIGINT)
    assert run.process.wait(timeout=60) == 130


def test_an_edit_that_cannot_be_built_waits_for_the_next(watched, tmp_path):
    run = watched("--viewer", "none")
    run.hears("/4320000")
    save(tmp_path, LONG + "limits: {memory: 1.0e-6}\n")
    run.hears("GiB")
    save(tmp_path, LONG)
    run.hears("/4320000")
    assert run.process.poll() is None


def test_after_a_blow_up_it_waits_for_an_edit(watched, tmp_path):
    from tests.command import BLOW_UP

    run = watched("--viewer", "none")
    run.hears("/4320000")
    save(tmp_path, BLOW_UP)
    run.hears("substeps")
    save(tmp_path, LONG)
    run.hears("/4320000")


def test_at_the_end_it_waits_for_an_edit(watched, tmp_path):
    run = watched("--viewer", "none", "--frames", "5")
    run.hears("frame 5/5")
    run.hears("done; Ctrl-C ends")
    save(tmp_path, LONG)
    run.hears("starting again")
    run.hears("done; Ctrl-C ends")
    run.process.send_signal(signal.SIGTERM)
    assert run.process.wait(timeout=60) == 0
