"""CONTRIBUTING.md shows a real diff: applied to a copy of the checkout, its own tests and those of the registry pass."""

import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
COPIED = ("pyproject.toml", "kernels", "warpsim", "scenes", "tests")


def call(*command, cwd: Path, **more) -> str:
    done = subprocess.run(command, cwd=cwd, capture_output=True, text=True, timeout=300, **more)
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


@pytest.mark.skipif(shutil.which("git") is None, reason="git, which applies the diff, is not installed")
def test_the_recipe_adds_a_flow_primitive(tmp_path):
    diff = re.search(r"^```diff\n(.*?)^```", (ROOT / "CONTRIBUTING.md").read_text(), re.S | re.M).group(1)
    assert diff.count("\n+++ ") <= 5, "at most five files"
    for name in COPIED:
        source = ROOT / name
        ignored = shutil.ignore_patterns("__pycache__")
        shutil.copytree(source, tmp_path / name, ignore=ignored) if source.is_dir() else shutil.copy(source, tmp_path)
    call("git", "apply", "-C1", "-", cwd=tmp_path, input=diff)
    call(sys.executable, "-m", "warpsim", "schema", "--out", "scenes/scene.schema.json", cwd=tmp_path)
    suites = [f"tests/{name}.py" for name in ("house/test_contract", "house/test_kernel_style", "kernels/test_fields")]
    suites += ["tests/physics/test_strain.py"]
    said = call(sys.executable, "-m", "pytest", "-q", "-k", "strain", *suites, cwd=tmp_path)
    assert int(re.search(r"(\d+) passed", said).group(1)) >= 6, said
