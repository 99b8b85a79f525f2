"""Pair forces of one system: the laws as a table, and the stages that sum them over neighbors, once per substep."""

from collections.abc import Iterator

import warp as wp

from warpsim.environment import Environment, Surroundings
from warpsim.integrators import Integrator
from warpsim.kernels import pairwise, pairwise_loops
from warpsim.kernels.emission import Particles
from warpsim.kernels.integration import Pace
from warpsim.launch import Stage
from warpsim.population import Population
from warpsim.systems.neighbors import Neighbors


def substep_of(pace: Pace, s: int) -> Pace:
    """Return the pace of one substep alone."""
    one = Pace()
    one.dt, one.fps, one.substep_count, one.first, one.last = pace.dt, pace.fps, pace.substep_count, s, s + 1
    return one


class PairForces:
    """What the particles of a population do to each other; `internal` (3, capacity) [m/s²] is what their neighbors do to each."""

    def __init__(self, laws: list, population: Population, environment: Environment, clock: wp.array, pace: Pace):
        device = population.device
        self.population, self._environment, self._clock, self.pace = population, environment, clock, pace
        self._laws = wp.array(laws, dtype=pairwise.PairLaw, device=device)
        self._table = wp.zeros((pace.substep_count + 1, len(laws)), dtype=pairwise.PairLaw, device=device)
        self.neighbors = Neighbors(population, reach_of(laws))
        self.internal = wp.zeros((3, population.capacity), dtype=float, device=device)

    def change(self, laws: list) -> None:
        """Take other numbers for the same laws, in place."""
        self._laws.assign(wp.array(laws, dtype=pairwise.PairLaw, device=self._laws.device))
        self.neighbors.change(reach_of(laws))

    def stages(self, particles: Particles, method: type[Integrator], surroundings: Surroundings, native: bool) -> Iterator[Stage]:
        """Yield a frame's stages, the advance of `particles` included.

        The advance adds `internal` to the other accelerations. Where the method splits it off, what the neighbors do is half a kick
        before and after each substep; the two that meet between substeps are one.
        """
        split, (plain, loop) = method.splits_pairs, method.kernels(surroundings.has_colliders, surroundings.long_flows)
        count, counters, capacity = self.pace.substep_count, self.population.counters, self.population.capacity
        signals, start_time = self._environment.signals, self._environment.start_time
        yield Stage("environment", pairwise.sample_pair_laws, count + 1, (start_time, self.pace.dt, signals, self._laws, self._table))
        sort = list(self.neighbors.stages(native))
        for s in range(count + 1 if split else count):
            yield from self._forces(s, particles, sort)
            if split:
                h = self.pace.dt if 0 < s < count else 0.5 * self.pace.dt
                yield Stage("pairs", pairwise.kick_pairs, capacity, (h, counters, self.internal, particles.velocity))
            if s < count:
                yield Stage(
                    "advance", plain, capacity, (substep_of(self.pace, s), self._clock, surroundings.row, particles, counters), loop
                )

    def _forces(self, s: int, particles: Particles, sort: list[Stage]) -> Iterator[Stage]:
        """Yield the stages that fill `internal` at the beginning of substep s, or at the end of the last."""
        counters, capacity, grid = self.population.counters, self.population.capacity, self.neighbors.grid
        inputs = (substep_of(self.pace, min(s, self.pace.substep_count - 1)), int(s > 0), self._clock, particles, counters, grid)
        yield Stage("neighbors", pairwise.mark_buckets, capacity, inputs, pairwise_loops.mark_buckets)
        yield from sort
        inputs = (s, counters, self._table, grid, self.neighbors.sorted, particles.mass, self.internal)
        yield Stage("pairs", pairwise.accumulate_pairs, capacity, inputs, pairwise_loops.accumulate_pairs)


def reach_of(laws: list) -> float:
    """Return the largest radius among the laws [m]."""
    return max(law.radius for law in laws)
