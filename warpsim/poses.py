"""Poses: where a scene's colliders are at a time, by the kernel that the particles' tables are filled with."""

import numpy as np
import warp as wp

from warpsim.colliders import course_row
from warpsim.kernels.collider import Collider, sample_colliders
from warpsim.scene import Scene
from warpsim.signals import SignalTable


class Poses:
    """The courses of a scene's colliders, on the processor, whatever the particles are on: calling it gives their places."""

    def __init__(self, scene: Scene):
        table = SignalTable()
        rows = [course_row(spec, table) for spec in scene.colliders]
        self._count, self._rows = len(rows), wp.array(rows, dtype=Collider, device="cpu")
        self._signals, self._time = table.tables("cpu"), wp.zeros(1, dtype=wp.float64, device="cpu")
        self._posed = wp.zeros((1, len(rows)), dtype=Collider, device="cpu")

    def __call__(self, time: float) -> np.ndarray:
        """Return float32 (n, 7): center [m] and quaternion (x, y, z, w) of each collider at a time [s]."""
        poses = np.zeros((self._count, 7), np.float32)
        if self._count:
            self._time.fill_(time)
            wp.launch(sample_colliders, 1, [0, self._time, 0.0, self._signals, self._rows, self._posed], device="cpu")
            posed = self._posed.numpy()[0]
            poses[:, :3], poses[:, 3:] = posed["center"], posed["rotation"]
        return poses
