"""The boids of benchmarks/flocks.py as people write them: the whole step, with the same physics, over Warp's own hash grid.

Those for Numba and Taichi are beside, in modules that need them; they sort places and velocities by cell and scan rows of three cells
as one run, which is the best of what plain loops do.
"""

from dataclasses import dataclass

import numpy as np
import warp as wp

CLOSEST = 1e-3  # of the radius: as near count those that are nearer


@dataclass(frozen=True)
class Law:
    """What all of them do: three rules of weight 1, a largest force, a band of speeds, walls at 0 and `edge`."""

    radius: float  # [m]
    cosine: float  # of half the field of view; −1: all round
    strongest: float  # [N]
    slowest: float  # [m/s]
    fastest: float
    edge: float  # of the box [m]
    h: float  # [s]

    @property
    def cells(self) -> int:
        """How many cells lie along an axis, none shorter than the radius."""
        return max(1, int(self.edge / (self.radius * 1.0001)))


class HashGridFlock:
    """A flock over Warp's own grid, one plain kernel, one core."""

    def __init__(self, x: np.ndarray, v: np.ndarray, law: Law):
        self.law, self.grid = law, wp.HashGrid(128, 128, 128, device="cpu")
        self.x, self.v = (wp.array(a, dtype=wp.vec3, device="cpu") for a in (x, v))
        self.y, self.w = wp.clone(self.x), wp.clone(self.v)

    def step_frame(self) -> None:
        """Advance one frame."""
        law = self.law
        self.grid.build(self.x, law.radius)
        limits = wp.vec3(law.strongest, law.slowest, law.fastest)
        inputs = [self.grid.id, self.x, self.v, law.radius, law.cosine, limits, law.edge, law.h, self.y, self.w]
        wp.launch(move_hashed, len(self.x), inputs, device="cpu")
        self.x, self.y, self.v, self.w = self.y, self.x, self.w, self.v

    @property
    def position(self) -> np.ndarray:
        """Where its boids are, (n, 3) [m]."""
        return self.x.numpy()


@wp.kernel(enable_backward=False)
def move_hashed(
    grid: wp.uint64,
    x: wp.array[wp.vec3],
    v: wp.array[wp.vec3],
    radius: float,
    cosine: float,
    limits: wp.vec3,
    edge: float,
    h: float,
    x_out: wp.array[wp.vec3],
    v_out: wp.array[wp.vec3],
):
    i = wp.hash_grid_point_id(grid, wp.tid())
    xi = x[i]
    vi = v[i]
    limit = cosine * wp.length(vi)
    apart = wp.vec3()
    way = wp.vec3()
    course = wp.vec3()
    count = wp.float32(0.0)
    for j in wp.hash_grid_query(grid, xi, radius):
        d = x[j] - xi
        d2 = wp.dot(d, d)
        if d2 < radius * radius and j != i and wp.dot(d, vi) >= limit * wp.sqrt(d2):
            apart = apart - d / wp.max(d2, 1.0e-6 * radius * radius)
            way = way + d
            course = course + v[j]
            count = count + 1.0
    f = apart
    if count > 0.0:
        f = f + way / count + course / count - vi
    if wp.length(f) > limits[0]:
        f = f * (limits[0] / wp.length(f))
    w = vi + f * h
    w = w * (wp.clamp(wp.length(w), limits[1], limits[2]) / wp.max(wp.length(w), 1.0e-9))
    y = xi + w * h
    for axis in range(3):
        if y[axis] < 0.0:
            y[axis] = -y[axis]
            w[axis] = wp.abs(w[axis])
        elif y[axis] > edge:
            y[axis] = edge - (y[axis] - edge)
            w[axis] = -wp.abs(w[axis])
    x_out[i] = y
    v_out[i] = w
