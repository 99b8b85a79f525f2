"""A formula edited on disk is seen by the native loops: Warp's cache must know everything that went into them."""

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
RUN = """
import hashlib, json
import warp as wp
wp.config.log_level = wp.LOG_WARNING
import warpsim
assert warpsim.__file__.startswith(FOLDER), warpsim.__file__

def system(shape, **keys):
    emitter = {"burst": {"count": 70}, "shape": shape, "lifetime": 9.0, "mass": keys.pop("mass", 1.0)}
    return {"type": "particles", "capacity": 100, "emitters": [emitter], **keys}

point, line = {"type": "point", "center": [1, 0, 0]}, {"type": "segment", "start": [1, 0, 0], "end": [2, 0, 0]}
still = {"flow": False, "forces": False, "gravity": False}
systems = {
    "wind": system(point, coupling={"alpha": 40.0}, feels={**still, "flow": [0]}),
    "pull": system(point, feels={**still, "forces": True}),
    "born": system(line, feels=still),
    "light": system(point, feels=still, mass=1e-6),
}
flow = [{"type": "uniform", "velocity": [1, 0, 0]}, {"type": "vortex", "circulation": 1.0}]
forces = [{"type": "attractor", "strength": 1.0, "law": "spring"}]
scene = warpsim.Scene.model_validate({"name": "x", "flow": flow, "forces": forces, "systems": systems})
sim = warpsim.Simulation(scene, device="cpu", threads=1)
sim.run(0.1)
parts = {name: (p.position, p.velocity, p.mass) for name, p in ((name, sim.frame()[name]) for name in sim.frame())}
print(json.dumps({name: hashlib.blake2b(b"".join(a.tobytes() for a in arrays)).hexdigest() for name, arrays in parts.items()}))
"""
LOOP = "flow(2 * s); force(2 * s); EACH(PUT(V, KICK(GET(V), GET(U), GET(A), k, {step}))"
ORDER = [f'"{kind}": sample_{kind},' for kind in ("uniform", "source")]
EDITS = {  # what changes then, and the edits (file, old, new): they meet the cache of the unedited code
    "formulas": (
        {"wind", "pull", "born"},
        [
            ("flow.py", "return p.strength", "return p.strength * 1.5"),
            ("forces.py", "return d * (field.strength[0] * g)", "return d * (field.strength[0] * g * 2.0)"),
            ("birth.py", "return emitter.center + emitter.half *", "return emitter.center - emitter.half *"),
        ],
    ),
    "what formulas use": (
        {"wind", "light"},
        [
            ("elementary.py", "z * (0.5 - z", "z * (0.25 - z"),  # a function called by a formula, in another file
            ("birth.py", "SMALLEST_BULK = wp.constant(1.0e-12)", "SMALLEST_BULK = wp.constant(1.0e-3)"),
        ],
    ),
    "the loop's own text": ({"wind", "pull"}, [("loops.py", LOOP.format(step="h"), LOOP.format(step="0.5f * h"))]),
    "a registry's order": (set(), [("flow.py", "\n    ".join(ORDER), "\n    ".join(reversed(ORDER)))]),
}


@pytest.fixture(scope="module")
def checkout(tmp_path_factory) -> Path:
    """A copy of the checkout's code."""
    folder = tmp_path_factory.mktemp("checkout")
    for room in ("kernels", "warpsim", "scenes"):
        shutil.copytree(ROOT / room, folder / room, ignore=shutil.ignore_patterns("__pycache__"))
    return folder


def run(checkout: Path) -> dict[str, str]:
    """Run the copy in a process of its own, with a kernel cache of its own, and return a hash per system."""
    environment = {**os.environ, "WARP_CACHE_PATH": str(checkout / "cache"), "PYTHONPATH": str(checkout), "PYTHONDONTWRITEBYTECODE": "1"}
    code = RUN.replace("FOLDER", repr(str(checkout)))
    done = subprocess.run([sys.executable, "-c", code], cwd=checkout, env=environment, capture_output=True, text=True, timeout=300)
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout.splitlines()[-1])


@pytest.fixture(scope="module")
def before(checkout) -> dict[str, str]:
    """The hashes of the unedited code."""
    return run(checkout)


@pytest.mark.parametrize("what", EDITS)
def test_an_edit_is_seen(what, checkout, before):
    changed, edits = EDITS[what]
    originals = {name: (checkout / "kernels" / name).read_text() for name, _, _ in edits}
    try:
        for name, old, new in edits:
            text = (checkout / "kernels" / name).read_text()
            assert old in text, f"{name} reads otherwise now: edit this test"
            (checkout / "kernels" / name).write_text(text.replace(old, new))
        after = run(checkout)
    finally:
        for name, text in originals.items():
            (checkout / "kernels" / name).write_text(text)
    assert {name for name in before if after[name] != before[name]} == changed
