"""Footprint: the bytes that a scene takes, system by system and part by part, told before anything is allocated.

tests/simulation/test_footprint.py holds it to the arrays of simulations, `python -m benchmarks.memory` to the memory of processes.
"""

import math
from collections import Counter
from dataclasses import dataclass, field

from warpsim.scene import Scene
from warpsim.scene.assets import assets_of
from warpsim.scene.events import events_of, has_colors
from warpsim.scene.flocks import Flock
from warpsim.scene.forces import felt_pairs
from warpsim.scene.layers import longest_list
from warpsim.scene.obstacles import answers
from warpsim.scene.pacing import is_adaptive, substep_count
from warpsim.scene.particles import MULTISTEP_SOLVERS
from warpsim.scene.springs import Network

MOST_KEPT = 16  # states to go back to
MOST_KEPT_BYTES = 1 << 26  # of them all, where two do not need more
KEPT = "kept states"  # the part of states to go back to
ROWS = 13  # words of a particle: place, velocity, birth (2), lifetime, mass, radius, identity (2)
BYTES_PER_PARTICLE = 4 * ROWS + 4  # and the flag of the living
BLOCK = 64  # capacities are multiples of it
BYTES_PER_PRIMITIVE = 384  # one row of a table of flow or forces
BYTES_PER_COLLIDER = 208  # one row of a table of colliders
BYTES_PER_SEGMENT = 40  # a run of births within a frame
BYTES_PER_EVENT = 40  # place, velocity, time, lineage and number of an event in the log of its kind
TABLE_PER_FILE = 8  # bytes of a mesh's table per byte of its file: 44 and more per triangle, of which a binary file spends 19
BYTES_PER_SPRING = 8  # its ends, on the host
BYTES_PER_ROW = 20  # of a spring in the table of those that solvers and parts go through one by one: ends, three numbers
BYTES_PER_LISTED = 56  # of one whose ends gather it from lists: entries for both, on the device and the host, and some that are void
SOLVER_BYTES = {"implicit_euler": (126, 62), "xpbd": (4, 8)}  # what a solver keeps of a network: per point, per spring
SOLVER_BYTES |= dict.fromkeys(("rk4", "heun", *MULTISTEP_SOLVERS), (60, 0))
BYTES_PER_BREAKABLE = 12  # of a spring that may tear: its entries, whether it is torn
BYTES_PER_LIMITED = 8  # of a spring whose strain is limited: its place and its pull
BYTES_PER_VERTEX = 24  # at least, of a mesh file
BYTES_PER_LAYER_POINT = 80  # of a sheet that meets itself, without its lists: places, pushes, counts
LEAST_BITS, MOST_BITS, MOST_CORES = 10, 28, 64  # of the grid's buckets, and of the cores that count who is in them


@dataclass
class Footprint:
    """Bytes that one system takes."""

    unit: str
    """What it is made of: particle, boid, vertex or point."""
    count: int
    """How many it may have."""
    device: Counter = field(default_factory=Counter)
    """Bytes by part, where the system is simulated."""
    host: Counter = field(default_factory=Counter)
    """Bytes by part, on the host wherever that is."""
    state: int = 0
    """Bytes of a state that is kept to go back to, at most."""
    first: int = 0
    """Bytes of the first one."""
    states: int = 0
    """How many are kept at most."""

    @property
    def parts(self) -> dict[str, int]:
        """Bytes by part; no empty ones."""
        return {name: size for name, size in {**self.device, **self.host}.items() if size}

    @property
    def total(self) -> int:
        """Bytes in all."""
        return self.device.total() + self.host.total()

    @property
    def each(self) -> float:
        """Bytes of one particle, boid, vertex or point, but for the kept states."""
        return (self.total - self.host[KEPT]) / max(self.count, 1)


def footprints(scene: Scene, advised: dict, on_gpu: bool = False) -> dict[str, Footprint]:
    """Return what each system takes, by name; `advised` says how many substeps networks have (memory.network_advice)."""
    result = {}
    for name, system in scene.systems.items():
        substeps = advised[name].chosen if name in advised else substep_count(system, scene.time)
        if isinstance(system, Network):
            result[name] = of_network(scene, system, substeps, on_gpu)
        elif isinstance(system, Flock):
            result[name] = of_flock(scene, name, on_gpu)
        else:
            result[name] = of_particles(scene, name, on_gpu)
        result[name].device["tables"] += tables(scene, substeps)
    keep(result, unstable=scene.limits.unstable != "stop")
    return result


def keep(systems: dict[str, Footprint], unstable: bool) -> None:
    """Count the states that are kept: the first, and as many as there is room for; of systems that start anew after a fault one more."""
    first, state = sum(one.first for one in systems.values()), sum(one.state for one in systems.values())
    later = min(MOST_KEPT - 1, max(1, (MOST_KEPT_BYTES - first) // max(state, 1)))
    for one in systems.values():
        origin = unstable and one.unit != "particle"
        one.states, one.host[KEPT] = 1 + later + origin, one.first + (later + origin) * one.state


def rounded(count: int) -> int:
    """Return the capacity of so many particles."""
    return -(-max(count, 1) // BLOCK) * BLOCK


def trail_bytes(system) -> int:
    """Return the bytes of a particle's trail."""
    return 12 * system.look.trail.points if system.look.trail else 0


def history_bytes(solver: str | None) -> int:
    """Return the bytes of past drives that a multistep method keeps of a particle, and of their number."""
    order = MULTISTEP_SOLVERS.get(solver, 0)
    return 12 * (order - 1) + 4 if order else 0


def grid_bytes(capacity: int, rows: int, on_gpu: bool) -> int:
    """Return the bytes of a grid of neighbors with so many sorted rows, and of its sort."""
    bits = min(max(LEAST_BITS, (2 * capacity - 1).bit_length()), MOST_BITS)
    buckets = 4 * ((1 << bits) + 2)
    tallies = buckets if on_gpu else 4 * MOST_CORES * ((1 << bits // 2) + 1)
    return (4 + 4 + 4 * rows + 8) * capacity + buckets + tallies


def of_particles(scene: Scene, name: str, on_gpu: bool) -> Footprint:
    """Return what a system of particles takes."""
    system = scene.systems[name]
    capacity, heard = rounded(system.capacity), events_of(name, scene.systems)
    one = Footprint("particle", system.capacity)
    impacts, trail, history = any(on.event == "collision" for on in heard), trail_bytes(system), history_bytes(system.solver)
    more = 24 * (system.motion == "ballistic") + 4 * is_adaptive(system, scene.time) + 4 * has_colors(system)
    more += 8 * bool(heard) + 48 * impacts + 4 * scene.sticky_to(system)
    one.device["state"] = (BYTES_PER_PARTICLE + more) * capacity
    one.device["history"], one.device["trails"] = history * capacity, trail * capacity
    row = BYTES_PER_EVENT + 4 * has_colors(system) + 8 * on_gpu
    one.device["events"] = sum((row + 12 * (on.event == "collision")) * capacity for on in heard)
    if felt_pairs(scene.forces, system.feels.forces):
        one.device["neighbors"] = grid_bytes(capacity, 3, on_gpu)
        one.device["forces"] = 12 * capacity
    births = sum(BYTES_PER_SEGMENT * pieces(emitter, scene.time.fps) for emitter in system.emitters)
    one.device["births"] = births + sum(asset.path.stat().st_size * TABLE_PER_FILE for asset in assets_of(system.emitters))
    words = BYTES_PER_PARTICLE - 4 + more + history + trail
    if on_gpu:
        one.device["removal"] = (4 + words) * capacity
    kept = words - 4 * even_rows(system)
    one.state, one.first = kept * system.capacity, kept * first_count(scene, system)
    return one


def even_rows(system) -> int:
    """Return how many rows are one number for all particles: the high word of identities, and what all emitters give alike."""
    alike = [{getattr(emitter, key) for emitter in system.emitters} for key in ("mass", "radius", "lifetime")]
    return 1 + sum(len(values) == 1 and next(iter(values)).spread == 0.0 for values in alike)


def first_count(scene: Scene, system) -> int:
    """Return how many particles frame 0 has, at most: bursts until then, and whatever a prewarm brings."""
    if scene.time.prewarm:
        return system.capacity
    return min(system.capacity, sum(burst.count for emitter in system.emitters for burst in emitter.burst if burst.at <= 0.0))


def of_flock(scene: Scene, name: str, on_gpu: bool) -> Footprint:
    """Return what a flock takes."""
    system = scene.systems[name]
    capacity, carried, trail = rounded(system.count), 12 * (system.coupling is not None), trail_bytes(system)
    one = Footprint("boid", system.count)
    one.device["state"], one.device["trails"] = (BYTES_PER_PARTICLE + 4 + carried) * capacity, trail * capacity
    seen = any(name in getattr(other, "attends", ()) for other in scene.systems.values())
    one.device["neighbors"] = (1 + seen) * grid_bytes(capacity, 6, on_gpu)
    one.device["forces"] = 12 * capacity
    one.device["contacts"] = 24 * capacity * bool(scene.colliders and system.feels.colliders)
    one.state = one.first = (28 + 4 + carried + trail) * system.count  # place, velocity, number; neighbors; alike is all else
    return one


def of_network(scene: Scene, system: Network, substeps: int, on_gpu: bool) -> Footprint:
    """Return what a network takes; one from a file is guessed by the file's size."""
    size = system.generator.file.path.stat().st_size if system.point_count is None else 0
    points, springs = system.point_count or size // BYTES_PER_VERTEX, system.spring_count or 3 * size // BYTES_PER_VERTEX
    one = Footprint("vertex" if system.type == "cloth" else "point", points)
    capacity, trail, history = rounded(points), trail_bytes(system), history_bytes(system.solver)
    one.device["state"] = BYTES_PER_PARTICLE * capacity
    one.device["history"], one.device["trails"] = history * capacity, trail * capacity
    one.device["forces"] = 16 * capacity
    per_point, per_spring = SOLVER_BYTES.get(system.solver, (0, 0))
    layers = system.layers if system.type == "cloth" else None
    if not SOLVER_BYTES.get(system.solver, (0, 0))[0] >= 60:  # else counted with the solver
        constrained = system.strain_limit is not None or layers is not None
        met = system.solver == "xpbd" and bool(scene.colliders and system.feels.colliders)
        one.device["contacts"] = 24 * capacity * (constrained or met)
    listed = system.type == "springs" or system.tear is not None
    if system.solver == "xpbd" and not listed:  # a sheet needs no list, but where it goes over its springs again it keeps their pulls
        per_point, per_spring = per_point + 48 * ((system.iterations or 1) > 1), 0
    one.device["solver"] = per_point * capacity + per_spring * springs
    tabled = system.solver == "implicit_euler" or (system.solver == "xpbd" and listed) or system.tear is not None
    tabled = tabled or system.strain_limit is not None or bool(getattr(system, "muscles", ()))
    broken = 0 if system.tear is None else BYTES_PER_BREAKABLE
    limited = 0 if system.strain_limit is None else BYTES_PER_LIMITED
    one.device["springs"] = springs * (BYTES_PER_LISTED * listed + BYTES_PER_ROW * tabled + broken + limited)
    if layers is not None:
        rows = longest_list(layers.distance, 1.0 / (scene.time.fps * substeps), system.edges, system.resolution)
        one.device["layers"] = (4 * rows + BYTES_PER_LAYER_POINT) * capacity + grid_bytes(capacity, 3, on_gpu)
    line = system.type == "springs" and (system.generator is None or system.generator.type in ("chain", "ring"))
    one.host["layout"] = 24 * points + BYTES_PER_SPRING * springs + 24 * points * (not line)  # two triangles for each point of a sheet
    pulls = 4 * springs * (system.strain_limit is not None) + 4 * springs * (system.tear is not None)
    one.state = one.first = (32 + history + trail) * points + pulls  # place, velocity, mass, number; alike is all else
    return one


def tables(scene: Scene, substeps: int) -> int:
    """Return the bytes of what a system feels at each moment of a frame: flow, forces, colliders."""
    fields = (2 * substeps + 1) * (flow_row_count(scene) + len(scene.forces)) * BYTES_PER_PRIMITIVE
    return fields + (2 * substeps + 2) * len(scene.colliders) * BYTES_PER_COLLIDER


def flow_row_count(scene: Scene) -> int:
    """Return the most rows that the flow's table has: primitives, their images at obstacles, the obstacles' own circulations."""
    shares = {"cylinder": 3, "wall": 2}
    answered = [[shares[obstacle.type] for obstacle in scene.obstacles if answers(obstacle, k, spec)] for k, spec in enumerate(scene.flow)]
    octaves = sum(getattr(primitive, "octaves", 1) - 1 for primitive in scene.flow)
    return sum(map(math.prod, answered)) + octaves + len(scene.obstacles)


def pieces(emitter, fps: float) -> int:
    """Return the most runs of births that an emitter's rate has in one frame: one per interval that touches it."""
    return 0 if emitter.rate is None else math.ceil(1.0 / (fps * (emitter.rate.interval or 1.0 / fps))) + 2


def scene_tables(scene: Scene) -> int:
    """Return the bytes of what all systems share: meshes of colliders, grids of velocities as their files and the device have them."""
    total = sum(asset.path.stat().st_size * TABLE_PER_FILE for asset in assets_of(scene.colliders))
    return total + sum(velocity_grid_bytes(spec, place) for place, spec in enumerate(scene.flow) if spec.type == "grid")


def velocity_grid_bytes(spec, place: int) -> int:
    """Return the bytes of a grid of velocities. Raises SceneError for a file that holds none."""
    from warpsim.grids import grid_bytes  # imports NumPy

    return 2 * grid_bytes(spec.file.path, f"flow.{place}.file", spec.array)
