"""Environment: what all systems of a scene share — gravity, flow, forces, colliders — as tables on the device."""

import math
from collections.abc import Iterator, Sequence
from itertools import chain

import numpy as np
import warp as wp

from warpsim.colliders import Colliders
from warpsim.directions import across, unit
from warpsim.grids import VelocityGrid, load_grid
from warpsim.images import CylinderImages, answered, changed
from warpsim.kernels import flow, forces, pairwise
from warpsim.kernels.collider import Collider, sample_colliders
from warpsim.kernels.environment import UNSTABLE_POLICIES, sample_moments
from warpsim.kernels.environment import Environment as EnvironmentRow
from warpsim.kernels.grids import OUTSIDES
from warpsim.kernels.primitive import CORES, FlowPrimitive
from warpsim.launch import Stage
from warpsim.scene import Scene
from warpsim.scene.obstacles import answers
from warpsim.signals import SignalTable, strength_signals

PLASTIC = np.array([0.8191725134, 0.6710436067, 0.5497004779])  # powers of 1/1.2207…: the evenest spread of places in a box
IDENTITY = wp.mat33(1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0)


def still_row(kind: str) -> FlowPrimitive:
    """Make a row of a kind that no signal drives: without strength, where it is, as it is."""
    row = FlowPrimitive()
    row.kind, row.gain, row.turn = list(flow.FLOWS).index(kind), IDENTITY, IDENTITY
    row.signal = row.travel = wp.vec3i(-1, -1, -1)
    row.radius_signal = -1
    return row


def flow_row(spec, table: SignalTable) -> FlowPrimitive:
    """Make a primitive's row: its fields by their names, its strength and its travel as signals."""
    row = still_row(spec.type)
    row.core_radius = 1.0
    if spec.strength_field is None:
        spans = [table.add_program(program) for program in spec.programs]
        row.span = wp.vec4i(*[begin for begin, _ in spans], spans[-1][1])
    else:
        row.signal = strength_signals(getattr(spec, spec.strength_field), table)
    if hasattr(spec, "travel"):
        row.travel = strength_signals(spec.travel, table)
    place_row(row, spec)
    if hasattr(spec, "direction"):
        row.direction = across(spec.axis, spec.direction)
    if spec.type == "doublet":
        row.gain = wp.mat33(*(x for component in row.direction for x in (component, 0.0, 0.0)))  # its moment is strength times direction
    if hasattr(spec, "radius"):
        row.radius_signal = table.add(spec.radius)
    if hasattr(spec, "core"):
        row.core, row.core_radius = CORES[spec.core.model], spec.core.radius or 1.0
    return row


def octave_rows(row: FlowPrimitive, spec) -> list[FlowPrimitive]:
    """Make the rows of a noise, one per octave: half the length, and by Kolmogorov 2^(−1/3) of the speed, 2^(2/3) of the frequency."""
    speeds = 2.0 ** (-np.arange(spec.octaves) / 3.0)
    shares = speeds / np.linalg.norm(speeds)  # octaves are independent: their squares add up
    rows = []
    for octave, share in enumerate(shares):
        length, shift = spec.length / 2**octave, np.modf(octave * PLASTIC)[0]  # no two lattices have a corner in common
        fields = {"length": length, "frequency": spec.frequency * 2.0 ** (2.0 * octave / 3.0), "center": wp.vec3(*(length * shift))}
        rows.append(changed(row, float(share), **fields, seed=(spec.seed + 0x9E3779B9 * octave) % 2**32))
    return rows


def place_row(row: FlowPrimitive, spec) -> None:
    """Put a primitive where it is: its center and axis, or those of its segment, worked out in float64."""
    if getattr(spec, "center", None) is not None:  # a grid's file may know it
        row.center = wp.vec3(*spec.center)
    for name in ("axis", "normal"):
        if hasattr(spec, name):
            row.axis = unit(getattr(spec, name))
    if hasattr(spec, "start"):
        start, end = np.array(spec.start), np.array(spec.end)
        row.center, row.axis = wp.vec3(*(0.5 * (start + end))), unit(end - start)
        row.half_length = 0.5 * math.dist(start, end)


def put_grid(row: FlowPrimitive, spec, grid: VelocityGrid, values: wp.array) -> None:
    """Put a grid where the scene, else its file, has it, and let the row point at its velocities, which the environment keeps alive."""
    size = np.array(grid.size if spec.size is None else spec.size)
    center = np.array(grid.center if spec.center is None else spec.center)
    row.values, row.nodes, row.outside = values, wp.vec3i(*grid.nodes), OUTSIDES[spec.outside]
    row.center = wp.vec3(*(center - 0.5 * size))
    row.inverse_spacing = wp.vec3(*((np.array(grid.nodes) - 1) / size))


def bound_rows(spec, table: SignalTable) -> list[FlowPrimitive]:
    """Make the row of an obstacle's own circulation, if it has one."""
    if spec.type != "cylinder":
        return []
    row = still_row("vortex")
    row.signal = strength_signals(spec.circulation, table)
    return [CylinderImages(spec).own(row)]


def force_row(spec, table: SignalTable) -> forces.ForceField:
    """Make a force field's row."""
    row = forces.ForceField()
    row.kind = list(forces.FORCES).index(spec.type)
    row.law, row.center, row.softening = forces.ATTRACTOR_LAWS[spec.law], wp.vec3(*spec.center), spec.softening
    row.signal = strength_signals(spec.strength, table)
    return row


def law_row(spec, table: SignalTable) -> pairwise.PairLaw:
    """Make the row of a force between particles."""
    row = pairwise.PairLaw()
    row.kind = list(pairwise.PAIR_LAWS).index(spec.law)
    row.radius, row.inverse_radius, row.softening = spec.radius, 1.0 / spec.radius, spec.softening
    row.signal = strength_signals(spec.strength, table)
    return row


class Environment:
    """Master rows of the scene's flow and forces, and the frame's start time, on one device."""

    def __init__(self, scene: Scene, device: str):
        self.scene, self.device = scene, device
        self._solids = Colliders(scene, device)
        self._grids = {}  # by place in the scene's flow: what the file says, and the velocities on the device
        for place, spec in enumerate(scene.flow):
            if spec.type == "grid":
                grid, velocities = load_grid(spec.file.path, f"flow.{place}.file", spec.array)
                self._grids[place] = grid, wp.array(velocities.ravel(), dtype=float, device=device)
        table = self._rows_of(scene)
        self.signals = table.tables(device)
        self._give_programs()
        self.start_time = wp.zeros(1, dtype=wp.float64, device=device)

    def _rows_of(self, scene: Scene) -> SignalTable:
        table = SignalTable()
        self._flow = []  # per primitive: its row, and those of its images
        for place, spec in enumerate(scene.flow):
            row = flow_row(spec, table)
            if place in self._grids:
                put_grid(row, spec, *self._grids[place])
            answering = [obstacle for obstacle in scene.obstacles if answers(obstacle, place, spec)]
            self._flow.append(octave_rows(row, spec) if spec.type == "curl_noise" else answered(row, answering))
        self._bound = [bound_rows(spec, table) for spec in scene.obstacles]
        self._forces = [[] if spec.type == "pairwise" else [force_row(spec, table)] for spec in scene.forces]
        self._laws = [[law_row(spec, table)] if spec.type == "pairwise" else [] for spec in scene.forces]
        self._colliders = self._solids.rows(scene, table)
        return table

    def change(self, scene: Scene) -> None:
        """Take the numbers of another scene of the same structure, in place: addresses stay, so captured graphs stay valid."""
        self.scene = scene
        self._rows_of(scene).write(self.signals)
        self._give_programs()

    def _give_programs(self) -> None:
        """Let the rows of expressions point at the table of programs; the environment keeps it alive."""
        for row in chain(*self._flow):
            row.program = self.signals.program

    def feel(self, feels, coupling, substep_count: int) -> "Surroundings":
        """Return the tables of one system: what it feels, with a moment at every half substep."""
        spacing = 0.5 / (self.scene.time.fps * substep_count)
        return Surroundings(self, self.felt(feels, coupling), 2 * substep_count + 1, spacing)

    def felt(self, feels, coupling) -> tuple[EnvironmentRow, list, list, list]:
        """Return what one system feels: its row but for the tables, the rows of flow, of forces and of colliders."""
        row = EnvironmentRow()
        row.gravity = wp.vec3(*self.scene.gravity) if feels.gravity else wp.vec3()
        row.alpha, row.viscosity = getattr(coupling, "alpha", 0.0), getattr(coupling, "viscosity", 0.0)
        row.tracer = int(coupling == "tracer")
        row.extent, row.policy = self.scene.limits.extent, UNSTABLE_POLICIES[self.scene.limits.unstable]
        felt = False if coupling is None else feels.flow
        groups = [*pick(self.scene.flow, self._flow, felt), *pick(self.scene.obstacles, self._bound, felt, numbered=False)]
        felt_forces = [*chain(*pick(self.scene.forces, self._forces, feels.forces))]
        return row, [*chain(*groups)], felt_forces, pick(self.scene.colliders, self._colliders, feels.colliders)

    def laws(self, feels) -> list:
        """Return the rows of the forces between particles that act within one system."""
        return [*chain(*pick(self.scene.forces, self._laws, feels.forces))]

    def everything(self) -> tuple[EnvironmentRow, list, list, list]:
        """Return what a probe feels: the whole flow."""
        return EnvironmentRow(), [*chain(*self._flow, *self._bound)], [], []

    def probe(self) -> "Surroundings":
        """Return tables of the whole flow with a single moment, for probes; their time is their own."""
        return Surroundings(self, self.everything(), 1, 0.0, wp.zeros(1, dtype=wp.float64, device=self.device))


def pick(specs: Sequence, rows: list, chosen, numbered: bool = True) -> list:
    """Return what of the rows a system feels: all, none, or those named by name or, where the list is the numbered one, place."""
    if isinstance(chosen, bool):
        return rows if chosen else []
    pairs = enumerate(zip(specs, rows, strict=True))
    return [row for place, (spec, row) in pairs if (numbered and place in chosen) or spec.name in chosen]


class Surroundings:
    """Tables (moments, rows) of what one system feels in a frame; `row` is the one-row array that its kernels take."""

    def __init__(self, environment: Environment, felt: tuple, moment_count: int, spacing: float, start_time=None):
        device, (row, flow_rows, force_rows, collider_rows) = environment.device, felt
        self.start_time = environment.start_time if start_time is None else start_time
        felt_kinds = {list(flow.FLOWS)[row.kind] for row in flow_rows}
        self.long_flows = tuple(name for name in flow.LONG_FLOWS if name in felt_kinds)
        self._signals, self._moment_count, self._spacing = environment.signals, moment_count, spacing
        self._flow = wp.array(flow_rows, dtype=FlowPrimitive, device=device)
        self._forces = wp.array(force_rows, dtype=forces.ForceField, device=device)
        row.flow = wp.zeros((moment_count, len(flow_rows)), dtype=FlowPrimitive, device=device)
        row.forces = wp.zeros((moment_count, len(force_rows)), dtype=forces.ForceField, device=device)
        self._colliders = wp.array(collider_rows, dtype=Collider, device=device)
        row.colliders = wp.zeros((moment_count, len(collider_rows)), dtype=Collider, device=device)
        self.flow, self.forces, self.colliders = row.flow, row.forces, row.colliders
        self.row = wp.array([row], dtype=EnvironmentRow, device=device)

    def change(self, row: EnvironmentRow, flow_rows: list, force_rows: list, collider_rows: list) -> None:
        """Take other numbers for the same rows, in place."""
        row.flow, row.forces, row.colliders = self.flow, self.forces, self.colliders
        self.row.assign(wp.array([row], dtype=EnvironmentRow, device=self.row.device))
        for table, rows in ((self._flow, flow_rows), (self._forces, force_rows), (self._colliders, collider_rows)):
            if rows:
                table.assign(wp.array(rows, dtype=table.dtype, device=table.device))

    @property
    def has_colliders(self) -> bool:
        """Whether there is anything to bump into."""
        return self.colliders.shape[1] > 0

    def stages(self) -> Iterator[Stage]:
        """Yield the stages that fill the tables for the frame under way."""
        inputs = (self.start_time, self._spacing, self._signals, self._flow, self._forces, self.flow, self.forces)
        yield Stage("environment", sample_moments, self._moment_count, inputs)
        if self.has_colliders:
            inputs = (self.start_time, self._spacing, self._signals, self._colliders, self.colliders)
            yield Stage("colliders", sample_colliders, self._moment_count, inputs)
