"""What info tells of memory is what there is: held to the arrays of simulations, part by part told, and to the memory of a process."""

import json
import subprocess
import sys
from pathlib import Path

import pytest

from tests.command import environment
from tests.simulation.holding import bytes_held
from tests.simulation.networks import network
from warpsim import Scene, Simulation, footprint
from warpsim.memory import memory_of

pytestmark = pytest.mark.cpu

COUNT = 20_000
SHEET = {"type": "cloth", "resolution": [100, 100], "edges": [[1, 0, 0], [0, 1, 0]]}
SHEET |= {kind: {"stiffness": 1.0} for kind in ("structural", "shear", "bend")}
CHAIN = {"generator": {"type": "chain", "count": 9000, "start": [0, 0, 0], "end": [9, 0, 0]}, "stiffness": 1.0}
BLOCK = {"generator": {"type": "block", "resolution": [20, 20, 20], "size": [1, 1, 1]}, "stiffness": 1.0}
GRID = {"generator": {"type": "grid", "resolution": [90, 90], "edges": [[1, 0, 0], [0, 1, 0]]}, "stiffness": 1.0}
TRAIL = {"look": {"trail": {"duration": 0.2}}}
FLOOR = {"colliders": [{"type": "plane"}]}


def particles(more=None, **keys) -> Scene:
    """A system that is full at once."""
    emitter = {"shape": {"type": "box", "size": [1, 1, 1]}, "burst": {"count": COUNT}, "lifetime": 100}
    system = {"type": "particles", "capacity": COUNT, "emitters": [emitter], **keys}
    return Scene.model_validate({"name": "x", **(more or {}), "systems": {"s": system}})


def heard() -> Scene:
    """A system of whose collisions another hears."""
    listener = {"type": "particles", "capacity": 64, "emitters": [{"on": {"event": "collision", "of": "s"}, "burst": {"count": 1}}]}
    document = particles(FLOOR).model_dump(mode="json", by_alias=True, exclude_unset=True)
    return Scene.model_validate(document | {"systems": document["systems"] | {"c": listener}})


def flock(boundary="periodic", more=None, hunted=False, **keys) -> Scene:
    """Boids among few neighbors, maybe with one that hunts them."""
    domain = {"min": [-20, -20, -20], "max": [20, 20, 20], "boundary": boundary}
    system = {"type": "flock", "count": COUNT, "domain": domain, "perception": {"radius": 1.5}, "speed": [1, 2], **keys}
    hunter = {"type": "flock", "count": 1, "domain": domain, "perception": {"radius": 1.5}, "attends": {"s": {"cohesion": 1.0}}}
    return Scene.model_validate({"name": "x", **(more or {}), "systems": {"s": system} | ({"h": hunter} if hunted else {})})


SCENES = {  # and by how much the figure may be too high: lists have void entries, and as many as the layout makes
    "particles": (particles(), 1.01),
    "adams_bashforth_4": (particles(solver="adams_bashforth_4"), 1.01),
    "ballistic": (particles(motion="ballistic"), 1.01),
    "trails": (particles(**TRAIL), 1.01),
    "pairs": (particles({"forces": [{"type": "pairwise", "radius": 0.1, "strength": 1e-9}]}, substeps=1), 1.01),
    "heard": (heard(), 1.01),
    "flock": (flock(), 1.01),
    "flock that is seen": (flock(hunted=True), 1.01),
    "flock in a wind": (flock(coupling={"alpha": 1.0}), 1.01),
    "flock among colliders": (flock("contain", FLOOR), 1.01),
    "cloth": (network(**SHEET), 1.01),
    "cloth, heun": (network(**SHEET, solver="heun"), 1.01),
    "cloth, abm_pece_4": (network(**SHEET, solver="abm_pece_4"), 1.01),
    "cloth on a floor": (network(**SHEET, solver="xpbd", more=FLOOR), 1.01),
    "cloth, xpbd, three passes": (network(**SHEET, solver="xpbd", iterations=3), 1.01),
    "cloth that meets itself": (network(**SHEET, self_collision=True), 1.01),
    "cloth that tears": (network(**SHEET, tear=0.5), 1.1),
    "cloth, implicit_euler": (network(**SHEET, solver="implicit_euler"), 1.1),
    "cloth, limited strain": (network(**SHEET, strain_limit=0.5), 1.1),
    "chain": (network(**CHAIN), 1.1),
    "chain, xpbd": (network(**CHAIN, solver="xpbd"), 1.1),
    "block": (network(**BLOCK), 1.1),
    "grid with trails": (network(**GRID, **TRAIL), 1.1),
}


@pytest.mark.parametrize("name", SCENES)
def test_arrays_are_what_is_told(name):
    """Everything that systems and the graph hold; what is not told, tables of a row or two, is less than 1 %."""
    scene, margin = SCENES[name]
    simulation = Simulation(scene, device="cpu", threads=1)
    simulation.step_frame()
    systems = memory_of(scene).values()
    taken = bytes_held(simulation.systems, simulation._graph)
    assert 0.99 * taken <= sum(one.total - one.host[footprint.KEPT] for one in systems) <= margin * taken
    assert bytes_held(simulation._kept) <= 1.01 * sum(one.first for one in systems) + 10_000  # counters, and what a frame 0 alone has


def line_of(name: str) -> str:
    """Return the line of docs/memory.md about a scene."""
    one = memory_of(SCENES[name][0])["s"]
    parts = ", ".join(f"{part} {size / one.count:.0f}" for part, size in one.parts.items() if size >= one.count and part != footprint.KEPT)
    return f"| {name} | {one.unit} | {one.each:.0f} | {parts} | {one.state / one.count:.0f} |"


def test_the_table_of_the_documents_is_this():
    lines = (Path(__file__).resolve().parents[2] / "docs" / "memory.md").read_text().splitlines()
    assert [line for line in lines if line.split("|")[1:2] and line.split("|")[1].strip() in SCENES] == [line_of(name) for name in SCENES]


def test_kept_states_are_what_is_told_and_never_more():
    """Births all the time; all rows differ but mass and high words. 1.7 % die in a frame, and are replaced in the next."""
    emitter = {"shape": {"type": "box", "size": [1, 1, 1]}, "rate": 8000, "lifetime": {"mean": 1.0, "spread": 0.2}}
    emitter |= {"radius": {"mean": 0.1, "spread": 0.05}, "velocity": {"cone": 20, "speed": 1}}
    scene = Scene.model_validate({"name": "x", "systems": {"s": {"type": "particles", "capacity": 6400, "emitters": [emitter]}}})
    simulation = Simulation(scene, device="cpu", threads=1)
    for _ in range(20 * 64 + 1):
        simulation.step_frame()
    told = memory_of(scene)["s"]
    assert told.first == 0 and told.host[footprint.KEPT] == 15 * told.state
    one = bytes_held(simulation._kept[-1])
    assert 0.97 * told.state <= one <= 1.01 * told.state
    assert bytes_held(simulation._kept) <= told.host[footprint.KEPT]


def test_a_large_scene_keeps_two_states():
    scene = particles(capacity=3_000_000)
    told = memory_of(scene)["s"]
    assert told.host[footprint.KEPT] == told.first + told.state > footprint.MOST_KEPT_BYTES


def test_memory_of_a_process_is_what_is_told():
    """A twentieth of what docs/performance.md tells: Python's and Warp's own pages are a few hundred kB."""
    command = [sys.executable, "-m", "benchmarks.memory", "--json", "--share", "0.05"]
    done = subprocess.run(command, capture_output=True, text=True, env=environment(), check=True)
    rows = [json.loads(line) for line in done.stdout.splitlines()]
    assert [row["what"] for row in rows] == ["particle", "boid", "vertex"]
    for row in rows:
        assert abs(row["taken"] - row["told"]) * row["count"] <= 0.05 * row["told"] * row["count"] + 1_500_000, row
