"""run: its options, what it writes, and how it ends."""

import csv
import hashlib
import json
import subprocess
import urllib.error
import urllib.request
from urllib.parse import urlsplit

import numpy as np
import pytest

from tests.command import BLOW_UP, SPARKS, command, environment, warpsim


@pytest.fixture
def folder(tmp_path):
    (tmp_path / "sparks.yaml").write_text(SPARKS)
    return tmp_path


def run(folder, *arguments, **more):
    return warpsim("run", "sparks.yaml", "--viewer", "none", *arguments, cwd=folder, **more)


def result_of(folder, *arguments):
    process = run(folder, "--json", *arguments)
    assert process.returncode == 0, process.stderr
    return json.loads(process.stdout)


def test_runs_the_duration_of_the_scene(folder):
    result = result_of(folder)
    assert result["outcome"] == "done" and result["frame"] == 30 and result["time"] == pytest.approx(0.5)
    assert result["systems"]["sparks"]["born"] == pytest.approx(600, abs=5) and result["systems"]["sparks"]["refused"] == 0


def test_plain_lines_when_piped(folder):
    process = run(folder, "--frames", 7)
    assert process.returncode == 0 and "\x1b" not in process.stdout
    last = process.stdout.splitlines()[-1]
    assert last.startswith("frame 7/7 ") and "live" in last and "ms/frame" in last and "x real time" in last


def test_changes_from_the_command_line(folder):
    assert result_of(folder, "--frames", 3)["state_hash"] == result_of(folder, "--frames", 3, "--seed", 3)["state_hash"]
    assert result_of(folder, "--frames", 3)["state_hash"] != result_of(folder, "--frames", 3, "--seed", 4)["state_hash"]
    narrow = result_of(folder, "--set", "systems.sparks.capacity=50", "--set", "time.duration=0.25")
    assert narrow["frame"] == 15 and narrow["systems"]["sparks"]["live"] <= 50 and narrow["systems"]["sparks"]["refused"] > 0
    bad = run(folder, "--set", "systems.sparks.capacty=50")
    assert bad.returncode == 3 and "capacity" in bad.stderr and "Traceback" not in bad.stderr


def test_equal_bits_for_any_threads(folder):
    assert len({result_of(folder, "--threads", n)["state_hash"] for n in (1, 2, 3)}) == 1


def test_overflow_is_told_when_it_begins_and_at_the_end(folder):
    process = run(folder, "--set", "systems.sparks.capacity=50")
    assert process.returncode == 0
    assert process.stdout.count("sparks is full at frame") == 1 and "births were refused for lack of room" in process.stdout


def test_a_tolerance_that_is_not_kept_is_told_once_and_counted(tmp_path):
    comet = SPARKS.replace("capacity: 1000", "solver: abm_pece_4\n    substeps: auto\n    tolerance: 1.0e-8\n    max_substeps: 2")
    pull = "forces: [{type: attractor, center: [0, 1.2, 0], law: inverse_square, strength: 1.0}]\nsystems:"
    (tmp_path / "sparks.yaml").write_text(comet.replace("systems:", pull))
    told = run(tmp_path)
    assert told.returncode == 0 and told.stdout.count("the most substeps do not keep the tolerance") == 1, told.stderr
    assert "systems.sparks.max_substeps" in told.stdout and "frames of particles" in told.stdout
    sparks = result_of(tmp_path)["systems"]["sparks"]
    assert sparks["inexact"] > 0 and 1.0 < sparks["substeps"] <= 2.0


def test_a_strain_that_cannot_be_limited_is_told_once_and_counted(tmp_path):
    """A thread whose ends are drawn apart to twice its length: the run goes on; drawn apart by a twentieth there is nothing to tell."""
    text = """\
name: Thread
time: {fps: 60, substeps: 8, duration: 0.5}
systems:
  sparks:
    type: springs
    generator: {type: chain, count: 5, start: [0, 0, 0], end: [1, 0, 0]}
    stiffness: 5
    strain_limit: 0.1
    pins: [start, end]
    pin_motion: [{pins: [end], keyframes: [[0, [0, 0, 0]], [0.4, [1, 0, 0]]]}]
"""
    (tmp_path / "sparks.yaml").write_text(text)
    told = run(tmp_path)
    assert told.returncode == 0 and told.stdout.count("longer than strain_limit allows") == 1, told.stderr
    assert result_of(tmp_path)["systems"]["sparks"]["overlong"] > 0
    (tmp_path / "sparks.yaml").write_text(text.replace("[0.4, [1, 0, 0]]", "[0.4, [0.05, 0, 0]]"))
    assert "strain_limit" not in run(tmp_path).stdout and result_of(tmp_path)["systems"]["sparks"]["overlong"] == 0


def test_run_folder(folder):
    assert run(folder, "--frames", 12, "--out", "r").returncode == 0
    entries = [json.loads(line) for line in (folder / "r" / "frames.jsonl").read_text().splitlines()]
    assert [entry["index"] for entry in entries] == [*range(13)]
    assert sorted(path.name for path in (folder / "r" / "frames").iterdir()) == [f"{k:06d}.npz" for k in range(13)]
    chain = ""
    for entry in entries:
        data = (folder / "r" / entry["file"]).read_bytes()
        chain = hashlib.sha256((chain + entry["state"]).encode()).hexdigest()
        assert entry["sha256"] == hashlib.sha256(data).hexdigest() and entry["chain"] == chain
        with np.load(folder / "r" / entry["file"], allow_pickle=False) as arrays:
            n = entry["live"]["sparks"]
            assert arrays["sparks.position"].shape == arrays["sparks.velocity"].shape == (n, 3)
            assert arrays["sparks.position"].dtype == np.float32 and arrays["sparks.id"].dtype == np.uint64
            assert arrays["sparks.age"].shape == (n,) and arrays["index"] == entry["index"] and arrays["time"] == entry["time"]
    rows = list(csv.DictReader((folder / "r" / "stats.csv").open()))
    assert [int(row["sparks.live"]) for row in rows] == [entry["live"]["sparks"] for entry in entries]
    assert float(rows[-1]["time"]) == 12 / 60 and float(rows[-1]["sparks.kinetic_energy"]) > 0


def test_the_resolved_scene_repeats_the_run(folder):
    first = result_of(folder, "--frames", 5, "--out", "r", "--seed", 9, "--set", "gravity=[0, -1, 0]")
    text = (folder / "r" / "scene.yaml").read_text()
    assert "# warpsim: " in text and "# processor features: " in text and "# device: cpu" in text and "# seed: 9" in text
    (folder / "sparks.yaml").write_text(text)
    assert result_of(folder, "--frames", 5)["state_hash"] == first["state_hash"]


def test_equal_runs_write_equal_bytes(folder):
    for name, threads in (("a", 1), ("b", 2)):
        assert run(folder, "--frames", 6, "--threads", threads, "--out", name).returncode == 0
    for path in [*sorted((folder / "a" / "frames").iterdir()), folder / "a" / "frames.jsonl", folder / "a" / "stats.csv"]:
        assert path.read_bytes() == (folder / "b" / path.relative_to(folder / "a")).read_bytes(), path


def test_a_folder_that_holds_something_is_not_harmed(folder):
    (folder / "precious").mkdir()
    (folder / "precious" / "thesis.txt").write_text("mine")
    for extra in ((), ("--overwrite",)):
        refused = run(folder, "--frames", 2, "--out", "precious", *extra)
        assert refused.returncode == 5 and "precious" in refused.stderr
    assert [path.name for path in (folder / "precious").iterdir()] == ["thesis.txt"]


def test_a_run_is_replaced_only_when_told(folder):
    assert run(folder, "--frames", 9, "--out", "r").returncode == 0
    before = (folder / "r" / "frames.jsonl").read_bytes()
    refused = run(folder, "--frames", 2, "--out", "r")
    assert refused.returncode == 5 and "--overwrite" in refused.stderr and (folder / "r" / "frames.jsonl").read_bytes() == before
    (folder / "r" / "notes.txt").write_text("mine")
    assert run(folder, "--frames", 2, "--out", "r", "--overwrite").returncode == 0
    assert len(list((folder / "r" / "frames").iterdir())) == 3 and (folder / "r" / "notes.txt").read_text() == "mine"


def test_unknown_scenes_end_with_2_and_a_suggestion(folder):
    unknown, missing = warpsim("run", "campfir"), warpsim("run", "spark.yaml", cwd=folder)
    assert unknown.returncode == missing.returncode == 2
    assert "campfire" in unknown.stderr and "sparks.yaml" in missing.stderr
    assert "Traceback" not in unknown.stderr + missing.stderr


@pytest.mark.parametrize(
    "arguments",
    [["--device", "gpu"], ["--device", "cuda:77"], ["--viewer", "vr"], ["--overwrite"], ["--watch", "--out", "r"], ["--threads", "0"]],
)
def test_impossible_wishes_end_with_2(folder, arguments):
    process = run(folder, *arguments)
    assert process.returncode == 2 and "Traceback" not in process.stderr and process.stderr


def test_bad_scene_ends_with_3(folder):
    (folder / "sparks.yaml").write_text(SPARKS.replace("capacity: 1000", "capacity: -1"))
    process = run(folder)
    assert process.returncode == 3 and "sparks.yaml:7:" in process.stderr and "^" in process.stderr


def test_too_much_memory_ends_with_3(folder):
    process = run(folder, "--set", "systems.sparks.capacity=100000000", "--set", "limits.memory=0.5")
    assert process.returncode == 3 and "GiB" in process.stderr and "Traceback" not in process.stderr


@pytest.mark.parametrize("out", [(), ("--out", "r")])
def test_blow_up_ends_with_4_and_saves_the_last_good_state(folder, out):
    (folder / "sparks.yaml").write_text(BLOW_UP)
    process = run(folder, *out)
    assert process.returncode == 4, process.stderr
    assert "sparks" in process.stderr and "frame" in process.stderr and "substeps" in process.stderr and "Traceback" not in process.stderr
    path = folder / "r" / "lastgood.npz" if out else folder / "Blow-up.lastgood.npz"
    assert (str(path) if not out else "r/lastgood.npz") in process.stderr
    for file in [path, *(folder / "r" / "frames").glob("*.npz")]:
        with np.load(file, allow_pickle=False) as arrays:
            assert all(np.isfinite(arrays[name]).all() for name in arrays.files)
    if out:
        entries = [json.loads(line) for line in (folder / "r" / "frames.jsonl").read_text().splitlines()]
        with np.load(path) as arrays:
            assert arrays["index"] == entries[-1]["index"]
        assert "not finite" in (folder / "r" / "log.txt").read_text()


def test_blow_up_in_the_prewarm_ends_with_4(folder):
    (folder / "sparks.yaml").write_text(BLOW_UP.replace("duration: 0.5", "duration: 0.5, prewarm: 1.0"))
    process = run(folder)
    assert process.returncode == 4 and "Traceback" not in process.stderr


def test_an_internal_bug_leaves_one_line_and_a_report(folder):
    (folder / "sitecustomize.py").write_text(
        "import sys, types\nfake = types.ModuleType('warpsim.simulation')\nfake.resolve_device = lambda name: 1 // 0\n"
        "fake.Simulation = fake.UnstableError = Exception\nsys.modules['warpsim.simulation'] = fake\n"
    )
    process = run(folder, PYTHONPATH=str(folder))
    assert process.returncode == 70 and len(process.stderr.splitlines()) == 1 and "ZeroDivisionError" in process.stderr
    (report,) = folder.glob("warpsim-crash-*.txt")
    assert str(report) in process.stderr and "Traceback" in report.read_text() and "arguments: ['run', 'sparks.yaml'" in report.read_text()


def test_host_is_an_address(tmp_path):
    (tmp_path / "sparks.yaml").write_text(SPARKS)
    done = subprocess.run(
        command("run", "sparks.yaml", "--host", "nowhere"), cwd=tmp_path, env=environment(), capture_output=True, text=True
    )
    assert done.returncode == 2 and "--host nowhere" in done.stderr and "Traceback" not in done.stderr


def test_a_viewer_opened_wider_asks_for_its_token(tmp_path):
    (tmp_path / "sparks.yaml").write_text(SPARKS.replace("duration: 0.5", "duration: 72000"))
    line = command("run", "sparks.yaml", "--host", "0.0.0.0", "--port", "0")
    process = subprocess.Popen(line, cwd=tmp_path, env=environment(), stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
    try:
        address = next(word for text in process.stdout for word in text.split() if word.startswith("http"))
        port, token = urlsplit(address).port, urlsplit(address).query
        with pytest.raises(urllib.error.HTTPError, match="403"):
            urllib.request.urlopen(f"http://127.0.0.1:{port}/", timeout=60)
        assert urllib.request.urlopen(f"http://127.0.0.1:{port}/?{token}", timeout=60).status == 200
    finally:
        process.terminate()
        process.communicate(timeout=60)
