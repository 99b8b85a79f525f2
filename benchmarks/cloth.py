"""Cloth beside Warp's own sample: the same grid of springs, stepped by our scene and by the benchmark that comes with Warp, in turns.

The sample's kernels are run from the installed package, as they are; Taichi's come with it and are run where Taichi is installed. What they
are given differs from their own scene in one thing: points at the rim have the mass of the cells round them, as our cloth has it, so that
the motion is the same, and is compared.
"""

import importlib.util
import sys
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from unittest import mock

import numpy as np
import warp as wp

from benchmarks.contest import Claim, Contest, Entrant
from benchmarks.measure import Stepped
from warpsim import Scene, Simulation
from warpsim.frame import Frame
from warpsim.launch import available_cores

SPACING, STIFFNESS, DAMPING, MASS = 0.1, 1000.0, 10.0, 0.1  # [m], [N/m], [N s/m], [kg]: the sample's
FPS, SUBSTEPS = 60, 16
COMPARED_FRAMES = 60  # as many as the sample takes
MOST_APART = 1e-3  # [m]
WHY = "float32 sums in another order come to 2e-5 m, growing as the sheet crumples; a wrong spring shows as centimeters"
SAMPLES = Path(wp.__file__).parent / "examples" / "benchmarks"


def rows(quick: bool) -> list[Contest]:
    """The rows of cloth."""
    counts = {"cloth-64": 12, "cloth-128": 16, "cloth-256": 20} if quick else {"cloth-64": 64, "cloth-128": 128, "cloth-256": 256}
    return [contest(name, count, to_reach=name != "cloth-64") for name, count in counts.items()]


def contest(name: str, count: int, to_reach: bool) -> Contest:
    """A sheet of count × count points; `to_reach`: the smallest is told beside the peers, and held to nothing but its second core."""
    cores, sample, taichi = available_cores(), "Warp's sample", "Taichi's sample"
    springs = 2 * count * (count - 1) + 2 * (count - 1) ** 2 + 2 * count * (count - 2)
    return Contest(
        name=name,
        work=f"the cloth of Warp's sample, {count} x {count} points, {springs:,} springs, {SUBSTEPS} substeps",
        scene=sheet(count),
        items=count * count * SUBSTEPS,
        item="point and substep",
        warmup=0,  # the peers begin with the sheet at rest
        compared=COMPARED_FRAMES,
        entrants=[Entrant(sample, 1, partial(warp_peer, count=count)), Entrant(taichi, cores, partial(taichi_peer, count=count), "taichi")],
        compare=apart,
        most=MOST_APART,
        why=WHY,
        claims=[Claim((sample,), 8.0 if to_reach else None), Claim((taichi,), 25.0 if to_reach else None)],
    )


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


def warp_peer(run: Simulation, count: int) -> Stepped:
    """Warp's own sample."""
    return Peer(sample_module("benchmark_cloth_warp").WpIntegrator(sample_cloth(run, count), "cpu").simulate)


def taichi_peer(run: Simulation, count: int) -> Stepped:
    """Taichi's version of it, which comes with Warp."""
    return Peer(sample_module("benchmark_cloth_taichi").TiIntegrator(sample_cloth(run, count), "cpu").simulate)


def apart(frame: Frame, peer: Stepped) -> float:
    """Return how far a peer's points are from ours at most [m]."""
    return float(np.abs(peer.position - frame["sheet"].position).max())
