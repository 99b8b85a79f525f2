"""Memory of a scene: estimated before anything is allocated, because the system grants what it does not have and kills later."""

import math
import os

from warpsim.scene import Scene, SceneError
from warpsim.scene.assets import assets_of
from warpsim.scene.events import events_of, has_colors
from warpsim.scene.flocks import Flock
from warpsim.scene.forces import felt_pairs
from warpsim.scene.layers import longest_list
from warpsim.scene.obstacles import answers
from warpsim.scene.pacing import is_adaptive, substep_count
from warpsim.scene.particles import MULTISTEP_SOLVERS
from warpsim.scene.springs import Network

BYTES_PER_PARTICLE = 60  # fields (52), flag of the living, and the place in a snapshot's index; a test holds it to the population's own
BYTES_PER_PRIMITIVE = 384  # one row of a table of flow or forces
BYTES_PER_COLLIDER = 208  # one row of a table of colliders
BYTES_PER_EVENT = 68  # a row of the log of a kind of event, and its place in the prefix sum
BYTES_PER_NEIGHBOR = 80  # the grid, places in its order, and what neighbors do
TABLE_PER_FILE = 8  # bytes of a mesh's table per byte of its file: 44 and more per triangle, of which a binary file spends 19
BYTES_PER_POINT = 40  # internal acceleration and inverse mass of a network's point, and where a substep found it
BYTES_PER_BOID = 120  # the grid, places and velocities in its order, steering, where a substep found it
BYTES_PER_SEEN = 56  # of one whom other flocks see: the grid, places and velocities as the frame began
BYTES_PER_SPRING = 32  # its ends and three numbers, as frames and energies have them
BYTES_PER_LISTED = 64  # of one whose ends gather it from lists: entries for both, and those of a slice that are void
SOLVER_BYTES = {"implicit_euler": (120, 72), "xpbd": (4, 28)}  # what a solver keeps of a network: per point, per spring
SOLVER_BYTES |= dict.fromkeys(("rk4", "heun", *MULTISTEP_SOLVERS), (60, 0))
BYTES_PER_BREAKABLE = 64  # of a spring that may tear: in the table, its entries, whether it is torn, now and in kept states
LAYOUT_PER_POINT, LAYOUT_PER_SPRING = 100, 400  # bytes on the host while a network is laid out and advised, before the device has it
BYTES_PER_LIMITED = 48  # of a spring whose strain is limited: in the table, its place and its pull, now and in kept states
BYTES_PER_VERTEX = 24  # at least, of a mesh file
BYTES_PER_LAYER_POINT = 80  # of a sheet that meets itself, without its lists: places, pushes, counts
BYTES_PER_SEGMENT = 40  # a run of births within a frame
GIB = 1 << 30


class MemoryLimitError(SceneError):
    """The scene needs more memory than the machine has free, or than its own limit allows."""


def estimate_memory(scene: Scene) -> int:
    """Return the bytes a simulation of the scene will take on its device, snapshots for the last good state included."""
    total, advised = 0, network_advice(scene)
    for name, system in scene.systems.items():
        count = advised[name].chosen if name in advised else substep_count(system, scene.time)
        total += (2 * count + 1) * (flow_row_count(scene) + len(scene.forces)) * BYTES_PER_PRIMITIVE
        total += (2 * count + 2) * len(scene.colliders) * BYTES_PER_COLLIDER
        if isinstance(system, Network):
            total += network_memory(system) + layer_memory(system, 1.0 / (scene.time.fps * count))
            continue
        if isinstance(system, Flock):
            seen = any(name in getattr(other, "attends", ()) for other in scene.systems.values())
            total += flock_memory(system) + seen * BYTES_PER_SEEN * (system.count + 1024)
            continue
        more = (24 if system.motion == "ballistic" else 0) + (12 * system.look.trail.points if system.look.trail else 0)
        order = MULTISTEP_SOLVERS.get(system.solver, 0)
        more += 12 * (order - 1) + 4 if order else 0
        more += 4 * is_adaptive(system, scene.time)
        heard = events_of(name, scene.systems)
        more += 4 * has_colors(system) + 8 * bool(heard) + 48 * any(on.event == "collision" for on in heard)
        more += 4 * scene.sticky_to(system)
        total += BYTES_PER_EVENT * system.capacity * len(heard)
        total += BYTES_PER_NEIGHBOR * (system.capacity + 1024) * bool(felt_pairs(scene.forces, system.feels.forces))
        total += 3 * system.capacity * (BYTES_PER_PARTICLE + more)  # the state, that of frame 0, and the last good one
        total += sum(asset.path.stat().st_size * TABLE_PER_FILE for asset in assets_of(system.emitters))
        total += sum(BYTES_PER_SEGMENT * pieces(emitter, scene.time.fps) for emitter in system.emitters)
    total += sum(asset.path.stat().st_size * TABLE_PER_FILE for asset in assets_of(scene.colliders))
    return total + sum(grid_memory(spec, place) for place, spec in enumerate(scene.flow) if spec.type == "grid")


def grid_memory(spec, place: int) -> int:
    """Return the bytes of a grid of velocities, as its file and the device have them. Raises SceneError for a file that holds none."""
    from warpsim.grids import grid_bytes  # imports NumPy

    return 2 * grid_bytes(spec.file.path, f"flow.{place}.file", spec.array)


def network_advice(scene: Scene) -> dict:
    """Return what the springs of each network stand, by name; without networks nothing is imported for it.

    Raises MemoryLimitError where there is no room even for the layout, SceneError for a mesh that cannot be used.
    """
    networks = {name: system for name, system in scene.systems.items() if isinstance(system, Network)}
    if not networks:
        return {}
    check_layout(networks, free_memory())
    from warpsim.stability import scene_advice  # imports NumPy

    return scene_advice(scene)


def check_layout(networks: dict[str, Network], free: int) -> None:
    """Raise MemoryLimitError if the points and springs of networks do not fit into `free` bytes while they are laid out."""
    for name, system in networks.items():
        points, springs = system.point_count or 0, system.spring_count or 0
        needed = LAYOUT_PER_POINT * points + LAYOUT_PER_SPRING * springs
        if needed > free:
            raise MemoryLimitError(
                f"systems.{name}: its {points} points and {springs} springs take about {needed / GIB:.2f} GiB to lay out, "
                f"but {free / GIB:.2f} GiB is free; lower its resolution"
            )


def network_memory(system: Network) -> int:
    """Return the bytes that a network takes on its device, but for its tables; one from a file is guessed by the file's size."""
    size = system.generator.file.path.stat().st_size if system.point_count is None else 0
    points, springs = system.point_count or size // BYTES_PER_VERTEX, system.spring_count or 3 * size // BYTES_PER_VERTEX
    state = BYTES_PER_PARTICLE + (12 * system.look.trail.points if system.look.trail else 0)
    order = MULTISTEP_SOLVERS.get(system.solver, 0)
    state += 12 * (order - 1) + 4 if order else 0
    per_point, per_spring = SOLVER_BYTES.get(system.solver, (0, 0))
    listed = system.type == "springs" or system.tear is not None
    if system.solver == "xpbd" and not listed:  # a sheet needs no list, but where it goes over its springs again it keeps their pulls
        per_point, per_spring = per_point + 48 * ((system.iterations or 1) > 1), 0
    per_spring += BYTES_PER_SPRING + BYTES_PER_LISTED * listed + (0 if system.tear is None else BYTES_PER_BREAKABLE)
    per_spring += 0 if system.strain_limit is None else BYTES_PER_LIMITED
    return 4 * points * state + points * (BYTES_PER_POINT + per_point) + springs * per_spring  # also the state to start anew from


def layer_memory(system: Network, h: float) -> int:
    """Return the bytes that a sheet takes to meet itself, with substeps of h [s]: lists, a grid, places and pushes."""
    layers = system.layers if system.type == "cloth" else None
    if layers is None:
        return 0
    lists = 4 * longest_list(layers.distance, h, system.edges, system.resolution)
    return (lists + BYTES_PER_LAYER_POINT + BYTES_PER_NEIGHBOR) * (system.point_count + 1024)


def flock_memory(system: Flock) -> int:
    """Return the bytes that a flock takes on its device, but for its tables."""
    state = BYTES_PER_PARTICLE + 4 + 12 * (system.coupling is not None) + (12 * system.look.trail.points if system.look.trail else 0)
    return (4 * state + BYTES_PER_BOID) * (system.count + 1024)  # also the state to start anew from


def flow_row_count(scene: Scene) -> int:
    """Return the most rows that the flow's table has: primitives, their images at obstacles, the obstacles' own circulations."""
    shares = {"cylinder": 3, "wall": 2}
    answered = [[shares[obstacle.type] for obstacle in scene.obstacles if answers(obstacle, k, spec)] for k, spec in enumerate(scene.flow)]
    octaves = sum(getattr(primitive, "octaves", 1) - 1 for primitive in scene.flow)
    return sum(map(math.prod, answered)) + octaves + len(scene.obstacles)


def pieces(emitter, fps: float) -> int:
    """Return the most runs of births that an emitter's rate has in one frame: one per interval that touches it."""
    return 0 if emitter.rate is None else math.ceil(1.0 / (fps * (emitter.rate.interval or 1.0 / fps))) + 2


def free_memory() -> int:
    """Return the bytes the machine can still give to this process, 1 << 62 where it does not say."""
    try:
        with open("/proc/meminfo") as lines:
            free = next(int(line.split()[1]) * 1024 for line in lines if line.startswith("MemAvailable"))
    except (OSError, StopIteration):
        try:
            return os.sysconf("SC_AVPHYS_PAGES") * os.sysconf("SC_PAGE_SIZE")
        except (AttributeError, ValueError, OSError):
            return 1 << 62
    return min(free, container_limit())


def container_limit() -> int:
    """Return the bytes that a container's limit still leaves, 1 << 62 without one."""
    try:
        with open("/sys/fs/cgroup/memory.max") as limit, open("/sys/fs/cgroup/memory.current") as current:
            text = limit.read().strip()
            return 1 << 62 if text == "max" else max(0, int(text) - int(current.read()))
    except (OSError, ValueError):
        return 1 << 62


def check_memory(scene: Scene, free: int) -> None:
    """Raise MemoryLimitError if the scene needs more than `free` bytes or than its limits.memory."""
    needed = estimate_memory(scene)
    allowed = free if scene.limits.memory is None else min(free, int(scene.limits.memory * GIB))
    if needed > allowed:
        source = "its limits.memory allows" if allowed < free else "is free"
        capacities = ", ".join(f"{name}: {_size(system)}" for name, system in scene.systems.items())
        raise MemoryLimitError(
            f"the scene needs about {needed / GIB:.2f} GiB, but {allowed / GIB:.2f} GiB {source}; "
            f"lower the capacity of its systems ({capacities})"
        )


def _size(system) -> str:
    """Return how large a system is, in words."""
    if isinstance(system, Flock):
        return f"{system.count} boids"
    if not isinstance(system, Network):
        return str(system.capacity)
    return "a mesh's points" if system.point_count is None else f"{system.point_count} points"
