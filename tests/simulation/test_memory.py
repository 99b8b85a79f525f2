"""Memory is estimated before it is taken."""

import numpy as np
import pytest
import warp as wp

from tests.simulation.networks import network
from tests.simulation.scenes import scene
from warpsim import Scene, SceneError, Simulation, memory
from warpsim.kernels.forces import ForceField
from warpsim.kernels.primitive import FlowPrimitive
from warpsim.population import FIELDS
from warpsim.systems.parts import SelfCollision


def test_the_estimate_knows_the_sizes_of_the_real_tables():
    assert memory.BYTES_PER_PARTICLE >= 4 * (sum(field.rows for field in FIELDS.values()) + 1)  # and the flag of the living
    assert max(FlowPrimitive.numpy_dtype()["itemsize"], ForceField.numpy_dtype()["itemsize"]) <= memory.BYTES_PER_PRIMITIVE


def test_the_estimate_counts_what_events_need():
    """As much as the arrays of a simulation: rows of who is listened to, and the log of each kind of event."""

    def scene_with(emitter):
        systems = {"p": {"type": "particles", "capacity": 6400}, "c": {"type": "particles", "capacity": 64, "emitters": [emitter]}}
        return Scene.model_validate({"name": "x", "colliders": [{"type": "plane"}], "systems": systems})

    heard, deaf = scene_with({"on": {"event": "collision", "of": "p"}, "burst": {"count": 1}}), scene_with({"burst": {"count": 1}})
    parent = Simulation(heard, device="cpu").systems["p"]
    log = parent.events.log(heard.systems["c"].emitters[0].on)
    rows = parent.population.slab.shape[0] - sum(field.rows for field in FIELDS.values())
    taken = 3 * 4 * 6400 * rows  # the state, that of frame 0, and the last good one
    taken += sum(array.capacity for array in (log.position, log.velocity, log.since, log.lineage, log.number, log.normal, log.tint))
    assert taken <= memory.estimate_memory(heard) - memory.estimate_memory(deaf) <= 1.5 * taken


def test_a_scene_beyond_its_own_limit_is_refused_before_allocation():
    greedy = scene({"capacity": 2**27}, limits={"memory": 1.0})
    with pytest.raises(SceneError, match=r"needs about 22\.\d+ GiB, but 1.00 GiB its limits.memory allows"):
        Simulation(greedy, device="cpu")


def test_a_scene_beyond_the_machine_is_refused(monkeypatch):
    monkeypatch.setattr("warpsim.simulation.free_memory", lambda: 1 << 20)
    with pytest.raises(memory.MemoryLimitError, match="is free"):
        Simulation(scene(), device="cpu")


def test_intervals_far_shorter_than_a_frame_are_counted():
    tiny = scene(emitter={"rate": {"mean": 1.0, "interval": 1e-5}}, time={"fps": 1e-6})
    with pytest.raises(memory.MemoryLimitError):
        Simulation(tiny, device="cpu")


def test_the_machine_says_how_much_is_free():
    assert 1 << 24 < memory.free_memory() <= 1 << 62


@pytest.mark.parametrize(("solver", "past"), [("heun", 0), ("adams_bashforth_2", 1), ("adams_bashforth_3", 2), ("abm_pece_4", 3)])
def test_past_drives_are_counted(solver, past):
    """Three floats for each of them and a count, in the state and in two snapshots."""
    capacity = 64_000
    more = memory.estimate_memory(scene({"capacity": capacity, "solver": solver})) - memory.estimate_memory(scene({"capacity": capacity}))
    assert more == 3 * capacity * (12 * past + 4 * bool(past))


@pytest.mark.parametrize(
    "generator",
    [
        {"type": "chain", "count": 5000, "start": [0, 0, 0], "end": [9, 0, 0]},
        {"type": "block", "resolution": [16, 16, 16], "size": [1, 1, 1]},
    ],
)
def test_what_implicit_euler_keeps_is_counted(generator):
    """As much as its arrays: the system's vectors, and the woven springs, of which slices at a border have void entries."""
    keys = {"generator": generator, "stiffness": 1.0}
    simple, implicit = network(**keys), network(**keys, solver="implicit_euler")
    system = Simulation(implicit, device="cpu").systems["s"]
    structs = (system.solver._weave, system.solver._linear, system.table)
    arrays = {id(a): a for struct in structs for name in struct._cls.vars if isinstance(a := getattr(struct, name), wp.array)}
    taken = sum(array.capacity for array in arrays.values())
    counted = memory.estimate_memory(implicit) - memory.estimate_memory(simple)
    assert 0.8 * taken <= counted <= 1.5 * taken


@pytest.mark.parametrize("iterations", [1, 3])
@pytest.mark.parametrize("layout", ["chain", "cloth"])
def test_what_xpbd_keeps_is_counted(layout, iterations):
    """Springs: the table, their order and pulls. Of a sheet the pulls alone, if there is more than one pass."""
    chain = {"generator": {"type": "chain", "count": 5000, "start": [0, 0, 0], "end": [9, 0, 0]}, "stiffness": 1.0}
    cloth = {"type": "cloth", "resolution": [80, 80], "edges": [[1, 0, 0], [0, 1, 0]], "structural": {"stiffness": 10}}
    keys = {"chain": chain, "cloth": cloth}[layout]
    simple, xpbd = network(**keys), network(**keys, solver="xpbd", iterations=iterations)
    system = Simulation(xpbd, device="cpu").systems["s"]
    projection, memory_of_pulls = system.solver._projection, 4 * (5000 - 1 if layout == "chain" else 12 * 6400) * (iterations > 1)
    structs = (projection, system.table) if layout == "chain" else (projection,)
    arrays = {id(a): a for struct in structs for name in struct._cls.vars if isinstance(a := getattr(struct, name), wp.array)}
    taken = sum(array.capacity for array in arrays.values() if array is not system.inverse_mass) + memory_of_pulls
    counted = memory.estimate_memory(xpbd) - memory.estimate_memory(simple)
    assert 0.9 * taken <= counted <= 1.5 * taken


def test_the_estimate_counts_what_a_sheet_needs_to_meet_itself():
    """All arrays of the part and of its grid, of a sheet of 6400 points: no less, and not more than twice as much."""
    keys = {"type": "cloth", "resolution": [80, 80], "edges": [[1, 0, 0], [0, 1, 0]], "structural": {"stiffness": 10}}
    alone, met = (network(self_collision=asked, **keys) for asked in (False, True))
    part = next(part for part in Simulation(met, device="cpu").systems["s"].parts if isinstance(part, SelfCollision))
    structs = (part.layers, part._neighbors.grid)
    arrays = [a for struct in structs for name in struct._cls.vars if isinstance(a := getattr(struct, name), wp.array)]
    taken = sum(array.capacity for array in arrays if array is not part.layers.inverse_mass)
    assert taken <= memory.estimate_memory(met) - memory.estimate_memory(alone) <= 2 * taken


@pytest.mark.parametrize(("solver", "past"), [("rk4", 0), ("heun", 0), ("adams_bashforth_2", 1), ("abm_pece_4", 3)])
def test_what_staged_solvers_keep_of_a_network_is_counted(solver, past):
    """Three drives or sums and the substep's beginning, and in the state and its three copies the past."""
    keys = {"generator": {"type": "chain", "count": 6400, "start": [0, 0, 0], "end": [9, 0, 0]}, "stiffness": 1.0}
    simple, made = network(**keys), Simulation(network(**keys, solver=solver), device="cpu")
    system = made.systems["s"]
    work = [getattr(system.solver._work, name) for name in ("now", "middle", "slide", "start")]
    rows = [system.population.field(name) for name in ("history", "history_count") if past]
    taken = sum(array.size * 4 for array in work) + 4 * sum(array.size * 4 for array in rows)
    assert memory.estimate_memory(made.scene) - memory.estimate_memory(simple) == taken


def arrays_of(thing, met: dict) -> None:
    """Find all arrays that something holds, by their addresses: device arrays, NumPy's, those of structs."""
    if id(thing) in met:
        return
    met[id(thing)] = (None, thing)
    if isinstance(thing, wp.array):
        met[id(thing)] = ((thing.ptr or 0, thing.capacity), thing)
    elif isinstance(thing, np.ndarray):
        owner = thing
        while isinstance(owner.base, np.ndarray):
            owner = owner.base
        met[id(thing)] = ((owner.__array_interface__["data"][0], owner.nbytes), thing)
    elif isinstance(thing, (dict, list, tuple)):
        for part in thing.values() if isinstance(thing, dict) else thing:
            arrays_of(part, met)
    elif type(thing).__module__.startswith("warpsim"):
        for part in vars(thing).values() if hasattr(thing, "__dict__") else ():
            arrays_of(part, met)
    elif hasattr(getattr(thing, "_cls", None), "vars"):
        for name in thing._cls.vars:
            arrays_of(getattr(thing, name), met)


def bytes_held(*things) -> int:
    """Bytes of all arrays that things hold; views and what several hold count once."""
    met, total, end = {}, 0, 0
    arrays_of(things, met)
    for address, size in sorted(span for span, _ in met.values() if span):
        total += max(0, address + size - max(end, address))
        end = max(end, address + size)
    return total


SHEET = {"type": "cloth", "resolution": [100, 100], "edges": [[1, 0, 0], [0, 1, 0]]}
GRID = {"type": "grid", "resolution": [90, 90], "edges": [[1, 0, 0], [0, 1, 0]]}
SHEET |= {kind: {"stiffness": 1.0} for kind in ("structural", "shear", "bend")}


@pytest.mark.parametrize(
    "keys",
    [
        SHEET,
        SHEET | {"tear": 0.5},
        SHEET | {"solver": "xpbd"},
        {"generator": {"type": "chain", "count": 9000, "start": [0, 0, 0], "end": [9, 0, 0]}, "stiffness": 1.0},
        {"generator": {"type": "block", "resolution": [20, 20, 20], "size": [1, 1, 1]}, "stiffness": 1.0},
        {"generator": GRID, "stiffness": 1.0, "tear": 0.5},
        {"generator": GRID, "stiffness": 1.0, "look": {"trail": {"duration": 0.2}}},
    ],
)
def test_the_arrays_of_networks_are_counted(keys):
    """What is estimated is there for the worst: a kept state more than in the first frame, lists of numbers, slices with void entries."""
    simulation = Simulation(network(**keys), device="cpu", threads=1)
    simulation.step_frame()
    taken = bytes_held(simulation.systems, simulation._kept)
    assert taken <= memory.estimate_memory(simulation.scene) <= 2 * taken
