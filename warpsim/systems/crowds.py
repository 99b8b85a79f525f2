"""Crowds: the boids of a flock in the order of the cells of their domain, for whoever looks at them."""

import math
from collections.abc import Iterator

import numpy as np
import warp as wp

from warpsim.kernels import domain, flock, flock_loops, grid
from warpsim.launch import Stage
from warpsim.population import Population
from warpsim.systems.neighbors import Neighbors, bits_for


class Crowd:
    """The boids of a population, sorted whenever its stages run; everybody nearer than `reach` [m] is found for sure."""

    def __init__(self, population: Population, spec, reach: float):
        self._population, self._neighbors = population, Neighbors(population, reach, rows=6)
        self.domain = wp.array([domain_row(spec, reach)], dtype=domain.Domain, device=population.device)
        self.row = flock.Crowd()
        self.row.count, self.row.grid, self.row.sorted = spec.count, self._neighbors.grid, self._neighbors.sorted
        self.row.domain = self.domain

    def sorting(self, native: bool) -> list[Stage]:
        """Return the stages that sort the boids as they are; the same ones serve every substep."""
        inputs = (self.row, self._population.field("position"), self.row.grid)
        marking = Stage("neighbors", flock.mark_flock, self._population.capacity, inputs, flock_loops.mark_flock)
        return [marking, *self._neighbors.stages(native)]

    def change(self, spec, reach: float) -> None:
        """Take another domain and reach, in place."""
        self.domain.assign(wp.array([domain_row(spec, reach)], dtype=domain.Domain, device=self._population.device))
        self._neighbors.change(reach)


class Attention:
    """What the boids of one flock do because of those of another, or of their own: its rules as a row, and the stage that adds it up."""

    def __init__(self, rules: flock.Rules, device: str):
        self._rules = wp.array([rules], dtype=flock.Rules, device=device)

    def change(self, rules: flock.Rules) -> None:
        """Take other numbers, in place."""
        self._rules.assign(wp.array([rules], dtype=flock.Rules, device=self._rules.device))

    def stages(self, mine: Crowd, theirs: Crowd, steering: wp.array, seen: wp.array) -> Iterator[Stage]:
        """Yield the stage that adds to the steering [N] of the boids of `mine`, and counts whom they see among `theirs`."""
        inputs = (int(mine is theirs), self._rules, mine.row, theirs.row, steering, seen)
        yield Stage("flock", flock.accumulate_flock, steering.shape[1], inputs, flock_loops.accumulate_flock)


def rule_row(rules: dict, radius: float, field_of_view: float, nearest: int | None, key: wp.vec2ui) -> flock.Rules:
    """Return the row of the three rules, of what is seen within a radius [m] and a field of view [degrees]: all, or the nearest."""
    row = flock.Rules()
    row.nearest = nearest or 0
    row.reach2, row.closest, row.key = radius**2, 1e-3 * radius, key
    row.cosine = math.cos(math.radians(0.5 * field_of_view)) if field_of_view < 360.0 else flock.EVERYTHING
    for name, rule in rules.items():
        setattr(row, name, rule.weight)
        setattr(row, f"{name}_reach2", (rule.radius or radius) ** 2)
    return row


def domain_row(spec, reach: float) -> domain.Domain:
    """Return the domain's row, with cells for a reach [m]; without a domain one without borders."""
    row = domain.Domain()
    if spec.domain is None:
        return row
    row.boundary = domain.BOUNDARIES[spec.domain.boundary]
    size = spec.domain.size
    row.low, row.size = wp.vec3(*spec.domain.min), wp.vec3(*size)
    row.rate = wp.vec3(*(1.0 / np.float32(edge) if edge > 0.0 else 0.0 for edge in size))
    if row.boundary == domain.PERIODIC:
        cells = periodic_cells(size, reach, 1 << bits_for(spec.count))
        row.cells = wp.vec3i(*cells)
        row.per_meter = wp.vec3d(*(n / edge if edge > 0.0 else 0.0 for n, edge in zip(cells, size, strict=True)))
    elif row.boundary == domain.CONTAIN and min(size) > 0.0:
        corner, cells = walled_cells(row, reach)
        if math.prod(cells) <= 1 << bits_for(spec.count):
            row.corner, row.cells = wp.vec3d(*corner), wp.vec3i(*cells)
    return row


def walled_cells(row: domain.Domain, reach: float) -> tuple[np.ndarray, list[int]]:
    """Return the numbers of a box's first cells among those of the endless domain, and how many it has along each axis."""
    edges = np.array([grid.FINE, 1.0, 1.0]) / (reach * grid.SLACK)
    low, size = np.array(row.low, np.float32), np.array(row.size, np.float32)
    corner = np.floor(low * edges)
    return corner, [int(n) + 1 for n in np.floor((low + size) * edges) - corner]


def periodic_cells(size, reach: float, most: int) -> tuple[int, int, int]:
    """Return how many cells lie along each axis, none shorter than the reach (a fine one: a quarter of it), in all at most so many."""
    cells = [max(1, math.floor(edge / (reach * grid.SLACK))) for edge in size]
    while grid.FINE * math.prod(cells) > most:
        longest = cells.index(max(cells))
        cells[longest] = max(1, cells[longest] // 2)
    return grid.FINE * cells[0] if size[0] > 0.0 else 1, cells[1], cells[2]
