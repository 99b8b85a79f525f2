"""What listing and validating scenes costs: no Warp, no NumPy, and no pydantic where nothing is validated."""

import subprocess
import sys
import time

LEAN = "import sys; from warpsim.scene import {names}; {use}; print(*sorted({{'warp', 'numpy', 'pydantic', 'yaml'}} & set(sys.modules)))"


def loaded(names: str, use: str) -> tuple[set[str], float]:
    """Run a line in a fresh interpreter: (which heavy packages it imported, seconds of the fastest of three)."""
    fastest = 1e9
    for _ in range(3):
        begin = time.perf_counter()
        done = subprocess.run(
            [sys.executable, "-c", LEAN.format(names=names, use=use)], capture_output=True, text=True, timeout=60, check=True
        )
        fastest = min(fastest, time.perf_counter() - begin)
    return set(done.stdout.split()), fastest


def test_listing_imports_nothing_heavy():
    packages, seconds = loaded("shipped_scenes, SceneError, find_scene", "shipped_scenes()")
    assert packages == set() and seconds < 0.3


def test_validating_imports_pydantic_and_yaml_only():
    packages, seconds = loaded("load_text", "load_text('name: x')")
    assert packages == {"pydantic", "yaml"} and seconds < 0.4
