"""Flocks: boids that gather what their neighbors make them do, steer within their limits, and stay in their domain."""

import math
from collections.abc import Iterator, Mapping

import numpy as np
import warp as wp

from warpsim.compiling import load_modules
from warpsim.environment import Environment
from warpsim.flocks import starting_state
from warpsim.kernels import flight, flight_loops, flock
from warpsim.launch import Stage, available_cores
from warpsim.population import Field
from warpsim.scene import Scene
from warpsim.systems.census import Census
from warpsim.systems.crowds import Attention, Crowd, rule_row
from warpsim.systems.emitters import random_key
from warpsim.systems.lasting import LastingSystem
from warpsim.systems.pairs import substep_of
from warpsim.systems.points import PointPacker
from warpsim.systems.steering import Steering

NEIGHBORS = {"neighbors": Field(1, wp.int32, "1", "how many others it saw in the last substep")}
SWIMMING = {"swimming": Field(3, wp.float32, "m/s", "velocity through the flow that carries it")}


class Flock(LastingSystem):
    """One flock; `earlier` are the systems that move before it, of which it needs none: whom it attends to it meets later."""

    def __init__(self, name: str, spec, scene: Scene, environment: Environment, clock: wp.array, earlier: Mapping):
        count = 1 if (spec.substeps or scene.time.substeps) == "auto" else spec.substeps or scene.time.substeps
        place, velocity = starting_state(name, spec, scene.limits.extent)
        fields = NEIGHBORS | (SWIMMING if spec.coupling else {})
        super().__init__(name, spec, scene, environment, clock, count, place, velocity, np.full(spec.count, spec.mass), fields)
        self.resolve_contacts()
        self._key = random_key(scene.seed, name, spec.start.seed)
        self.crowd = Crowd(self.population, spec, spec.perception.radius)
        self.domain = self.crowd.domain
        if spec.start.file is None:
            inputs = (spec.count, self._key, spec.starting_speed, self.domain, self.particles)
            load_modules([flight.emit_flock], self.device, available_cores())
            wp.launch(flight.emit_flock, self.population.capacity, [0, *inputs], device=self.device)
        self._limits = wp.array([limit_row(spec, self.pace.dt)], dtype=flight.Limits, device=self.device)
        self._vicsek = wp.array([self._vicsek_row(spec)] if spec.vicsek else [], dtype=flight.Vicsek, device=self.device)
        self.steering = wp.zeros((3, self.population.capacity), dtype=float, device=self.device)
        self.points = PointPacker(self.population, self.particles, spec.look, scene.time.fps, self.steering)
        self._behaviors = Steering(self, environment)
        self._attention = {other: Attention(row, self.device) for other, row in self._rule_rows(spec).items()}
        self._appearance: Crowd | None = None  # for other flocks: where it was when the frame began
        self._others: dict[str, Flock] = {}
        self._census: Census | None = None  # made when somebody asks
        self._native = False
        self.remember_start()

    def _rule_rows(self, spec) -> dict[str, flock.Rules]:
        """Return what its boids do because of each other, and of the flocks that it attends to, by name."""
        own = rule_row(spec.rules, spec.perception.radius, spec.perception.field_of_view, spec.perception.nearest, self._key)
        rows = {self.name: own}
        for name, one in spec.attends.items():
            radius = one.radius or spec.perception.radius
            view = spec.perception.field_of_view if one.field_of_view is None else one.field_of_view
            rows[name] = rule_row(one.rules, radius, view, one.nearest, self._key)
        return rows

    def _vicsek_row(self, spec) -> flight.Vicsek:
        row = flight.Vicsek()
        row.key, row.speed, row.noise = random_key(self.scene.seed, self.name, 0), spec.vicsek.speed, spec.vicsek.noise
        return row

    def meet(self, flocks: Mapping[str, "Flock"]) -> None:
        """Get to know all flocks of the scene, before any stage is made."""
        self._others = {name: flocks[name] for name in self.spec.attends}
        if reach := self._seen_from(flocks):
            self._appearance = Crowd(self.population, self.spec, reach)

    def _seen_from(self, flocks: Mapping[str, "Flock"]) -> float:
        """Return from how far others look at it [m]; 0: nobody does."""
        looks = [(other.spec, other.spec.attends.get(self.name)) for other in flocks.values()]
        return max((one.radius or spec.perception.radius for spec, one in looks if one), default=0.0)

    def appear(self, native: bool) -> Iterator[Stage]:
        """Yield the stages that show it to others as it is when the frame begins; before anybody moves."""
        if self._appearance is not None:
            yield from self._appearance.sorting(native)

    def stages(self, native: bool) -> Iterator[Stage]:
        """Yield the frame's stages; nothing in them waits for the device."""
        yield from self.surroundings.stages()
        yield from self._behaviors.sampling()
        self._native, gathering = native, list(self._gathering(native))
        for s in range(self.pace.substep_count):
            if self.surroundings.has_colliders:
                yield from self.begin()
            yield from gathering
            yield from self._behaviors.stages(s)
            yield self._advance(s)
            yield from self.resolve(s)
        yield from self.points.stages(self.clock)

    def confine(self) -> Iterator[Stage]:
        """Yield the stage that keeps the boids in their domain."""
        inputs = (self.point_count, self.domain, self.particles)
        yield Stage("domain", flight.project_domain, self.population.capacity, inputs, flight_loops.project_domain, own=True)

    def _gathering(self, native: bool) -> Iterator[Stage]:
        """Yield the stages that add up in `steering` what the boids do for the sake of those whom they see."""
        seen = self.population.field("neighbors")
        yield from self.crowd.sorting(native)
        for name, attention in self._attention.items():
            theirs = self.crowd if name == self.name else self._others[name]._appearance
            yield from attention.stages(self.crowd, theirs, self.steering, seen)

    def _advance(self, s: int) -> Stage:
        """Return the stage that moves the boids through substep s."""
        inputs = (self.point_count, self.opening, substep_of(self.pace, s), self.clock)
        if self.spec.vicsek:
            inputs += (self.domain, self._vicsek, self.steering, self.population.field("neighbors"), self.particles)
            return Stage("advance", flight.advance_vicsek, self.population.capacity, inputs, flight_loops.advance_vicsek, own=True)
        inputs += (self.surroundings.row, self._limits, self.steering, self.particles, self._swimming)
        return Stage("advance", flight.advance_flock, self.population.capacity, inputs, flight_loops.advance_flock, own=True)

    @property
    def _swimming(self) -> wp.array:
        """Where velocities through the flow are kept; empty where no flow carries the flock."""
        if "swimming" in self.population.fields:
            return self.population.field("swimming")
        return wp.empty((3, 0), dtype=float, device=self.device)

    def change(self, spec, scene: Scene, environment: Environment) -> None:
        """Take the numbers of another spec of the same structure, in place; the environment has changed already."""
        moved, self._census = spec.domain != self.spec.domain, None
        self.take(spec, scene, environment, np.full(spec.count, spec.mass))
        self.crowd.change(spec, spec.perception.radius)
        if moved:  # who looks for neighbors takes for granted that all are within
            wp.launch(
                flight.project_domain, self.population.capacity, [0, self.point_count, self.domain, self.particles], device=self.device
            )
        if self._appearance is not None:
            specs = [(other, other.attends[self.name]) for other in scene.systems.values() if self.name in getattr(other, "attends", ())]
            self._appearance.change(spec, max(one.radius or other.perception.radius for other, one in specs))
        for name, row in self._rule_rows(spec).items():
            self._attention[name].change(row)
        self._limits.assign(wp.array([limit_row(spec, self.pace.dt)], dtype=flight.Limits, device=self.device))
        self._behaviors.change()
        if spec.vicsek:
            self._vicsek.assign(wp.array([self._vicsek_row(spec)], dtype=flight.Vicsek, device=self.device))

    @property
    def remedy(self) -> str:
        """What to try where it blows up."""
        return f"try substeps: {2 * self.pace.substep_count} for this flock, a speed band or max_force"

    def statistics(self) -> dict[str, float]:
        """Return what there is to tell besides counts and kinetic energy: how much order there is, spacing, clusters."""
        copied = wp.get_device(self.device).is_cuda
        if self._census is None or copied:
            self._census = Census(self, self._native, copied)
        return self._census.numbers()


def limit_row(spec, h: float) -> flight.Limits:
    """Return the limits of a substep of h seconds."""
    row = flight.Limits()
    row.slowest, row.fastest = spec.speed or (0.0, flight.NO_LIMIT)
    row.strongest = spec.max_force or flight.NO_LIMIT
    turn = math.radians(spec.turn_rate) * h if spec.turn_rate else math.pi
    row.turn_cosine, row.turn_sine = (math.cos(turn), math.sin(turn)) if turn < math.pi else (-2.0, 0.0)
    return row
