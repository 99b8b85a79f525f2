"""Strain limit: sweeps against the twin; native loops, plain kernels and any parts to the bit."""

import numpy as np
import pytest
import warp as wp

from tests.reference import strain as twin
from tests.simulation.networks import network, simulate, state, tangle
from warpsim import SceneError, Simulation
from warpsim.kernels import strain, strain_loops
from warpsim.systems.parts.strain import StrainLimit

LIMIT = 0.1


def limited(**keys):
    """A network whose strain is limited, with the part that does so."""
    net = tangle()
    ends = np.array(net["points"])[np.array(net["springs"])]
    net["rest_length"] = np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1).tolist()
    sim = simulate(**{**net, "pins": [3], "strain_limit": LIMIT, "substeps": 4, **keys})
    return sim, next(part for part in sim.systems["s"].parts if isinstance(part, StrainLimit))


@pytest.mark.parametrize("loops", [strain, strain_loops], ids=["plain", "native"])
def test_a_sweep_equals_the_twin(loops):
    """200 springs one after the other, each moved by up to 0.2 m, float32: some 50 roundings of 1 m on a way through the network."""
    sim, part = limited()
    system, limit = sim.systems["s"], part._limit
    rng, h = np.random.default_rng(7), system.pace.dt
    for key in ("position", "velocity"):
        field = system.population.field(key)
        field.assign(field.numpy() + rng.normal(scale=0.1, size=field.shape).astype(np.float32))
    known = rng.uniform(0, 0.02, len(part._limit.order)).astype(np.float32)
    limit.multiplier.assign(known)
    limit.going.fill_(1)
    limit.kept.fill_(0.8)
    order, inverse = limit.order.numpy(), system.inverse_mass.numpy().astype(float)
    springs, rest = system.net.springs[order], system.table.rest.numpy()[order].astype(float)
    x, v = state(sim)
    step = (0, 0, len(part._sizes))
    wp.launch(loops.project_colors, 1, [*step, 1, limit, system.table, system.particles], device="cpu")
    x, v, multiplier = twin.begin(x, v, springs, inverse, known.astype(float), h)
    for aim in (0.9, 0.9):
        limit.aim.fill_(aim)
        wp.launch(loops.project_colors, 1, [*step, 0, limit, system.table, system.particles], device="cpu")
        x, v, multiplier = twin.sweep(x, v, springs, rest, inverse, multiplier, LIMIT, h, aim)
    now = [system.population.field(key).numpy()[:, : len(x)].T for key in ("position", "velocity")]
    assert np.abs(now[0] - x).max() < 2e-5 and np.abs(now[1] - v).max() < 2e-5 / h
    assert np.abs(limit.multiplier.numpy() - multiplier).max() < 4e-5 and (multiplier > 0).any() and (multiplier == 0).any()
    limit.turn.fill_(100)
    limit.aim.fill_(0.5)
    x, v = now[0].astype(float), now[1]
    wp.launch(loops.project_colors, 1, [*step, 0, limit, system.table, system.particles], device="cpu")
    late = twin.late_sweep(x, springs, rest, inverse, LIMIT, 0.5)
    assert np.abs(system.population.field("position").numpy()[:, : len(x)].T - late).max() < 2e-5 and np.abs(late - x).max() > 0.01
    assert (system.population.field("velocity").numpy()[:, : len(x)].T == v).all()


def test_which_springs_are_limited():
    """Not those between two pins; of cloth not those to the next but one. No two of a color share a point."""
    _, part = limited(pins=[3, 4])
    system, order = part.system, part._limit.order.numpy()
    assert sorted(order) == [k for k, (i, j) in enumerate(system.net.springs.tolist()) if {i, j} - {3, 4}]
    assert len(order) < len(system.net.springs)
    sheet = {"type": "cloth", "resolution": [6, 5], "edges": [[1, 0, 0], [0, -1, 0]], "structural": {"stiffness": 1.0}}
    system = simulate(**sheet, strain_limit=LIMIT).systems["s"]
    part = next(part for part in system.parts if isinstance(part, StrainLimit))
    assert sorted(part._limit.order.numpy()) == list(range(system.scene.systems["s"].generator.spring_count))
    for begin, end in zip(part._limit.begin.numpy()[:-1], part._limit.begin.numpy()[1:], strict=True):
        ends = system.net.springs[part._limit.order.numpy()[begin:end]].reshape(-1)
        assert len(set(ends.tolist())) == len(ends)


def test_a_network_that_begins_too_long_is_a_mistake():
    with pytest.raises(SceneError, match="spring 0 begins with a strain of 0.25"):
        simulate(points=[[0, 0, 0], [1, 0, 0]], springs=[[0, 1]], stiffness=1.0, rest_length=0.8, strain_limit=0.2)
    zero = simulate(points=[[0, 0, 0], [1, 0, 0]], springs=[[0, 1]], stiffness=1.0, rest_length=0.0, strain_limit=0.2)
    assert zero.statistics()["s"]["overlong"] == 0  # has no strain


@pytest.mark.parametrize(
    "keys",
    [
        {"points": [[0, 0, 0], [1, 0, 0]], "springs": [[0, 1]], "stiffness": 1.0, "pins": [0]},
        {"generator": {"type": "block", "resolution": [5, 4, 3], "size": [1, 0.8, 0.5]}, "stiffness": 3.0, "mass": 0.01, "pins": ["top"]},
        {"type": "cloth", "resolution": [67, 5], "edges": [[2, 0, 0], [0, 0, 0.2]], "structural": {"stiffness": 2.0}, "pins": ["left"]},
    ],
    ids=["pair", "block", "cloth"],
)
def test_parts_and_plain_kernels_share_their_bits(keys, monkeypatch):
    monkeypatch.setattr("warpsim.launch.PARALLEL_FROM", 0)
    hashes = set()
    scene = network(**keys, strain_limit=0.05, gravity=(0.3, -9.81, 0.4), substeps=8)
    for native, threads, worth in ((True, 1, 4096), (True, 2, 16), (True, 3, 4096), (False, 1, 16), (False, 3, 4096), (False, 2, 1)):
        monkeypatch.setattr("warpsim.systems.parts.strain.WORTH_A_LAUNCH", {True: worth, False: worth})
        sim = Simulation(scene, device="cpu", threads=threads, native=native)
        sim.run(0.3)
        hashes.add(sim.state_hash())
    part = next(part for part in sim.systems["s"].parts if isinstance(part, StrainLimit))
    assert len(hashes) == 1 and part._limit.multiplier.numpy().max() > 0.0
