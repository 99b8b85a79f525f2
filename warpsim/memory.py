"""Memory of a scene: estimated before anything is allocated, because the system grants what it does not have and kills later."""

import os

from warpsim.footprint import Footprint, footprints, scene_tables
from warpsim.scene import Scene, SceneError
from warpsim.scene.flocks import Flock
from warpsim.scene.springs import Network

LAYOUT_PER_POINT, LAYOUT_PER_SPRING = 100, 400  # bytes on the host while a network is laid out and advised, before the device has it
GIB = 1 << 30


class MemoryLimitError(SceneError):
    """The scene needs more memory than the machine has free, or than its own limit allows."""


def memory_of(scene: Scene, on_gpu: bool = False) -> dict[str, Footprint]:
    """Return what each system of a scene takes, by name.

    Raises MemoryLimitError where there is no room even for the layout of a network, SceneError for a file that cannot be used.
    """
    return footprints(scene, network_advice(scene), on_gpu)


def estimate_memory(scene: Scene, on_gpu: bool = False) -> int:
    """Return the bytes that a simulation of the scene takes, on a GPU those of the GPU alone."""
    systems = memory_of(scene, on_gpu).values()
    return scene_tables(scene) + sum(one.device.total() if on_gpu else one.total for one in systems)


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


def check_memory(scene: Scene, free: int, on_gpu: bool = False) -> None:
    """Raise MemoryLimitError if the scene needs more than `free` bytes, of a GPU those there, or than its limits.memory."""
    needed = estimate_memory(scene, on_gpu)
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
