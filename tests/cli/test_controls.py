"""A run in another process, led from a page: what is asked for is seen in the positions that come back."""

import json
import signal
import time

import numpy as np
import pytest

from tests.cli.controlled import SLIDING, Process, by_hand
from tests.command import warpsim

MILLIMETRE = 1.5e-3  # the 16 bits of a place in a box of 40 m, and rounding


@pytest.fixture
def folder(tmp_path):
    (tmp_path / "sliding.yaml").write_text(SLIDING)
    return tmp_path


def test_pause_step_set_seek_and_reset(folder):
    async def script(person):
        await person.until(lambda p: p.status.get("index", 0) > 5)
        assert person.status["playing"] and person.status["frame_count"] == 360 and person.status["live"] == {"dust": 2}
        assert person.controls[0]["label"] == "wind" and person.status["values"] == {"flow.wind.velocity.0": 0.0}
        await person.ask("pause")
        await person.until(lambda p: not p.status["playing"])
        at = person.status["index"]
        await person.stands_at(at)
        assert abs(person.x) < MILLIMETRE
        await person.ask("set", control=0, value=3.0)
        await person.ask("set", control=7, value=3.0)  # a control that there is not
        await person.until(lambda p: p.status["values"] == {"flow.wind.velocity.0": 3.0})
        for k in range(1, 4):
            await person.ask("step")
            await person.stands_at(at + k)
            assert person.x == pytest.approx(3.0 * k / 60, abs=MILLIMETRE)
        await person.ask("seek", value=at + 60)
        await person.stands_at(at + 60)
        assert person.x == pytest.approx(3.0, abs=MILLIMETRE)
        await person.ask("reset")
        await person.stands_at(0)
        assert abs(person.x) < MILLIMETRE and person.status["values"] == {"flow.wind.velocity.0": 0.0}
        await person.ask("seek", value=at + 30)  # the same story again, with the change in its place
        await person.stands_at(at + 30)
        assert person.x == pytest.approx(1.5, abs=MILLIMETRE)
        await person.ask("seek", value=10**6)
        await person.stands_at(360)
        await person.ask("play")  # from the beginning, to leave it well
        await person.until(lambda p: p.status["playing"] and 0 < p.status["index"] < 300)
        await person.ask("seek", value=355)
        await person.until(lambda p: p.status["index"] >= 355)

    with Process("run", "sliding.yaml", "--port", "0", cwd=folder) as run:
        by_hand(run.url, script)
        assert run.end() == 0, "at the last frame a piped run ends"


def test_speed(folder):
    async def script(person):
        await person.until(lambda p: p.status)
        await person.ask("speed", value=0.05)
        await person.until(lambda p: p.status.get("speed") == 0.05)
        first, began = person.status["index"], time.monotonic()
        await person.until(lambda p: time.monotonic() - began > 1.0)
        assert person.status["index"] - first <= 5, "three frames a second"
        await person.ask("speed", value=8)
        began = time.monotonic()
        await person.until(lambda p: p.status["index"] >= 200)
        assert time.monotonic() - began < 2.5, "more than three seconds of the scene, eight times as fast"

    with Process("run", "sliding.yaml", "--port", "0", cwd=folder) as run:
        by_hand(run.url, script)
        assert run.end() == 0


def test_a_second_page_sees_the_same_and_has_the_same_say(folder):
    async def script(first, second):
        await first.until(lambda p: p.status.get("index", 0) > 5)
        await first.ask("pause")
        await first.ask("set", control=0, value=-4.0)
        await first.ask("seek", value=200)
        for person in (first, second):
            await person.stands_at(200)
            assert person.status["values"] == {"flow.wind.velocity.0": -4.0} and person.x < -10.0
        assert first.x == second.x
        await second.ask("step")
        for person in (first, second):
            await person.stands_at(201)
        await second.ask("play")
        await first.until(lambda p: p.status["playing"])

    with Process("run", "sliding.yaml", "--port", "0", cwd=folder) as run:
        by_hand(run.url, script, pages=2)
        assert run.end() == 0


def test_ctrl_c_while_paused(folder):
    async def script(person):
        await person.ask("pause")
        await person.until(lambda p: p.status.get("playing") is False)

    with Process("run", "sliding.yaml", "--port", "0", cwd=folder) as run:
        by_hand(run.url, script)
        run.process.send_signal(signal.SIGINT)
        assert run.end() == 130
        assert "interrupted after frame" in "".join(run.words) and (folder / "Sliding.lastgood.npz").exists()


def test_a_recorded_run_with_changes_is_run_again_to_the_same_state(folder):
    async def script(person):
        await person.until(lambda p: p.status.get("index", 0) > 3)
        await person.ask("set", control=0, value=2.0)
        await person.until(lambda p: p.status["values"] == {"flow.wind.velocity.0": 2.0})
        await person.until(lambda p: p.status["index"] > 20)
        await person.ask("pause")
        await person.until(lambda p: not p.status["playing"])
        at = person.status["index"]
        for value in (1.0, -2.5):  # of two in one frame the last counts
            await person.ask("set", control=0, value=value)
            await person.until(lambda p, value=value: p.status["values"] == {"flow.wind.velocity.0": value})
        await person.ask("reset")
        await person.until(lambda p: "goes back only after its end" in p.status["note"])
        assert person.status["index"] == at
        await person.ask("speed", value=8)
        await person.ask("play")
        await person.until(lambda p: p.status["index"] >= 200)

    with Process("run", "sliding.yaml", "--port", "0", "--out", "r", cwd=folder) as run:
        by_hand(run.url, script)
        assert run.end() == 0
    changes = [json.loads(line) for line in (folder / "r" / "changes.jsonl").read_text().splitlines()]
    assert [change["value"] for change in changes] == ["2", "-2.5"] and changes[0]["index"] < changes[1]["index"]
    log = (folder / "r" / "log.txt").read_text()
    assert f"frame {changes[0]['index']}: flow.wind.velocity.0 = 2\n" in log and "goes back only after its end" in log
    entries = [json.loads(line) for line in (folder / "r" / "frames.jsonl").read_text().splitlines()]
    assert [entry["index"] for entry in entries] == [*range(361)]
    again = warpsim("run", "r/scene.yaml", "--changes", "r/changes.jsonl", "--viewer", "none", "--out", "again", "--json", cwd=folder)
    assert again.returncode == 0, again.stderr
    assert json.loads(again.stdout)["state_hash"] == entries[-1]["state"]
    for name in ("frames.jsonl", "changes.jsonl", "stats.csv"):
        assert (folder / "again" / name).read_bytes() == (folder / "r" / name).read_bytes(), name


def test_streamlines_follow_the_slider(folder):
    text = SLIDING.replace("type: uniform, velocity: [0, 0, 0]", "type: uniform, velocity: [0, 1, 0]")
    (folder / "sliding.yaml").write_text(text + "viewer: {streamlines: 9}\n")

    def ends(person):
        places = np.frombuffer(person.lines["places"], np.float32).reshape(9, person.lines["points"], 3)
        return places[:, -1] - places[:, 0]

    async def script(person):
        await person.until(lambda p: p.lines is not None)
        up = ends(person)
        assert np.allclose(up[:, [0, 2]], 0, atol=1e-4) and (up[:, 1] > 1).all()
        person.lines = None
        await person.ask("set", control=0, value=4.0)
        await person.until(lambda p: p.lines is not None)
        aside = ends(person)
        assert np.allclose(aside[:, 0] / aside[:, 1], 4.0, rtol=1e-3)
        await person.ask("speed", value=8)

    with Process("run", "sliding.yaml", "--port", "0", cwd=folder) as run:
        by_hand(run.url, script)
        assert run.end() == 0


@pytest.mark.parametrize(
    ("text", "code", "words"),
    [
        ('{"index": 3, "path": "flow.wind.velocity.0"}\n', 5, "c.jsonl:1"),
        ('{"index": 3, "path": "a", "value": "1"}\n{"index": 2, "path": "a", "value": "1"}\n', 5, "c.jsonl:2"),
        ('{"index": 3, "path": "flow.wind.velosity.0", "value": "1"}\n', 3, "velosity"),
        ('{"index": 3, "path": "systems.dust.capacity", "value": "9"}\n', 3, "cannot change while the scene runs"),
        ('{"index": 3, "path": "flow.wind.velocity.0", "value": "1"}\n{"index": 4, "path": "flow.wi', 0, ""),
        ('{"index": 3, "path": "flow.wind", "value": "[1"}\n', 3, "frame 3"),
        ('{"index": 3, "path": "gravity.0", "value": "1"}\n{"index": 4, "path": "gravity.0", "value": "no"}\n', 3, "after frame 4"),
    ],
)
def test_files_of_changes_that_do_not_fit(folder, text, code, words):
    (folder / "c.jsonl").write_text(text)
    done = warpsim("run", "sliding.yaml", "--viewer", "none", "--frames", 9, "--changes", "c.jsonl", cwd=folder)
    assert done.returncode == code and words in done.stderr and "Traceback" not in done.stderr, done.stderr


def test_a_missing_file_of_changes(folder):
    done = warpsim("run", "sliding.yaml", "--viewer", "none", "--changes", "no.jsonl", cwd=folder)
    assert done.returncode == 5 and "no.jsonl" in done.stderr and "Traceback" not in done.stderr
