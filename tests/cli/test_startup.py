"""Verbs that only read and print must not make anyone wait: no Warp, NumPy or viewer is imported."""

import subprocess
import sys
import time

import pytest

from tests.command import SPARKS, command, environment

HEAVY = {"warp", "numpy", "meshcat", "tornado", "rich"}
QUICK = {  # arguments -> bar [s] for the whole process
    "--help": 0.3,
    "run --help": 0.3,
    "list": 0.3,
    "validate sparks.yaml": 0.4,
    "validate campfire": 0.4,
    "schema": 0.4,
    "info campfire": 0.4,
    "info systems.particles.capacity": 0.4,
    "new fresh.yaml": 0.4,
    "run no_such_scene": 0.4,
}


@pytest.fixture
def folder(tmp_path):
    (tmp_path / "sparks.yaml").write_text(SPARKS)
    return tmp_path


@pytest.mark.parametrize("arguments", QUICK)
def test_imports_nothing_heavy(arguments, folder):
    line = [sys.executable, "-X", "importtime", *command(*arguments.split())[1:]]
    result = subprocess.run(line, cwd=folder, env=environment(), capture_output=True, text=True)
    imported = {row.rpartition("|")[2].strip() for row in result.stderr.splitlines() if row.startswith("import time:")}
    assert "typer" in imported, result.stderr
    assert not imported & HEAVY


@pytest.mark.parametrize("arguments", QUICK)
def test_takes_no_time(arguments, folder):
    """The fastest of five, because other work on the machine only ever adds."""
    times = []
    for _ in range(5):
        began = time.perf_counter()
        subprocess.run(command(*arguments.split()), cwd=folder, env=environment(), capture_output=True)
        times.append(time.perf_counter() - began)
    assert min(times) < QUICK[arguments], times
