"""Real signals to real processes: what ends, with which words and code, and what is left. Nothing is timed; guards are generous."""

import os
import re
import signal
import subprocess
import sys
import time

import numpy as np
import pytest

from tests.command import command, environment, warpsim
from tests.reliability.run_folder import check_run_folder
from warpsim.interruption import WAITING

pytestmark = [pytest.mark.cpu, pytest.mark.skipif(os.name == "nt", reason="no signals of this kind")]
GUARD = 240.0  # s
DEAF = """\
import hashlib, sys
from warpsim.interruption import Interruption

with Interruption(lambda text: print(text, flush=True)) as stop:
    stop.patient = sys.argv[1] == "patient"
    words = ["deaf"]
    while True:
        try:
            while words:
                print(words.pop(), flush=True)
            hashlib.pbkdf2_hmac("sha256", b"", b"", 2**31 - 1)  # native code for an hour: Python's handlers wait for its end
        except KeyboardInterrupt:  # the signal came before it began
            pass
"""
MARKS = """\
import atexit, os

class Last:
    def __del__(self):
        os.write(2, b"taken apart")

last = Last()
atexit.register(lambda: os.write(1, b"what is due at the end was done"))
"""
MANY = """\
name: Many
seed: 1
time: {fps: 60, substeps: 4, duration: 7200}
flow: [{type: curl_noise, amplitude: 0.5, length: 0.9, frequency: 0.1, octaves: 3}]
systems:
  dust:
    type: particles
    capacity: 100000
    coupling: tracer
    emitters: [{shape: {type: box, center: [0, 0, 0], size: [4, 4, 4]}, burst: {count: 100000, at: 0}, lifetime: 100000}]
"""


def started(line: list[str], cwd, **more: str) -> subprocess.Popen:
    return subprocess.Popen(line, cwd=cwd, env=environment(**more), stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)


def deaf(tmp_path, kind: str) -> subprocess.Popen:
    """Return a process whose main thread is in native code."""
    (tmp_path / "deaf.py").write_text(DEAF)
    process = started([sys.executable, "deaf.py", kind], tmp_path)
    assert process.stdout.readline() == "deaf\n"
    return process


def ended(process: subprocess.Popen) -> tuple[str, str]:
    """Wait for the end and return what it said; no other end than 130."""
    try:
        out, err = process.communicate(timeout=GUARD)
    finally:
        process.kill()
    assert process.returncode == 130 and "Traceback" not in err, (process.returncode, err)
    return out, err


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_one_signal_ends_native_code_in_which_there_is_nothing_to_save(tmp_path, number):
    process = deaf(tmp_path, "impatient")
    process.send_signal(number)
    assert ended(process) == ("", "interrupted\n")


def test_a_long_frame_is_waited_for_with_words_and_the_second_signal_ends_it(tmp_path):
    process = deaf(tmp_path, "patient")
    process.send_signal(signal.SIGINT)
    assert process.stdout.readline() == WAITING + "\n"
    time.sleep(2.0)
    assert process.poll() is None, "a first signal never cuts off what is worth finishing"
    process.send_signal(signal.SIGINT)
    assert ended(process) == ("", "interrupted\n")


def test_the_third_signal_kills(tmp_path):
    process = deaf(tmp_path, "patient")
    for _ in range(3):
        process.send_signal(signal.SIGINT)
        time.sleep(0.05)  # the system merges what it has not handed over
    assert ended(process)[1] == "interrupted\n"


def test_compiling_is_not_waited_for_and_leaves_a_cache_that_is_whole(tmp_path):
    """23 modules are announced, and the signal comes with the announcement."""
    more = {"WARP_CACHE_PATH": str(tmp_path / "cache"), "TMPDIR": str(tmp_path / "temporary")}
    (tmp_path / "temporary").mkdir()
    process = started(command("run", "flags", "--viewer", "none"), tmp_path, **more)
    assert "compiling kernels" in process.stdout.readline()
    (cache,) = (tmp_path / "cache").iterdir()
    while not list(cache.glob("wp_*_p*_t*")):  # a compiler is at work
        assert process.poll() is None
    process.send_signal(signal.SIGINT)
    out, err = ended(process)
    assert "compiled" not in out and err == "interrupted\n"
    assert not list((tmp_path / "temporary").glob("wp_pch_*")), "headers of 5 MB each"
    half_built = [path for path in cache.iterdir() if re.search(r"_p\d+_t\d+$", path.name)]
    for module in set(cache.glob("wp_*")) - set(half_built):
        assert {path.suffix for path in module.iterdir()} >= {".o", ".meta"}, module
    check_sweep(cache, more)


def check_sweep(cache, more) -> None:
    """What was left long ago goes at the next start; what somebody may be building, and all else, stays."""
    fresh, left, whole = (cache / f"wp_a.b_0123abc{builder}" for builder in ("_p1_t2", "_p3_t4", ""))
    fresh.mkdir(), left.mkdir(), whole.mkdir()
    long_ago = time.time() - 2 * 3600
    for path in (left, whole):
        os.utime(path, (long_ago, long_ago))
    warpsim("doctor", **more)
    assert fresh.exists() and whole.exists() and not left.exists()


def test_a_heavy_run_ends_whole_and_nothing_is_taken_apart(tmp_path):
    """Taking Python and Warp apart took 0.5 s and, on a busy machine, 1.8."""
    (tmp_path / "many.yaml").write_text(MANY)
    (tmp_path / "marks").mkdir()
    (tmp_path / "marks" / "sitecustomize.py").write_text(MARKS)
    line = command("run", "many.yaml", "--viewer", "none", "--out", "r", "--record", "many.html")
    process = started(line, tmp_path, PYTHONPATH=str(tmp_path / "marks"))
    while not (tmp_path / "r" / "frames" / "000002.npz").exists():
        assert process.poll() is None
        time.sleep(0.02)
    process.send_signal(signal.SIGINT)
    out, err = ended(process)
    assert "what is due at the end was done" in out and "taken apart" not in err
    count = check_run_folder(tmp_path / "r")
    assert f"interrupted after frame {count - 1}\n" in err and count > 2
    with np.load(tmp_path / "r" / "lastgood.npz") as last, np.load(tmp_path / "r" / "frames" / f"{count - 1:06d}.npz") as frame:
        assert last["index"] == count - 1 and all(np.array_equal(last[key], frame[key]) for key in frame.files)
    page = (tmp_path / "many.html").read_text()
    assert page.count('class="frame"') == count and page.endswith("</html>\n")
    assert not list(tmp_path.rglob(".*"))
