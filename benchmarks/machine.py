"""What stands at the head of a run: without it no figure can be judged."""

import importlib.metadata
import os
import platform
from datetime import UTC, datetime
from pathlib import Path

import warp as wp

import warpsim
from benchmarks.measure import machine_load
from warpsim.launch import available_cores


def processor() -> str:
    """Return the name of this machine's processor, as well as the system tells it."""
    names = Path("/proc/cpuinfo")
    lines = names.read_text().splitlines() if names.exists() else []
    return next((line.split(":")[1].strip() for line in lines if line.startswith("model name")), platform.processor() or platform.machine())


def memory() -> float:
    """Return how much memory the machine has [GiB], 0 where the system does not tell."""
    try:
        return os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE") / 2**30
    except (ValueError, OSError, AttributeError):
        return 0.0


def version(package: str) -> str:
    """Return the version of a package, or that it is not there."""
    try:
        return importlib.metadata.version(package)
    except importlib.metadata.PackageNotFoundError:
        return "not installed"


def machine_facts(command: str) -> dict:
    """Return machine, date, versions and load."""
    devices = [device.name for device in wp.get_cuda_devices()]
    return {
        "date": f"{datetime.now(UTC):%Y-%m-%d %H:%M} UTC",
        "command": command,
        "processor": processor(),
        "cores": available_cores(),
        "memory_gib": round(memory(), 1),
        "gpu": ", ".join(devices) or "none",
        "load": round(machine_load(), 2),
        "system": platform.platform(terse=True),
        "python": platform.python_version(),
        "warpsim": warpsim.__version__,
        **{package: version(package) for package in ("warp-lang", "numpy", "numba", "taichi")},
    }
