"""What every test may ask for. Kernels compile into Warp's usual cache, so that a second run of the tests is fast."""

import numpy as np
import pytest


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
        metafunc.parametrize("device", _devices())


@pytest.fixture
def rng() -> np.random.Generator:
    """Random numbers that are the same in every run."""
    return np.random.default_rng(20240607)
