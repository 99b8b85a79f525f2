"""Points brought into the grid's order by the stages that systems use, natively or by the plain kernels, on any number of cores."""

import numpy as np
import warp as wp

from tests.simulation.stages import carry_out
from warpsim.kernels import emission
from warpsim.kernels.emission import ACTIVE
from warpsim.kernels.grid import Grid, bucket_at, finite, layout_for
from warpsim.launch import Stage
from warpsim.population import FIELDS, Population
from warpsim.systems.neighbors import Neighbors


@wp.kernel(module="unique")
def mark_points(first: int, counters: wp.array[wp.int64], points: wp.array2d[float], grid_out: Grid):
    i = first + wp.tid()
    active = int(counters[ACTIVE])
    if i < active:
        layout = layout_for(grid_out, active)
        x = wp.vec3(points[0, i], points[1, i], points[2, i])
        grid_out.bucket[i] = int(layout.mask) + 1
        if finite(x) == 1:
            grid_out.bucket[i] = bucket_at(x, layout)


def populate(points: np.ndarray, device: str, capacity: int | None = None) -> Population:
    """A population whose active slots are these points, at rest, of 1 kg."""
    population = Population(max(capacity or len(points), 1), FIELDS, device)
    slab = np.zeros((3, population.capacity), np.float32)
    slab[:, : len(points)] = np.asarray(points, np.float32).T.reshape(3, -1)
    population.field("position").assign(slab)
    population.field("mass").fill_(1.0)
    counters = np.zeros(emission.COUNTER_COUNT, np.int64)
    counters[[emission.LIVE, ACTIVE]] = len(points)
    population.counters.assign(counters)
    return population


def gather(points: np.ndarray, reach: float, device="cpu", native=True, cores=1, more=(), capacity=None) -> Neighbors:
    """Sort points by cells; `more(neighbors)` are stages that follow."""
    population = populate(points, device, capacity)
    neighbors = Neighbors(population, reach)
    native = native and device == "cpu"
    stages = [Stage("mark", mark_points, population.capacity, (population.counters, population.field("position"), neighbors.grid))]
    stages += [*neighbors.stages(native), *(more(neighbors) if more else ())]
    carry_out(stages, device, cores, native)
    return neighbors


def bits_of(count: int) -> int:
    """The bits of the layout in effect for so many points."""
    return max(10, (2 * count - 1).bit_length())


def clouds(rng: np.random.Generator, reach: float) -> dict[str, np.ndarray]:
    """Points that have gone wrong in somebody's grid: none, one, two, clusters, borders, negative and far coordinates, coincident ones."""
    borders = reach * rng.integers(-3, 4, (300, 3)).astype(np.float32)
    far = 3e5 * reach * rng.choice([-1.0, 1.0], (200, 3)) + reach * rng.uniform(-1, 1, (200, 3))
    found = {
        "none": np.zeros((0, 3)),
        "one": rng.normal(size=(1, 3)),
        "two": np.array([[0.1, 0.2, 0.3], [0.1 + 0.9 * reach, 0.2, 0.3]]),
        "three": np.array([[0.0, 0, 0], [0.99999 * reach, 0, 0], [-0.99999 * reach, 0, 0]]),
        "uniform": rng.uniform(-4, 4, (2000, 3)) * reach,
        "clustered": np.concatenate([rng.normal(size=(150, 3)) * 0.3 * reach + c for c in 20 * reach * rng.normal(size=(5, 3))]),
        "sheet": rng.uniform(-12, 12, (1500, 3)) * [reach, 0, reach],
        "line": rng.uniform(-300, 300, (900, 3)) * [0, reach, 0],
        "sparse": rng.uniform(-50, 50, (1000, 3)) * reach,
        "borders": np.concatenate([borders, np.nextafter(borders, -np.inf), np.nextafter(borders, np.inf)]),
        "far": far,
        "beyond": 1e13 * reach * rng.choice([-1.0, 1.0], (100, 3)),
        "one point": np.repeat([[0.5, -0.5, 0.25]], 300, axis=0),
        "one cell": rng.uniform(0, 0.2, (500, 3)) * reach,
        "a block": rng.uniform(-1, 1, (64, 3)) * reach,
    }
    return {name: points.astype(np.float32) for name, points in found.items()}
