"""Tearing: springs that break, forces, hinges and wind of what is left against the twins; any parts to the bit."""

import numpy as np
import pytest
import warp as wp

from tests.kernels.test_bending import crumpled
from tests.reference import bending as bent
from tests.reference import cloth as wind
from tests.reference import springs as twin
from tests.reference import tearing
from tests.simulation.networks import accelerations, network, simulate, state, tangle
from tests.simulation.stages import carry_out
from warpsim import Simulation
from warpsim.networks import Net, edges_of, network_of

SHEET = {"type": "cloth", "resolution": [7, 5], "edges": [[0.6, 0, 0], [0, -0.4, 0]], "density": 0.3, "structural": {"stiffness": 20.0}}


def tear(sim, torn: np.ndarray) -> None:
    """Tear springs by hand, bool (m,)."""
    system = sim.systems["s"]
    system.torn_springs.assign(torn.astype(np.int32))
    system.renew()


def test_frames_equal_the_twin(device):
    """Each frame starts the twin from the device's state, torn springs included: 3 substeps of float32, some of them break."""
    net, substeps, strain = tangle(), 3, 1.0
    net["rest_length"] = [0.3 + r for r in net["rest_length"]]
    springs, rest = np.array(net["springs"]), np.array(net["rest_length"])
    sim = simulate(device=device, **net, tear=strain, substeps=substeps, pins=[3], gravity=(0.3, -9.81, 0))
    mass, home, h = np.array(net["mass"]), np.array(net["points"]), 1 / 60 / substeps
    free = np.ones((len(home), 1))
    free[3] = 0.0
    counts = []
    for _ in range(12):
        broken = sim.frame()["s"].torn.copy()
        x, v = state(sim)
        for _ in range(substeps):
            whole = [
                (*pair, k, c, r)
                for pair, k, c, r, gone in zip(springs, net["stiffness"], net["damping"], rest, broken, strict=True)
                if not gone
            ]
            pull = lambda x, v, whole=whole: free * twin.forces(x, v, whole) / mass[:, None]  # noqa: E731
            outer = lambda x: np.tile([0.3, -9.81, 0], (len(x), 1))  # noqa: E731
            x, v = twin.frame("semi_implicit_euler", x, v, pull, outer, np.zeros(len(x)), h, [{3: home[3]}])
            broken |= tearing.torn(x, springs, rest, strain)
        sim.step_frame()
        assert (sim.frame()["s"].torn == broken).all()
        assert np.abs(state(sim)[0] - x).max() < 3e-6 and np.abs(state(sim)[1] - v).max() < 1e-4
        counts.append(int(broken.sum()))
    assert 0 < counts[0] < counts[-1] < len(springs) and sim.statistics()["s"]["torn"] == counts[-1]


def test_every_spring_finds_its_two_entries():
    system = simulate(**tangle(), tear=1.0).systems["s"]
    places, flat = system.packed.places(), system.packed.spring.reshape(-1)
    assert places.shape == (len(system.net.springs), 2) and (flat[places] == np.arange(len(places))[:, None]).all()
    assert (places[:, 0] != places[:, 1]).all()


def test_triangles_know_their_edges():
    for spec in ({**SHEET}, {"generator": {"type": "block", "resolution": [3, 4, 2], "size": [1, 1, 1]}, "stiffness": 1.0}):
        net = network_of(network(**spec).systems["s"], "systems.s")
        edges = edges_of(net)
        ends = np.sort(np.stack([net.triangles, np.roll(net.triangles, -1, axis=1)], axis=2), axis=2)
        assert (np.sort(net.springs[edges], axis=2) == ends).all() and (edges >= 0).all()
    lonely = Net(np.eye(3), np.array([[0, 1]], np.int32), np.array([[0, 1, 2]], np.int32))
    assert edges_of(lonely).tolist() == [[0, -1, -1]]
    assert (edges_of(Net(np.eye(3), np.zeros((0, 2), np.int32), lonely.triangles)) == -1).all()


def torn_sheet(seed: int, **keys):
    """A crumpled sheet of which a third of the springs are torn, and these."""
    sim = simulate(**SHEET, tear=100.0, **keys)
    crumpled(sim)
    torn = np.random.default_rng(seed).random(len(sim.systems["s"].net.springs)) < 0.3
    tear(sim, torn)
    return sim, torn


def test_hinges_beside_torn_springs_are_gone():
    """float32 of hinges of up to 0.2 m, as for a whole sheet."""
    stiffness, damping = 2e-3, 1e-4
    sim, torn = torn_sheet(3, bending={"stiffness": stiffness, "damping": damping})
    x, v = state(sim)
    rows = [(*pair, 20.0, 0.0, 0.1) for pair, gone in zip(sim.systems["s"].net.springs[:58], torn, strict=False) if not gone]
    gone = [tuple(pair) for pair, broken in zip(sim.systems["s"].net.springs[:58].tolist(), torn, strict=False) if broken]
    mass = sim.frame()["s"].mass.astype(float)[:, None]
    found = bent.hinges(7, 5, 0.1, 0.1)
    expected = twin.forces(x, v, rows) + bent.forces(x, v, found, stiffness, damping, gone)
    assert np.abs(accelerations(sim) * mass - expected).max() < 2e-5 * np.abs(expected).max()
    energy = sum(0.5 * 20.0 * (np.linalg.norm(x[j] - x[i]) - 0.1) ** 2 for i, j, *_ in rows)
    whole = [(weights, k) for weights, k in found if not any({i, j} <= set(weights) for i, j in gone)]
    assert sim.systems["s"].energy() == pytest.approx(energy + bent.energy(x, whole, stiffness), rel=1e-6)


def blown(sim) -> np.ndarray:
    """What the wind alone does to each point (n, 3) [m/s²]."""
    system = sim.systems["s"]
    system.internal.zero_()
    carry_out([*system._wind.stages(), *system.wind(0)])
    return system.internal.numpy()[:, :35].T.copy()


FLOW = {"flow": [{"type": "uniform", "velocity": [1.0, 0.5, 3.0]}]}


def test_the_wind_finds_what_is_left_of_the_cells():
    """Along the area vector of the cells with four whole sides; none where there are none. float32 of unit vectors times 6 m/s²."""
    sim, torn = torn_sheet(4, air=2.0, more=FLOW)
    x, v = state(sim)
    springs = sim.systems["s"].net.springs
    whole = {tuple(sorted(pair)) for pair, gone in zip(springs.tolist(), torn, strict=True) if not gone}
    area = tearing.areas(7, 5, x, whole)
    size = np.linalg.norm(area, axis=1)[:, None]
    n = np.divide(area, size, out=np.zeros_like(area), where=size > 1e-12)
    h, k = 1 / 240, 2.0 / 0.3
    expected = n * ((np.array([1.0, 0.5, 3.0]) - v) * n).sum(axis=1)[:, None] * (1 - np.exp(-k * h)) / h
    assert np.abs(blown(sim) - expected).max() < 1e-4 * np.abs(expected).max() and (size < 1e-12).any()


def test_the_wind_on_a_whole_sheet_is_that_of_cloth():
    """To the last bit: the same sum in the same order; and the twin of cloth agrees."""
    plain, able = simulate(**SHEET, air=2.0, more=FLOW), simulate(**SHEET, air=2.0, more=FLOW, tear=100.0)
    for sim in (plain, able):
        crumpled(sim)
    assert (blown(plain) == blown(able)).all()
    expected = wind.pull(7, 5, *state(able), np.array([1.0, 0.5, 3.0]), 2.0 / 0.3, 1 / 240)
    assert np.abs(blown(able) - expected).max() < 1e-4 * np.abs(expected).max()


@pytest.mark.parametrize("keys", [tangle(), {**SHEET, "resolution": [67, 5], "bending": {"stiffness": 1e-6}, "air": 1.0}])
def test_parts_and_plain_kernels_share_their_bits(keys, monkeypatch):
    monkeypatch.setattr("warpsim.launch.PARALLEL_FROM", 0)
    hashes = set()
    scene = network(**keys, tear=0.5, gravity=(0.3, -9.81, 0.4), substeps=64, more=FLOW)
    for native, threads in ((True, 1), (True, 2), (True, 3), (False, 1), (False, 3)):
        sim = Simulation(scene, device="cpu", threads=threads, native=native)
        field = sim.systems["s"].population.field("velocity")
        field.assign(np.random.default_rng(2).normal(scale=3.0, size=field.shape).astype(np.float32))
        sim.run(0.1)
        hashes.add(sim.state_hash())
    wp.synchronize()
    assert len(hashes) == 1 and 0 < sim.statistics()["s"]["torn"] < len(sim.systems["s"].net.springs)
