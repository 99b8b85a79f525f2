"""The command line as a user has it: another process, its words and its exit code."""

import atexit
import json
import os
import select
import subprocess
import sys
import tempfile
from functools import cache
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
    if not hasattr(os, "fork") or any(name.startswith("PYTHON") for name in more):  # what Python itself reads it reads at its start
        return subprocess.run(command(*arguments), cwd=cwd, env=environment(**more), capture_output=True, text=True, timeout=timeout)
    with tempfile.TemporaryDirectory() as folder:
        out, err = Path(folder, "out"), Path(folder, "err")
        out.touch(), err.touch()
        order = {"arguments": [str(each) for each in arguments], "cwd": str(cwd or Path.cwd()), "out": str(out), "err": str(err)}
        order["environment"] = {**os.environ, **more}
        code = _forked(order, timeout)
        return subprocess.CompletedProcess(command(*arguments), code, out.read_text(), err.read_text())


def _forked(order: dict[str, object], timeout: float) -> int:
    """Have an order carried out by tests/forked.py and return the exit code. Raises TimeoutExpired."""
    server = _server(os.getpid())
    server.stdin.write(json.dumps(order).encode() + b"\n")
    if not select.select([server.stdout], [], [], timeout)[0]:
        _end(server)
        _server.cache_clear()
        raise subprocess.TimeoutExpired(order["arguments"], timeout)
    answer = server.stdout.readline()
    assert answer, "tests/forked.py has ended"
    return int(answer)


@cache
def _server(process: int) -> subprocess.Popen:
    """Start tests/forked.py, once."""
    line = [sys.executable, "-m", "tests.forked"]
    server = subprocess.Popen(line, cwd=ROOT, bufsize=0, env=environment(), stdin=subprocess.PIPE, stdout=subprocess.PIPE, process_group=0)
    atexit.register(_end, server)
    return server


def _end(server: subprocess.Popen) -> None:
    """End the server and what it carries out."""
    try:
        os.killpg(server.pid, 9)
    except ProcessLookupError:
        pass
    server.wait()
