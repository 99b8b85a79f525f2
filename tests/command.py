"""The command line as a user has it: another process, its words and its exit code."""

import os
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
SPARKS = """\
name: Sparks
seed: 3
time: {fps: 60, substeps: 2, duration: 0.5}
systems:
  sparks:
    type: particles
    capacity: 1000
    emitters:
      - shape: {type: point, center: [0, 1, 0]}
        rate: 1200
        lifetime: 0.2
        velocity: {direction: [0, 1, 0], cone: 20, speed: 2}
"""
BLOW_UP = SPARKS.replace("Sparks", "Blow up").replace(
    "systems:", "forces: [{type: attractor, center: [9, 9, 9], law: spring, strength: 1.0e+9}]\nsystems:"
)


def environment(**more: str) -> dict[str, str]:
    """Return the environment of a process that finds this checkout's warpsim from any folder; a PYTHONPATH in `more` goes first."""
    paths = [more.get("PYTHONPATH"), os.environ.get("PYTHONPATH"), str(ROOT)]
    return {**os.environ, **more, "PYTHONPATH": os.pathsep.join(filter(None, paths))}


def command(*arguments: object) -> list[str]:
    """Return the command for `warpsim ARGUMENTS`."""
    return [sys.executable, "-m", "warpsim", *map(str, arguments)]


def warpsim(*arguments: object, cwd: Path | None = None, timeout: float = 120.0, **more: str) -> subprocess.CompletedProcess:
    """Run `warpsim ARGUMENTS` to its end; `more` goes into its environment."""
    return subprocess.run(command(*arguments), cwd=cwd, env=environment(**more), capture_output=True, text=True, timeout=timeout)
