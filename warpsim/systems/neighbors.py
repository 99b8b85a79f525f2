"""Neighbors: who is near whom in one population, sorted anew whenever it is asked for; nothing here waits for the device."""

from collections.abc import Iterator

import warp as wp

from warpsim.kernels import grid, grid_loops
from warpsim.launch import MOST_CORES, Stage
from warpsim.population import Population


def bits_for(count: int) -> int:
    """Return n of the 2^n buckets that so many particles are sorted into: 2 to 4 for each."""
    return min(max(grid.LEAST_BITS, (2 * count - 1).bit_length()), grid.MOST_BITS)


class Neighbors:
    """The hashed grid of a population: marked by whoever knows which particles take part, then sorted and gathered by the stages here.

    `reach` [m]: nobody farther away is found for sure, everybody nearer is. `rows`: of the slab, position first, that are gathered; or
    `places`, other planar rows. `counters` say of how many, if not those of the population.
    """

    def __init__(
        self, population: Population, reach: float, rows: int = 3, places: wp.array | None = None, counters: wp.array | None = None
    ):
        device, capacity = population.device, population.capacity
        self.population, self._bits = population, bits_for(capacity)
        self._places = population.rows(rows) if places is None else places
        self._counters = population.counters if counters is None else counters
        self.grid = grid.Grid()
        self.grid.edges = wp.zeros(1, dtype=wp.float64, device=device)
        self.grid.strides = wp.array(list(grid.STRIDES), dtype=wp.vec2ui, device=device)
        self.grid.bucket = wp.zeros(capacity, dtype=int, device=device)
        self.grid.order = wp.zeros(capacity, dtype=int, device=device)
        self.grid.begin = wp.zeros((1 << self._bits) + 2, dtype=int, device=device)
        self.sorted = wp.zeros((self._places.shape[0], capacity), dtype=float, device=device)
        self.change(reach)

    def change(self, reach: float) -> None:
        """Take another reach [m], in place."""
        self.grid.edges.fill_(1.0 / (reach * grid.SLACK))

    def stages(self, native: bool) -> Iterator[Stage]:
        """Yield the stages that sort by bucket and gather positions in that order; `grid.bucket` is marked already.

        The same stages serve every substep.
        """
        counters, capacity = self._counters, self.population.capacity
        if native:
            yield from self._passes()
        else:
            yield from self._counting_sort()
        inputs = (counters, self.grid, self._places, self.sorted)
        yield Stage("neighbors", grid.gather_rows, capacity, inputs, grid_loops.gather_rows)

    def _passes(self) -> Iterator[Stage]:
        counters, capacity, device = self._counters, self.population.capacity, self.population.device
        sorting = grid_loops.Sorting()
        sorting.tally = wp.zeros((MOST_CORES, (1 << self._bits // 2) + 1), dtype=int, device=device)
        sorting.loose = wp.zeros(capacity, dtype=wp.vec2i, device=device)
        for loop in (grid_loops.tally_groups, grid_loops.scatter_groups, grid_loops.sort_groups):
            yield Stage("neighbors", loop, capacity, (counters, self.grid, sorting), loop)

    def _counting_sort(self) -> Iterator[Stage]:
        """Yield a sort of plain kernels and a scan: Warp's own keeps a buffer that a captured graph may outlive."""
        counters, capacity, device = self._counters, self.population.capacity, self.population.device
        tally, arrival, loose = wp.zeros_like(self.grid.begin), wp.zeros_like(self.grid.bucket), wp.zeros_like(self.grid.bucket)
        arrivals = [0, counters, self.grid.bucket, tally, arrival]
        yield Stage("neighbors", grid.clear_tallies, len(tally), (tally,))
        # As one call, because the atomics of a CPU's plain kernels are none between threads.
        yield Stage("neighbors", launch=lambda: wp.launch(grid.mark_arrivals, capacity, arrivals, device=device))
        yield Stage("neighbors", launch=lambda: wp.utils.array_scan(tally, self.grid.begin, inclusive=False))
        yield Stage("neighbors", grid.scatter_arrivals, capacity, (counters, self.grid, arrival, loose))
        yield Stage("neighbors", grid.scatter_in_order, capacity, (counters, loose, self.grid))
