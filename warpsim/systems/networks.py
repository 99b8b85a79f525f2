"""Networks: systems whose points neither come nor go, joined by forces that are gathered once per substep, and pinned where they are."""

from abc import ABC, abstractmethod
from collections.abc import Iterator

import numpy as np
import warp as wp

from warpsim.environment import Environment, Surroundings
from warpsim.frame import SystemFrame
from warpsim.integrators import SECOND_ORDER_FORM
from warpsim.kernels import emission, integration, springs
from warpsim.kernels.collider import BOUNCE, BOX, Collider
from warpsim.kernels.environment import KILL, RESET
from warpsim.launch import Stage
from warpsim.networks import Net, point_masses, spring_numbers
from warpsim.population import FIELDS, Population
from warpsim.scene import Scene
from warpsim.signals import SignalTable, components, strength_signals
from warpsim.stability import Advice, advice_for, checked_advice
from warpsim.systems.pairs import substep_of
from warpsim.systems.points import PointPacker

FOREVER = 1.0e30  # [s]: a point's lifetime
WITHIN, AFTER, HALVES = range(3)
WHEN = {  # when the springs act: with the other forces, as a kick after the substep, or as half a kick before and after
    "euler": WITHIN,
    "semi_implicit_euler": WITHIN,
    "drift_kick": AFTER,
    "verlet": HALVES,
}


class NetworkSystem(ABC):
    """A population of fixed size that the particles' kernels advance; subclasses say what its points do to each other.

    `net` holds the points where they start and what joins them.
    """

    def __init__(self, name: str, spec, scene: Scene, environment: Environment, clock: wp.array, net: Net):
        self.name, self.spec, self.net, self._scene, self._clock, self._fps = name, spec, net, scene, clock, scene.time.fps
        self.method = SECOND_ORDER_FORM[spec.solver]
        count = checked_advice(name, spec, scene, net).chosen
        self.population = Population(len(net.points), FIELDS | PointPacker.fields(spec.look), environment.device)
        self._opening = int(clock.numpy()[0]) + 1  # number of the first frame; the motion begins at its end
        self.surroundings = Surroundings(environment, self._felt(spec, environment), 2 * count + 1, 0.5 / (self._fps * count))
        self.pace = integration.Pace()
        self.pace.dt, self.pace.fps, self.pace.substep_count = 1.0 / (scene.time.fps * count), scene.time.fps, count
        self._fill(spec)
        self.particles = self.population.view()
        self.internal = wp.zeros((3, self.population.capacity), dtype=float, device=environment.device)
        if WHEN[spec.solver] == WITHIN:
            self.particles.internal = self.internal
        self.points = PointPacker(self.population, self.particles, spec.look, scene.time.fps)
        self._pins, table = self._pin_rows(spec)
        self._pins.signals = table.tables(environment.device)
        self._start_time = environment.start_time
        self._start = self.population.save()

    @abstractmethod
    def forces(self, s: int) -> Iterator[Stage]:
        """Yield the stages that store in `internal` what the neighbors do at the beginning of substep s [m/s²]."""

    def energy(self) -> float:
        """Return what the springs hold at the present frame, Σ ½ k (|d| − r)² [J], in float64."""
        stiffness, _, rest = spring_numbers(self.spec, self.net)
        ends = self.population.host("position").T.astype(float)[self.net.springs]
        return float(0.5 * (stiffness * (np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1) - rest) ** 2).sum())

    def _fill(self, spec) -> None:
        """Put every point where it starts, at rest."""
        count, capacity, population = len(self.net.points), self.population.capacity, self.population
        resting = {"lifetime": FOREVER, "radius": spec.radius, "mass": 1.0, "birth_frame": self._opening}
        for key, value in resting.items():
            population.field(key).fill_(value)  # the empty slots too: a loop computes them and stores nothing
        population.field("position").assign(spread(self.net.points.T, capacity))
        population.field("mass").assign(spread(point_masses(spec, self.net), capacity, 1.0))
        numbers = np.zeros((2, capacity), np.uint32)
        numbers[0, :count] = np.arange(count)
        population.field("id").assign(numbers)
        population.alive.fill_(1)
        counters = np.zeros(emission.COUNTER_COUNT, np.int64)
        counters[[emission.LIVE, emission.ACTIVE, emission.NEXT_ID]] = count
        population.counters.assign(counters)

    def _felt(self, spec, environment: Environment) -> tuple:
        """Return what the network feels. No point of it is ever removed: where points would be killed it starts anew as a whole."""
        row, flow, forces, colliders = environment.felt(spec.feels, spec.coupling)
        row.policy = RESET if row.policy == KILL else row.policy
        return row, flow, forces, [thickened(one, spec.thickness) for one in colliders if one.action == BOUNCE]

    def _pin_rows(self, spec) -> tuple[springs.Pins, SignalTable]:
        device, table, motion = self.population.device, SignalTable(), {}
        for one in spec.pin_motion:
            row = strength_signals(one.displacement or components(one.keyframes), table)
            motion |= dict.fromkeys(spec.pinned(one.pins or spec.pins), row)
        points = spec.pinned(spec.pins)
        pins = springs.Pins()
        pins.point = wp.array(points, dtype=int, device=device)
        pins.home = wp.array(np.ascontiguousarray(self.net.points[points].T.reshape(3, -1)), dtype=float, device=device)
        pins.motion = wp.array([motion.get(i, wp.vec3i(-1, -1, -1)) for i in points], dtype=wp.vec3i, device=device)
        return pins, table

    def inverse_masses(self, spec) -> np.ndarray:
        """Return 1/m of every slot [1/kg], 0 for pins."""
        inverse = 1.0 / point_masses(spec, self.net)
        inverse[spec.pinned(spec.pins)] = 0.0
        return spread(inverse, self.population.capacity)

    def stages(self, native: bool) -> Iterator[Stage]:
        """Yield the frame's stages; nothing here waits for the device."""
        yield from self.surroundings.stages()
        when, count, dt = WHEN[self.spec.solver], self.pace.substep_count, self.pace.dt
        for s in range(count):
            if when == WITHIN or (when == HALVES and s == 0):
                yield from self.forces(s)
            if when == HALVES and s == 0:
                yield self._kick(0.5 * dt)
            yield self._advance(s)
            yield from self._hold(s)
            if when != WITHIN:
                yield from self.forces(s + 1)
                yield self._kick(0.5 * dt if when == HALVES and s == count - 1 else dt)  # the two halves that meet are one
        yield from self.points.stages(self._clock)

    def _advance(self, s: int) -> Stage:
        """Return the stage that moves every point through substep s."""
        plain, loop = self.method.kernels(self.surroundings)
        inputs = (substep_of(self.pace, s), self._clock, self.surroundings.row, self.particles, self.population.counters)
        return Stage("advance", plain, self.population.capacity, inputs, loop)

    def _kick(self, h: float) -> Stage:
        """Return the stage in which the springs act for a time h."""
        inputs = (h, len(self.net.points), self._opening, self._clock, self.internal, self.particles.velocity)
        return Stage("springs", springs.kick_points, self.population.capacity, inputs)

    def _hold(self, s: int) -> Iterator[Stage]:
        """Yield the stage that puts the pins where they belong at the end of substep s."""
        count = self._pins.point.shape[0]
        if count:
            inputs = (s, self.pace.dt, self._start_time, self._pins, self.particles.position, self.particles.velocity)
            yield Stage("pins", springs.project_pins, count, inputs)

    @property
    def load(self) -> int:
        """How many particles that move alone are about as much work: it decides between one core and all."""
        return len(self.net.points)  # more work each, but in as many pieces as there are substeps

    def frame(self, index: int) -> SystemFrame:
        """Return what observers see of the present frame."""
        population = self.population
        return SystemFrame(
            population.host,
            tuple(population.fields),
            self.points.pack,
            lambda: population.counter("live"),
            index,
            self._fps,
            {"springs": self.net.springs, "triangles": self.net.triangles},
        )

    def change(self, spec, scene: Scene, environment: Environment) -> None:
        """Take the numbers of another spec of the same structure, in place; the environment has changed already."""
        self.spec, self._scene = spec, scene
        self.surroundings.change(*self._felt(spec, environment))
        self.population.field("mass").assign(spread(point_masses(spec, self.net), self.population.capacity, 1.0))
        self.population.field("radius").fill_(spec.radius)
        self._pin_rows(spec)[1].write(self._pins.signals)
        self.points.change(spec.look)

    @property
    def advice(self) -> Advice:
        """What its springs stand as they are now, and the substeps that it has."""
        return advice_for(self.spec, self._scene, self.net)._replace(chosen=self.pace.substep_count)

    @property
    def remedy(self) -> str:
        """What to try where it blows up."""
        advice = self.advice
        if advice.least > advice.chosen:
            stand = f"its springs stand {advice.longest:.3g} s"
            asked = self.spec.substeps or self._scene.time.substeps
            other = "; auto counted before a number was changed" if asked == "auto" else ", or auto"
            return f"try substeps: {advice.least} for this system{other}: {stand}; or weaker springs, more mass"
        return f"try substeps: {2 * advice.chosen} for this system, or weaker forces" if advice.least else str(advice)

    def reset(self) -> None:
        """Put the network back to where it started."""
        self.population.restore(self._start)

    def statistics(self) -> dict[str, float]:
        """Return what there is to tell besides counts and kinetic energy."""
        return {"elastic_energy": self.energy()}

    def save(self) -> dict[str, np.ndarray]:
        """Return a copy of the full state."""
        return self.population.save()

    def restore(self, state: dict[str, np.ndarray]) -> None:
        """Take back a state made by save()."""
        self.population.restore(state)


def thickened(row: Collider, thickness: float) -> Collider:
    """Return a collider's row grown by a thickness [m] on the side where points may be; a mesh becomes one with two sides."""
    grown = Collider()
    for name in Collider.vars:
        setattr(grown, name, getattr(row, name))
    if row.kind == BOX:
        grown.half = wp.vec3(*(max(edge + (-thickness if row.inside else thickness), 1e-6) for edge in row.half))
    elif thickness:
        grown.radius = max(row.radius + (-thickness if row.inside else thickness), 1e-6)
    return grown


def spread(values: np.ndarray, capacity: int, rest: float = 0.0) -> np.ndarray:
    """Return values (…, n) as float32 (…, capacity), the columns beyond n filled with `rest`."""
    array = np.full((*values.shape[:-1], capacity), rest, np.float32)
    array[..., : values.shape[-1]] = values
    return array
