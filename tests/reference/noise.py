"""Twin of kernels/noise.py in float64: the potential itself, and its curl by differences of fourth order."""

import numpy as np

MASK = 2**32 - 1


def stir(x: int, y: int, z: int, w: int) -> tuple[int, int, int, int]:
    x = (x + y * w) & MASK
    y = (y + z * x) & MASK
    z = (z + x * y) & MASK
    return x, y, z, (w + y * z) & MASK


def corner(cell, seed: int, clock: int) -> np.ndarray:
    """The velocity of a corner: A cos θ + B sin θ, from the halves of three words, θ at the pace of the fourth."""
    v = stir(*((int(c) * 1664525 + 1013904223) & MASK for c in (*cell, seed)))
    v = stir(*(word ^ (word >> 16) for word in v))
    halves = np.array([[word >> 16, word & 0xFFFF] for word in v[:3]])
    a, b = ((halves + 0.5) / 2**15 - 1.0).T
    angle = 2.0 * np.pi * ((((v[3] >> 20) + 2048) * clock) & MASK) / 2**32
    return a * np.cos(angle) + b * np.sin(angle)


def fade(u):
    return 6.0 * u**5 - 15.0 * u**4 + 10.0 * u**3


def potential(x: np.ndarray, seed: int, clock: int) -> np.ndarray:
    """½ Σ w ω × d over the corners of the cell, x and d in cells."""
    low = np.floor(x)
    total = np.zeros(3)
    for offset in np.ndindex(2, 2, 2):
        d = x - low - offset
        total += 0.5 * np.prod(1.0 - fade(np.abs(d))) * np.cross(corner(low + offset, seed, clock), d)
    return total


def curl_noise(x: np.ndarray, seed: int, clock: int, h: float = 1e-3) -> np.ndarray:
    """Return curl Ψ in units of the corners' velocities; h⁴ times a fifth derivative of about 1e3 is an error of 1e-9."""
    gradient = np.zeros((3, 3))
    for j in range(3):
        step = h * np.eye(3)[j]
        values = [potential(x + k * step, seed, clock) for k in (-2, -1, 1, 2)]
        gradient[:, j] = (values[0] - 8.0 * values[1] + 8.0 * values[2] - values[3]) / (12.0 * h)
    return np.array([gradient[2, 1] - gradient[1, 2], gradient[0, 2] - gradient[2, 0], gradient[1, 0] - gradient[0, 1]])


def turbulence(spec, x, t: float) -> np.ndarray:
    """The velocity of a scene's curl noise with a constant amplitude: octaves of half the length, Kolmogorov's speeds and frequencies."""
    speeds = [2.0 ** (-octave / 3.0) for octave in range(spec.octaves)]
    plastic = np.array([0.8191725134, 0.6710436067, 0.5497004779])
    total = np.zeros(3)
    for octave, speed in enumerate(speeds):
        length = spec.length / 2**octave
        periods = spec.frequency * 2.0 ** (2.0 * octave / 3.0) * t / 4096.0
        clock = int((periods - np.floor(periods)) * 2**32)
        cells = np.asarray(x, float) / length - np.modf(octave * plastic)[0]
        corners = curl_noise(cells, (spec.seed + 0x9E3779B9 * octave) & MASK, clock)
        total += spec.amplitude * speed / np.linalg.norm(speeds) / np.sqrt(1.0974211434 / 3.0) * corners
    return total
