"""Flocks: boids that gather what their neighbors make them do, steer within their limits, and stay in their domain."""

import math
from collections.abc import Iterator, Mapping

import numpy as np
import warp as wp

from warpsim.environment import Environment
from warpsim.flocks import starting_state
from warpsim.kernels import domain, flight, flock, flock_loops, grid
from warpsim.launch import Stage
from warpsim.population import Field
from warpsim.scene import Scene
from warpsim.systems.emitters import random_key
from warpsim.systems.lasting import LastingSystem
from warpsim.systems.neighbors import Neighbors, bits_for
from warpsim.systems.pairs import substep_of
from warpsim.systems.steering import Steering

NEIGHBORS = {"neighbors": Field(1, wp.int32, "1", "how many others it saw in the last substep")}
LOAD_OF_NEIGHBORS = 4  # five times the work with 24 of them, and more barriers


class Flock(LastingSystem):
    """One flock; `earlier` are the systems that move before it."""

    def __init__(self, name: str, spec, scene: Scene, environment: Environment, clock: wp.array, earlier: Mapping):
        count = 1 if (spec.substeps or scene.time.substeps) == "auto" else spec.substeps or scene.time.substeps
        self.domain = wp.array([domain_row(spec)], dtype=domain.Domain, device=environment.device)
        place, velocity = starting_state(name, spec)
        mass = np.full(spec.count, spec.mass)
        super().__init__(name, spec, scene, environment, clock, count, place, velocity, mass, NEIGHBORS)
        self.resolve_contacts()
        if spec.start.file is None:
            inputs = (spec.count, random_key(scene.seed, name, spec.start.seed), spec.starting_speed, self.domain, self.particles)
            wp.launch(flight.emit_flock, self.population.capacity, [0, *inputs], device=self.device)
        self._neighbors = Neighbors(self.population, spec.perception.radius, rows=6)
        self.crowd = flock.Crowd()
        self.crowd.count, self.crowd.grid, self.crowd.sorted, self.crowd.domain = (
            spec.count,
            self._neighbors.grid,
            self._neighbors.sorted,
            self.domain,
        )
        self._rules = wp.array([self._rule_row(spec)], dtype=flock.Rules, device=self.device)
        self._limits = wp.array([limit_row(spec, self.pace.dt)], dtype=flight.Limits, device=self.device)
        self._vicsek = wp.array([self._vicsek_row(spec)] if spec.vicsek else [], dtype=flight.Vicsek, device=self.device)
        self.steering = wp.zeros((3, self.population.capacity), dtype=float, device=self.device)
        self._behaviors = Steering(self, environment)
        self._origin = self.save()

    def _rule_row(self, spec) -> flock.Rules:
        row, reach = flock.Rules(), spec.perception.radius
        row.reach2, row.closest = reach**2, 1e-3 * reach
        row.key = random_key(self.scene.seed, self.name, 0)
        view = spec.perception.field_of_view
        row.cosine = math.cos(math.radians(0.5 * view)) if view < 360.0 else flock.EVERYTHING
        for key, rule in spec.rules.items():
            setattr(row, key, rule.weight)
            setattr(row, f"{key}_reach2", (rule.radius or reach) ** 2)
        return row

    def _vicsek_row(self, spec) -> flight.Vicsek:
        row = flight.Vicsek()
        row.key, row.speed, row.noise = random_key(self.scene.seed, self.name, 0), spec.vicsek.speed, spec.vicsek.noise
        return row

    def stages(self, native: bool) -> Iterator[Stage]:
        """Yield the frame's stages; nothing in them waits for the device."""
        yield from self.surroundings.stages()
        yield from self._behaviors.sampling()
        sort = list(self._neighbors.stages(native))
        for s in range(self.pace.substep_count):
            yield from self.begin()
            yield from self._gather(sort)
            yield from self._behaviors.stages(s)
            yield self._advance(s)
            yield from self.resolve(s)
            yield Stage("domain", flight.project_domain, self.population.capacity, (self.point_count, self.domain, self.particles))
        yield from self.points.stages(self.clock)

    def _gather(self, sort: list[Stage]) -> Iterator[Stage]:
        """Yield the stages that add up in `steering` what the boids do for their neighbors' sake."""
        capacity, seen = self.population.capacity, self.population.field("neighbors")
        inputs = (self.crowd, self.particles.position, self.crowd.grid)
        yield Stage("neighbors", flock.mark_flock, capacity, inputs, flock_loops.mark_flock)
        yield from sort
        yield Stage("flock", flock.clear_steering, capacity, (self.steering, seen))
        inputs = (1, self._rules, self.crowd, self.crowd, self.steering, seen)
        yield Stage("flock", flock.accumulate_flock, capacity, inputs, flock_loops.accumulate_flock)

    def _advance(self, s: int) -> Stage:
        if self.spec.vicsek:
            inputs = (self.point_count, self.opening, substep_of(self.pace, s), self.clock, self.domain, self._vicsek)
            inputs += (self.steering, self.population.field("neighbors"), self.particles)
            return Stage("advance", flight.advance_vicsek, self.population.capacity, inputs)
        inputs = (self.point_count, self.opening, substep_of(self.pace, s), self.clock, self.surroundings.row)
        return Stage("advance", flight.advance_flock, self.population.capacity, (*inputs, self._limits, self.steering, self.particles))

    @property
    def load(self) -> int:
        """How many particles that move alone are about as much work."""
        return LOAD_OF_NEIGHBORS * self.point_count

    def change(self, spec, scene: Scene, environment: Environment) -> None:
        """Take the numbers of another spec of the same structure, in place; the environment has changed already."""
        self.take(spec, scene, environment, np.full(spec.count, spec.mass))
        self.domain.assign(wp.array([domain_row(spec)], dtype=domain.Domain, device=self.device))
        self._neighbors.change(spec.perception.radius)
        self._rules.assign(wp.array([self._rule_row(spec)], dtype=flock.Rules, device=self.device))
        self._limits.assign(wp.array([limit_row(spec, self.pace.dt)], dtype=flight.Limits, device=self.device))
        self._behaviors.change()
        if spec.vicsek:
            self._vicsek.assign(wp.array([self._vicsek_row(spec)], dtype=flight.Vicsek, device=self.device))

    @property
    def remedy(self) -> str:
        """What to try where it blows up."""
        return f"try substeps: {2 * self.pace.substep_count} for this flock, a speed band or max_force"

    def reset(self) -> None:
        """Put the flock back to where it started."""
        self.restore(self._origin)

    def statistics(self) -> dict[str, float]:
        """Return what there is to tell besides counts and kinetic energy."""
        return {}


def domain_row(spec) -> domain.Domain:
    """Return the domain's row; without a domain one without borders."""
    row = domain.Domain()
    if spec.domain is None:
        return row
    row.boundary = domain.BOUNDARIES[spec.domain.boundary]
    size = spec.domain.size
    row.low, row.size = wp.vec3(*spec.domain.min), wp.vec3(*size)
    row.rate = wp.vec3(*(1.0 / np.float32(edge) if edge > 0.0 else 0.0 for edge in size))
    if row.boundary == domain.PERIODIC:
        cells = periodic_cells(size, spec.perception.radius, 1 << bits_for(spec.count))
        row.cells = wp.vec3i(*cells)
        row.per_meter = wp.vec3d(*(n / edge if edge > 0.0 else 0.0 for n, edge in zip(cells, size, strict=True)))
    return row


def periodic_cells(size, reach: float, most: int) -> tuple[int, int, int]:
    """Return how many cells lie along each axis, none shorter than the reach (a fine one: a quarter of it), in all at most so many."""
    cells = [max(1, math.floor(edge / (reach * grid.SLACK))) for edge in size]
    while grid.FINE * math.prod(cells) > most:
        longest = cells.index(max(cells))
        cells[longest] = max(1, cells[longest] // 2)
    return grid.FINE * cells[0] if size[0] > 0.0 else 1, cells[1], cells[2]


def limit_row(spec, h: float) -> flight.Limits:
    """Return the limits of a substep of h seconds."""
    row = flight.Limits()
    row.slowest, row.fastest = spec.speed or (0.0, flight.NO_LIMIT)
    row.strongest = spec.max_force or flight.NO_LIMIT
    turn = math.radians(spec.turn_rate) * h if spec.turn_rate else math.pi
    row.turn_cosine, row.turn_sine = (math.cos(turn), math.sin(turn)) if turn < math.pi else (-2.0, 0.0)
    return row
