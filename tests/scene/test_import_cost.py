"""What listing and validating scenes costs: no Warp, no NumPy, and no pydantic where nothing is validated. Seconds are `benchmarks`'."""

import subprocess
import sys

LEAN = "import sys; from warpsim.scene import {names}; {use}; print(*sorted({{'warp', 'numpy', 'pydantic', 'yaml'}} & set(sys.modules)))"


def loaded(names: str, use: str) -> set[str]:
    """Run a line in a fresh interpreter and return which heavy packages it imported."""
    line = LEAN.format(names=names, use=use)
    done = subprocess.run([sys.executable, "-c", line], capture_output=True, text=True, timeout=60, check=True)
    return set(done.stdout.split())


def test_listing_imports_nothing_heavy():
    assert loaded("shipped_scenes, SceneError, find_scene", "shipped_scenes()") == set()


def test_validating_imports_pydantic_and_yaml_only():
    assert loaded("load_text", "load_text('name: x')") == {"pydantic", "yaml"}
