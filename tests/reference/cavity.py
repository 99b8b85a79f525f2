"""The flow in scenes/grids/cavity.npz: a square box of fluid, stirred by its lid, as it comes to rest in motion at Reynolds number 400.

    python -m tests.reference.cavity scenes/grids/cavity.npz

Vorticity ω and stream function ψ in the unit square, lid speed 1: ∂ω/∂t = −u·∇ω + ∇²ω/Re, ∇²ψ = −ω, central differences, the walls'
vorticity by Thom's formula, steps of 4 ms until nothing changes. All of second order: the file holds (4 fine − coarse)/3 of 129² and 65²
nodes, at the coarse ones (Richardson). Compared with Ghia, Ghia and Shin, J. Comput. Phys. 48 (1982) 387.
"""

import sys

import numpy as np

NODES = 65
REYNOLDS = 400.0
STEP = 0.004  # below h²Re/4 = 0.0061 (diffusion) and 2/(Re u²) = 0.005 u⁻² (Hirt), u < 1 away from the lid


def laplacian_inverse(n: int, h: float):
    """Return a function that solves ∇²ψ = f on n × n inner nodes with ψ = 0 on the walls, by sine transforms."""
    k = np.arange(1, n + 1)
    sines = np.sqrt(2.0 / (n + 1)) * np.sin(np.pi * np.outer(k, k) / (n + 1))
    eigenvalues = -(4.0 / h**2) * np.sin(0.5 * np.pi * k / (n + 1)) ** 2
    divisor = eigenvalues[:, None] + eigenvalues[None, :]
    return lambda f: sines @ ((sines @ f @ sines) / divisor) @ sines


def velocities(psi: np.ndarray, h: float) -> tuple[np.ndarray, np.ndarray]:
    """Return u = ∂ψ/∂y and v = −∂ψ/∂x at all nodes, x first; at the walls their own: at rest, but for the lid."""
    u, v = np.zeros_like(psi), np.zeros_like(psi)
    u[1:-1, 1:-1] = (psi[1:-1, 2:] - psi[1:-1, :-2]) / (2.0 * h)
    v[1:-1, 1:-1] = -(psi[2:, 1:-1] - psi[:-2, 1:-1]) / (2.0 * h)
    u[1:-1, -1] = 1.0
    return u, v


def driven_cavity(nodes: int = NODES, reynolds: float = REYNOLDS, step: float = STEP, tolerance: float = 1e-6) -> np.ndarray:
    """Return the velocity at the nodes, float64 (nodes, nodes, 1, 3), x first."""
    h = 1.0 / (nodes - 1)
    solve = laplacian_inverse(nodes - 2, h)
    psi, omega = np.zeros((nodes, nodes)), np.zeros((nodes, nodes))
    for _ in range(100_000):
        omega[:, -1] = -2.0 * (psi[:, -2] / h**2 + 1.0 / h)
        omega[:, 0], omega[0, :], omega[-1, :] = -2.0 * psi[:, 1] / h**2, -2.0 * psi[1, :] / h**2, -2.0 * psi[-2, :] / h**2
        u, v = velocities(psi, h)
        center = omega[1:-1, 1:-1]
        east, west, north, south = omega[2:, 1:-1], omega[:-2, 1:-1], omega[1:-1, 2:], omega[1:-1, :-2]
        carried = u[1:-1, 1:-1] * (east - west) / (2.0 * h) + v[1:-1, 1:-1] * (north - south) / (2.0 * h)
        change = (east + west + north + south - 4.0 * center) / (h**2 * reynolds) - carried
        omega[1:-1, 1:-1] = center + step * change
        psi[1:-1, 1:-1] = solve(-omega[1:-1, 1:-1])
        if np.abs(change).max() < tolerance:
            break
    u, v = velocities(psi, h)
    return np.stack([u, v, np.zeros_like(u)], axis=-1)[:, :, None, :]


def extrapolated() -> np.ndarray:
    """Return what the file holds, float64."""
    return (4.0 * driven_cavity(2 * NODES - 1)[::2, ::2] - driven_cavity()) / 3.0


if __name__ == "__main__":
    np.savez_compressed(sys.argv[1], velocity=extrapolated().astype(np.float32))
