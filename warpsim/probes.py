"""Probes: samples and integrals of the flow at any time, through the same device functions that the particles feel."""

import math
from collections.abc import Callable, Sequence

import numpy as np
import warp as wp

from warpsim.directions import perpendiculars
from warpsim.environment import Environment
from warpsim.kernels.environment import sample_velocities

TURNS = 1024  # points round a circle; the trapezoid rule converges exponentially there
RULE = np.polynomial.legendre.leggauss(48)  # Gauss–Legendre nodes and weights on [-1, 1]
STENCIL = ((-2.0, 1.0 / 12.0), (-1.0, -8.0 / 12.0), (1.0, 8.0 / 12.0), (2.0, -1.0 / 12.0))  # fourth-order first derivative


def frame_of(axis: Sequence[float]) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return two unit vectors across an axis and the unit axis, right-handed. Raises ValueError for a zero axis."""
    a = np.array(axis, dtype=float)
    length = np.linalg.norm(a)
    if a.shape != (3,) or not np.isfinite(length) or length == 0.0:
        raise ValueError(f"axis must be three finite numbers, not all zero; got {axis!r}")
    a /= length
    return *perpendiculars(a), a


def circle(axis: Sequence[float]) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return outward and tangential unit vectors (TURNS, 3) round an axis, and the unit axis."""
    first, second, a = frame_of(axis)
    angle = (np.arange(TURNS) + 0.5) * (2.0 * math.pi / TURNS)
    outward = np.outer(np.cos(angle), first) + np.outer(np.sin(angle), second)
    return outward, np.cross(a, outward), a


class FlowProbe:
    """The scene's whole flow: samples, derivatives and integrals. `time` [s] defaults to the simulation's present."""

    def __init__(self, environment: Environment, now: Callable[[], float]):
        self._environment, self._tables, self._now, self._device = environment, environment.probe(), now, environment.device

    def change(self) -> None:
        """Take the numbers of the environment, which has changed."""
        self._tables.change(*self._environment.everything())

    def _sample(self, points: np.ndarray, time: float | None) -> np.ndarray:
        """Return the velocity in float64 at points (n, 3)."""
        self._tables.start_time.fill_(self._now() if time is None else float(time))
        stage = next(self._tables.stages())
        wp.launch(stage.kernel, 1, [0, *stage.inputs], device=self._device)
        planar = wp.array(np.ascontiguousarray(points.T, dtype=np.float32), dtype=float, device=self._device)
        velocity = wp.empty_like(planar)
        wp.launch(sample_velocities, len(points), [0, self._tables.flow, planar, velocity], device=self._device)
        return velocity.numpy().T.astype(float)

    def sample(self, points, time: float | None = None) -> np.ndarray:
        """Return the velocity of the flow [m/s], float32 (n, 3), at points (n, 3) [m]. Raises ValueError for another shape."""
        return self._sample(checked(points), time).astype(np.float32)

    def streamlines(self, seeds, length: float, step_count: int = 100, time: float | None = None) -> np.ndarray:
        """Return streamlines of the flow frozen at `time`: float32 (n, step_count + 1, 3) [m], `length` [m] downstream of seeds (n, 3).

        Runge–Kutta of fourth order on dx/ds = v/|v|; a line that meets still fluid, or none that is finite, stays there.
        """
        lines = [checked(seeds).astype(float)]
        ds = length / step_count
        for _ in range(step_count):
            x = lines[-1]
            a = self._direction(x, time)
            b = self._direction(x + 0.5 * ds * a, time)
            c = self._direction(x + 0.5 * ds * b, time)
            lines.append(x + ds / 6.0 * (a + 2.0 * b + 2.0 * c + self._direction(x + ds * c, time)))
        return np.stack(lines, axis=1).astype(np.float32)

    def _direction(self, points: np.ndarray, time: float | None) -> np.ndarray:
        velocity = self._sample(points, time)
        velocity[~np.isfinite(velocity).all(axis=1)] = 0.0
        speed = np.linalg.norm(velocity, axis=1, keepdims=True)
        return velocity / np.where(speed > 1e-12, speed, np.inf)

    def _gradient(self, points, time: float | None, spacing: float) -> np.ndarray:
        """Return dv_i/dx_j, (n, 3, 3): fourth-order central differences at the float32 places really sampled."""
        base = checked(points).astype(float)
        gradient = np.zeros((len(base), 3, 3))
        for j in range(3):
            step = np.zeros(3)
            step[j] = spacing
            for offset, weight in STENCIL:
                gradient[:, :, j] += weight / spacing * self._sample((base + offset * step).astype(np.float32), time)
        return gradient

    def divergence(self, points, time: float | None = None, spacing: float = 0.015625) -> np.ndarray:
        """Return div v [1/s], (n,), by differences over `spacing` [m]; a power of two keeps the points exact in float32."""
        return np.trace(self._gradient(points, time, spacing), axis1=1, axis2=2)

    def curl(self, points, time: float | None = None, spacing: float = 0.015625) -> np.ndarray:
        """Return curl v [1/s], (n, 3), by differences over `spacing` [m]."""
        g = self._gradient(points, time, spacing)
        return np.stack([g[:, 2, 1] - g[:, 1, 2], g[:, 0, 2] - g[:, 2, 0], g[:, 1, 0] - g[:, 0, 1]], axis=1)

    def circulation(self, center, axis, radius: float, time: float | None = None) -> float:
        """Return ∮ v·ds round a circle [m²/s], counterclockwise seen against the axis."""
        outward, along, _ = circle(axis)
        velocity = self._sample(np.asarray(center, float) + radius * outward, time)
        return float(np.einsum("ij,ij->", velocity, along) * 2.0 * math.pi * radius / TURNS)

    def flux(self, center, axis=None, radius: float = 1.0, time: float | None = None) -> float:
        """Return ∮ v·n ds outward through a cylinder of unit length [m²/s]; without axis, ∮ v·n dA through the sphere [m³/s]."""
        outward, _, a = circle((0.0, 1.0, 0.0) if axis is None else axis)
        nodes, weights = RULE
        total = 0.0
        for node, weight in zip(nodes, weights, strict=True):
            if axis is None:  # dA = r² dz dφ on the sphere, z = cosine of the polar angle
                normal = math.sqrt(1.0 - node * node) * outward + node * a
                points, area = np.asarray(center, float) + radius * normal, weight * radius**2
            else:
                normal = outward
                points, area = np.asarray(center, float) + radius * outward + 0.5 * node * a, 0.5 * weight * radius
            total += area * np.einsum("ij,ij->", self._sample(points, time), normal)
        return float(total * 2.0 * math.pi / TURNS)

    def pressure_force(self, center, axis, radius: float, density: float, time: float | None = None) -> np.ndarray:
        """Return −∮ p n ds round a cylinder, (3,), per length of it [N/m], in a fluid of a density [kg/m³] at the moment `time`.

        The pressure is Bernoulli's of a steady flow, p = −ρ|v|²/2 and a constant that adds nothing; the circle is meant to be a
        streamline, the surface of an obstacle. Of a cylinder in a stream U with circulation Γ about its axis a the force is ρ Γ U × a: all
        lift (Kutta, Joukowski) and no drag (d'Alembert).
        """
        outward, _, _ = circle(axis)
        speed2 = (self._sample(np.asarray(center, float) + radius * outward, time) ** 2).sum(axis=1)
        return 0.5 * density * (speed2 @ outward) * 2.0 * math.pi * radius / TURNS

    def discharge(self, center, axis, radius: float, time: float | None = None) -> float:
        """Return ∫ v·dA through a disc, along its axis [m³/s]: the lecture's V′."""
        outward, _, a = circle(axis)
        nodes, weights = RULE
        total = 0.0
        for r, weight in zip(0.5 * radius * (nodes + 1.0), 0.5 * radius * weights, strict=True):
            total += weight * r * (self._sample(np.asarray(center, float) + r * outward, time) @ a).sum()
        return float(total * 2.0 * math.pi / TURNS)


def checked(points) -> np.ndarray:
    """Return points as float32 (n, 3). Raises ValueError for another shape or numbers that are not finite."""
    array = np.asarray(points, dtype=np.float32)
    if array.ndim != 2 or array.shape[1] != 3:
        raise ValueError(f"points must have shape (n, 3), got {array.shape}")
    if not np.isfinite(array).all():
        raise ValueError("points must be finite")
    return array
