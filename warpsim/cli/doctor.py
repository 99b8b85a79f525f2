"""doctor: check this machine, and say what to do."""

import os
import shutil
import socket
import sys
from collections.abc import Callable, Iterator
from dataclasses import asdict, dataclass
from pathlib import Path

import typer

from warpsim.cli.validate import JSON

OK, WARN, FAIL = "ok", "warn", "fail"
OLDEST_PYTHON = (3, 11)
GIBIBYTE = 2**30


@dataclass(frozen=True)
class Finding:
    """One line of the doctor's: what was looked at, how it is, and what to do if it is not well."""

    topic: str
    state: str
    finding: str
    remedy: str = ""


def doctor(json: JSON = False) -> int:
    """Check this machine: Warp, GPU, kernel cache, viewer, browser, disk, extras; and say what to do."""
    from warpsim.cli.outcome import Exit, print_json

    findings = [finding for check in CHECKS for finding in _checked(check)]
    if json:
        print_json([asdict(finding) for finding in findings])
    else:
        for f in findings:
            typer.echo(f"{f.state:<5} {f.topic:<13} {f.finding}" + (f"\n      -> {f.remedy}" if f.remedy else ""))
    return Exit.CHECK_FAILED if any(f.state == FAIL for f in findings) else Exit.OK


def _checked(check: Callable[[], Iterator[Finding]]) -> list[Finding]:
    """Run one check; a check that itself fails is a finding, not a traceback."""
    try:
        return [*check()]
    except Exception as error:
        topic = check.__name__.removeprefix("check_").replace("_", " ")
        return [Finding(topic, FAIL, f"{type(error).__name__}: {str(error).splitlines()[0] if str(error) else 'no more is known'}")]


def check_python() -> Iterator[Finding]:
    """Python itself."""
    found = ".".join(map(str, sys.version_info[:3]))
    old = sys.version_info < OLDEST_PYTHON
    yield Finding("Python", FAIL if old else OK, found, "warpsim needs Python 3.11 or newer" if old else "")


def check_warp() -> Iterator[Finding]:
    """Warp, its devices, and its kernel cache."""
    try:
        import warp as wp
    except ImportError as error:
        yield Finding("Warp", FAIL, f"cannot be imported: {error}", "pip install 'warp-lang>=1.19'")
        return
    from warpsim.kernel_cache import prepare_kernel_cache

    notes: list[str] = []
    folder = prepare_kernel_cache(notes.append)
    yield Finding("Warp", OK, wp.config.version)
    cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count()
    yield Finding("CPU", OK if wp.is_cpu_available() else FAIL, f"{cores} core(s)", "" if wp.is_cpu_available() else "reinstall warp-lang")
    for device in wp.get_cuda_devices():
        yield Finding("GPU", OK, f"{device.alias}: {device.name}, {device.total_memory / GIBIBYTE:.0f} GiB, sm_{device.arch}")
    if not wp.get_cuda_devices():
        yield Finding("GPU", WARN, "no CUDA device", "scenes run on the CPU; for a GPU install the NVIDIA driver")
    if notes:
        yield Finding("kernel cache", WARN, notes[0], "make the folder writable, or set WARP_CACHE_PATH to one that is")
    else:
        yield Finding("kernel cache", OK, f"{folder}: {held(folder)}")
    yield _disk("disk (cache)", folder)


def held(folder: Path) -> str:
    """Return how many modules of kernels a cache holds, and how large they are."""
    from warpsim.kernel_cache import BUILDING

    modules = [place for place in folder.glob("wp_*") if place.is_dir() and not BUILDING.fullmatch(place.name)]
    size = sum(file.stat().st_size for place in modules for file in place.glob("*"))
    return f"{len(modules)} modules, {size / 2**20:.0f} MiB" if modules else "empty: the first run of a scene compiles its kernels"


def check_viewer() -> Iterator[Finding]:
    """What the viewer needs: Meshcat's page, a port, a browser."""
    from importlib.util import find_spec

    for package in ("meshcat", "tornado"):
        if find_spec(package) is None:
            yield Finding("viewer", FAIL, f"the package {package} is missing", f"pip install {package}")
            return
    from warpsim.observers.viewer.hub import DEFAULT_PORT

    with socket.socket() as probe:
        try:
            probe.bind(("127.0.0.1", DEFAULT_PORT))
            yield Finding("port", OK, f"127.0.0.1:{DEFAULT_PORT} is free")
        except OSError as error:
            yield Finding("port", WARN, f"127.0.0.1:{DEFAULT_PORT}: {error.strerror}", "the viewer takes the next free one and prints it")
    from warpsim.cli.browser import missing_browser
    from warpsim.observers.snapshot import find_browser

    trouble, painter = missing_browser(), find_browser()
    remedies = ["runs go on without; open the printed address by hand, or from another machine through an ssh tunnel"] if trouble else []
    remedies += [] if painter else ["install Chromium, Chrome or Edge, if you want --snapshot"]
    finding = f"{trouble or 'found'}; " + (f"pictures (--snapshot) by {painter}" if painter else "none that takes pictures (--snapshot)")
    yield Finding("browser", WARN if remedies else OK, finding, "; ".join(remedies))


def check_disk() -> Iterator[Finding]:
    """Room for recordings in the current folder."""
    yield _disk("disk (here)", Path.cwd())


def check_extras() -> Iterator[Finding]:
    """Optional packages."""
    from importlib.util import find_spec

    extras = {
        "mesh": ("trimesh",),
        "plot": ("matplotlib",),
        "bench": ("numba", "taichi"),
        "test": ("pytest", "hypothesis", "websocket", "PIL", "jsonschema"),
    }
    for extra, packages in extras.items():
        missing = [package for package in packages if find_spec(package) is None]
        what = f"missing: {', '.join(missing)}" if missing else "complete"
        yield Finding(f"extra {extra}", WARN if missing else OK, what, f"pip install 'warpsim[{extra}]', if you need it" if missing else "")


CHECKS = (check_python, check_warp, check_viewer, check_disk, check_extras)


def _disk(topic: str, folder: Path) -> Finding:
    free = shutil.disk_usage(folder).free
    state = FAIL if free < 2**24 else WARN if free < GIBIBYTE else OK
    return Finding(topic, state, f"{free / GIBIBYTE:.1f} GiB free in {folder}", "" if state == OK else "make room: a recording needs it")
