"""Pair forces: nanoseconds per particle and neighbor, beside Warp's own hash grid and all pairs, as people write them.

The peers are plain Warp kernels on one core, over the same points with the same law; what they find must agree.
"""

import numpy as np
import warp as wp

from benchmarks.contest import Claim, Contest, Entrant
from benchmarks.measure import Stepped
from warpsim import Scene, Simulation
from warpsim.frame import Frame

NEIGHBORS = 24
RADIUS = 0.1  # [m]
SOFTENING = 1e-3  # [m]
STRENGTH = 1e-9  # [N m²]: so weak that the points stay where they are


def rows(quick: bool) -> list[Contest]:
    """The row of pair forces: told beside what people write, held to nothing but the second core."""
    count = 2_000 if quick else 100_000
    peers = [Entrant("wp.HashGrid, plain kernel", 1, HashGrid)] + ([Entrant("all pairs, plain kernel", 1, BruteForce)] if quick else [])
    return [
        Contest(
            name="pairs-100k",
            work=f"{count:,} particles with {NEIGHBORS} neighbors each, inverse square: the whole step, of peers the forces alone",
            scene=cloud(count),
            items=count,
            compared=1,
            entrants=peers,
            claims=[Claim((peer.label,), None) for peer in peers],
            compare=disagreement,
            unit="of the mean force",
            most=1e-5,
            why="24 roundings of a sum; and whatever is made of a pair at the very radius",
        )
    ]


def cloud(count: int) -> Scene:
    """A box of points at rest with 24 neighbors each, fewer near its faces."""
    edge = RADIUS * (count * 4.0 / 3.0 * np.pi / NEIGHBORS) ** (1.0 / 3.0)
    force = {"type": "pairwise", "law": "inverse_square", "strength": STRENGTH, "radius": RADIUS, "softening": SOFTENING}
    emitter = {"shape": {"type": "box", "size": [edge] * 3}, "burst": {"count": count}, "lifetime": 1e6, "mass": 1.0}
    system = {"type": "particles", "capacity": count, "emitters": [emitter]}
    time = {"fps": 60, "substeps": 1}
    return Scene.model_validate({"name": "cloud", "time": time, "gravity": [0, 0, 0], "forces": [force], "systems": {"cloud": system}})


@wp.func
def pull(d: wp.vec3) -> wp.vec3:
    d2 = wp.dot(d, d)
    s2 = d2 + SOFTENING * SOFTENING
    return wp.where(s2 < RADIUS * RADIUS, d * (STRENGTH / (s2 * wp.sqrt(s2))), wp.vec3())


@wp.kernel(enable_backward=False)
def pull_all(x: wp.array[wp.vec3], a_out: wp.array[wp.vec3]):
    i = wp.tid()
    a = wp.vec3()
    for j in range(x.shape[0]):
        a = a + pull(x[j] - x[i])
    a_out[i] = a


@wp.kernel(enable_backward=False)
def pull_near(grid: wp.uint64, x: wp.array[wp.vec3], a_out: wp.array[wp.vec3]):
    i = wp.hash_grid_point_id(grid, wp.tid())
    a = wp.vec3()
    for j in wp.hash_grid_query(grid, x[i], RADIUS):
        a = a + pull(x[j] - x[i])
    a_out[i] = a


class BruteForce:
    """All pairs."""

    def __init__(self, run: Simulation):
        self.ours = run.systems["cloud"].pairs.internal
        self.x = wp.array(np.array(run.frame()["cloud"].position), dtype=wp.vec3, device="cpu")
        self.a = wp.zeros_like(self.x)

    def step_frame(self) -> None:
        wp.launch(pull_all, len(self.x), [self.x, self.a], device="cpu")


class HashGrid(BruteForce):
    """Warp's own grid, built and asked."""

    def __init__(self, run: Simulation):
        super().__init__(run)
        self.grid = wp.HashGrid(128, 128, 128, device="cpu")

    def step_frame(self) -> None:
        self.grid.build(self.x, RADIUS)
        wp.launch(pull_near, len(self.x), [self.grid.id, self.x, self.a], device="cpu")


def disagreement(frame: Frame, peer: Stepped) -> float:
    """Return how far a peer's accelerations are from ours, in the mean, as a share of them."""
    ours = peer.ours.numpy()[:, : len(frame["cloud"].position)].T
    return float(np.abs(peer.a.numpy() - ours).mean() / np.abs(ours).mean())
