"""Compiling: kernel modules that are not in Warp's cache are compiled side by side, and that is told before it begins.

Left alone, Warp compiles a module where one of its kernels is first launched: one after the other on one core, without a word. Since 1.19
its compiler may be called from several threads (native/clang/clang.cpp: targets are registered once, the linker has a lock, every thread
has its own precompiled header); what Python does for it, a tenth of the time, keeps to one thread by a lock of Warp's own.
"""

import time
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from functools import partial
from pathlib import Path

import warp as wp

from warpsim.kernel_cache import ROOM, check_room, full_cache

Report = Callable[[str], None]
SECONDS = 1.4  # of one core for a module of a scene with its share of the headers, measured (docs/adr/0040-compiling-side-by-side.md)
WITH_CONTACTS = ("_among_colliders", ".contacts")  # names of modules end so
MOST_NAMES = 3  # that are told
_listeners: list[Report] = []


@contextmanager
def announced_compiling(report: Report) -> Iterator[None]:
    """Tell `report` what is compiled inside the block, before it begins and when it is done: seconds in which nothing else moves."""
    _listeners.append(report)
    try:
        yield
    finally:
        _listeners.remove(report)


def load_modules(kernels: Iterable[wp.Kernel], device: wp.Device | str, core_count: int) -> None:
    """Make the modules of kernels ready on a device; those that no cache holds are compiled first, by so many cores.

    Raises what Warp raises where a module cannot be compiled or read, FullCache where the disk has no room for them, and KeyboardInterrupt
    at once: what is being compiled then goes into the cache all the same, if the process lives on.
    """
    device = wp.get_device(device)
    kernels = list(kernels)
    if device.is_cuda:
        suit_gpu(kernels)
    block_dim = 1 if device.is_cpu else 256  # threads of a block, as launches ask for it
    modules = list(dict.fromkeys(kernel.module for kernel in kernels))
    absent = [module for module in modules if not (module.execs or is_cached(module, block_dim))]
    if absent:
        absent.sort(key=lambda module: -_size(module, block_dim))  # the longest first, so that no core ends alone
        check_room(len(absent))
        with _told(absent, min(core_count, len(absent))):
            _side_by_side([partial(_compile, module, device, block_dim) for module in absent], core_count)
    for module in modules:
        module.load(device, block_dim)


def _compile(module: wp.Module, device: wp.Device, block_dim: int) -> None:
    """Compile a module into the cache. Raises what Warp raises, and FullCache where the disk has filled meanwhile."""
    try:
        module.load(device, block_dim)
    except OSError as error:
        if error.filename is not None:
            raise
        raise full_cache(error, ROOM) from None


def suit_gpu(kernels: Iterable[wp.Kernel]) -> None:
    """Let a GPU round every product and every sum, as CPUs do here: two in one go are more exact, but other numbers (docs/adr/0003).

    At its highest level NVRTC 13.4 unrolls what looks for contacts, for sm_100: 48 s and 12 MB instead of 3 s and 0.7. Before a module is
    first hashed.
    """
    for module in {kernel.module for kernel in kernels}:
        module.options["fuse_fp"] = False
        if module.name.endswith(WITH_CONTACTS):
            module.options["optimization_level"] = 2


def is_cached(module: wp.Module, block_dim: int) -> bool:
    """Return whether Warp's cache has something of the module as it is; should it be for another processor, Warp compiles all the same."""
    return (Path(wp.config.kernel_cache_dir) / module.get_module_identifier(block_dim)).is_dir()


def _size(module: wp.Module, block_dim: int) -> int:
    """Return the number of functions that a module is made of: its time to compile goes with it (correlation 0.86)."""
    return len(getattr(module.hashers.get(block_dim), "function_hashes", ()))


def _side_by_side(jobs: list[Callable[[], object]], core_count: int) -> None:
    """Do jobs by so many threads; the present one waits where a signal reaches it. The first error ends what has not begun."""
    crew = ThreadPoolExecutor(min(core_count, len(jobs)), "warpsim-compiling")
    try:
        for done in [crew.submit(job) for job in jobs]:
            done.result()
    except Exception:
        crew.shutdown(cancel_futures=True)
        raise
    finally:
        crew.shutdown(wait=False, cancel_futures=True)


@contextmanager
def _told(modules: list[wp.Module], core_count: int) -> Iterator[None]:
    """Tell the listeners that modules are compiled, and how long it took."""
    names = [module.name.removeprefix("warpsim.kernels.") for module in modules]
    more = len(names) - MOST_NAMES
    what = ", ".join(names[:MOST_NAMES]) + (f" and {more} more" if more > 0 else "")
    count = f"{len(names)} {'module' if len(names) == 1 else 'modules'}"
    cores = f"{core_count} {'core' if core_count == 1 else 'cores'}"
    seconds = max(1, round(SECONDS * len(names) / core_count))
    _tell(f"compiling kernels for this machine, {count} on {cores} ({what}): some {seconds} s, once; they are kept for the next run")
    begin = time.perf_counter()
    yield
    _tell(f"compiled in {time.perf_counter() - begin:.1f} s")


def _tell(words: str) -> None:
    for report in _listeners[-1:]:
        report(words)
