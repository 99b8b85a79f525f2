"""Compiling: what no cache holds is compiled side by side, told before and after, and the rest is only loaded."""

import threading

import pytest
import warp as wp

from warpsim.compiling import announced_compiling, load_modules

wp.config.log_level = max(wp.config.log_level, wp.LOG_WARNING)
CPU = "cpu"
SOURCE = """
import warp as wp


@wp.kernel(enable_backward=False)
def fill(value: float, x_out: wp.array[float]):
    x_out[wp.tid()] = value * {factor}
"""


@pytest.fixture
def kernels(tmp_path, monkeypatch):
    """Three kernels, each in a module of its own, and a cache that has never seen them."""
    wp.init()
    monkeypatch.setattr(wp.config, "kernel_cache_dir", str(tmp_path / "cache"))
    made = []
    for factor in range(1, 4):
        (tmp_path / f"factor_{factor}.py").write_text(SOURCE.format(factor=float(factor)))
        scope = {"__name__": f"{tmp_path.name}.factor_{factor}", "__file__": str(tmp_path / f"factor_{factor}.py")}
        exec(compile(SOURCE.format(factor=float(factor)), scope["__file__"], "exec"), scope)
        made.append(scope["fill"])
    return made


def results(kernels) -> list[float]:
    x = wp.zeros(1, dtype=float, device=CPU)
    found = []
    for kernel in kernels:
        wp.launch(kernel, 1, [2.0, x], device=CPU)
        found.append(float(x.numpy()[0]))
    return found


def test_modules_are_compiled_by_several_threads_and_told(kernels, monkeypatch):
    """Each of two jobs waits for the other: on one thread they would never end."""
    together, said = threading.Barrier(2, timeout=60), []
    load = wp.Module.load

    def meeting(module, *more):
        if threading.current_thread() is not threading.main_thread():
            together.wait()
        return load(module, *more)

    monkeypatch.setattr(wp.Module, "load", meeting)
    with announced_compiling(said.append):
        load_modules(kernels[:2], CPU, 2)
    assert results(kernels[:2]) == [2.0, 4.0]
    assert len(said) == 2 and "2 modules on 2 cores" in said[0] and "factor_1" in said[0] and said[1].startswith("compiled in")


def test_what_the_cache_holds_is_loaded_without_a_word(kernels):
    load_modules(kernels, CPU, 2)
    for kernel in kernels:
        kernel.module.unload()
    said = []
    with announced_compiling(said.append):
        load_modules(kernels, CPU, 2)
    assert not said and results(kernels) == [2.0, 4.0, 6.0]


def test_the_first_error_ends_what_has_not_begun(kernels, monkeypatch):
    begun = []

    def broken(module, *more):
        begun.append(module)
        raise ValueError("no room")

    monkeypatch.setattr(wp.Module, "load", broken)
    with pytest.raises(ValueError, match="no room"):
        load_modules(kernels, CPU, 1)
    assert 1 <= len(begun) <= 3
    assert not [thread for thread in threading.enumerate() if thread.name.startswith("warpsim-compiling")]
