"""What every test may ask for. Kernels compile into Warp's usual cache, so that a second run of the tests is fast."""

import numpy as np
import pytest


def pytest_addoption(parser):
    parser.addoption(
        "--device", choices=("cpu", "cuda"), help="where all simulations of the tests run, also those that name the CPU (docs/gpu.md)"
    )


def pytest_configure(config):
    config.addinivalue_line("markers", "cpu: about threads, native loops or this process's memory; left out with --device cuda")
    if config.getoption("--device") == "cuda":
        from warpsim import simulation

        if "cuda" not in _devices():
            raise pytest.UsageError("--device cuda: Warp finds no CUDA device on this machine")
        resolve = simulation.resolve_device
        simulation.resolve_device = lambda name: resolve("cuda" if name in ("auto", "cpu") else name)


def pytest_collection_modifyitems(config, items):
    if config.getoption("--device") == "cuda":
        left_out = [item for item in items if item.get_closest_marker("cpu")]
        items[:] = [item for item in items if not item.get_closest_marker("cpu")]
        config.hook.pytest_deselected(items=left_out)


def _devices() -> list[str]:
    import warp as wp

    wp.config.log_level = max(wp.config.log_level, wp.LOG_WARNING)  # no banner, no line per module
    return ["cpu", *(["cuda"] if wp.is_cuda_available() else [])]


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_auto_num_workers() -> int:
    """`-n auto`: a worker for each core that this process may use, up to eight; each holds up to a gigabyte."""
    from warpsim.launch import available_cores

    return min(available_cores(), 8)


def pytest_generate_tests(metafunc):
    """A test that takes `device` runs once on every kind of device this machine has."""
    if "device" in metafunc.fixturenames:
        asked = metafunc.config.getoption("--device")
        metafunc.parametrize("device", [asked] if asked else _devices())


@pytest.fixture
def rng() -> np.random.Generator:
    """Random numbers that are the same in every run."""
    return np.random.default_rng(20240607)
