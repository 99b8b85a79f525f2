"""Limits that keep the house liveable: files, functions, and names that say nothing."""

import ast
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
ROOMS = ("kernels", "warpsim", "tests", "benchmarks")
CODE = sorted(path for room in ROOMS for kind in ("py", "js", "html") for path in (ROOT / room).rglob(f"*.{kind}"))
PYTHON = [path for path in CODE if path.suffix == ".py"]
EMPTY_WORDS = {"util", "utils", "helper", "helpers", "manager", "handler", "data", "info", "misc", "common"}


def name(path: Path) -> str:
    return str(path.relative_to(ROOT))


@pytest.mark.parametrize("path", CODE, ids=name)
def test_file_is_short(path):
    assert len(path.read_text().splitlines()) <= 400, "which second room is hiding in there?"


@pytest.mark.parametrize("path", PYTHON, ids=name)
def test_functions_are_short(path):
    functions = [n for n in ast.walk(ast.parse(path.read_text())) if isinstance(n, ast.FunctionDef | ast.AsyncFunctionDef)]
    long = {f.name: f.end_lineno - f.lineno + 1 for f in functions if f.end_lineno - f.lineno >= 60}
    assert not long, long


@pytest.mark.parametrize("path", CODE, ids=name)
def test_names_say_what_is_inside(path):
    words = {word for part in path.relative_to(ROOT).with_suffix("").parts for word in part.split("_")}
    # `info` is a verb of the command line (docs/scene.md), so its module is named for what the user types.
    assert not words & EMPTY_WORDS or name(path) == "warpsim/cli/info.py"
