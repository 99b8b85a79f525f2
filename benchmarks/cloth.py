"""Cloth beside Warp's own sample: the same grid of springs, stepped by our scene and by the benchmark that comes with Warp, in turns.

The sample's kernels are run from the installed package, as they are; Taichi's come with it and are run where Taichi is installed. What they
are given differs from their own scene in one thing: points at the rim have the mass of the cells round them, as our cloth has it, so that
the motion is the same, and is compared.
"""

import importlib.util
import sys
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from unittest import mock

import numpy as np
import warp as wp

from benchmarks.measure import Timing, Way, stage_shares, take_turns
from benchmarks.report import Report
from warpsim import Scene, Simulation
from warpsim.launch import PARALLEL_FROM, available_cores

SPACING, STIFFNESS, DAMPING, MASS = 0.1, 1000.0, 10.0, 0.1  # [m], [N/m], [N s/m], [kg]: the sample's
FPS, SUBSTEPS = 60, 16
COMPARED_FRAMES = 60  # as many as the sample takes
MOST_APART = 1e-3  # [m]: float32 sums in another order come to 2e-5, growing as the sheet crumples; a wrong spring shows as centimeters
SAMPLES = Path(wp.__file__).parent / "examples" / "benchmarks"


def sheet(count: int) -> Scene:
    """The sample's sheet of count × count points, lying flat, held at two corners."""
    edge, spring = SPACING * (count - 1), {"stiffness": STIFFNESS, "damping": DAMPING}
    system = {"type": "cloth", "resolution": [count, count], "edges": [[edge, 0, 0], [0, 0, edge]], "density": MASS / SPACING**2}
    system |= {"structural": spring, "shear": spring, "bend": spring, "pins": [[0, 0], [count - 1, 0]]}
    scene = {"name": "sheet", "time": {"fps": FPS, "substeps": SUBSTEPS}, "gravity": [0, -9.81, 0], "systems": {"sheet": system}}
    return Scene.model_validate(scene)


@dataclass
class SampleCloth:
    """The sheet as the sample's integrators want it, its springs in the sample's order."""

    positions: np.ndarray
    velocities: np.ndarray
    inv_masses: np.ndarray
    spring_indices: np.ndarray
    spring_lengths: np.ndarray
    spring_stiffness: np.ndarray
    spring_damping: np.ndarray

    @property
    def num_particles(self) -> int:
        return len(self.positions)

    @property
    def num_springs(self) -> int:
        return len(self.spring_lengths)


def sample_springs(count: int) -> np.ndarray:
    """Return pairs of points in the sample's order: point by point those along the rows and the diagonals, then column by column."""
    pairs = []
    for y in range(count):
        for x in range(count):
            steps = ((1, 0, x > 0), (2, 0, x > 1), (-1, 1, y > 0 and x < count - 1), (1, 1, y > 0 and x > 0))
            pairs += [(y * count + x, (y - j) * count + x - i) for i, j, there in steps if there]
    for x in range(count):
        for y in range(count):
            pairs += [(y * count + x, (y - j) * count + x) for j in (1, 2) if y >= j]
    return np.array(pairs, np.int32)


def sample_cloth(run: Simulation, count: int) -> SampleCloth:
    """Give the sample the points of a simulation that has not moved yet."""
    frame = run.frame()["sheet"]
    springs = sample_springs(count)
    inverse = 1.0 / frame.mass
    inverse[[0, count - 1]] = 0.0
    lengths = np.linalg.norm(np.diff(frame.position[springs].astype(float), axis=1)[:, 0], axis=1)
    numbers = [np.full(len(springs), value, np.float32) for value in (STIFFNESS, DAMPING)]
    return SampleCloth(frame.position, np.zeros_like(frame.position), inverse, springs.ravel(), lengths.astype(np.float32), *numbers)


class Peer:
    """One of the sample's integrators, stepped like a simulation."""

    def __init__(self, simulate: Callable[[float, int], np.ndarray]):
        self._simulate = simulate
        self.position = np.zeros((0, 3), np.float32)

    def step_frame(self) -> None:
        """Advance one frame."""
        self.position = self._simulate(1.0 / FPS, SUBSTEPS)


def sample_module(name: str):
    """Load one of Warp's sample files from the installed package; it may not empty the cache of kernels on the way."""
    spec = importlib.util.spec_from_file_location(name, SAMPLES / f"{name}.py")
    module = importlib.util.module_from_spec(spec)
    sys.modules[name] = module  # where Warp looks for a kernel's source
    with mock.patch.object(wp, "clear_kernel_cache", lambda: None):
        spec.loader.exec_module(module)
    return module


def peers_of(cloth: SampleCloth) -> dict[Way, Peer]:
    """Make the peers that are installed."""
    warp_sample = sample_module("benchmark_cloth_warp").WpIntegrator(cloth, "cpu")
    peers = {Way("Warp's sample, 1 thread", 1, native=False): Peer(warp_sample.simulate)}
    if importlib.util.find_spec("taichi"):
        taichi_sample = sample_module("benchmark_cloth_taichi").TiIntegrator(cloth, "cpu")
        peers[Way(f"Taichi's, {available_cores()} threads", available_cores(), native=False)] = Peer(taichi_sample.simulate)
    return peers


def measure_cloth(count: int, report: Report, rounds: int) -> None:
    """Our whole step with one core and all, beside the peers', in turns, from the same start."""
    scene, cores = sheet(count), available_cores()
    ways = [Way("warpsim, 1 thread", 1), *([Way(f"warpsim, {cores} threads", cores)] if cores > 1 else [])]
    runs = {way: way.build(scene, "cpu") for way in ways}
    peers = peers_of(sample_cloth(runs[ways[0]], count))
    for stepped in (runs | peers).values():
        for _ in range(COMPARED_FRAMES):
            stepped.step_frame()
    apart = compare(runs, peers)
    times = take_turns(runs | peers, rounds, lambda: None)
    tell_times(count, report, runs[ways[0]], times, apart)
    tell_ratios(report, times, cores if runs[ways[-1]].systems["sheet"].load >= PARALLEL_FROM else 1)
    shares = stage_shares(runs[ways[0]], max(5, rounds // 3))
    report.fact("cloth", "stages, 1 thread", ", ".join(f"{stage} {share:.1%}" for stage, share in shares.items()), shares=shares)
    report.console.print()


def tell_ratios(report: Report, times: dict[Way, Timing], used: int) -> None:
    """Print how much longer the peers take than we do with all cores and with one; `used`: cores that the sheet is worth."""
    peers = [way for way in times if not way.native]
    alone, *more = [way for way in times if way.native]
    for way in peers:
        for mine in (alone, *more) if way.threads == 1 else (*more, alone)[:1]:
            bar = None if mine is alone and more else 8.0 if way.threads == 1 else 25.0
            starved = times[mine].starved(min(mine.threads, used))
            report.ratio("cloth", f"{way.label} / {mine.label}", times[way].seconds.over(times[mine].seconds), bar, starved)
    for mine in more if used > 1 else ():
        ratio = times[alone].seconds.over(times[mine].seconds)
        report.ratio("cloth", f"{alone.label} / {mine.label}", ratio, 1.5, times[mine].starved(used))


def compare(runs: dict[Way, Simulation], peers: dict[Way, Peer]) -> float:
    """Return how far from ours the peers' points are at most [m]. Stops where that is too far, or where the hashes of ours differ."""
    if len({run.state_hash() for run in runs.values()}) > 1:
        sys.exit("the ways do not agree: their state hashes differ")
    ours = next(iter(runs.values())).frame()["sheet"].position
    apart = {way: float(np.abs(peer.position - ours).max()) for way, peer in peers.items()}
    for way, distance in apart.items():
        if not distance <= MOST_APART:
            sys.exit(f"{way.label} is {distance:.1e} m away after {COMPARED_FRAMES} frames")
    return max(apart.values())


def tell_times(count: int, report: Report, run: Simulation, times: dict[Way, Timing], apart: float) -> None:
    """Print a table of the times."""
    springs, lines = len(run.frame()["sheet"].springs), []
    for way, timing in times.items():
        seconds = timing.seconds
        each = 1e9 * seconds.median / (springs * SUBSTEPS)
        cells = [way.label, f"{1e3 * seconds.median:.2f}", f"{seconds.spread:.0%}", f"{each:.2f}", f"{timing.cores.median:.2f}"]
        row = {"way": way.label, "points": count * count, "seconds": seconds.median, "spread": seconds.spread, "ns_per_spring": each}
        lines.append((cells, row))
    what = (
        f"a sheet of {count} x {count} points, {springs:,} springs, {SUBSTEPS} substeps; {apart:.0e} m apart after {COMPARED_FRAMES} frames"
    )
    report.figures("cloth", what, ["", "ms/frame", "spread", "ns/spring/substep", "cores got"], lines)
