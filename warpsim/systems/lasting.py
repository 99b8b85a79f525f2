"""Lasting systems: populations whose points neither come nor go, and whose motion begins at the end of the opening frame."""

from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator, Mapping
from functools import cached_property, partial

import numpy as np
import warp as wp

from warpsim.environment import Environment, Surroundings
from warpsim.frame import SystemFrame
from warpsim.keeping import KeptArray, kept
from warpsim.kernels import emission, integration, point_loops, points
from warpsim.kernels.collider import BOUNCE, BOX, Collider
from warpsim.kernels.environment import KILL, RESET
from warpsim.launch import Stage
from warpsim.population import FIELDS, Field, Population
from warpsim.scene import Scene
from warpsim.systems.pairs import substep_of
from warpsim.systems.points import PointPacker

FOREVER = 1.0e30  # [s]: a point's lifetime


class LastingSystem(ABC):
    """A population of fixed size: where its points start, what they feel, the answer to colliders and faults, its state.

    place, velocity: (n, 3) [m], [m/s] at the start; mass: (n,) [kg]; count: substeps per frame.
    """

    resolves = False
    """Whether resolve() leads points past colliders and notes who left the world; else the stages that move them do so themselves."""

    def __init__(
        self,
        name: str,
        spec,
        scene: Scene,
        environment: Environment,
        clock: wp.array,
        count: int,
        place: np.ndarray,
        velocity: np.ndarray,
        mass: np.ndarray,
        more: dict[str, Field] | None = None,
    ):
        self.name, self.spec, self.scene, self.clock, self._fps, self.point_count = name, spec, scene, clock, scene.time.fps, len(place)
        self.device = environment.device
        self.population = Population(max(1, len(place)), FIELDS | (more or {}) | PointPacker.fields(spec.look), self.device)
        self.opening = int(clock.numpy()[0]) + 1  # number of the first frame; the motion begins at its end
        self.surroundings = Surroundings(environment, self._felt(spec, environment), 2 * count + 1, 0.5 / (self._fps * count))
        self.pace = integration.Pace()
        self.pace.dt, self.pace.fps, self.pace.substep_count = 1.0 / (scene.time.fps * count), scene.time.fps, count
        self._fill(spec, place, velocity, mass)
        self.particles = self.population.view()
        self.points = PointPacker(self.population, self.particles, spec.look, scene.time.fps)

    def _fill(self, spec, place: np.ndarray, velocity: np.ndarray, mass: np.ndarray) -> None:
        """Put every point where it starts."""
        capacity, population = self.population.capacity, self.population
        resting = {"lifetime": FOREVER, "radius": spec.radius, "birth_frame": self.opening}
        for key, value in resting.items():
            population.field(key).fill_(value)  # the empty slots too: a loop computes them and stores nothing
        population.field("position").assign(spread(place.T, capacity))
        population.field("velocity").assign(spread(velocity.T, capacity))
        population.field("mass").assign(spread(mass, capacity, 1.0))
        numbers = np.zeros((2, capacity), np.uint32)
        numbers[0, : self.point_count] = np.arange(self.point_count)
        population.field("id").assign(numbers)
        population.alive.fill_(1)
        counters = np.zeros(emission.COUNTER_COUNT, np.int64)
        counters[[emission.LIVE, emission.ACTIVE, emission.NEXT_ID]] = self.point_count
        population.counters.assign(counters)

    @cached_property
    def internal(self) -> wp.array:
        """What acts within the system on each point, (3, capacity) [m/s²]; made when it is first asked for."""
        return wp.zeros((3, self.population.capacity), dtype=float, device=self.device)

    @cached_property
    def start(self) -> wp.array:
        """Place [m] and velocity [m/s] of each point where a substep began, (6, capacity); made when it is first asked for."""
        return wp.zeros((6, self.population.capacity), dtype=float, device=self.device)

    def _felt(self, spec, environment: Environment) -> tuple:
        """Return what the points feel. None of them is ever removed: where points would be killed the system starts anew as a whole."""
        row, flow, forces, colliders = environment.felt(spec.feels, spec.coupling)
        row.policy = RESET if row.policy == KILL else row.policy
        return row, flow, forces, [thickened(one, spec.thickness) for one in colliders if one.action == BOUNCE]

    def resolve_contacts(self) -> None:
        """Let begin() and resolve() do their work from now on; before any stage is made. Once is enough."""
        if not self.resolves:
            self.resolves = True
            self._always = wp.ones(1, dtype=int, device=self.device)

    def begin(self) -> Iterator[Stage]:
        """Yield the stage that notes where a substep finds the points, if somebody wants to know; before anything moves."""
        if self.resolves:
            yield Stage("points", points.scatter_start, self.population.capacity, (self.point_count, self.particles, self.start))

    def resolve(self, s: int) -> Iterator[Stage]:
        """Yield the stages that lead the points past colliders since begin(), and note who is not in the world at the frame's end."""
        if not self.resolves:
            return
        count, population, row = self.point_count, self.population, self.surroundings.row
        yield from self.contacts(s, self._always)
        yield from self.confine()
        if s == self.pace.substep_count - 1:
            yield Stage("points", points.mark_faults, population.capacity, (count, row, self.particles, population.counters))

    def confine(self) -> Iterator[Stage]:
        """Yield the stages that bring back, after contacts, who may not leave some part of the world; none, unless a system has one."""
        yield from ()

    def contacts(self, s: int, asked: wp.array) -> Iterator[Stage]:
        """Yield the stage that leads the points past colliders on their way since begin(), if `asked`, on the device, is 1."""
        if self.surroundings.has_colliders:
            moment = (self.point_count, self.opening, substep_of(self.pace, s), self.clock)
            inputs = (*moment, self.surroundings.row, self.start, asked, self.particles, self.population.counters)
            yield Stage("contacts", points.resolve_points, self.population.capacity, inputs, point_loops.resolve_points)

    @abstractmethod
    def stages(self, native: bool) -> Iterator[Stage]:
        """Yield the frame's stages; nothing in them waits for the device."""

    @property
    def load(self) -> int:
        """How many elements there are, with which the work of a frame grows."""
        return self.point_count

    @property
    def topology(self) -> dict[str, np.ndarray] | None:
        """What joins the points, as a frame has it: springs and triangles; None where nothing does."""
        return None

    @property
    def torn(self) -> Callable[[], np.ndarray] | None:
        """What fetches, of each spring, whether it is torn, bool (m,); None where none can be."""
        return None

    def frame(self, index: int) -> SystemFrame:
        """Return what observers see of the present frame."""
        population, fields = self.population, tuple(self.population.fields)
        live = partial(population.counter, "live")
        return SystemFrame(population.host, fields, self.points.pack, live, index, self._fps, self.topology, self.torn)

    def take(self, spec, scene: Scene, environment: Environment, mass: np.ndarray) -> None:
        """Take the numbers of another spec of the same structure, in place; the environment has changed already."""
        self.spec, self.scene = spec, scene
        self.surroundings.change(*self._felt(spec, environment))
        self.population.field("mass").assign(spread(mass, self.population.capacity, 1.0))
        self.population.field("radius").fill_(spec.radius)
        self.points.change(spec.look)

    def arrays(self) -> dict[str, np.ndarray]:
        """Return the full state; on the CPU the arrays themselves."""
        return self.population.arrays()

    def restore(self, state: Mapping[str, KeptArray]) -> None:
        """Take back what arrays() were when they were kept."""
        self.population.restore(state)

    def remember_start(self) -> None:
        """Keep the state as it is for reset(), once it is complete."""
        if self.scene.limits.unstable != "stop":  # else nobody ever asks for it
            self._origin = kept({self.name: self.arrays()})[self.name]

    def reset(self) -> None:
        """Put the system back to where it started."""
        self.restore(self._origin)


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
