"""Points: a particle system as the viewer draws it, packed on the device into a few bytes per particle."""

from dataclasses import dataclass

import numpy as np
import warp as wp

from warpsim.kernels.emission import Particles
from warpsim.kernels.render import Box, splat_points
from warpsim.population import Population

LIFE_STEPS = 256  # resolution of size and color over life


@dataclass(frozen=True)
class PackedPoints:
    """Quantized points: place = position[:, :3]·scale + offset [m], diameter = position[:, 3]/65535·size_max [m]."""

    count: int
    position: np.ndarray  # uint16 (n, 4): x, y, z, size
    color: np.ndarray  # uint8 (n, 4): r, g, b, a
    scale: np.ndarray  # float32 (3,) [m]
    offset: np.ndarray  # float32 (3,) [m]
    size_max: float  # [m]


class PointPacker:
    """Packs one system's live particles with its look."""

    def __init__(self, population: Population, particles: Particles, look, fps: float):
        self._population, self._particles, self._fps = population, particles, fps
        self.change(look)

    def change(self, look) -> None:
        """Take another look."""
        device = self._population.device
        life = (np.arange(LIFE_STEPS) + 0.5) / LIFE_STEPS
        size = np.interp(life, *zip(*look.size.stops, strict=True))
        stops, colors = zip(*look.color.stops, strict=True)
        rgba = np.stack([np.interp(life, stops, channel) for channel in np.array(colors).T], axis=1)
        self._size_max = max(float(size.max()), 1e-9)
        self._size = wp.array(size / self._size_max, dtype=float, device=device)
        words = np.ascontiguousarray(np.rint(rgba * 255).astype(np.uint8)).view("<u4")[:, 0]
        self._color = wp.array(words, dtype=wp.uint32, device=device)

    def pack(self, index: int, limit: int | None) -> PackedPoints:
        """Pack the live particles of the present frame; above `limit` a subset by id, so that a particle does not come and go."""
        live = self._population.counter("live")
        position = self._population.field("position").numpy()[:, :live]
        chosen = np.arange(live, dtype=np.int32)
        if limit is not None and live > limit:
            stride = -(-live // max(limit, 1))
            chosen = np.flatnonzero(self._population.field("id").numpy()[0, :live] % stride == 0).astype(np.int32)
            position = position[:, chosen]
        if len(chosen) == 0:
            nothing, nowhere = np.zeros((0, 4)), np.zeros(3, np.float32)
            return PackedPoints(0, nothing.astype(np.uint16), nothing.astype(np.uint8), nowhere, nowhere, self._size_max)
        low, high = position.min(axis=1), position.max(axis=1)
        extent = (high - low).astype(float)
        box, device, n = Box(), self._population.device, len(chosen)
        box.low, box.to_steps = wp.vec3(*low.tolist()), wp.vec3(*np.where(extent > 0.0, 65535.0 / np.maximum(extent, 1e-30), 0.0).tolist())
        place, color = wp.empty((n, 2), dtype=wp.uint32, device=device), wp.empty(n, dtype=wp.uint32, device=device)
        inputs = [0, wp.array(chosen, device=device), index, self._fps, self._particles, box, self._size, self._color, place, color]
        wp.launch(splat_points, n, inputs, device=device)
        scale = (extent / 65535.0).astype(np.float32)
        return PackedPoints(n, place.numpy().view("<u2"), color.numpy().view(np.uint8).reshape(n, 4), scale, low, self._size_max)
