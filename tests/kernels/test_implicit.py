"""Implicit Euler: weaves, the matrix of a spring, its block's factor, and whole frames against a dense solution; bits for any parts."""

import numpy as np
import pytest
import warp as wp

from tests.kernels.test_cloth import AIR, DENSITY, EDGES, GRAVITY, NUMBERS, sheet
from tests.reference import cloth as cloth_twin
from tests.reference import implicit as twin
from tests.reference.integration import kick
from tests.simulation.networks import network, simulate, state, tangle
from warpsim import Simulation
from warpsim.kernels.implicit import inverse_factor, resist, scale_back, scale_down, tie_of
from warpsim.networks import network_of
from warpsim.weaves import SCATTERED, woven

ALPHA = 0.4
MOTION = {"pins": [3], "keyframes": [[0.0, [0, 0, 0]], [0.1, [0.2, 0, 0.1]], [0.2, [0.2, 0.3, 0.1]]]}


def springs_of(case: str, count: int) -> tuple[int, np.ndarray]:
    """Return a number of points and springs between them."""
    if case == "random":
        rng = np.random.default_rng(count)
        pairs = [(i, j) for i in range(count) for j in range(i) if rng.random() < 0.1]
        return count, np.array(pairs, np.int32).reshape(-1, 2)
    if case == "sheet":
        spec = network(**sheet(count, 7)).systems["s"]
        return count * 7, network_of(spec, "").springs
    return count, np.stack([np.arange(count - 1), np.arange(1, count)], axis=1).astype(np.int32).reshape(-1, 2)


@pytest.mark.parametrize("case", ["random", "sheet", "chain"])
@pytest.mark.parametrize("count", [2, 63, 64, 65, 200])
def test_every_spring_is_woven_twice_and_rows_by_step_keep_theirs(case, count):
    n, springs = springs_of(case, count)
    weave = woven(n, springs)
    found = []
    for i in range(64 * (len(weave.begin) - 1)):
        for row in range(weave.begin[i // 64], weave.begin[i // 64 + 1]):
            number, j = weave.spring[row, i % 64], weave.neighbor[row, i % 64]
            if number < 0:
                assert j == i
                continue
            found.append((number, i, j))
            assert weave.step[row] in (SCATTERED, j - i) and abs(j - i) <= (weave.reach if weave.step[row] != SCATTERED else n)
    expected = [(k, *pair) for k, pair in enumerate(springs.tolist())] + [(k, j, i) for k, (i, j) in enumerate(springs.tolist())]
    assert sorted(found) == sorted(expected) and weave.reach % 64 == 0
    assert case == "random" or (weave.step != SCATTERED).all()


def test_a_spring_twice_between_the_same_points_is_scattered():
    weave = woven(3, np.array([[0, 1], [0, 1], [1, 2]]))
    assert (weave.step == SCATTERED).all() and sorted(weave.spring[weave.spring >= 0]) == [0, 0, 1, 1, 2, 2]


def test_the_matrix_of_a_spring_equals_the_twin_and_is_positive():
    """float32: some 10 roundings of the largest entry; coincident ends have no direction, but a spring of no rest length holds them."""
    rng = np.random.default_rng(1)
    for turn in range(200):
        d = rng.normal(size=3).astype(np.float32)
        r, k, c, h = (float(np.float32(x)) for x in (*rng.uniform(0, 2, 1), *rng.uniform(0, 1e4, 2), rng.uniform(1e-3, 0.1)))
        tie = tie_of(wp.vec3(*map(float, d)), r, k, c * (turn % 2), h, 1e-3)
        w, beta, e = np.array(tie.w, float), tie.beta, rng.normal(size=3)
        expected = twin.tie_matrix(d.astype(float), k, c * (turn % 2), r, h)
        matrix = beta * np.eye(3) + np.outer(w, w)
        assert matrix == pytest.approx(expected, abs=10 * 2**-24 * np.abs(expected).max())
        assert beta >= 0.0
        assert np.array(resist(tie.w, beta, wp.vec3(*e))) == pytest.approx(matrix @ e, abs=1e-5 * np.abs(matrix).max())
    light = tie_of(wp.vec3(2.0, 0.0, 0.0), 1.0, 1e12, 1e12, 0.01, 50.0)  # no more than 1e5/50 kg along it
    assert light.w[0] ** 2 == pytest.approx(1e3 + 2e3, rel=1e-6) and light.beta == pytest.approx(1e3, rel=1e-6)
    assert light.impulse[0] == pytest.approx(2e3 / 0.01, rel=1e-6)
    still = tie_of(wp.vec3(), 0.5, 1e12, 1e12, 0.01, 1.0)
    assert [*still.w, still.beta, *still.impulse] == [0.0] * 7
    assert tie_of(wp.vec3(), 0.0, 100.0, 0.0, 0.1, 1.0).beta == pytest.approx(1.0)


@wp.kernel(enable_backward=False)
def invert_blocks(mass: wp.array[wp.float64], block: wp.array2d[wp.float64], inverse_out: wp.array3d[float]):
    """Store L⁻ᵀ L⁻¹ of each block, column by column."""
    i = wp.tid()
    factor = inverse_factor(mass[i], block[i, 0], block[i, 1], block[i, 2], block[i, 3], block[i, 4], block[i, 5])
    for column in range(3):
        axis = wp.vec3()
        axis[column] = 1.0
        z = scale_back(factor, scale_down(factor, axis))
        for row in range(3):
            inverse_out[i, row, column] = z[row]


@pytest.mark.parametrize("stiffness", [0.0, 1.0, 1e3, 1e6, 1e12])
def test_a_factor_inverts_its_block_however_stiff(stiffness, device):
    """L⁻ᵀ L⁻¹ of m I + Σ k n nᵀ in the norm of the block, whose root magnifies ten roundings of the entries; never negative beyond them."""
    rng = np.random.default_rng(5)
    mass, blocks = rng.uniform(0.5, 2, 50), []
    for turn in range(50):
        n = rng.normal(size=(1 + turn % 4, 3))
        blocks.append(stiffness * n.T @ n)
    upper = np.array([block[np.triu_indices(3)] for block in blocks])
    out = wp.zeros((50, 3, 3), dtype=float, device=device)
    wp.launch(invert_blocks, 50, [wp.array(array, dtype=wp.float64, device=device) for array in (mass, upper)], [out], device=device)
    for m, block, inverse in zip(mass, blocks, out.numpy().astype(float), strict=True):
        root = np.linalg.cholesky(m * np.eye(3) + block)
        if stiffness <= 1e3:  # beyond, the root magnifies so much that there is nothing to compare
            assert root.T @ inverse @ root == pytest.approx(np.eye(3), abs=10 * 2**-24 * (1.0 + stiffness))
        assert np.linalg.eigvalsh(0.5 * (inverse + inverse.T)).min() > -10 * 2**-24


@pytest.mark.parametrize("native", [True, False])
def test_frames_of_a_tangle_equal_a_dense_solution(native, device):
    """Each frame starts the twin from the device's state. Tolerance 1e-6: what is left of a change of some m/s is below rounding."""
    net, substeps, pins = tangle(), 3, [3, 8]
    net["stiffness"] = [50 * k for k in net["stiffness"]]
    keys = {"solver": "implicit_euler", "gravity": GRAVITY, "substeps": substeps, "pins": pins, "pin_motion": [MOTION]}
    sim = simulate(device=device, native=native, **net, **keys, coupling={"alpha": ALPHA}, tolerance=1e-6, iterations=500)
    springs = [
        (*pair, k, c, r) for pair, k, c, r in zip(*(net[n] for n in ("springs", "stiffness", "damping", "rest_length")), strict=True)
    ]
    mass, home, h = np.array(net["mass"]), np.array(net["points"]), 1 / 60 / substeps
    inertia = mass * (ALPHA / mass * h) / -np.expm1(-ALPHA / mass * h)  # m/φ(k h)
    times, places = [row[0] for row in MOTION["keyframes"]], np.array([row[1] for row in MOTION["keyframes"]])

    def held(t):
        return {3: home[3] + [np.interp(t, times, places[:, axis]) for axis in range(3)], 8: home[8]}

    assert np.abs(state(sim)[0] - home).max() < 1e-7 and not state(sim)[1].any()
    for index in range(10):
        x, v = state(sim)
        for s in range(substeps):
            u = np.array([kick(v[i], 0.0, np.array(GRAVITY), ALPHA / mass[i], h) for i in range(len(v))])
            for i, place in held((index * substeps + s + 1) * h).items():
                u[i] = (place - x[i]) / h
            x, v = twin.substep(x, u, inertia, springs, h, pins)
        sim.step_frame()
        assert np.abs(state(sim)[0] - x).max() < 3e-6 and np.abs(state(sim)[1] - v).max() < 1e-4, index
    assert sim.statistics()["s"]["cg_unconverged"] == 0 and sim.statistics()["s"]["cg_iterations"] > 5


@pytest.mark.parametrize("native", [True, False])
def test_frames_of_a_sheet_in_the_wind_equal_a_dense_solution(native, device):
    """The wind acts before the springs, at the places of the substep's beginning."""
    nx, ny, substeps, wind = 7, 5, 3, np.array([0.5, 0.2, 3.0])
    keys = {"solver": "implicit_euler", "gravity": GRAVITY, "substeps": substeps, "air": AIR, "pins": ["left", [6, 4]]}
    flow = {"flow": [{"type": "uniform", "velocity": wind.tolist()}]}
    sim = simulate(**sheet(nx, ny, **keys), device=device, native=native, more=flow, tolerance=1e-6, iterations=500)
    spec = sim.scene.systems["s"]
    mass, pins, h = sim.frame()["s"].mass.astype(float), spec.pinned(spec.pins), 1 / 60 / substeps
    springs = cloth_twin.springs(nx, ny, np.array(EDGES[0]) / (nx - 1), np.array(EDGES[1]) / (ny - 1), NUMBERS)
    free = np.ones((nx * ny, 1))
    free[pins] = 0.0
    for index in range(12):
        x, v = state(sim)
        for _ in range(substeps):
            u = v + h * free * (np.array(GRAVITY) + cloth_twin.pull(nx, ny, x, v, wind, AIR / DENSITY, h))
            x, v = twin.substep(x, u, mass, springs, h, pins)
        sim.step_frame()
        assert np.abs(state(sim)[0] - x).max() < 3e-6 and np.abs(state(sim)[1] - v).max() < 1e-4, index


@pytest.mark.parametrize("case", ["tangle", "chain", "sheet", "long sheet", "block", "loose"])
def test_parts_and_plain_kernels_share_their_bits(case, monkeypatch):
    monkeypatch.setattr("warpsim.launch.PARALLEL_FROM", 0)
    spring = {"type": "springs", "stiffness": 3e3, "damping": 0.5}
    keys = {
        "tangle": tangle(200, 600),
        "chain": spring | {"generator": {"type": "chain", "count": 150, "start": [0, 0, 0], "end": [3, 0, 0]}, "pins": ["start"]},
        "sheet": sheet(65, 5, pins=["top"], air=1.0),
        "long sheet": sheet(3, 70, pins=["left"]),
        "block": spring | {"generator": {"type": "block", "resolution": [6, 5, 4], "size": [1, 1, 1]}},
        "loose": {"points": [[0, 0, 0], [1, 0, 0]], "springs": [], "stiffness": 1.0},
    }[case]
    more = {"flow": [{"type": "uniform", "velocity": [1, 0, {"sine": {"amplitude": 4, "period": 0.1}}]}]}
    more["colliders"] = [{"type": "sphere", "center": [0.5, -0.6, 0.0], "radius": 0.3}]
    hashes = set()
    scene = network(**keys, solver="implicit_euler", gravity=GRAVITY, more=more, substeps=2)
    for native, threads in ((True, 1), (True, 2), (True, 3), (False, 1), (False, 2)):
        sim = Simulation(scene, device="cpu", threads=threads, native=native)
        sim.run(0.2)
        hashes.add(sim.state_hash())
    assert len(hashes) == 1
