"""What every test may ask for. Kernels compile into Warp's usual cache, so that a second run of the tests is fast."""

import numpy as np
import pytest


def _devices() -> list[str]:
    import warp as wp

    wp.config.log_level = max(wp.config.log_level, wp.LOG_WARNING)  # no banner, no line per module
    return ["cpu", *(["cuda"] if wp.is_cuda_available() else [])]


def pytest_generate_tests(metafunc):
    """A test that takes `device` runs once on every kind of device this machine has."""
    if "device" in metafunc.fixturenames:
        metafunc.parametrize("device", _devices())


@pytest.fixture
def rng() -> np.random.Generator:
    """Random numbers that are the same in every run."""
    return np.random.default_rng(20240607)
