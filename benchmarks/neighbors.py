"""Pair forces: nanoseconds per particle and neighbor, beside Warp's own hash grid and all pairs, as people write them.

The peers are plain Warp kernels on one core, over the same points with the same law; what they find must agree.
"""

import sys

import numpy as np
import warp as wp

from benchmarks.measure import Way, stage_shares, take_turns
from benchmarks.report import Report
from warpsim import Scene, Simulation
from warpsim.launch import available_cores

NEIGHBORS = 24
RADIUS = 0.1  # [m]
SOFTENING = 1e-3  # [m]
STRENGTH = 1e-9  # [N m²]: so weak that the points stay where they are
MOST_BY_BRUTE_FORCE = 20_000


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

    def __init__(self, points: np.ndarray):
        self.x = wp.array(points, dtype=wp.vec3, device="cpu")
        self.a = wp.zeros_like(self.x)

    def step_frame(self) -> None:
        wp.launch(pull_all, len(self.x), [self.x, self.a], device="cpu")


class HashGrid(BruteForce):
    """Warp's own grid, built and asked."""

    def __init__(self, points: np.ndarray):
        super().__init__(points)
        self.grid = wp.HashGrid(128, 128, 128, device="cpu")

    def step_frame(self) -> None:
        self.grid.build(self.x, RADIUS)
        wp.launch(pull_near, len(self.x), [self.grid.id, self.x, self.a], device="cpu")


def measure_neighbors(count: int, report: Report, rounds: int) -> None:
    """Our whole step with one core and all, the peers' forces alone, in turns."""
    scene, cores = cloud(count), available_cores()
    ways = [Way("warpsim, 1 thread", 1), *([Way(f"warpsim, {cores} threads", cores)] if cores > 1 else [])]
    runs = {way: way.build(scene, "cpu") for way in ways}
    for run in runs.values():
        run.step_frame()
    points = runs[ways[0]].frame()["cloud"].position
    peers = {Way("wp.HashGrid, plain kernel, 1 thread", 1, native=False): HashGrid(points)}
    if count <= MOST_BY_BRUTE_FORCE:
        peers[Way("all pairs, plain kernel, 1 thread", 1, native=False)] = BruteForce(points)
    for peer in peers.values():
        peer.step_frame()
    agree(runs[ways[0]], peers, points)
    met = count_neighbors(points)
    times = take_turns(runs | peers, rounds, lambda: None)
    lines = []
    for way, timing in times.items():
        seconds, each = timing.seconds, 1e9 * timing.seconds.median / count
        per_neighbor = each / max(met, 1e-9)
        cells = [way.label, f"{1e3 * seconds.median:.2f}", f"{seconds.spread:.0%}", f"{each:.0f}", f"{per_neighbor:.2f}"]
        lines.append((cells, {"way": way.label, "seconds": seconds.median, "spread": seconds.spread, "ns_per_neighbor": per_neighbor}))
    what = f"{count:,} particles with {met:.1f} neighbors each, inverse square: the whole step, of peers the forces alone"
    report.figures("neighbors", what, ["", "ms", "spread", "ns/particle", "ns/particle/neighbor"], lines)
    for way in [way for way in times if not way.native]:
        report.ratio("neighbors", f"{way.label} / {ways[0].label}", times[way].seconds.over(times[ways[0]].seconds))
    if cores > 1:
        starved = times[ways[1]].starved(cores)
        report.ratio("neighbors", f"{ways[0].label} / {ways[1].label}", times[ways[0]].seconds.over(times[ways[1]].seconds), 1.5, starved)
    shares = stage_shares(runs[ways[0]], max(5, rounds // 3))
    report.fact("neighbors", "stages, 1 thread", ", ".join(f"{stage} {share:.1%}" for stage, share in shares.items()), shares=shares)
    report.console.print()


def agree(run: Simulation, peers: dict, points: np.ndarray) -> None:
    """Stop if a peer's accelerations are not those of the run: on average to rounding, whatever is made of a pair at the very radius."""
    ours = run.systems["cloud"].pairs.internal.numpy()[:, : len(points)].T
    for way, peer in peers.items():
        error = np.abs(peer.a.numpy() - ours).mean() / np.abs(ours).mean()
        if error > 1e-5:
            sys.exit(f"{way.label} does not agree: {error:.1e}")


def count_neighbors(points: np.ndarray, most: int = 500) -> float:
    """Return the mean number of neighbors, from some of the points."""
    some = points[:: max(1, len(points) // most)].astype(float)
    found = [((points.astype(float) - x) ** 2).sum(axis=1) < RADIUS**2 - SOFTENING**2 for x in some]
    return float(np.mean([near.sum() - 1 for near in found]))
