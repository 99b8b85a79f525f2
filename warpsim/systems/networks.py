"""Networks: systems whose points neither come nor go, joined by forces that are gathered once per substep, and pinned where they are."""

import math
from abc import abstractmethod
from collections.abc import Callable, Iterator, Mapping
from functools import cached_property

import numpy as np
import warp as wp

from warpsim.budget import checked_advice, excess
from warpsim.environment import Environment
from warpsim.keeping import KeptArray
from warpsim.kernels import points, spring_loops, springs
from warpsim.launch import Stage
from warpsim.networks import SPRING_NUMBERS, Net, Packed, check_places, edges_of, packed, point_masses, spring_numbers
from warpsim.scene import Scene
from warpsim.signals import SignalTable, components, strength_signals
from warpsim.stability import Advice, advice_for
from warpsim.systems.lasting import LastingSystem, spread
from warpsim.systems.parts import PARTS
from warpsim.systems.solvers import SOLVERS


class NetworkSystem(LastingSystem):
    """A population of fixed size, which a solver moves; subclasses say how its springs are summed, parts what acts on it besides.

    `net` holds the points where they start and what joins them; `packed` and `network` are its springs in slices, made by pack().
    """

    packed: Packed | None = None
    network = None

    native = False
    """Whether stages run native loops; known when the stages are asked for."""

    def __init__(self, name: str, spec, scene: Scene, environment: Environment, clock: wp.array, net: Net):
        check_places(spec, net, scene.limits.extent, f"systems.{name}")
        self.net, self.start_time = net, environment.start_time
        count, mass = checked_advice(name, spec, scene, net).chosen, point_masses(spec, net)
        more = SOLVERS[spec.solver].fields(spec)
        super().__init__(name, spec, scene, environment, clock, count, net.points, np.zeros_like(net.points), mass, more)
        self.inverse_mass = wp.array(self._inverse_masses(spec), dtype=float, device=self.device)
        self._pins, table = self._pin_rows(spec)
        self._pins.signals = table.tables(self.device)
        self.torn_springs = wp.zeros(0 if spec.tear is None else len(net.springs), dtype=int, device=self.device)
        self._pins.displacement = wp.zeros((count + 1, len(self._pins.paths)), dtype=wp.vec3, device=self.device)
        moments = 2 * count + 1 if SOLVERS[spec.solver].has_stages else 0
        for name in ("place", "rate"):
            setattr(self._pins, name, wp.zeros((moments, len(self._pins.paths)), dtype=wp.vec3, device=self.device))
        self.solver = SOLVERS[spec.solver](self)
        self.parts = [part(self) for part in PARTS if part.wanted(spec)]
        if not self.solver.resolves or any(part.constrains for part in self.parts):
            self.resolve_contacts()
        self.remember_start()

    @abstractmethod
    def pull(self, moment: int) -> Iterator[Stage]:
        """Yield the stages that store in `internal` what the springs do to each point, and the flow across a surface that it has [m/s²]."""

    def wind(self, moment: int) -> Iterator[Stage]:
        """Yield the stages that store in `internal` what the flow alone does across a surface: nothing where there is none [m/s²]."""
        yield Stage("springs", points.clear_internal, self.population.capacity, (self.internal,))

    @cached_property
    def table(self) -> springs.SpringTable:
        """The springs one by one, on the device; made when it is first asked for."""
        table, device = springs.SpringTable(), self.population.device
        table.ends = wp.array(self.net.springs, dtype=wp.vec2i, device=device)
        for key, values in self.numbers.items():
            setattr(table, key, wp.array(values, dtype=float, device=device))
        return table

    @property
    def numbers(self) -> dict[str, np.ndarray]:
        """Stiffness [N/m], damping [N·s/m] and rest length [m] of every spring, float64 (m,) each; torn ones neither pull nor damp."""
        numbers = dict(zip(SPRING_NUMBERS, map(np.array, spring_numbers(self.spec, self.net)), strict=True))
        if self.torn is not None:
            torn = self.torn()
            numbers["stiffness"][torn] = numbers["damping"][torn] = 0.0
        return numbers

    def renew(self) -> None:
        """Write the springs' numbers wherever kernels read them; subclasses add their own places."""
        if "table" in self.__dict__:
            for key, values in self.numbers.items():
                getattr(self.table, key).assign(values.astype(np.float32))
        if self.network is not None:
            for key, values in self.numbers.items():
                getattr(self.network, key).assign(self.packed.values(values))

    def pack(self) -> None:
        """Lay the springs out in slices, for kernels that gather them from lists."""
        self.packed = packed(len(self.net.points), self.net.springs)
        self.network = springs.Network()
        self.network.point_count = len(self.net.points)
        self.network.begin = wp.array(self.packed.begin, dtype=int, device=self.device)
        self.network.neighbor = wp.array(self.packed.neighbor.reshape(-1), dtype=int, device=self.device)
        self.network.inverse_mass = self.inverse_mass
        for key, values in self.numbers.items():
            setattr(self.network, key, wp.array(self.packed.values(values), dtype=float, device=self.device))

    def pull_packed(self) -> Stage:
        """Return the stage that sums the springs of every point from their slices."""
        inputs = (self.network, self.particles, self.internal)
        return Stage("springs", springs.accumulate_springs, self.population.capacity, inputs, spring_loops.accumulate_springs)

    def energy(self) -> float:
        """Return what springs and parts hold at the present frame, of springs Σ ½ k (|d| − r)² [J], in float64."""
        stiffness, rest = self.numbers["stiffness"], self.numbers["rest"]
        for part in self.parts:
            rest = part.rest_lengths(int(self.clock.numpy()[0]) / self._fps, rest)
        ends = self.population.host("position").T.astype(float)[self.net.springs]
        springs = float(0.5 * (stiffness * (np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1) - rest) ** 2).sum())
        return springs + sum(part.energy() for part in self.parts)

    def _pin_rows(self, spec) -> tuple[springs.Pins, SignalTable]:
        device, table, motion = self.population.device, SignalTable(), {}
        for one in spec.pin_motion:
            row = strength_signals(one.displacement or components(one.keyframes), table)
            motion |= dict.fromkeys(spec.pinned(one.pins or spec.pins), row)
        points = spec.pinned(spec.pins)
        pins = springs.Pins()
        pins.point = wp.array(points, dtype=int, device=device)
        pins.home = wp.array(np.ascontiguousarray(self.net.points[points].T.reshape(3, -1)), dtype=float, device=device)
        paths = list({id(row): row for row in motion.values()}.values())
        number = {id(row): k for k, row in enumerate(paths)}
        pins.path = wp.array([number[id(motion[i])] if i in motion else -1 for i in points], dtype=int, device=device)
        pins.paths = wp.array(paths, dtype=wp.vec3i, device=device)
        pins.point_count = len(self.net.points)
        return pins, table

    def _inverse_masses(self, spec) -> np.ndarray:
        """Return 1/m of every slot [1/kg], 0 for pins."""
        inverse = 1.0 / point_masses(spec, self.net)
        inverse[spec.pinned(spec.pins)] = 0.0
        return spread(inverse, self.population.capacity)

    def stages(self, native: bool) -> Iterator[Stage]:
        """Yield the frame's stages; nothing here waits for the device."""
        self.native = native
        yield from self.surroundings.stages()
        yield from self._sample_paths()
        yield from self.solver.stages()
        yield from self.points.stages(self.clock)

    def prepare(self, moment: int) -> Iterator[Stage]:
        """Yield what parts do before anybody asks for forces at a moment, in half substeps."""
        for part in self.parts:
            yield from part.prepare(moment)

    def forces(self, moment: int) -> Iterator[Stage]:
        """Yield the stages that store in `internal` all that acts within the network at a moment, in half substeps [m/s²]."""
        yield from self.prepare(moment)
        yield from self.pull(moment)
        for part in self.parts:
            yield from part.forces(moment)

    def outer_forces(self, moment: int) -> Iterator[Stage]:
        """Yield the same but for the springs, for solvers that answer those in a way of their own; prepare() is not in it."""
        yield from self.wind(moment)
        for part in self.parts:
            yield from part.forces(moment)

    def stride(self, s: int) -> list[Stage]:
        """Return the stages of all of substep s where somebody has them in one, with the same bits; none where stage follows on stage."""
        return []

    def settle(self, s: int) -> Iterator[Stage]:
        """Yield what comes after substep s has moved the points: constraints, contacts, pins."""
        for part in self.parts:
            yield from part.constrain(s)
        yield from self.resolve(s)
        yield from self.hold(s)
        for part in self.parts:
            yield from part.after(s)

    def hold(self, s: int) -> Iterator[Stage]:
        """Yield the stage that puts the pins where they belong at the end of substep s."""
        count = self._pins.point.shape[0]
        if count:
            inputs = (s, self.pace.dt, self._pins, self.surroundings.row, self.particles, self.population.counters)
            yield Stage("pins", springs.project_pins, count, inputs, spring_loops.project_pins, own=True)

    def _sample_paths(self) -> Iterator[Stage]:
        """Yield the stages that work out where moved pins are at each substep's end, and at each stage: once for all that move alike."""
        table = self._pins.displacement
        if table.size:
            inputs = (self.pace.dt, self.start_time, self._pins, table)
            yield Stage("pins", springs.sample_paths, table.size, inputs)
        place, rate = self._pins.place, self._pins.rate
        if place.size:
            inputs = (self.pace.dt, self.start_time, self._pins, place, rate)
            yield Stage("pins", springs.sample_courses, place.size, inputs)

    def place_pins(self, moment: int) -> Iterator[Stage]:
        """Yield the stage that puts pins that move where they are at a moment, in half substeps, with the velocity that they have there."""
        if self._pins.place.size:
            inputs = (moment, self._pins, self.particles.position, self.particles.velocity)
            yield Stage("pins", springs.place_pins, self._pins.point.shape[0], inputs)

    @property
    def topology(self) -> dict[str, np.ndarray]:
        """Its springs and triangles; where springs may tear, also those along the edges of each triangle."""
        parts = {"springs": self.net.springs, "triangles": self.net.triangles}
        return parts if self.spec.tear is None else parts | {"edges": self._edges}

    @cached_property
    def _edges(self) -> np.ndarray:
        return edges_of(self.net)

    @property
    def torn(self) -> Callable[[], np.ndarray] | None:
        """What fetches, of each spring, whether it is torn, bool (m,); None where none can be."""
        return None if self.spec.tear is None else lambda: self.torn_springs.numpy() != 0

    def change(self, spec, scene: Scene, environment: Environment) -> None:
        """Take the numbers of another spec of the same structure, in place; the environment has changed already."""
        self.take(spec, scene, environment, point_masses(spec, self.net))
        self.inverse_mass.assign(self._inverse_masses(spec))
        self.renew()
        self._pin_rows(spec)[1].write(self._pins.signals)
        for member in self._members:
            member.change()

    @property
    def advice(self) -> Advice:
        """What its springs stand as they are now, and the substeps that it has."""
        return advice_for(self.spec, self.scene, self.net)._replace(chosen=self.pace.substep_count)

    @property
    def remedy(self) -> str:
        """What to try where it blows up."""
        led = self.population.host("position")[:, self.spec.pinned(self.spec.pins)]
        if not (np.abs(led) <= self.scene.limits.extent).all():
            return "its pin_motion leads there"
        advice = self.advice
        if advice.least == 0:
            return excess(self.spec, self.net, math.ceil(1.0 / (self.scene.time.fps * advice.longest)), self.scene.time.fps)[1]
        if advice.least > advice.chosen:
            stand = f"its springs stand {advice.longest:.3g} s"
            asked = self.spec.substeps or self.scene.time.substeps
            other = "; auto counted before a number was changed" if asked == "auto" else ", or auto"
            return f"try substeps: {advice.least} for this system{other}: {stand}; or weaker springs, more mass"
        return f"try substeps: {2 * advice.chosen} for this system, or weaker forces"

    def reset(self) -> None:
        """Put the network back to where it started."""
        super().reset()
        for part in self.parts:
            part.reset()

    @property
    def _members(self) -> list:
        return [self.solver, *self.parts]

    def statistics(self) -> dict[str, float]:
        """Return what there is to tell besides counts and kinetic energy."""
        numbers = {"elastic_energy": self.energy()}
        for member in self._members:
            numbers |= member.statistics()
        return numbers

    def arrays(self) -> dict[str, np.ndarray]:
        """Return the full state; on the CPU the arrays themselves."""
        return super().arrays() | {key: array.numpy() for member in self._members for key, array in member.state.items()}

    def restore(self, state: Mapping[str, KeptArray]) -> None:
        """Take back what arrays() were when they were kept."""
        super().restore(state)
        for member in self._members:
            for key, array in member.state.items():
                array.assign(state[key].whole())
        if self.torn is not None:
            self.renew()
