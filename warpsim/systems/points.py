"""Points: a particle system as the viewer draws it, packed on the device into a few bytes per particle."""

from dataclasses import dataclass

import numpy as np
import warp as wp

from warpsim.kernels import render
from warpsim.kernels.emission import Particles
from warpsim.kernels.trails import advance_trails, splat_trails
from warpsim.launch import Stage
from warpsim.population import Field, Population

STEPS = 256  # resolution of size and color over life, or over a quantity's range
BODIES = ("arrows", "birds", "fish")  # looks that point somewhere
MOST_TRAILS = 20_000  # lines that a page can draw


@dataclass(frozen=True)
class PackedPoints:
    """Quantized points: place = position[:, :3]·scale + offset [m], diameter = position[:, 3]/65535·size_max [m]."""

    count: int
    position: np.ndarray  # uint16 (n, 4): x, y, z, size
    color: np.ndarray  # uint8 (n, 4): r, g, b, a
    scale: np.ndarray  # float32 (3,) [m]
    offset: np.ndarray  # float32 (3,) [m]
    size_max: float  # [m]
    trail: np.ndarray | None = None  # uint16 (m, places, 4): x, y, z, 0, oldest place first, of the first m points
    trail_color: np.ndarray | None = None  # uint8 (m, 4)
    heading: np.ndarray | None = None  # int8 (n, 4), of bodies: unit vector along which it points, sine of its roll to the right, in 1/127


def frames_between(trail, fps: float) -> int:
    """Return how many frames lie between two places of a trail."""
    return max(1, round(trail.duration * fps / (trail.points - 1)))


class PointPacker:
    """Packs one system's live particles with its look; bodies roll by `steering` (3, capacity) [N], if there is one."""

    def __init__(self, population: Population, particles: Particles, look, fps: float, steering: wp.array | None = None):
        self._population, self._particles, self._fps = population, particles, fps
        self._places = look.trail.points if look.trail else 0
        self._every = frames_between(look.trail, fps) if look.trail else 1
        self._bodies, self._steering = look.as_ in BODIES, steering
        self._everyone = wp.empty(0, dtype=int, device=population.device)
        self.change(look)

    @staticmethod
    def fields(look) -> dict[str, Field]:
        """Return the fields that the look needs in the population."""
        return {"trail": Field(3 * look.trail.points, wp.float32, "m", "its last places, in a ring")} if look.trail else {}

    @property
    def has_trails(self) -> bool:
        """Whether there is anything to note in each frame."""
        return self._places > 0

    def stages(self, clock: wp.array):
        """Yield the stage that notes the places of trails, if there are any."""
        if self._places:
            inputs = (self._every, clock, self._population.counters, self._particles, self._population.field("trail"))
            yield Stage("trails", advance_trails, self._population.capacity, inputs)

    def change(self, look) -> None:
        """Take another look."""
        device, share = self._population.device, (np.arange(STEPS) + 0.5) / STEPS
        size = np.interp(share, *zip(*look.size.stops, strict=True))
        stops, colors = zip(*look.color.stops, strict=True)
        rgba = np.stack([np.interp(share, stops, channel) for channel in np.array(colors).T], axis=1)
        words = np.ascontiguousarray(np.rint(rgba * 255).astype(np.uint8)).view("<u4")[:, 0]
        self._size_max = max(float(size.max()), 1e-9)
        self._look = render.Look()
        self._look.size = wp.array(size / self._size_max, dtype=float, device=device)
        self._look.color = wp.array(words, dtype=wp.uint32, device=device)
        self._look.quantity = render.QUANTITIES[getattr(look.color, "by", "life")]
        self._look.low, high = getattr(look.color, "range", (0.0, 1.0))
        self._look.scale = 1.0 / (high - self._look.low)

    def pack(self, index: int, limit: int | None) -> PackedPoints:
        """Pack the live particles of the present frame; above `limit` a subset by id, so that a particle does not come and go."""
        live = self._population.counter("live")
        chosen = self._everyone if limit is None or live <= limit else self._subset(live, limit)
        count = len(chosen) or live
        if count == 0:
            nothing, nowhere = np.zeros((0, 4)), np.zeros(3, np.float32)
            return PackedPoints(0, nothing.astype(np.uint16), nothing.astype(np.uint8), nowhere, nowhere, self._size_max)
        box, low, scale = self._box(live)
        device = self._population.device
        place, color = wp.empty((count, 2), dtype=wp.uint32, device=device), wp.empty(count, dtype=wp.uint32, device=device)
        inputs = [0, chosen, index, self._fps, self._particles, box, self._look, place, color]
        wp.launch(render.splat_points, count, inputs, device=device)
        rgba = color.numpy().view(np.uint8).reshape(count, 4)
        trail = self._trail(index, chosen, min(count, MOST_TRAILS), box) if self._places else None
        shades = None if trail is None else rgba[: len(trail)]
        heading = self._heading(chosen, count) if self._bodies else None
        return PackedPoints(count, place.numpy().view("<u2"), rgba, scale, low, self._size_max, trail, shades, heading)

    def _heading(self, chosen: wp.array, count: int) -> np.ndarray:
        """Return where bodies point, through what carries them, and how they roll."""
        population = self._population
        course = population.field("swimming" if "swimming" in population.fields else "velocity")
        steering = wp.empty((3, 0), dtype=float, device=population.device) if self._steering is None else self._steering
        heading = wp.empty(count, dtype=wp.uint32, device=population.device)
        wp.launch(render.splat_headings, count, [0, chosen, self._particles, course, steering, heading], device=population.device)
        return heading.numpy().view(np.int8).reshape(count, 4)

    def _subset(self, live: int, limit: int) -> wp.array:
        stride = -(-live // max(limit, 1))
        words = self._population.field("id").numpy()[0, :live]
        chosen = np.flatnonzero(words % stride == 0).astype(np.int32)
        return wp.array(chosen if len(chosen) else np.zeros(1, np.int32), device=self._population.device)

    def _box(self, live: int) -> tuple[render.Box, np.ndarray, np.ndarray]:
        """Return the box round all that is drawn, its corner and the size of a step."""
        position = self._population.field("position").numpy()[:, :live]
        low, high = position.min(axis=1), position.max(axis=1)
        if self._places:
            places = self._population.field("trail").numpy().reshape(self._places, 3, -1)[:, :, :live]
            low, high = np.minimum(low, places.min(axis=(0, 2))), np.maximum(high, places.max(axis=(0, 2)))
        extent = (high - low).astype(float)
        box = render.Box()
        box.low = wp.vec3(*low.tolist())
        box.to_steps = wp.vec3(*np.where(extent > 0.0, 65535.0 / np.maximum(extent, 1e-30), 0.0).tolist())
        return box, low, (extent / 65535.0).astype(np.float32)

    def _trail(self, index: int, chosen: wp.array, count: int, box: render.Box) -> np.ndarray:
        places = wp.empty((count, self._places, 2), dtype=wp.uint32, device=self._population.device)
        newest = index // self._every % self._places
        inputs = [0, chosen, newest, box, self._population.field("trail"), places]
        wp.launch(splat_trails, count, inputs, device=self._population.device)
        return places.numpy().view("<u2")
