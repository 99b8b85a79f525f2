"""Muscles and facets: what kernels compute against the twins; whole frames; native loops, plain kernels and any parts to the bit."""

from itertools import pairwise

import numpy as np
import pytest
import warp as wp

from tests.reference import facets as fluid
from tests.reference import muscles as twin
from tests.reference import springs as elastic
from tests.simulation.networks import network, simulate, state
from warpsim import Simulation
from warpsim.kernels.facets import facet_force
from warpsim.networks import looseness, network_of, packed_facets

FISH = [(0, 0, 0), (0.2, 0.2, 0.3), (0.5, 0.15, 0.2), (0.7, 0.1, 0.2), (1, 0, 0.4)]
BODY = {
    "type": "body",
    "head": [1, 0.1, 0],
    "tail": [0, 0, 0.2],
    "sections": [{"at": at, "width": w, "height": h} for at, w, h in FISH],
}
MUSCLES = [
    {"chain": "left_top", "wave": {"amplitude": [0.1, 0.3], "period": 0.4, "wavelength": 0.7, "phase": 0.5}},
    {"chain": ["right_top", "right_bottom"], "part": [0.4, 1], "rest": {"keyframes": [[0, 1], [0.1, 0.7]]}, "activation": 0.8},
    {
        "springs": [0, 2],
        "wave": {"amplitude": 0.2, "period": 0.3, "wavelength": 2, "direction": [1, 1, 0]},
        "activation": {"expression": "3*t"},
    },
]
STREAM = {"flow": [{"type": "vortex", "center": [0, 0, 2], "axis": [0, 1, 0], "circulation": 3}]}
KEYS = {"generator": BODY, "mass": 0.3, "stiffness": 300.0, "damping": 0.6, "water": 40.0, "muscles": MUSCLES, "more": STREAM}


@wp.kernel(module="unique")
def sample_forces(areas: wp.array[wp.vec3], speeds: wp.array[wp.vec3], numbers: wp.array[wp.vec3], force_out: wp.array[wp.vec3]):
    i = wp.tid()
    force_out[i] = facet_force(areas[i], speeds[i], numbers[i][0], numbers[i][1], numbers[i][2])


def forces_on(areas, speeds, numbers, device) -> np.ndarray:
    """The force [N] on facets by the kernel's formula; numbers are resistance, looseness and substep."""
    arrays = [wp.array(np.asarray(values, np.float32), dtype=wp.vec3, device=device) for values in (areas, speeds, numbers)]
    force = wp.zeros_like(arrays[0])
    wp.launch(sample_forces, len(force), arrays, [force], device=device)
    return force.numpy().astype(float)


def factors_of(scene, net, time: float) -> np.ndarray:
    """The factor of every spring's rest length, worked out along the chains of BODY and by the words of the format."""
    number = {frozenset(pair): k for k, pair in enumerate(net.springs.tolist())}
    found = np.ones(len(net.springs))
    spec = scene.systems["s"]
    for corner, name in enumerate(spec.generator.chains):
        line = [section[corner] for section in spec.generator.numbers[1:-1]]
        springs = [number[frozenset(pair)] for pair in pairwise(line)]
        length = np.linalg.norm(np.diff(net.points[line], axis=0), axis=1)
        middle = length.cumsum() - 0.5 * length
        for spring, s in zip(springs, middle, strict=True):
            share = s / length.sum()
            if name == "left_top":
                found[spring] = twin.factor(time, wave=(0.1 + 0.2 * share, 0.4, s / 0.7, 0.5))
            elif name.startswith("right") and share >= 0.4:
                found[spring] = twin.factor(time, rest=float(np.interp(time, [0, 0.1], [1, 0.7])), activation=0.8)
    place = net.points @ np.array([1, 1, 0]) / np.sqrt(2)
    for spring in (0, 2):
        s = place[net.springs[spring]].mean() - place.min()
        found[spring] = twin.factor(time, activation=3 * time, wave=(0.2, 0.3, s / 2, 0.0))
    return found


def test_rest_lengths_follow_the_twin(device):
    """float32 factors: one rounding of a number near 1; the float64 sine is good to 1e-15."""
    sim = simulate(device=device, **KEYS)
    scene = network(**KEYS)
    net = network_of(scene.systems["s"], "systems.s")
    length = np.linalg.norm(np.diff(net.points[net.springs], axis=1)[:, 0], axis=1)
    part = sim.systems["s"].parts[0]
    for time in (0.0, 0.05, 0.33, 2.0):
        assert part.rest_lengths(time, length) == pytest.approx(length * factors_of(scene, net, time), rel=2.0**-23), time


def test_a_force_of_a_facet_equals_the_twin(device):
    """float32: eight roundings of the force, and 5e-7 of the decay's mean; nothing where a facet moves away, or has no area."""
    rng = np.random.default_rng(2)
    corners, w = rng.normal(size=(200, 3, 3)).astype(np.float32).astype(float), rng.normal(size=(200, 3)).astype(np.float32).astype(float)
    c, inverse, h = 10.0 ** rng.uniform(-1, 5, 200), 10.0 ** rng.uniform(-2, 2, 200), 10.0 ** rng.uniform(-4, -1, 200)
    areas = np.array([fluid.area_vector(one) for one in corners])
    found = forces_on(areas, w, np.stack([c, inverse / 3.0, h], axis=1), device)
    for k, force in enumerate(found):
        still = {"flow": lambda x: 0.0, "facets": [(0, 1, 2)], "c": c[k], "inverse_mass": np.full(3, inverse[k]), "h": h[k]}
        expected = fluid.water_forces(corners[k], np.tile(w[k], (3, 1)), **still).sum(axis=0)
        assert np.abs(force - expected).max() <= 2e-6 * c[k] * np.linalg.norm(areas[k]) * np.linalg.norm(w[k]), k
    assert not forces_on([[1, 0, 0], [0, 0, 0]], [[-1, 2, 0], [1, 0, 0]], np.ones((2, 3)), device).any()


def test_every_facet_is_packed_at_its_corners():
    net = network_of(network(**KEYS).systems["s"], "systems.s")
    begin, facet = packed_facets(len(net.points), net.facets)
    for i in range(64):
        mine = [facet[row, i % 64] for row in range(begin[i // 64], begin[i // 64 + 1])]
        expected = [k for k, corners in enumerate(net.facets) if i in corners[corners >= 0]]
        assert mine == expected + [-1] * (len(mine) - len(expected))
    degree = np.bincount(net.facets[net.facets >= 0], minlength=len(net.points))
    inverse = np.linspace(1, 2, len(net.points))
    for k, corners in enumerate(net.facets):
        real = corners[corners >= 0]
        assert looseness(net, inverse)[k] == pytest.approx((degree[real] * inverse[real]).sum() / len(real) ** 2)


@pytest.mark.parametrize("native", [True, False])
def test_frames_equal_the_twin(native, device):
    """Each frame starts the twin from the device's state: 3 substeps of float32, |x| < 2 m, |v| < 3 m/s, a dozen springs each."""
    substeps, gravity = 3, np.array([0.1, -0.2, 0.0])
    sim = simulate(device=device, native=native, substeps=substeps, gravity=gravity.tolist(), pins=["head"], **KEYS)
    scene = network(**KEYS)
    net = network_of(scene.systems["s"], "systems.s")
    home, h = net.points, 1 / 60 / substeps
    length = np.linalg.norm(np.diff(home[net.springs], axis=1)[:, 0], axis=1)
    inverse = np.full(len(home), 1 / 0.3)
    inverse[0] = 0.0
    facets = [corners[corners >= 0].tolist() for corners in net.facets]

    def flow(x):
        r = np.array([x[0], 0.0, x[2] - 2.0])
        return 3 / (2 * np.pi * (r @ r)) * np.cross([0, 1, 0], r)

    for index in range(12):
        x, v = state(sim)
        for s in range(substeps):
            rest = length * factors_of(scene, net, (index * substeps + s) * h)
            springs = [(i, j, 300.0, 0.6, r) for (i, j), r in zip(net.springs, rest, strict=True)]
            force = elastic.forces(x, v, springs) + fluid.water_forces(x, v, flow, facets, 40.0, inverse, h)
            v = v + h * (force * inverse[:, None] + gravity)
            x = x + h * v
            x[0], v[0] = home[0], 0.0
        sim.step_frame()
        assert np.abs(state(sim)[0] - x).max() < 1e-6 and np.abs(state(sim)[1] - v).max() < 3e-5, index


@pytest.mark.parametrize("solver", ["semi_implicit_euler", "drift_kick", "verlet"])
def test_parts_and_plain_kernels_share_their_bits(solver, monkeypatch):
    monkeypatch.setattr("warpsim.launch.PARALLEL_FROM", 0)
    long = {**BODY, "sections": [{"at": k / 40, "width": 0.1, "height": 0.1} for k in range(41)]}
    scene = network(**(KEYS | {"generator": long, "solver": solver, "pins": ["head"], "muscles": MUSCLES[:2]}))
    hashes = set()
    for native, threads in ((True, 1), (True, 2), (True, 3), (False, 1), (False, 3)):
        sim = Simulation(scene, device="cpu", threads=threads, native=native)
        sim.run(0.2)
        hashes.add(sim.state_hash())
    assert len(hashes) == 1
