"""Cloth: springs, areas, wind and whole frames against the twin; native rows, plain kernels and any parts to the bit."""

import numpy as np
import pytest

from tests.reference import cloth as twin
from tests.reference import springs
from tests.simulation.networks import network, simulate, state
from warpsim import Simulation, UnstableError
from warpsim.kernels.cloth import STEPS
from warpsim.networks import network_of, spring_numbers
from warpsim.systems.solvers.split import WHEN

GRAVITY, DENSITY, AIR, SUBSTEPS = (0.3, -9.81, 0.0), 0.5, 2.0, 3
NUMBERS = {"structural": (20.0, 0.02), "shear": (10.0, 0.01), "bend": (1.0, 0.005)}
EDGES = [[1.4, 0, 0], [0.1, -1.0, 0.05]]


def sheet(nx: int, ny: int, **keys) -> dict:
    """Keys of a sheet of nx × ny points."""
    kinds = {kind: {"stiffness": k, "damping": c} for kind, (k, c) in NUMBERS.items()}
    return {"type": "cloth", "resolution": [nx, ny], "edges": EDGES, "density": DENSITY, **kinds, **keys}


@pytest.mark.parametrize("size", [(2, 2), (2, 5), (3, 3), (7, 4)])
def test_a_sheet_has_the_springs_of_the_twin(size):
    spec = network(**sheet(*size)).systems["s"]
    net = network_of(spec, "systems.s")
    along, down = (np.array(edge) / (n - 1) for edge, n in zip(EDGES, size, strict=True))
    expected = {tuple(sorted(row[:2])): row[2:] for row in twin.springs(*size, along, down, NUMBERS)}
    found = {tuple(sorted(map(int, pair))): row for pair, *row in zip(net.springs, *spring_numbers(spec, net), strict=True)}
    assert set(found) == set(expected) and len(net.springs) == spec.spring_count == len(expected)
    assert all(found[pair] == pytest.approx(list(expected[pair])) for pair in expected)
    assert sorted(STEPS) == sorted((s * a, s * b) for steps in twin.KINDS.values() for a, b in steps for s in (1, -1))


def test_mass_and_area_are_those_of_the_cells_round_a_point():
    sim = simulate(**sheet(4, 3))
    mass = sim.frame()["s"].mass.reshape(3, 4).astype(float)
    area = np.linalg.norm(np.cross(*EDGES))
    assert mass.sum() == pytest.approx(DENSITY * area) and mass[1, 1] == pytest.approx(DENSITY * area / 6)
    assert mass[0, 1] == pytest.approx(mass[1, 1] / 2) and mass[0, 0] == pytest.approx(mass[1, 1] / 4)


@pytest.mark.parametrize("native", [True, False])
@pytest.mark.parametrize("solver", WHEN)
def test_frames_equal_the_twin(solver, native, device):
    """Each frame starts the twin from the device's state: 3 substeps of float32, |x| < 2 m, |v| < 4 m/s, twelve springs to a point."""
    nx, ny, alpha, wind = 7, 5, 0.003, np.array([0.5, 0.2, 3.0])
    flow = {"flow": [{"type": "uniform", "velocity": wind.tolist()}]}
    keys = {"solver": solver, "gravity": GRAVITY, "substeps": SUBSTEPS, "air": AIR, "drag": alpha, "pins": ["left", [6, 4]]}
    sim = simulate(**sheet(nx, ny, **keys), device=device, native=native, more=flow)
    spec = sim.scene.systems["s"]
    home, mass = network_of(spec, "systems.s").points, sim.frame()["s"].mass.astype(float)
    net = twin.springs(nx, ny, np.array(EDGES[0]) / (nx - 1), np.array(EDGES[1]) / (ny - 1), NUMBERS)
    held, h = spec.pinned(spec.pins), 1 / 60 / SUBSTEPS
    free = np.ones((nx * ny, 1))
    free[held] = 0.0

    def internal(x, v):
        return free * springs.forces(x, v, net) / mass[:, None]

    def air(x, v, h):
        return free * twin.pull(nx, ny, x, v, wind, AIR / DENSITY, h)

    for index in range(12):
        pins = [{i: home[i] for i in held}] * SUBSTEPS
        x, v = springs.frame(solver, *state(sim), internal, lambda x: np.tile(GRAVITY, (len(x), 1)), alpha / mass, h, pins, air)
        sim.step_frame()
        assert np.abs(state(sim)[0] - x).max() < 2e-6 and np.abs(state(sim)[1] - v).max() < 5e-5, index
    assert np.abs(state(sim)[0] - home).max() > 0.05


@pytest.mark.parametrize("size", [(2, 2), (63, 3), (64, 4), (65, 3), (130, 5), (3, 70), (256, 3), (257, 4), (515, 3)])
def test_parts_and_plain_kernels_share_their_bits(size, monkeypatch):
    monkeypatch.setattr("warpsim.launch.PARALLEL_FROM", 0)
    flow = [
        {"type": "uniform", "velocity": [1, 0, {"sine": {"amplitude": 4, "period": 0.1}}]},
        {"type": "vortex", "axis": [0, 1, 0], "circulation": 2.0, "core": {"model": "lamb_oseen", "radius": 0.2}},
        {"type": "curl_noise", "amplitude": 1.0, "length": 0.5, "frequency": 2.0},
        {"type": "expression", "velocity": ["y*sin(9*t)", "x", "z + 1"]},
    ]
    colliders = [{"type": "sphere", "center": [0.7, -1.0, 0.0], "radius": 0.3}]
    hashes = set()
    wide = [[0.2 * size[0], 0, 0], EDGES[1]] if size[0] > 200 else EDGES  # cells of a few grams, which these springs do not tear away
    keys = {"pins": ["top"], "air": 1.0, "drag": 1e-4, "gravity": GRAVITY, "substeps": 3}
    scene = network(**sheet(*size, **keys | {"edges": wide}), more={"flow": flow, "colliders": colliders})
    for native, threads in ((True, 1), (True, 2), (True, 3), (True, 5), (False, 1), (False, 3)):
        sim = Simulation(scene, device="cpu", threads=threads, native=native)
        sim.run(0.1)
        hashes.add(sim.state_hash())
    assert len(hashes) == 1 and np.isfinite(state(sim)[0]).all()


@pytest.mark.parametrize("size", [(2, 2), (7, 9), (64, 4), (65, 3), (256, 5), (3, 70)])
@pytest.mark.parametrize("drag", [0.0, 1e-4])
def test_a_substep_in_one_pass_has_the_bits_of_its_stages(size, drag, monkeypatch):
    """On any number of cores, more than there are rows, too; the opening frame, moved pins and numbers that change on the way included."""
    monkeypatch.setattr("warpsim.launch.PARALLEL_FROM", 0)
    flow = [{"type": "uniform", "velocity": [1, 0, {"sine": {"amplitude": 4, "period": 0.1}}]}]
    wide = [[0.2 * size[0], 0, 0], EDGES[1]] if size[0] > 200 else EDGES
    motion = [{"displacement": [{"expression": "0.1*sin(9*t)"}, 0, 0]}]
    keys = {
        "pins": ["top"],
        "pin_motion": motion,
        "air": 1.0,
        "drag": drag,
        "gravity": GRAVITY,
        "substeps": 3,
        "prewarm": 0.05,
        "edges": wide,
    }
    scene = network(**sheet(*size, **keys), more={"flow": flow})
    hashes, stages = set(), set()
    for native, threads in ((True, 1), (True, 2), (True, 3), (True, 5), (False, 1)):
        sim = Simulation(scene, device="cpu", threads=threads, native=native)
        sim.run(0.1)
        sim.change("systems.s.structural.stiffness", 15.0)
        sim.run(0.1)
        hashes.add(sim.state_hash())
        stages.add((native, "cloth" in {stage.name for stage in sim._graph.stages}))
    assert len(hashes) == 1 and np.isfinite(state(sim)[0]).all()
    assert stages == {(True, True), (False, False)}


@pytest.mark.parametrize("native", [True, False])
def test_a_sheet_that_leaves_the_world_is_found(native):
    """Its lowest row falls from −1 m to the extent's −3 m: by ½ g t (t + h) with semi_implicit_euler; looked at when a frame ends."""
    scene = network(**sheet(5, 5, gravity=(0, -9.81, 0), substeps=4), more={"limits": {"extent": 3.0}})
    sim = Simulation(scene, device="cpu", threads=1, native=native)
    with pytest.raises(UnstableError) as error:
        sim.run(2.0)
    before, then = (4.905 * t * (t + 1 / 240) for t in ((error.value.index - 1) / 60, error.value.index / 60))
    assert before < 2.0 < then and error.value.last_good.index == error.value.index - 1
