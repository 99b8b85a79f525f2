"""Emitters of a particle system as device tables, and the progress of their births."""

import hashlib
import math

import numpy as np
import warp as wp

from warpsim.directions import perpendiculars, rotation_matrix, unit
from warpsim.footprint import pieces
from warpsim.kernels import birth, emission
from warpsim.launch import Stage
from warpsim.population import Population
from warpsim.scene.emitters import Distribution, Emitter, EmitterShape, Velocity
from warpsim.signals import SignalTable, strength_signals
from warpsim.systems.mesh_births import mesh_table

FOREVER = 1.0e300  # [s]
REST = Velocity(direction=(0.0, 1.0, 0.0), cone=0.0, speed=Distribution(mean=0.0))


def random_key(seed: int, system: str, emitter: int) -> wp.vec2ui:
    """Return the 64-bit key of one emitter's random numbers; systems are told apart by name, so that adding one changes no other."""
    digest = hashlib.blake2b(f"{seed}/{system}/{emitter}".encode(), digest_size=8).digest()
    return wp.vec2ui(*np.frombuffer(digest, dtype="<u4").tolist())


def distribution(spec: Distribution) -> emission.Distribution:
    """Make the row of an initial value."""
    row = emission.Distribution()
    row.mean, row.spread, row.law = spec.mean, spec.spread, emission.VALUE_LAWS[spec.law]
    return row


def place(row: emission.Emitter, shape: EmitterShape) -> None:
    """Fill in where particles are born."""
    row.shape = list(birth.SHAPES).index(shape.type)
    row.surface = int(getattr(shape, "fill", "volume") == "surface")
    row.radius = getattr(shape, "radius", 0.0)
    if shape.type == "segment":
        ends = np.array(shape.start), np.array(shape.end)
        row.center, row.half = wp.vec3(*(0.5 * (ends[0] + ends[1]))), wp.vec3(*(0.5 * (ends[1] - ends[0])))
    else:
        row.center = wp.vec3(*shape.center)
    if shape.type == "box":
        row.half = wp.vec3(*(0.5 * edge for edge in shape.size))
    if shape.type == "mesh":
        row.turn = wp.mat33(*(shape.scale * rotation_matrix(shape.rotation)).ravel())
    if shape.type == "disc":
        row.tangent, row.bitangent = (wp.vec3(*side) for side in perpendiculars(unit(shape.normal)))


class ColorTable:
    """Colors of the emitters of a system, one after the other, as rgba bytes."""

    def __init__(self):
        self.words: list[int] = []

    def add(self, colors) -> wp.vec2i:
        """Append an emitter's colors and return where they begin and how many they are."""
        first = len(self.words)
        for color in colors:
            self.words.append(int.from_bytes(bytes(round(255 * part) for part in color), "little"))
        return wp.vec2i(first, len(colors))


def listen(row: emission.Emitter, spec: Emitter, log: int) -> None:
    """Fill in which log an emitter listens to, and what its children inherit."""
    row.log, row.per_event = log, spec.burst[0].count
    row.on_surface = int(spec.on.axes == "surface")
    row.share, row.color_share = spec.on.inherit.velocity, int(spec.on.inherit.color)


def emitter_row(spec: Emitter, key: wp.vec2ui, table: SignalTable, beginning: float, frame_time: float) -> emission.Emitter:
    """Make an emitter's row; `beginning` is the simulation's first moment [s]."""
    row, velocity = emission.Emitter(), spec.velocity or REST
    row.key, row.mean, row.spread, row.log = key, -1, -1, -1
    row.travel = wp.vec3i(-1, -1, -1) if spec.travel is None else strength_signals(spec.travel, table)
    row.start = beginning if spec.start is None else max(beginning, spec.start)
    row.stop, row.interval = FOREVER if spec.stop is None else spec.stop, frame_time
    if spec.rate is not None:
        row.mean, row.spread = table.add(spec.rate.mean), table.add(spec.rate.spread)
        row.count_law, row.interval = emission.COUNT_LAWS[spec.rate.law], spec.rate.interval or frame_time
    place(row, spec.shape)
    row.direction = unit(velocity.direction)
    row.across, row.beyond = (wp.vec3(*side) for side in perpendiculars(row.direction))
    row.cone_cosine = math.cos(math.radians(velocity.cone))
    row.speed, row.lifetime = distribution(velocity.speed), distribution(spec.lifetime)
    row.mass, row.extent = distribution(spec.mass), distribution(spec.radius)
    return row


def burst_rows(specs: tuple[Emitter, ...], beginning: float) -> list[emission.Burst]:
    """Make the rows of all bursts that lie within the simulation; their ordinals are apart from those of the rate."""
    rows = []
    for e, spec in enumerate(specs):
        for number, burst in enumerate(spec.burst if spec.on is None else ()):
            row = emission.Burst()
            row.emitter, row.count, row.at, row.ordinal = e, burst.count, burst.at, (number + 1) << 40
            if burst.at >= beginning:
                rows.append(row)
    return rows


class Emission:
    """The births of one system: tables that stay, progress that moves on. `logs`: of the events that its emitters listen to, in order."""

    def __init__(self, name: str, spec, scene, population: Population, clock: wp.array, logs: list[emission.EventLog]):
        device, self.population, self.name, self._logs = population.device, population, name, logs
        self._meshes = {
            e: mesh_table(emitter.shape, f"systems.{name}.emitters.{e}.shape", device)
            for e, emitter in enumerate(spec.emitters)
            if emitter.shape.type == "mesh"
        }
        rows, table, colors = self._rows(spec, scene)
        bursts = burst_rows(spec.emitters, -scene.time.prewarm)
        self.births, self.plan = emission.Births(), emission.Plan()
        self.births.emitters = wp.array(rows, dtype=emission.Emitter, device=device)
        self.births.bursts = wp.array(bursts, dtype=emission.Burst, device=device)
        self.births.colors = wp.array(colors, dtype=wp.uint32, device=device)
        self.births.logs = wp.array(logs, dtype=emission.EventLog, device=device)
        self.births.signals, self.births.clock = table.tables(device), clock
        self.births.fps, self.births.capacity = scene.time.fps, population.limit
        start = np.zeros(len(rows), dtype=emission.Progress.numpy_dtype())
        start["count"] = -1  # not drawn yet
        self.plan.progress = wp.array(start, dtype=emission.Progress, device=device)
        most = sum(pieces(emitter, scene.time.fps) for emitter in spec.emitters) + len(bursts) + len(logs)
        self.plan.segments = wp.zeros(most, dtype=emission.Segment, device=device)
        self.plan.segment_count = wp.zeros(1, dtype=int, device=device)

    def _rows(self, spec, scene) -> tuple[list[emission.Emitter], SignalTable, list[int]]:
        table, colors = SignalTable(), ColorTable()
        keys = [random_key(scene.seed, self.name, e) for e in range(len(spec.emitters))]
        rows = [
            emitter_row(emitter, key, table, -scene.time.prewarm, 1.0 / scene.time.fps)
            for emitter, key in zip(spec.emitters, keys, strict=True)
        ]
        listening = [(row, emitter) for row, emitter in zip(rows, spec.emitters, strict=True) if emitter.on is not None]
        for log, (row, emitter) in enumerate(listening):
            listen(row, emitter, log)
        for e, table_of_mesh in self._meshes.items():
            rows[e].mesh = table_of_mesh
        for row, emitter in zip(rows, spec.emitters, strict=True):
            row.colors = colors.add(emitter.color)
        return rows, table, colors.words

    def change(self, spec, scene) -> None:
        """Take the numbers of another spec of the same structure, in place."""
        rows, table, colors = self._rows(spec, scene)
        table.write(self.births.signals)
        if rows:
            self.births.emitters.assign(wp.array(rows, dtype=emission.Emitter, device=self.population.device))
        if colors:
            self.births.colors.assign(np.array(colors, dtype=np.uint32))

    def stages(self, targets: emission.Particles, loop: wp.Kernel):
        """Yield the stages that plan and fill in this frame's births."""
        counters = self.population.counters
        yield Stage("plan", emission.plan_births, 1, (self.births, self.plan, counters))
        yield Stage("emit", birth.emit_particles, self.population.capacity, (self.births, self.plan, counters, targets), loop)
