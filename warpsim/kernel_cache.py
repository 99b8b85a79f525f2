"""Warp's kernel cache, kept usable: a folder that cannot be written or is full is replaced, a damaged module is rebuilt once.

Warp keeps compiled kernels in a folder per module (`wp_NAME_HASH`) and trusts what it finds there: a file cut short by a power cut makes
every later run fail, and a folder that cannot be written is a raw error (measured with Warp 1.19). Each thread builds in a folder
of its own (`wp_NAME_HASH_pPROCESS_tTHREAD`), which is renamed when it is complete: what a killed process leaves there is lost room.
"""

import errno
import json
import os
import re
import shutil
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import TypeVar

T = TypeVar("T")
Report = Callable[[str], None]
ROOM = 2 * 2**20  # bytes of disk for a module while it is built: the largest of warpsim's takes 1.3 MB, source and code
STALE = 3600.0  # s after which nobody builds in a folder any more; whether the process lives cannot be told across containers
BUILDING = re.compile(r"wp_.+_p\d+_t\d+")
HEADERS = re.compile(r"wp_pch_\w{8}")  # in the temporary folder, 5 MB for each thread that compiled; swept after a day


class FullCache(OSError):
    """The disk of the kernel cache has no room for what is to be compiled."""


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
        sweep_left_behind(usual)
        return usual
    return _replaced_cache("cannot be written", report)


def _replaced_cache(reason: str, report: Report) -> Path:
    """Let Warp keep its kernels in the temporary folder from now on, say why, and return the place. Raises OSError."""
    import warp as wp

    usual = wp.config.kernel_cache_dir
    folder = private_temporary_folder() / wp.config.version
    folder.mkdir(exist_ok=True)
    sweep_left_behind(folder)
    report(f"the kernel cache {usual} {reason}: kernels are kept in {folder} (set WARP_CACHE_PATH to choose)")
    wp.config.kernel_cache_dir = str(folder.parent)
    with _without_driver_warning():
        wp.init()
    wp.config.kernel_cache_dir = str(folder)  # where an initialized Warp looks; a first init has just set the same
    return folder


def sweep_left_behind(cache: Path) -> None:
    """Remove what killed processes were building, and the compiler's headers that they left in the temporary folder."""
    for folder, name, age in ((cache, BUILDING, STALE), (Path(tempfile.gettempdir()), HEADERS, 24 * STALE)):
        with suppress(OSError), os.scandir(folder) as entries:
            for entry in entries:
                if name.fullmatch(entry.name) and _is_left_behind(entry, age):
                    shutil.rmtree(entry.path, ignore_errors=True)


def _is_left_behind(entry: os.DirEntry, age: float) -> bool:
    with suppress(OSError):
        status = entry.stat(follow_symlinks=False)
        own = not hasattr(os, "getuid") or status.st_uid == os.getuid()
        return own and entry.is_dir(follow_symlinks=False) and time.time() - status.st_mtime > age
    return False


def check_room(module_count: int) -> None:
    """Raise FullCache unless the cache has room for so many modules to be compiled.

    The compiler itself ends the process where its output cannot be written (Warp 1.19, LLVM's words, exit code 1). So the room is taken
    for a moment, which tells of quotas, too.
    """
    import warp as wp

    cache, room = Path(wp.config.kernel_cache_dir), module_count * ROOM
    try:
        cache.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=cache) as file:
            if hasattr(os, "posix_fallocate"):
                os.posix_fallocate(file.fileno(), 0, room)
            elif shutil.disk_usage(cache).free < room:
                raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
    except OSError as error:
        if error.errno not in (errno.EINVAL, errno.EOPNOTSUPP):  # a file system that cannot reserve
            raise full_cache(error, room) from None


def full_cache(error: OSError, room: int) -> FullCache:
    """Return a failure to write into the cache, with what to do."""
    import warp as wp

    advice = f"compiling kernels needs {room / 2**20:.0f} MiB there (set WARP_CACHE_PATH to choose another folder)"
    return FullCache(error.errno, f"{error.strerror or error}: {advice}", wp.config.kernel_cache_dir)


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

    Where the cache's disk is full the temporary folder takes its place, once. The action must be repeatable: building a simulation, loading
    a module. Errors that are not the cache's pass through, and FullCache where both disks are full.
    """
    rebuilt: set[Path] = set()
    replaced = False
    while True:
        try:
            return action()
        except FullCache:
            if replaced:
                raise
            replaced = True
            _replaced_cache("has no room left", report)
            continue
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
        return sorted(path for path in cache.glob(f"wp_{match[1]}_{match[2]}*") if not BUILDING.fullmatch(path.name))
    if isinstance(error, json.JSONDecodeError | UnicodeDecodeError):
        parents = {path.parent for path in cache.glob("wp_*/*.meta") if not _is_json(path)}
        return sorted(path for path in parents if not BUILDING.fullmatch(path.name))  # that is another process's, at work
    return []


def _is_json(path: Path) -> bool:
    try:
        json.loads(path.read_text())
    except (OSError, ValueError):
        return False
    return True
