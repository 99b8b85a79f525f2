"""Particles: mass points from emitters that move, alone or with their neighbors, and die."""

from collections.abc import Iterator, Mapping

import numpy as np
import warp as wp

from warpsim.environment import Environment
from warpsim.frame import SystemFrame
from warpsim.integrators import FIRST_ORDER_FORM, SECOND_ORDER_FORM, Ballistic, Integrator
from warpsim.keeping import KeptArray
from warpsim.kernels import adaptive, integration, lifecycle_loops, lifetime
from warpsim.kernels.removal_loops import RELAY
from warpsim.launch import Stage
from warpsim.population import CONTACT, FIELDS, Field, Population, history_fields
from warpsim.scene import Scene
from warpsim.scene.events import events_of, has_colors
from warpsim.scene.pacing import MAX_SUBSTEPS, TOLERANCE, is_adaptive, substep_count
from warpsim.systems.emitters import Emission
from warpsim.systems.events import TINT, Events, fields_of
from warpsim.systems.pairs import PairForces
from warpsim.systems.points import PointPacker

BIRTH_STATE = {
    "birth_position": Field(3, wp.float32, "m", "where it was born"),
    "birth_velocity": Field(3, wp.float32, "m/s", "how fast it moved at birth"),
}


def method_of(spec) -> type[Integrator]:
    """Return the integrator that a particle system's spec asks for."""
    if spec.motion == "ballistic":
        return Ballistic
    if spec.coupling == "tracer":
        return FIRST_ORDER_FORM[spec.solver or "rk4"]
    return SECOND_ORDER_FORM[spec.solver or "semi_implicit_euler"]


def care_of(spec, device: str) -> wp.array:
    """Return what a system asks of substeps that its particles choose themselves, one row."""
    care = adaptive.Care()
    care.tolerance = spec.tolerance or TOLERANCE
    care.finest = (spec.max_substeps or MAX_SUBSTEPS).bit_length() - 1
    return wp.array([care], dtype=adaptive.Care, device=device)


def past_fields(method: type[Integrator], chooses: bool) -> dict[str, Field]:
    """Return the rows that a multistep method keeps of each particle, which may choose its substeps."""
    level = {"level": Field(1, wp.int32, "1", "log2 of the substeps per frame that it has chosen")}
    return (level if chooses else {}) | history_fields(method.past)


class Particles:
    """One system of particles: emit, advance (ages, forces, motion in one pass over memory), remove the expired.

    `earlier` are the systems that move before it in a frame, among them those whose events its emitters listen to.
    """

    def __init__(self, name: str, spec, scene: Scene, environment: Environment, clock: wp.array, earlier: Mapping[str, "Particles"]):
        self.name, self.spec, self._clock, self._fps = name, spec, clock, scene.time.fps
        self.method = method_of(spec)
        count = substep_count(spec, scene.time)
        self.care = care_of(spec, environment.device) if is_adaptive(spec, scene.time) else None
        ballistic = self.method is Ballistic
        heard = events_of(name, scene.systems)
        fields = FIELDS | (BIRTH_STATE if ballistic else {}) | past_fields(self.method, self.care is not None)
        fields |= PointPacker.fields(spec.look) | (TINT if has_colors(spec) else {})
        fields |= fields_of(heard) | (CONTACT if scene.sticky_to(spec) else {})
        self.population = Population(spec.capacity, fields, environment.device)
        self.surroundings = environment.feel(spec.feels, spec.coupling, count)
        self.pace = integration.Pace()
        self.pace.dt, self.pace.fps, self.pace.substep_count = 1.0 / (scene.time.fps * count), scene.time.fps, count
        self.pace.first, self.pace.last = 0, count
        self.particles = self.population.view()
        self.pairs = self._pair_forces(environment)
        self.newborn = self.population.view("birth_position", "birth_velocity") if ballistic else self.particles
        self.points = PointPacker(self.population, self.particles, spec.look, scene.time.fps)
        self.events = Events(heard, self.population, clock, self.surroundings.row, scene.time.fps)
        logs = [earlier[emitter.on.of].events.log(emitter.on) for emitter in spec.emitters if emitter.on is not None]
        self.emission = Emission(name, spec, scene, self.population, clock, logs)

    def _pair_forces(self, environment: Environment) -> PairForces | None:
        """Return what its particles do to each other; a tracer and an arc in closed form feel no force."""
        laws = environment.laws(self.spec.feels) if self.method in SECOND_ORDER_FORM.values() else []
        if not laws:
            return None
        pairs = PairForces(laws, self.population, environment, self._clock, self.pace)
        if not self.method.splits_pairs:
            self.particles.internal = pairs.internal
        return pairs

    def stages(self, native: bool) -> Iterator[Stage]:
        """Yield the frame's stages; nothing here waits for the device."""
        yield from self.surroundings.stages()
        yield from self.emission.stages(self.newborn, lifecycle_loops.emit_particles)
        yield from self.events.stages(native, self.newborn, "birth")
        if native and self._removes_at_once:
            loop = self.method.removing_loop(self.surroundings.has_colliders, self.surroundings.long_flows)
            relay = wp.zeros(RELAY, dtype=int, device=self.population.device)
            inputs = (self.pace, self._clock, self.surroundings.row, self.particles, self.population.counters, self.population.slab, relay)
            yield Stage("advance, remove", loop, self.population.capacity, inputs, loop, turns=True)
            return
        yield from self._motion(native)
        yield from self.events.stages(native, self.particles, "death", "collision")
        yield from self.points.stages(self._clock)
        yield from removal(self.population, native)

    @property
    def _removes_at_once(self) -> bool:
        """Whether one loop moves and removes: one pass is the whole frame, and nobody asks for the expired after it."""
        alone = self.pairs is None and self.care is None and self.method is not Ballistic
        return alone and not self.points.has_trails and not self.events.follow_motion

    def _motion(self, native: bool) -> Iterator[Stage]:
        """Yield the stages that move everybody: one for all substeps, or with neighbors several for each."""
        if self.pairs is not None:
            yield from self.pairs.stages(self.particles, self.method, self.surroundings, native)
            return
        if self.care is not None:
            plain, loop = adaptive.ADVANCE[self.method.name]
            inputs = (self.care, self.pace, self._clock, self.surroundings.row, self.particles, self.population.counters)
            yield Stage("advance", plain, self.population.capacity, inputs, loop)
            return
        plain, loop = self.method.kernels(self.surroundings.has_colliders, self.surroundings.long_flows)
        states = (self.newborn, self.particles) if self.newborn is not self.particles else (self.particles,)
        inputs = (self.pace, self._clock, self.surroundings.row, *states, self.population.counters)
        yield Stage("advance", plain, self.population.capacity, inputs, loop)

    @property
    def load(self) -> int:
        """How many elements there are, with which the work of a frame grows."""
        return self.population.counter("live")

    def frame(self, index: int) -> SystemFrame:
        """Return what observers see of the present frame."""
        population = self.population
        fields = tuple(population.fields)
        return SystemFrame(population.host, fields, self.points.pack, lambda: population.counter("live"), index, self._fps)

    def change(self, spec, scene: Scene, environment: Environment) -> None:
        """Take the numbers of another spec of the same structure, in place; the environment has changed already."""
        self.spec = spec
        if self.care is not None:
            self.care.assign(care_of(spec, environment.device))
        self.surroundings.change(*environment.felt(spec.feels, spec.coupling))
        if self.pairs is not None:
            self.pairs.change(environment.laws(spec.feels))
        self.emission.change(spec, scene)
        self.points.change(spec.look)

    @property
    def remedy(self) -> str:
        """What to try where it blows up."""
        key = "substeps" if self.care is None else "max_substeps"
        return f"try {key}: {2 * self.pace.substep_count} for this system, or weaker forces"

    def reset(self) -> None:
        """Remove all particles; the emitters go on."""
        self.population.clear()

    def statistics(self) -> dict[str, float]:
        """Return what there is to tell besides counts and kinetic energy: children, pushes out of colliders, how substeps were chosen."""
        numbers = {"children": self.population.counter("children")} if any(emitter.on for emitter in self.spec.emitters) else {}
        if self.surroundings.colliders.shape[1]:
            numbers["pushed"] = self.population.counter("pushed")
        if self.care is not None:
            chosen = np.exp2(self.population.host("level"))
            numbers |= {"substeps": float(chosen.mean()) if len(chosen) else 0.0, "inexact": self.population.counter("coarse")}
        return numbers

    def arrays(self) -> dict[str, np.ndarray]:
        """Return the full state; on the CPU the arrays themselves."""
        return {**self.population.arrays(), "progress": self.emission.plan.progress.numpy()}

    def restore(self, state: Mapping[str, KeptArray]) -> None:
        """Take back what arrays() were when they were kept."""
        self.population.restore(state)
        self.emission.plan.progress.assign(state["progress"].whole())


def removal(population: Population, native: bool) -> Iterator[Stage]:
    """Yield the stages that close the gaps of the expired, in order: in place by rows, or by mark, scan and scatter."""
    counters, alive, slab, n = population.counters, population.alive, population.slab, population.capacity
    if native:
        loop = lifecycle_loops.scatter_in_place
        yield Stage("remove", loop, n, (alive, counters, slab), loop)
        return
    order, scratch = wp.zeros_like(alive), wp.zeros_like(slab)
    yield Stage("remove", launch=lambda: wp.utils.array_scan(alive, order))
    yield Stage("remove", lifetime.scatter_survivors, n, (counters, alive, order, slab, scratch))
    yield Stage("remove", lifetime.scan_survivors, 1, (order, counters))
    yield Stage("remove", lifetime.scatter_back, n, (counters, order, scratch, slab))
