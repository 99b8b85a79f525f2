"""verify: its table, its JSON, how it ends, and what it says where there is nothing to verify."""

import json
import os
import pty
import signal
import subprocess
import time

import pytest

from tests.command import BLOW_UP, SPARKS, command, environment, warpsim

SWIRL = """\
name: Swirl
flow: [{type: vortex, axis: [0, 0, 1], circulation: 2.0}]
verify:
  - {name: round, type: circulation, axis: [0, 0, 1], radius: 1.0, expect: 2.0, tolerance: 1.0e-3, reason: rounding}
  - {type: velocity, point: [0.5, 0, 0], expect: [0, {expression: 1/(pi*0.5)}, 0], tolerance: {relative: 1e-5}}
"""
COUNT = "verify: [{name: living, type: live_count, system: sparks, at: 0.4, tolerance: {sigma: 3}}]\n"


@pytest.fixture
def folder(tmp_path):
    (tmp_path / "swirl.yaml").write_text(SWIRL)
    (tmp_path / "wrong.yaml").write_text(SWIRL.replace("expect: 2.0", "expect: 2.1"))
    (tmp_path / "bad.yaml").write_text(SWIRL.replace("radius", "radios"))
    (tmp_path / "plain.yaml").write_text(SPARKS)
    (tmp_path / "sparks.yaml").write_text(SPARKS + COUNT)
    (tmp_path / "blow_up.yaml").write_text(BLOW_UP + COUNT)
    return tmp_path


def test_the_table_says_what_was_measured_and_expected(folder):
    result = warpsim("verify", "swirl.yaml", cwd=folder)
    assert result.returncode == 0, result.stderr
    lines = result.stdout.splitlines()
    assert lines[0] == "swirl.yaml: 2 pass" and lines[1].split() == [
        "oracle",
        "kind",
        "measured",
        "expected",
        "error",
        "tolerance",
        "verdict",
    ]
    assert lines[2].split()[:4] == ["round", "circulation", "2", "2"] and lines[2].endswith("PASS")
    assert lines[3].split()[0] == "1" and "[0, 0.63662, 0]" in lines[3] and "Traceback" not in result.stderr


@pytest.mark.parametrize(
    ("scenes", "code", "words"),
    [
        (["swirl.yaml"], 0, "2 pass"),
        (["wrong.yaml"], 1, "FAIL"),
        (["swirl.yaml", "wrong.yaml"], 1, "swirl.yaml: 2 pass"),
        (["plain.yaml"], 1, "no oracles: nothing is verified"),
        (["bad.yaml"], 3, "bad.yaml: bad scene"),
        (["bad.yaml", "wrong.yaml"], 3, "1 pass, 1 fail"),
        (["blow_up.yaml"], 4, "UNMEASURED"),
        (["blow_up.yaml", "wrong.yaml"], 4, "FAIL"),
    ],
    ids=str,
)
def test_how_it_ends(folder, scenes, code, words):
    result = warpsim("verify", *scenes, "--device", "cpu", cwd=folder)
    assert result.returncode == code and words in result.stdout and "Traceback" not in result.stderr, result.stdout + result.stderr
    assert (":4:" in result.stderr and "radius" in result.stderr) == ("bad.yaml" in scenes)


@pytest.mark.parametrize("arguments", [("no_such_scene",), ("missing.yaml",), ("swirl.yaml", "--device", "tpu"), ()], ids=str)
def test_usage(folder, arguments):
    result = warpsim("verify", *arguments, cwd=folder)
    assert result.returncode == 2 and "Traceback" not in result.stderr


def test_json_for_machines(folder):
    result = warpsim("verify", "wrong.yaml", "sparks.yaml", "bad.yaml", "--json", "--threads", 1, cwd=folder)
    wrong, sparks, bad = json.loads(result.stdout)
    assert result.returncode == 3 and [each["outcome"] for each in (wrong, sparks, bad)] == ["failed", "passed", "bad scene"]
    first = wrong["oracles"][0]
    assert first["verdict"] == "fail" and first["error"] == pytest.approx(0.1, rel=1e-3) and first["allowed"] == 1e-3
    assert first["reason"] == "rounding" and len(wrong["oracles"][1]["expected"]) == 3 and "radius" in bad["error"]
    assert sparks["oracles"][0]["detects"] > sparks["oracles"][0]["allowed"]


def test_a_statistical_oracle_says_what_it_would_notice(folder):
    assert "living: would notice a change of" in warpsim("verify", "sparks.yaml", cwd=folder).stdout


def test_values_can_be_set(folder):
    settings = ("--set", "flow.0.circulation=2.1", "--set", "verify.round.expect=2.1", "--set", "verify.1.tolerance=1")
    assert warpsim("verify", "swirl.yaml", *settings, cwd=folder).returncode == 0
    assert warpsim("verify", "swirl.yaml", *settings[:2], cwd=folder).returncode == 1
    assert warpsim("verify", "sparks.yaml", "--seed", 9, cwd=folder).returncode == 0


def test_a_run_keeps_the_oracles(folder):
    made = warpsim("run", "sparks.yaml", "--viewer", "none", "--frames", 2, "--out", "run", "--set", "gravity=[0, 0, 0]", cwd=folder)
    assert made.returncode == 0, made.stderr
    assert warpsim("verify", "run/scene.yaml", cwd=folder).returncode == 0


def test_on_a_terminal_it_draws_a_table(folder):
    leader, follower = pty.openpty()
    run = subprocess.Popen(command("verify", "swirl.yaml"), cwd=folder, env=environment(), stdout=follower, stderr=subprocess.DEVNULL)
    os.close(follower)
    shown = b""
    while True:
        try:
            piece = os.read(leader, 65536)
        except OSError:
            piece = b""
        if not piece:
            break
        shown += piece
    os.close(leader)
    assert run.wait() == 0 and "PASS" in shown.decode() and "┃" in shown.decode()


def test_ctrl_c_ends_it(folder):
    long = SPARKS.replace("1200", "100000").replace("1000", "100000") + COUNT.replace("at: 0.4", "at: 100000")
    (folder / "long.yaml").write_text(long)
    run = subprocess.Popen(
        command("verify", "swirl.yaml", "long.yaml"),
        cwd=folder,
        env=environment(),
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    assert run.stdout.readline().startswith("swirl.yaml")  # the next one is on its way
    time.sleep(0.5)
    run.send_signal(signal.SIGINT)
    _, words = run.communicate()
    assert run.returncode == 130 and "Traceback" not in words
