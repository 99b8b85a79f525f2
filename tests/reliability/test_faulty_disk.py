"""A recorded run on a disk that fails: it ends with 5 and one line, and everything that is visible is whole."""

import json
import os
import subprocess

import numpy as np
import pytest

from tests.command import SPARKS, warpsim
from tests.reliability.run_folder import check_run_folder
from tests.reliability.test_files import FailingSystem
from warpsim import files


@pytest.fixture
def folder(tmp_path, monkeypatch):
    (tmp_path / "sparks.yaml").write_text(SPARKS)
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.fixture
def small_disk(tmp_path):
    """Return a function that mounts a real file system of so many KiB; skips where that is not allowed."""
    mounted = []

    def mount(size: int, *options: str):
        place = tmp_path / f"disk{len(mounted)}"
        place.mkdir()
        line = ["mount", "-t", "tmpfs", "-o", ",".join([f"size={size}k", *options]), "none", str(place)]
        try:
            done = subprocess.run(line, capture_output=True)
        except FileNotFoundError:
            pytest.skip("no mount here")
        if done.returncode:
            pytest.skip("only root may mount")
        mounted.append(place)
        return place

    yield mount
    for place in mounted:
        subprocess.run(["umount", "-l", str(place)], check=False)


def record(out, *more, frames=4) -> int:
    """Run in this process, so that every single call to the disk can be made to fail."""
    from warpsim.cli import main

    return main(["run", "sparks.yaml", "--viewer", "none", "--frames", str(frames), "--out", str(out), *more])


@pytest.mark.parametrize("half", [False, True])
def test_the_nth_write_flush_or_rename_fails_for_every_n(folder, monkeypatch, capsys, half):
    (folder / "c.jsonl").write_text('{"index": 2, "path": "gravity.1", "value": "-1"}\n')
    system = FailingSystem(fails_at=10**9)
    monkeypatch.setattr(files, "os", system)
    assert record("whole", "--changes", "c.jsonl") == 0 and (folder / "whole" / "changes.jsonl").exists()
    calls = system.calls
    assert calls > 40
    for n in range(1, calls + 1):
        monkeypatch.setattr(files, "os", FailingSystem(n, half))
        code = record(f"r{n}", "--changes", "c.jsonl")
        monkeypatch.setattr(files, "os", os)
        said = capsys.readouterr()
        assert code == 5, (n, said)
        assert "No space left on device" in said.err and "Traceback" not in said.err and f"r{n}" in said.err
        check_run_folder(folder / f"r{n}")
    again = record("r1")  # nothing was recorded there: the folder is as good as new
    assert again == 0


def test_a_failing_replacement_harms_no_frame_that_is_still_listed(folder, monkeypatch):
    assert record("r") == 0
    from warpsim.cli import main

    for n in range(1, 12):
        monkeypatch.setattr(files, "os", FailingSystem(n))
        assert main("run sparks.yaml --viewer none --frames 1 --out r --overwrite".split()) == 5
        monkeypatch.setattr(files, "os", os)
        check_run_folder(folder / "r")


@pytest.mark.parametrize("size", [8, 40, 120, 300])
def test_a_full_disk(folder, small_disk, size):
    disk = small_disk(size)
    result = warpsim("run", "sparks.yaml", "--viewer", "none", "--out", disk / "r", cwd=folder)
    assert result.returncode == 5 and "No space left on device" in result.stderr and "Traceback" not in result.stderr
    assert len(result.stderr.splitlines()) == 1
    check_run_folder(disk / "r")
    if size >= 120:
        assert len((disk / "r" / "frames.jsonl").read_text().splitlines()) > 3


@pytest.mark.parametrize("verb", [("run", "sparks.yaml"), ("view", "r")])
def test_a_full_disk_under_a_recording(folder, small_disk, verb):
    assert record("r", frames=30) == 0
    disk = small_disk(160)
    result = warpsim(*verb, "--viewer", "none", "--record", disk / "x.html", cwd=folder)
    assert result.returncode == 5 and "No space left on device" in result.stderr and "x.html" in result.stderr
    assert len(result.stderr.splitlines()) == 1 and "frame 30/30" in result.stdout, "the run itself went on to its end"
    assert not any(disk.iterdir())


def test_a_read_only_disk(folder, small_disk):
    disk = small_disk(64, "ro")
    result = warpsim("run", "sparks.yaml", "--viewer", "none", "--out", disk / "r", cwd=folder)
    assert result.returncode == 5 and "Read-only" in result.stderr and "Traceback" not in result.stderr


@pytest.mark.cpu
@pytest.mark.parametrize("size", [64, 3000])
def test_full_disks_under_the_kernel_cache_and_its_substitute(folder, small_disk, size):
    """Left alone, Python fails to write the source (64 KiB), or LLVM ends the process where it cannot write the code (3000)."""
    cache, temporary = small_disk(size), small_disk(size)
    more = {"WARP_CACHE_PATH": str(cache), "TMPDIR": str(temporary)}
    result = warpsim("run", "sparks.yaml", "--viewer", "none", cwd=folder, **more)
    assert result.returncode == 5 and f"{cache}" in result.stdout and "has no room left" in result.stdout, result.stderr
    (line,) = result.stderr.splitlines()
    assert line.startswith(f"error: {temporary}") and "No space left on device" in line and "WARP_CACHE_PATH" in line
    assert not list(cache.rglob("wp_*")) and not list(temporary.rglob("wp_*"))


@pytest.mark.cpu
def test_read_only_disks_under_the_kernel_cache(folder, small_disk):
    more = {"WARP_CACHE_PATH": str(small_disk(64, "ro")), "TMPDIR": str(small_disk(64))}
    result = warpsim("run", "sparks.yaml", "--viewer", "none", cwd=folder, **more)
    assert result.returncode == 5 and "cannot be written" in result.stdout and len(result.stderr.splitlines()) == 1, result.stderr


@pytest.mark.parametrize("out", ["sparks.yaml", "sparks.yaml/below"])
def test_a_file_where_a_folder_is_expected(folder, out):
    result = warpsim("run", "sparks.yaml", "--viewer", "none", "--frames", 2, "--out", out, cwd=folder)
    assert result.returncode == 5 and "sparks.yaml" in result.stderr and "Traceback" not in result.stderr
    assert (folder / "sparks.yaml").read_text() == SPARKS


def test_the_last_good_state_finds_another_place(folder, small_disk, tmp_path):
    from tests.command import BLOW_UP

    (folder / "sparks.yaml").write_text(BLOW_UP)
    disk, spare = small_disk(64, "ro"), tmp_path / "spare"
    spare.mkdir()
    result = warpsim("run", folder / "sparks.yaml", "--viewer", "none", cwd=disk, TMPDIR=str(spare))
    assert result.returncode == 4 and "Read-only" in result.stdout
    with np.load(spare / "Blow-up.lastgood.npz") as arrays:
        assert arrays["index"] >= 0


def test_a_crash_report_finds_another_place(folder, small_disk, tmp_path, monkeypatch, capsys):
    from warpsim.cli.outcome import exit_code_of

    monkeypatch.chdir(small_disk(64, "ro"))
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    assert exit_code_of(lambda: json.loads(1)) == 70
    assert len(list(tmp_path.glob("warpsim-crash-*.txt"))) == 1 and "crash report" in capsys.readouterr().err


def test_nothing_that_is_not_finite_is_written(folder):
    from types import SimpleNamespace

    from warpsim.observers.recorder import NonFiniteFrame, save_frame

    n = 4
    system = SimpleNamespace(**{name: np.zeros(n, np.float32) for name in ("id", "age", "lifetime", "mass", "radius")})
    system.has_colors = system.is_network = system.tears = system.is_flock = system.is_carried = False
    system.position, system.velocity = np.zeros((n, 3), np.float32), np.full((n, 3), np.nan, np.float32)
    frame = type("Frame", (dict,), {"index": 1, "time": 0.1})(sparks=system)
    with pytest.raises(NonFiniteFrame):
        save_frame(folder / "f.npz", frame)
    assert not (folder / "f.npz").exists()
