"""SIGKILL half-way through a recorded run: what is visible is whole, and the next run in the folder works."""

import random
import subprocess
import time

import pytest

from tests.command import SPARKS, command, environment, warpsim
from tests.reliability.run_folder import check_run_folder

MOMENTS = [random.Random(k).uniform(0.0, 1.0) for k in range(6)]  # s after the first frame


@pytest.mark.parametrize("moment", MOMENTS, ids=lambda moment: f"{moment:.2f}")
def test_kill_half_way(tmp_path, moment):
    (tmp_path / "sparks.yaml").write_text(SPARKS.replace("duration: 0.5", "duration: 72000"))
    line = command("run", "sparks.yaml", "--viewer", "none", "--out", "r")
    process = subprocess.Popen(line, cwd=tmp_path, env=environment(), stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    while not (tmp_path / "r" / "frames" / "000000.npz").exists():
        assert process.poll() is None
        time.sleep(0.01)
    time.sleep(moment)
    process.kill()
    process.wait()
    listed = check_run_folder(tmp_path / "r")
    written = len(list((tmp_path / "r" / "frames").glob("[!.]*.npz")))
    assert listed <= written <= listed + 1, "a frame is written, then listed"
    again = warpsim("run", "sparks.yaml", "--viewer", "none", "--frames", 3, "--out", "r", "--overwrite", cwd=tmp_path)
    assert again.returncode == 0, again.stderr
    assert check_run_folder(tmp_path / "r") == 4
    assert not list((tmp_path / "r").rglob(".*")), "stale temporaries are swept"
