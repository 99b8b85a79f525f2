"""φ-functions in both precisions, against the recurrence in sixty digits."""

import decimal
import math

import numpy as np
import pytest
import warp as wp

from warpsim.kernels.exponential import weights32, weights64


def phi(z: float) -> list[float]:
    """φ_0 … φ_5 of −z, exactly rounded."""
    if z == 0:
        return [1 / math.factorial(j) for j in range(6)]
    with decimal.localcontext(decimal.Context(prec=120)):
        y = decimal.Decimal(float(z))
        values = [(-y).exp()]
        for j in range(5):
            values.append((1 / decimal.Decimal(math.factorial(j)) - values[j]) / y)
        return [float(value) for value in values]


def kernel(real, weights):
    @wp.kernel(module=f"tests.exponential.{real.__name__}")
    def sample_weights(z: wp.array[real], weights_out: wp.array2d[real]):
        i = wp.tid()
        w = weights(z[i])
        for j in range(6):
            weights_out[j, i] = w[j]

    return sample_weights


SAMPLERS = {wp.float32: (kernel(wp.float32, weights32), np.float32), wp.float64: (kernel(wp.float64, weights64), np.float64)}


@pytest.mark.parametrize(("real", "tolerance"), [(wp.float32, 1e-7), (wp.float64, 2e-16)])
def test_weights_are_exact_to_rounding(real, tolerance, device):
    """From no drag over the seam at 1 to very stiff; all are at most 1, and about one rounding off."""
    sample, dtype = SAMPLERS[real]
    z = np.concatenate([[0.0], np.geomspace(1e-6, 1e12, 400), np.linspace(0.9, 1.1, 41)]).astype(dtype)
    out = wp.zeros((6, len(z)), dtype=real, device=device)
    wp.launch(sample, len(z), [wp.array(z, dtype=real, device=device), out], device=device)
    assert np.abs(out.numpy() - np.array([phi(value) for value in z]).T).max() < tolerance
