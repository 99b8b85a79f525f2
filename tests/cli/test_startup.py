"""Verbs that only read and print must not make anyone wait: no Warp, NumPy or viewer is imported. Seconds: python -m benchmarks."""

import subprocess
import sys

import pytest

from tests.command import SPARKS, command, environment

HEAVY = {"warp", "numpy", "meshcat", "tornado", "rich"}
QUICK = (
    *("--help", "run --help", "list", "validate sparks.yaml", "validate campfire", "schema"),
    *("info campfire", "info systems.particles.capacity", "new fresh.yaml", "run no_such_scene", "verify --help", "validate oracles.yaml"),
)


@pytest.fixture
def folder(tmp_path):
    (tmp_path / "sparks.yaml").write_text(SPARKS)
    (tmp_path / "oracles.yaml").write_text(SPARKS + "verify: [{type: live_count, system: sparks, at: 1, tolerance: 3}]\n")
    return tmp_path


@pytest.mark.parametrize("arguments", QUICK)
def test_imports_nothing_heavy(arguments, folder):
    line = [sys.executable, "-X", "importtime", *command(*arguments.split())[1:]]
    result = subprocess.run(line, cwd=folder, env=environment(), capture_output=True, text=True)
    imported = {row.rpartition("|")[2].strip() for row in result.stderr.splitlines() if row.startswith("import time:")}
    assert "typer" in imported, result.stderr
    assert not imported & HEAVY
