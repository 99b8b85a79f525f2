"""On a terminal: the bar, Ctrl-C, and staying until the user has seen enough."""

import os
import pty
import re
import select
import signal
import subprocess
import time

import numpy as np
import pytest

from tests.command import SPARKS, command, environment

LONG = SPARKS.replace("duration: 0.5", "duration: 72000")


class Terminal:
    """A process with a terminal of its own."""

    def __init__(self, *arguments, cwd):
        self._main, side = pty.openpty()
        more = environment(TERM="xterm", COLUMNS="100")
        self.process = subprocess.Popen(
            command(*arguments), cwd=cwd, env=more, stdin=side, stdout=side, stderr=side, start_new_session=True
        )
        os.close(side)
        self.text = ""

    def read_until(self, pattern: str, timeout: float = 120.0) -> str:
        """Return all that was said up to a pattern; fails if it is not said in time."""
        end = time.monotonic() + timeout
        while not re.search(pattern, self.text):
            assert time.monotonic() < end, f"{pattern!r} was not said in {timeout} s: {self.text[-2000:]!r}"
            self._read()
        return self.text

    def end(self, timeout: float = 60.0) -> int:
        """Wait for the end and return the exit code."""
        deadline = time.monotonic() + timeout
        while self.process.poll() is None:
            assert time.monotonic() < deadline, self.text[-2000:]
            self._read()
        self._read()
        return self.process.returncode

    def press_ctrl_c(self) -> None:
        os.kill(self.process.pid, signal.SIGINT)

    def close(self) -> None:
        if self.process.poll() is None:
            self.process.kill()
            self.process.wait()
        os.close(self._main)

    def _read(self) -> None:
        if select.select([self._main], [], [], 0.05)[0]:
            try:
                self.text += os.read(self._main, 65536).decode(errors="replace")
            except OSError:
                pass  # its other side is closed


@pytest.fixture
def terminal(tmp_path):
    (tmp_path / "long.yaml").write_text(LONG)
    (tmp_path / "short.yaml").write_text(SPARKS)
    opened = []

    def open_terminal(*arguments) -> Terminal:
        opened.append(Terminal(*arguments, cwd=tmp_path))
        return opened[-1]

    yield open_terminal
    for one in opened:
        one.close()


def test_bar_then_last_line(terminal):
    here = terminal("run", "long.yaml", "--viewer", "none", "--frames", "30000")
    assert here.end(timeout=120) == 0
    assert "━" in here.text and "\x1b[?25h" in here.text, "a bar was drawn and the cursor is back"
    assert "frame 30000/30000" in here.text.rstrip().splitlines()[-1]


def test_ctrl_c_ends_within_two_seconds_and_saves(terminal, tmp_path):
    here = terminal("run", "long.yaml", "--viewer", "none")
    here.read_until(r"frame \d+/4320000")
    here.press_ctrl_c()
    assert here.end() == 130
    index = int(re.search(r"interrupted after frame (\d+)", here.text).group(1))
    with np.load(tmp_path / "Sparks.lastgood.npz") as arrays:
        assert arrays["index"] == index > 0
    assert str(tmp_path / "Sparks.lastgood.npz") in here.text and "Traceback" not in here.text


def test_with_the_viewer_it_stays_until_ctrl_c(terminal, tmp_path):
    here = terminal("run", "short.yaml", "--port", "0")
    here.read_until(r"look at http://127\.0\.0\.1:\d+/")
    here.read_until(r"frame 30/30")
    here.read_until(r"done; Ctrl-C ends")
    time.sleep(0.5)
    assert here.process.poll() is None
    here.press_ctrl_c()
    assert here.end() == 0 and not (tmp_path / "Sparks.lastgood.npz").exists(), "the run was done: there is nothing to save"


def test_at_the_end_the_page_may_still_go_back(terminal, tmp_path):
    from tests.cli.controlled import by_hand

    async def script(person):
        await person.stands_at(30)
        await person.ask("reset")
        await person.stands_at(0)
        await person.ask("seek", value=12)
        await person.stands_at(12)
        await person.ask("play")
        await person.until(lambda p: p.status["playing"])
        await person.stands_at(30)

    here = terminal("run", "short.yaml", "--port", "0", "--out", "r")
    here.read_until(r"done; Ctrl-C ends")
    by_hand(re.search(r"look at (http://\S+?/)", here.text).group(1), script)
    here.press_ctrl_c()
    assert here.end() == 0
    assert len((tmp_path / "r" / "frames.jsonl").read_text().splitlines()) == 31, "what was recorded was recorded"


def test_a_view_stays_until_ctrl_c(terminal, tmp_path):
    recorded = subprocess.run(
        command("run", "short.yaml", "--viewer", "none", "--out", "r"), cwd=tmp_path, env=environment(), capture_output=True
    )
    assert recorded.returncode == 0
    here = terminal("view", "r", "--port", "0")
    here.read_until(r"done; Ctrl-C ends")
    time.sleep(0.3)
    assert here.process.poll() is None
    here.press_ctrl_c()
    assert here.end() == 0


def test_second_ctrl_c_does_not_wait_and_the_third_kills(terminal):
    here = terminal("run", "long.yaml", "--viewer", "none")
    here.read_until(r"frame \d+/4320000")
    for _ in range(3):
        here.press_ctrl_c()
    assert here.end() == 130


@pytest.mark.parametrize("moment", [0.2, 0.4, 0.7, 1.0])
def test_ctrl_c_at_any_moment_of_the_start_leaves_no_traceback(terminal, moment):
    here = terminal("run", "long.yaml", "--viewer", "none")
    time.sleep(moment)
    here.press_ctrl_c()
    here.end()
    assert "Traceback" not in here.text and here.process.returncode in (130, -signal.SIGINT)


def test_sigterm_is_ctrl_c(tmp_path):
    (tmp_path / "long.yaml").write_text(LONG)
    line = command("run", "long.yaml", "--viewer", "none", "--out", "r")
    process = subprocess.Popen(line, cwd=tmp_path, env=environment(), stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    while not list((tmp_path / "r" / "frames").glob("00001?.npz")):
        assert process.poll() is None
        time.sleep(0.02)
    process.terminate()
    _, errors = process.communicate(timeout=60)
    assert process.returncode == 130 and "r/lastgood.npz" in errors
    lines = (tmp_path / "r" / "frames.jsonl").read_text().splitlines()
    with np.load(tmp_path / "r" / "lastgood.npz") as arrays:
        assert arrays["index"] == len(lines) - 1


def test_with_the_viewer_it_ends_when_piped(tmp_path):
    (tmp_path / "short.yaml").write_text(SPARKS)
    began = time.monotonic()
    done = subprocess.run(
        command("run", "short.yaml", "--port", "0"), cwd=tmp_path, env=environment(), capture_output=True, text=True, timeout=60
    )
    assert done.returncode == 0 and "look at http://127.0.0.1:" in done.stdout, done.stderr
    assert time.monotonic() - began > 0.5, "half a second of scene takes half a second"
