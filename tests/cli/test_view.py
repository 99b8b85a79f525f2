"""view: a recorded run shown again, led from a page; damage is named."""

import shutil
import signal
import time

import pytest

from tests.cli.controlled import SLIDING, Process, by_hand
from tests.command import warpsim

WINDY = SLIDING.replace("velocity: [0, 0, 0]", "velocity: [2, 0, 0]").replace("duration: 6", "duration: 1")
MILLIMETRE = 1.5e-3


@pytest.fixture(scope="module")
def recorded(tmp_path_factory):
    folder = tmp_path_factory.mktemp("recorded")
    (folder / "windy.yaml").write_text(WINDY)
    assert warpsim("run", "windy.yaml", "--viewer", "none", "--out", "r", cwd=folder).returncode == 0
    return folder / "r"


@pytest.fixture
def run_folder(recorded, tmp_path):
    """A run folder that a test may damage."""
    return shutil.copytree(recorded, tmp_path / "r")


def test_pause_step_and_seek(recorded):
    async def script(person):
        await person.ask("pause")
        await person.until(lambda p: p.status.get("playing") is False)
        assert person.controls == [] and person.status["frame_count"] == 60
        for index in (50, 7, 31, 60, 0):
            await person.ask("seek", value=index)
            await person.stands_at(index)
            assert person.x == pytest.approx(2.0 * index / 60, abs=MILLIMETRE)
        await person.ask("step")
        await person.stands_at(1)
        await person.ask("set", control=0, value=3.0)  # nothing of a recorded run can be set
        await person.ask("seek", value=45)
        await person.stands_at(45)
        await person.ask("reset")
        await person.stands_at(0)
        await person.ask("speed", value=8)
        await person.ask("play")
        await person.until(lambda p: p.status["index"] > 5)

    with Process("view", recorded, "--port", "0", cwd=recorded) as run:
        by_hand(run.url, script)
        assert run.end() == 0, "at the last frame it ends when piped"


def test_it_takes_its_time_when_piped(recorded):
    began = time.monotonic()
    done = warpsim("view", recorded, "--port", 0)
    assert done.returncode == 0 and "look at http://127.0.0.1:" in done.stdout and "frame 60/60" in done.stdout, done.stderr
    assert time.monotonic() - began > 1.0


def test_ctrl_c_in_the_middle(recorded):
    async def script(person):
        await person.ask("pause")
        await person.until(lambda p: p.status.get("playing") is False)

    with Process("view", recorded, "--port", "0", cwd=recorded) as run:
        by_hand(run.url, script)
        run.process.send_signal(signal.SIGINT)
        assert run.end() == 130
    assert not (recorded / "lastgood.npz").exists(), "there is nothing to save"


def test_what_is_no_run_ends_with_5(recorded, tmp_path):
    empty = warpsim("view", tmp_path)
    assert empty.returncode == 5 and "holds no run" in empty.stderr and "Traceback" not in empty.stderr


@pytest.mark.parametrize("file", ["frames/000030.npz", "frames.jsonl", "scene.yaml"])
def test_a_damaged_run_is_named(run_folder, file):
    data = (run_folder / file).read_bytes()
    (run_folder / file).write_bytes(b"\x00{[" + data[: len(data) // 3])
    done = warpsim("view", run_folder, "--port", 0)
    assert done.returncode in (3, 5) and file in done.stderr and "Traceback" not in done.stderr, done.stderr


def test_nothing_to_do(recorded):
    assert warpsim("view", recorded, "--viewer", "none").returncode == 2
