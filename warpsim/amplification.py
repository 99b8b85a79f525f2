"""Amplification: what one step of a method makes of a damped oscillator, as a matrix, in float64.

The oscillator is x'' = −ω² x − γ x' − k x' with spring and damper explicit (−ω² x − γ x' is the drive N of kernels/multistep.py) and
the drag k solved exactly. A step of length h depends on a = h² ω², g = h γ and z = h k alone, and takes the state (x, h v, h² N₁, h² N₂,
h² N₃), with the N of the three steps before, to the next one. It is stable iff no eigenvalue of its matrix is beyond 1.
Source: characteristic polynomials; for k = 0 Hairer, Nørsett & Wanner 1993, II.9, III.10.
"""

import math

import numpy as np

STAGED = ("rk4", "heun", "adams_bashforth_2", "adams_bashforth_3", "adams_bashforth_4", "abm_pece_2", "abm_pece_4")
GROWING = ("adams_bashforth_2", "abm_pece_4")  # by which an undamped oscillator grows, however short the step


def largest_growth(solver: str, a: np.ndarray, g: np.ndarray, z: np.ndarray) -> float:
    """Return the largest factor by which a step multiplies anything, over oscillators given by arrays (n,) each."""
    size, phi = 2 + _PAST.get(solver, 0), _phi(z)
    columns = [_STEPS[solver](column, a, g, phi) for column in np.eye(size, 5)]
    matrices = np.stack([np.stack(np.broadcast_arrays(*column, a)[:size], axis=-1) for column in columns], axis=-1)
    return float(np.abs(np.linalg.eigvals(matrices)).max(initial=0.0))


def _phi(z: np.ndarray) -> list[np.ndarray]:
    """Return z and φ_0 … φ_5 of −z, φ_{j+1} = (1/j! − φ_j)/z upward; below 1, where that cancels, downward from the series of φ_5."""
    small = np.minimum(z, 1.0)
    series = [np.zeros_like(small)]
    for m in reversed(range(20)):
        series[0] = 1.0 / math.factorial(m + 5) - small * series[0]
    for j in reversed(range(5)):
        series.insert(0, 1.0 / math.factorial(j) - small * series[0])
    ratio, values = 1.0 / np.maximum(z, 1.0), [np.exp(-z)]
    for j in range(5):
        values.append((1.0 / math.factorial(j) - values[-1]) * ratio)
    return [z, *(np.where(z < 1.0, near, far) for near, far in zip(series, values, strict=True))]


def _glide(x, v, n, slopes, phi):
    """Return x and v after a step under the drive n with those derivatives."""
    w, pull = phi[1:], n - phi[0] * v
    terms = [pull, *slopes]
    return x + v + sum(term * w[j + 2] for j, term in enumerate(terms)), v + sum(term * w[j + 1] for j, term in enumerate(terms))


def _rk4(state, a, g, phi):
    x, v = state[0], state[1]
    z, half, whole = phi[0], _phi(0.5 * phi[0]), phi[1:]

    def drive(x, v):
        return -a * x - g * v

    def kicked(v, n):
        return v + 0.5 * half[2] * (n - z * v)

    n = drive(x, v)
    va, xa = kicked(v, n), x + 0.5 * v
    na = drive(xa, va)
    vb, xb = kicked(v, na), x + 0.5 * va
    nb = drive(xb, vb)
    vc, xc = kicked(va, 2.0 * nb - n), x + vb
    nc = drive(xc, vc)
    slope, bend = 2.0 * (na + nb) - 3.0 * n - nc, 4.0 * (n - na - nb + nc)
    after = v + (n - z * v) * whole[1] + slope * whole[2] + bend * whole[3]
    return (x + (v + 2.0 * va + 2.0 * vb + vc) / 6.0, after, 0.0, 0.0, 0.0)


def _adams(order: int, corrects: bool):
    """Make the step of one Adams method; order is that of the polynomial through the past."""

    def slopes(d1, d2, d3):
        return d1 + d2 / 2.0 + d3 / 3.0, d2 + d3, d3

    def step(state, a, g, phi):
        x, v, p1, p2, p3 = state
        n = -a * x - g * v
        past = (n - p1, n - 2.0 * p1 + p2, n - 3.0 * p1 + 3.0 * p2 - p3)
        x1, v1 = _glide(x, v, n, slopes(*(d if order > k + 1 else 0.0 for k, d in enumerate(past))), phi)
        if corrects:
            ahead = -a * x1 - g * v1
            newest = (past[0], past[1], ahead - 3.0 * n + 3.0 * p1 - p2) if order > 3 else (ahead - n, 0.0, 0.0)
            x1, v1 = _glide(x, v, n, slopes(*newest), phi)
        return (x1, v1, n, p1, p2)

    return step


_STEPS = {"rk4": _rk4, "heun": _adams(1, True)}
_STEPS |= {f"adams_bashforth_{order}": _adams(order, False) for order in (2, 3, 4)}
_STEPS |= {f"abm_pece_{order}": _adams(order, True) for order in (2, 4)}
_PAST = {name: order - 1 for order in (2, 3, 4) for name in (f"adams_bashforth_{order}", f"abm_pece_{order}")}
