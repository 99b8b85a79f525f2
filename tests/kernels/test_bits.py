"""Bits: native loops and plain kernels, any number of parts, any run and any watching give the same state, to the last bit."""

from pathlib import Path

import numpy as np
import pytest

from tests.physics.scenes import scene
from warpsim import Simulation
from warpsim.kernels.birth import SHAPES
from warpsim.kernels.emission import COUNT_LAWS, VALUE_LAWS
from warpsim.kernels.flow import FLOWS
from warpsim.kernels.forces import ATTRACTOR_LAWS
from warpsim.kernels.integration import METHODS
from warpsim.kernels.primitive import CORES

pytestmark = pytest.mark.cpu

SCENES = Path(__file__).resolve().parents[2] / "scenes"
SINE = {"sine": {"mean": 0.5, "amplitude": 0.3, "period": 0.2}}
BODIES = {
    "uniform": {"velocity": [SINE, 0.1, {"expression": "0.1*sin(20*t)"}]},
    "source": {"center": [3, 0, 0], "rate": {"keyframes": [[0, -0.5], [0.2, 0.5]]}},
    "point_source": {"center": [0, 3, 0], "rate": 2.0},
    "vortex": {"center": [0, 0, 0.1], "axis": [1, 2, 3], "circulation": SINE},
    "doublet": {"center": [0, 0, 3], "axis": [1, 0, 0], "direction": [0, 1, 0], "strength": 0.2},
    "rotation": {"axis": [0, 1, 1], "angular_velocity": 0.5, "travel": [SINE, 0.1, {"expression": "t"}]},
    "vortex_segment": {"start": [0, 0.2, 0], "end": [1, 0, 0.5], "circulation": SINE, "travel": [0, SINE, 0]},
    "vortex_ring": {"normal": [1, 0, 1], "radius": {"keyframes": [[0, 0.5], [0.2, 0.8]]}, "circulation": 0.5, "travel": [SINE, 0, 0]},
    "curl_noise": {"amplitude": SINE, "length": 0.3, "frequency": 4.0, "octaves": 2, "seed": 3, "travel": [SINE, 0, 0]},
    "expression": {
        "velocity": ["0.3*sin(x*y - t)", "smoothstep(-1, 1, z)*exp(-x^2)", "clamp(mod(x, 0.4), 0.1, 0.3) + 0.1*log(2 + y^2)"],
        "travel": [SINE, 0, 0],
    },
    "grid": {"file": str(SCENES / "grids" / "cavity.npz"), "size": [2, 2, 0.5], "scale": SINE, "travel": [0.1, SINE, 0]},
}
FLOW = [{"type": kind} | BODIES[kind] for kind in FLOWS]
VORTICES = ("vortex", "vortex_segment", "vortex_ring")
FLOW += [{"type": k} | BODIES[k] | {"core": {"model": core, "radius": 0.3}} for core in CORES if core != "ideal" for k in VORTICES]
PLACES = {kind: place for place, kind in enumerate(FLOWS)}
MAST = {"type": "cylinder", "center": [0, 0, -6], "radius": 0.5, "circulation": SINE, "answers": [PLACES["uniform"], PLACES["source"]]}
FLOOR = {"type": "wall", "center": [0, -9, 0], "answers": [PLACES[k] for k in ("point_source", "vortex_segment", "vortex_ring")]}
FORCES = [{"type": "attractor", "center": [k, 1, 0], "strength": 0.001, "law": law} for k, law in enumerate(ATTRACTOR_LAWS)]
EXTENTS = {
    "segment": {"start": [0, 0, 0], "end": [1, 1, 0]},
    "disc": {"radius": 0.5},
    "sphere": {"radius": 0.5},
    "box": {"size": [1, 2, 0.5]},
    "mesh": {"file": str(SCENES / "meshes" / "knot.obj"), "scale": 0.3},
}
FILLS = [(shape, fill) for shape in SHAPES for fill in (("volume", "surface") if shape in ("disc", "sphere", "box", "mesh") else (None,))]
CASES = [*METHODS, "ballistic"]
FRAMES = 12


def values(mean: float, law: str) -> dict:
    return {"mean": mean, "spread": 0.3 * mean, "law": law}


def emitters(live: int) -> list[dict]:
    """A burst of so many, of which a third dies within the run, and a rate that replaces them; all shapes, fills and laws."""
    born = {"velocity": {"cone": 90, "speed": values(1.0, "normal")}, "lifetime": values(0.2, "uniform")}
    first = {**born, "burst": {"count": live}, "shape": {"type": "box", "size": [1, 1, 1]}, "mass": 1e-3}
    rest = []
    for number, (shape, fill) in enumerate(FILLS):
        place = {"type": shape, **EXTENTS.get(shape, {}), **({"fill": fill} if fill else {})}
        law, value = list(COUNT_LAWS)[number % len(COUNT_LAWS)], list(VALUE_LAWS)[number % len(VALUE_LAWS)]
        rate = {"mean": 0.5 * live + 50.0, "spread": 0.2 * live, "law": law}
        one = {**born, "shape": place, "rate": rate, "lifetime": values(0.1, value), "mass": values(1e-3, "uniform"), "radius": 1e-3}
        rest.append(one | ({"travel": [SINE, {"expression": "0.3*t^2"}, 0.1]} if number % 2 else {}))
    return [first, *rest]


def crowd(name: str, live: int, **keys):
    system = {"coupling": {"alpha": 1e-3}, "solver": name}
    if name.startswith("tracer_"):
        system = {"coupling": "tracer", "solver": name.removeprefix("tracer_")}
    if name == "ballistic":
        system = {"motion": "ballistic", "feels": {"forces": False}}
    document = {"flow": FLOW, "obstacles": [MAST, FLOOR], "forces": FORCES, "gravity": (0.0, -9.81, 0.0), "substeps": 2}
    document |= {"capacity": live + live // 8 + 30} | keys
    return scene(*emitters(live), **document, **system)


def hash_of(document, threads=1, native=True, watch=None) -> str:
    sim = Simulation(document, device="cpu", threads=threads, native=native)
    for index in range(FRAMES):
        sim.step_frame()
        if watch:
            watch(sim, index)
    p = sim.statistics()["p"]
    assert p["born"] > p["live"], "there were births and deaths"
    return sim.state_hash()


@pytest.fixture
def always_parallel(monkeypatch):
    """Use all parts however few the particles: a part may then be empty."""
    monkeypatch.setattr("warpsim.launch.PARALLEL_FROM", 0)


def test_the_crowd_has_every_kind():
    assert set(BODIES) == set(FLOWS)
    used = emitters(100)
    assert {e["shape"]["type"] for e in used} == set(SHAPES) and {e["rate"]["law"] for e in used if "rate" in e} == set(COUNT_LAWS)
    assert {e["lifetime"]["law"] for e in used} == set(VALUE_LAWS)


@pytest.mark.parametrize("live", [1, 63, 64, 65, 1_025])
@pytest.mark.parametrize("name", CASES)
def test_parts_and_plain_kernels_share_their_bits(name, live, always_parallel):
    document = crowd(name, live)
    expected = hash_of(document)
    assert hash_of(document, native=False) == expected, "plain kernels"
    for threads in (2, 5):
        assert hash_of(document, threads) == expected, threads


@pytest.mark.parametrize("native", [True, False])
def test_many_particles_share_their_bits(native):
    """Above the number from which several cores work, by the program's own choice."""
    document = crowd("semi_implicit_euler", 20_003)
    assert len({hash_of(document, threads, native) for threads in (1, 1, 2, 3, 5, 16)} | {hash_of(document)}) == 1


COLLIDERS = [
    {"type": "plane", "center": [0, -0.6, 0], "restitution": 0.3, "friction": 0.2, "rotation": [5, 0, 10]},
    {
        "type": "sphere",
        "center": [0.3, 0, 0],
        "radius": 0.3,
        "motion": {"center": [0.3, SINE, 0], "rotation": [0, {"expression": "90*t"}, 0]},
    },
    {"type": "sphere", "radius": 1.6, "side": "inside", "restitution": 1.0, "friction": 0.0},
    {"type": "box", "size": [0.2, 0.5, 0.4], "center": [-0.4, 0, 0.2], "motion": {"rotation": [0, {"expression": "400*t"}, 30]}},
    {"type": "box", "size": [2.5, 2.5, 2.5], "side": "inside", "rotation": [10, 20, 30]},
    {"type": "capsule", "start": [-0.5, -0.4, -0.5], "end": [0.5, -0.3, 0.5], "radius": 0.1, "action": "stick"},
    {"type": "capsule", "start": [0, 1.1, -0.5], "end": [0.2, 1.2, 0.5], "radius": 0.2, "action": "kill"},
    {"type": "mesh", "center": [0, 0.4, 0], "scale": 0.2, "motion": {"rotation": [{"expression": "200*t"}, 0, 0]}},
]


@pytest.fixture(scope="module")
def tetrahedron(tmp_path_factory):
    path = tmp_path_factory.mktemp("meshes") / "tetrahedron.obj"
    path.write_text("v 1 1 1\nv -1 -1 1\nv -1 1 -1\nv 1 -1 -1\nf 1 3 2\nf 1 4 3\nf 1 2 4\nf 2 3 4\n")
    return str(path)


@pytest.mark.parametrize("name", ["semi_implicit_euler", "rk4", "tracer_rk4", "adams_bashforth_2"])
def test_collisions_share_their_bits(name, tetrahedron, always_parallel):
    solids = [solid | ({"file": tetrahedron} if solid["type"] == "mesh" else {}) for solid in COLLIDERS]
    document = crowd(name, 301, colliders=solids)
    expected = hash_of(document)
    assert hash_of(document, native=False) == expected, "plain kernels"
    for threads in (2, 5):
        assert hash_of(document, threads) == expected, threads
    sim = Simulation(document, device="cpu", threads=1)
    sim.run(FRAMES / 60)
    population = sim.systems["p"].population
    stuck = population.host("contact")
    assert 0 < (stuck == 6).sum() < len(stuck) and set(stuck) == {0, 6} and population.counter("pushed") > 0, "everything did happen"


@pytest.mark.parametrize("policy", ["reset", "kill"])
@pytest.mark.parametrize("name", ["semi_implicit_euler", "tracer_rk4", "ballistic"])
def test_unstable_particles_share_their_bits(name, policy, always_parallel):
    """A small world that many leave."""
    wind = {"type": "uniform", "velocity": [3.0, 0.0, 0.0]}
    extent = 0.95 if name == "ballistic" else 1.02  # no wind drives arcs out
    document = crowd(name, 301, limits={"extent": extent, "unstable": policy}, flow=[*FLOW, wind])
    ways = ((True, 1), (False, 1), (True, 3), (False, 3))
    assert len({hash_of(document, threads, native) for native, threads in ways}) == 1
    sim = Simulation(document, device="cpu", threads=1)
    counts = [sim.frame()["p"].count]
    counts += [frame["p"].count for frame in sim.frames(FRAMES)]
    assert sim.statistics()["p"]["killed"] > 0 if policy == "kill" else 0 in counts, "it did happen"
    assert max(counts) > 10


@pytest.mark.parametrize("name", ["abm_pece_2", "abm_pece_4", "tracer_abm_pece_4"])
def test_chosen_substeps_share_their_bits(name, always_parallel):
    """Born within a frame, dying within one, some content with few substeps and some not with the most."""
    document = crowd(name, 301, substeps="auto", tolerance=2e-5, max_substeps=8)
    expected = hash_of(document)
    assert all(hash_of(document, threads, native) == expected for native, threads in ((False, 1), (True, 3), (False, 3)))
    sim = Simulation(document, device="cpu", threads=1)
    sim.seek(FRAMES)
    statistics = sim.statistics()["p"]
    assert 1.0 < statistics["substeps"] < 8.0 and statistics["inexact"] > 0


def test_watching_does_not_change_the_bits():
    document = crowd("semi_implicit_euler", 301)
    kept = []
    watchers = {
        "never": None,
        "frames": lambda sim, index: kept.append(sim.frame()),
        "arrays": lambda sim, index: sim.frame()["p"].position,
        "packed": lambda sim, index: sim.frame()["p"].packed(50),
        "sometimes": lambda sim, index: sim.frame() if index % 5 == 3 else None,
        "hashes": lambda sim, index: sim.state_hash(),
        "statistics": lambda sim, index: sim.statistics(),
        "probes": lambda sim, index: sim.flow.circulation([0, 0, 0], [0, 1, 0], 1.0),
    }
    assert len({hash_of(document, watch=watch) for watch in watchers.values()}) == 1
    assert [frame.index for frame in kept] == list(range(1, FRAMES + 1))


def test_two_simulations_side_by_side_do_not_meet():
    document = crowd("verlet", 301)
    expected = hash_of(document)
    one, two = (Simulation(document, device="cpu", threads=2) for _ in range(2))
    for _ in range(FRAMES):
        one.step_frame()
        two.step_frame()
    assert one.state_hash() == two.state_hash() == expected


def test_the_hash_sees_every_word():
    sim = Simulation(crowd("verlet", 65), device="cpu", threads=1)
    sim.run(0.1)
    before = sim.state_hash()
    slab = sim.systems["p"].population.slab.numpy()
    for row in range(len(slab)):
        slab[row, 3] ^= np.uint32(1)
        assert sim.state_hash() != before, row
        slab[row, 3] ^= np.uint32(1)
    assert sim.state_hash() == before


def test_another_seed_is_another_run():
    assert hash_of(crowd("verlet", 65)) != hash_of(crowd("verlet", 65, seed=2))
