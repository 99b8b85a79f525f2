"""Warp's kernel cache, kept usable: a folder that cannot be written is replaced, a damaged module is rebuilt once.

Warp keeps compiled kernels in a folder per module (`wp_NAME_HASH`) and trusts what it finds there: a file cut short by a full disk or a
power cut makes every later run fail, and a folder that cannot be written is a raw error (measured with Warp 1.19).
"""

import json
import os
import re
import shutil
import sys
import tempfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import TypeVar

T = TypeVar("T")
Report = Callable[[str], None]


def prepare_kernel_cache(report: Report) -> Path:
    """Initialize Warp with a cache folder that can be written, and return that folder.

    The usual folder (WARP_CACHE_PATH, else the user's cache) is taken if it can be written, else one in the temporary folder, and
    `report` is told so. Harmless when Warp is initialized already.
    """
    import warp as wp

    wp.config.log_level = max(wp.config.log_level, wp.LOG_WARNING)  # no banner, no line per module
    with suppress(OSError), _without_driver_warning():
        wp.init()
    usual = Path(wp.config.kernel_cache_dir)
    if is_writable(usual):
        return usual
    folder = private_temporary_folder() / wp.config.version
    folder.mkdir(exist_ok=True)
    report(f"the kernel cache {usual} cannot be written: kernels are kept in {folder} (set WARP_CACHE_PATH to choose)")
    wp.config.kernel_cache_dir = str(folder.parent)
    wp.init()
    wp.config.kernel_cache_dir = str(folder)  # where an initialized Warp looks; a first init has just set the same
    return folder


@contextmanager
def _without_driver_warning() -> Iterator[None]:
    """Drop the line that Warp's native code prints on every machine without an NVIDIA driver; all else it prints comes through."""
    with tempfile.TemporaryFile() as caught:
        sys.stderr.flush()
        error_stream = os.dup(2)
        os.dup2(caught.fileno(), 2)
        try:
            yield
        finally:
            os.dup2(error_stream, 2)
            os.close(error_stream)
            caught.seek(0)
            os.write(2, b"".join(line for line in caught if b"find or load the NVIDIA CUDA driver" not in line))


def is_writable(folder: Path) -> bool:
    """Return whether a file can be made in the folder, by making one: permissions alone do not tell of read-only disks."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder):
            return True
    except OSError:
        return False


def private_temporary_folder() -> Path:
    """Return a temporary folder that only this user can write, the same one in every run: compiled code is executed."""
    user = os.getuid() if hasattr(os, "getuid") else "user"
    folder = Path(tempfile.gettempdir()) / f"warpsim-kernels-{user}"
    with suppress(OSError):
        folder.mkdir(mode=0o700, exist_ok=True)
        status = folder.lstat()
        if folder.is_dir() and not folder.is_symlink() and (os.name == "nt" or (status.st_uid == user and not status.st_mode & 0o022)):
            return folder
    return Path(tempfile.mkdtemp(prefix="warpsim-kernels-"))


def rebuilding(action: Callable[[], T], report: Report) -> T:
    """Run `action`; where Warp cannot load a module from its cache, delete that module's folder and run it again, once per module.

    The action must be repeatable: building a simulation, loading a module. Errors that are not the cache's pass through.
    """
    rebuilt: set[Path] = set()
    while True:
        try:
            return action()
        except Exception as error:
            damaged = set(damaged_folders(error)) - rebuilt
            if not damaged:
                raise
        for folder in sorted(damaged):
            report(f"the compiled kernels in {folder} are damaged: rebuilding them")
            shutil.rmtree(folder, ignore_errors=True)
        rebuilt |= damaged


def damaged_folders(error: Exception) -> list[Path]:
    """Return the module folders in Warp's cache that the error speaks of; none if it is an error of another kind."""
    import warp as wp

    if not wp.config.kernel_cache_dir:
        return []
    cache = Path(wp.config.kernel_cache_dir)
    if match := re.match(r"Failed to load (?:CPU|CUDA) module '([^']+)'.*module_hash=(\w+)", str(error)):
        return sorted(cache.glob(f"wp_{match[1]}_{match[2]}*"))
    if isinstance(error, json.JSONDecodeError | UnicodeDecodeError):
        return sorted({path.parent for path in cache.glob("wp_*/*.meta") if not _is_json(path)})
    return []


def _is_json(path: Path) -> bool:
    try:
        json.loads(path.read_text())
    except (OSError, ValueError):
        return False
    return True
