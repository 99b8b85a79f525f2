"""The hashed grid: what its strides promise, the order it makes, and that it finds exactly whom brute force finds."""

import numpy as np
import pytest
import warp as wp

from tests.kernels.gathering import bits_of, clouds, gather
from warpsim.kernels import grid
from warpsim.kernels.grid import ALONG, FINE, Grid, bucket_of, cell_along, layout_for, run_ends
from warpsim.launch import Stage


@wp.kernel(module="unique")
def note_neighbors(
    first: int, count: int, reach2: float, grid: Grid, sorted: wp.array2d[float], found_out: wp.array2d[int], met_out: wp.array[int]
):
    """Note the slots within reach of the point at each place, in the order in which they are met."""
    k = first + wp.tid()
    layout = layout_for(grid, count)
    if k >= grid.begin[int(layout.mask) + 1]:
        return
    i = grid.order[k]
    met_out[i] = 0
    for part in range(18):
        row = part // 2
        bucket = bucket_of(
            cell_along(sorted[0, k], layout.edges * ALONG) - FINE,
            cell_along(sorted[1, k], layout.edges) + row % 3 - 1,
            cell_along(sorted[2, k], layout.edges) + row // 3 - 1,
            layout,
        )
        ends = run_ends(grid, bucket, 2 * FINE + 1, layout, 1 - part % 2)
        for j in range(ends[0], ends[1]):
            dx = sorted[0, j] - sorted[0, k]
            dy = sorted[1, j] - sorted[1, k]
            dz = sorted[2, j] - sorted[2, k]
            if dx * dx + dy * dy + dz * dz < reach2:
                found_out[i, met_out[i]] = grid.order[j]
                met_out[i] = met_out[i] + 1


def found_neighbors(points, reach, **way) -> list[list[int]]:
    count, device = len(points), way.get("device", "cpu")
    found = wp.full((max(count, 1), max(count, 1)), -1, dtype=int, device=device)
    met = wp.zeros(max(count, 1), dtype=int, device=device)

    def note(neighbors):
        inputs = (count, float(np.float32(reach) ** 2), neighbors.grid, neighbors.sorted, found, met)
        return [Stage("note", note_neighbors, max(count, 2), inputs)] if count else []

    gather(points, reach, more=note, **way)
    return [list(row[:n]) for row, n in zip(found.numpy(), met.numpy(), strict=True)][:count]


def brute_force(points: np.ndarray, reach: float) -> list[set[int]]:
    """By the same float32 arithmetic, so that one at the very reach is judged the same."""
    found = []
    for x in points:
        d = points - x
        with np.errstate(over="ignore"):
            found.append(set(np.flatnonzero(d[:, 0] * d[:, 0] + d[:, 1] * d[:, 1] + d[:, 2] * d[:, 2] < np.float32(reach) ** 2).tolist()))
    return found


CLOUDS = list(clouds(np.random.default_rng(1), 0.37))
WAYS = ({"native": True}, {"native": True, "cores": 3}, {"native": False})


@pytest.mark.parametrize("name", CLOUDS)
def test_neighbors_are_those_of_brute_force_and_each_once(name, rng, device):
    points = clouds(rng, 0.37)[name]
    expected = brute_force(points, 0.37)
    orders = []
    for way in WAYS if device == "cpu" else WAYS[:1]:
        met = found_neighbors(points, 0.37, device=device, **way)
        assert [set(row) for row in met] == expected and all(len(set(row)) == len(row) for row in met), way
        orders.append(met)
    assert all(order == orders[0] for order in orders), "met in one order by all ways"


@pytest.mark.parametrize("number", range(40))
def test_neighbors_of_random_clouds(number):
    """Any reach and density, places from the size of a cell to a thousand of them away from the origin."""
    rng = np.random.default_rng(number)
    reach, count = float(10.0 ** rng.uniform(-3, 3)), int(rng.integers(2, 600))
    size = reach * 10.0 ** rng.uniform(-0.5, 1.5, 3)
    points = (reach * rng.uniform(-1000, 1000, 3) + size * rng.normal(size=(count, 3))).astype(np.float32)
    assert [set(row) for row in found_neighbors(points, reach)] == brute_force(points, reach)


def test_the_order_of_meeting_does_not_depend_on_the_size_of_the_table(rng):
    """Cells that share a bucket come and go with its size; a neighbor is met in the same order all the same."""
    points = clouds(rng, 0.37)["clustered"]
    few = found_neighbors(points, 0.37)
    crowd = np.concatenate([points, (1e4 + rng.uniform(0, 500, (3000, 3))).astype(np.float32)])
    assert found_neighbors(crowd, 0.37)[: len(points)] == few


def test_who_is_not_finite_is_near_nobody(rng):
    points = clouds(rng, 0.37)["uniform"].copy()
    bad = rng.choice(len(points), 60, replace=False)
    points[bad[:20], 0], points[bad[20:40], 1], points[bad[40:], 2] = np.nan, np.inf, -3e38
    good = np.setdiff1d(np.arange(len(points)), bad)
    for way in WAYS:
        neighbors = gather(points, 0.37, **way)
        order, begin, bits = neighbors.grid.order.numpy(), neighbors.grid.begin.numpy(), bits_of(len(points))
        assert begin[1 << bits] == len(good) and begin[(1 << bits) + 1] == len(points)
        assert sorted(order[len(good) : len(points)].tolist()) == sorted(bad.tolist())
        assert sorted(order[: len(good)].tolist()) == good.tolist()
        assert all(not row for row in np.array(found_neighbors(points, 0.37, **way), dtype=object)[bad])


def test_sorting_is_stable_and_the_same_by_all_ways(rng):
    """A bucket's members stand in the order of their slots, begin says where, and the cores' parts leave no trace."""
    points = np.concatenate([clouds(rng, 0.37)[name] for name in ("uniform", "clustered", "one cell", "sparse")])
    results = []
    for way in (*WAYS, {"native": True, "cores": 16}, {"native": True, "capacity": 50_000}):
        neighbors = gather(points, 0.37, **way)
        bits = bits_of(len(points))
        bucket, order = neighbors.grid.bucket.numpy()[: len(points)], neighbors.grid.order.numpy()[: len(points)]
        begin = neighbors.grid.begin.numpy()[: (1 << bits) + 2]
        assert (order == np.argsort(bucket, kind="stable")).all()
        assert (begin == np.searchsorted(bucket[order], np.arange((1 << bits) + 2))).all()
        assert (neighbors.sorted.numpy()[:, : len(points)] == points[order].T).all()
        results.append((order.tobytes(), begin.tobytes()))
    assert len(set(results)) == 1


def test_a_tiny_reach_in_a_wide_world_crowds_no_bucket(rng):
    """Cells are numbered beyond 32 bits, where a clamped grid has but one. Chance puts 10 of 20 000 into one of 65 536."""
    points = rng.uniform(-1e4, 1e4, (20_000, 3)).astype(np.float32)
    begin = gather(points, 1e-6).grid.begin.numpy()[: (1 << bits_of(len(points))) + 1]
    assert np.diff(begin).max() <= 12 and begin[-1] == len(points)


def signed(value: int, total: int) -> int:
    return (value + total // 2) % total - total // 2


@pytest.mark.parametrize("bits", range(grid.LEAST_BITS, grid.MOST_BITS + 1))
def test_strides_keep_runs_apart(bits):
    """Two of the nine runs differ by up to two rows in y and z; a run is at most LONGEST_RUN buckets long."""
    a, b = grid.STRIDES[bits - grid.LEAST_BITS]
    rows = [(y, z) for y in range(-2, 3) for z in range(-2, 3) if (y, z) != (0, 0)]
    assert min(abs(signed(a * y + b * z, 1 << bits)) for y, z in rows) >= grid.LONGEST_RUN


@pytest.mark.parametrize("bits", range(grid.LEAST_BITS, 23))
def test_cells_that_share_a_bucket_are_far_apart(bits):
    """The shortest vector between two such cells, in edges, over the side of a cube (in a plane: a square) of as many cells as buckets."""
    a, b = grid.STRIDES[bits - grid.LEAST_BITS]
    total = 1 << bits
    side = (total / FINE) ** (1 / 3)
    m = int(1.2 * side) + 1
    y, z = np.meshgrid(np.arange(-m, m + 1), np.arange(-m, m + 1))
    x = (a * y + b * z + total // 2) % total - total // 2
    length = np.sqrt((x / FINE) ** 2 + y**2 + z**2)
    assert length[(y != 0) | (z != 0)].min() >= 0.83 * side
    k = np.arange(1, int(1.2 * np.sqrt(total)) + 1)
    for stride, cells in ((a, total / FINE), (b, total / FINE), (-a * pow(b, -1, total) % total, total)):
        x = ((stride * k + total // 2) % total - total // 2) / (FINE if cells < total else 1)
        assert np.sqrt(x**2 + k**2.0).min() >= 0.83 * np.sqrt(cells)
