"""XPBD: colors, formulas and whole frames against the twin; native loops, plain kernels and any parts to the bit."""

import numpy as np
import pytest
import warp as wp

from tests.reference import cloth as sheets
from tests.reference import xpbd as twin
from tests.simulation.networks import network, simulate, state, tangle
from warpsim import Simulation
from warpsim.coloring import greedy, of_sheet, pieces, runs
from warpsim.kernels.xpbd import damping_impulse, spring_pull
from warpsim.networks import network_of, spring_numbers
from warpsim.systems.solvers.xpbd import Xpbd

GRAVITY, ALPHA = (0.3, -9.81, 0.0), 0.4
MOTION = {"pins": [3], "keyframes": [[0.0, [0, 0, 0]], [0.1, [0.2, 0, 0.1]], [0.2, [0.2, 0.3, 0.1]]]}
NUMBERS = {"structural": (2000.0, 0.2), "shear": (900.0, 0.1), "bend": (50.0, 0.05)}
EDGES = [[1.4, 0, 0], [0.1, -1.0, 0.05]]


def sheet(nx: int, ny: int, **keys) -> dict:
    """Keys of a sheet of nx × ny points."""
    kinds = {kind: {"stiffness": k, "damping": c} for kind, (k, c) in NUMBERS.items()}
    return {"type": "cloth", "resolution": [nx, ny], "edges": EDGES, "density": 0.5, "solver": "xpbd", **kinds, **keys}


def check_colors(springs: np.ndarray, coloring) -> None:
    assert sorted(coloring.order) == list(range(len(springs))) and coloring.begin[0] == 0 and coloring.begin[-1] == len(springs)
    for begin, end in zip(coloring.begin, coloring.begin[1:], strict=False):
        ends = springs[coloring.order[begin:end]].ravel()
        assert len(set(ends)) == len(ends), "two springs of a color share a point"


@pytest.mark.parametrize(("count", "springs"), [(2, 1), (70, 200), (300, 2000)])
def test_no_two_springs_of_a_color_share_a_point(count, springs):
    """First fit needs at most 2 d − 1 colors where a point has d springs, and no fewer than d."""
    pairs = np.array(tangle(count, springs)["springs"])
    coloring = greedy(pairs)
    check_colors(pairs, coloring)
    most = np.bincount(pairs.ravel()).max()
    assert most <= len(coloring.begin) - 1 <= 2 * most - 1
    for color in range(1, len(coloring.begin) - 1):  # each spring is where no earlier color had room for it
        earlier = pairs[coloring.order[: coloring.begin[color]]]
        assert all((earlier == i).any() or (earlier == j).any() for i, j in pairs[coloring.order[coloring.begin[color] :]])


@pytest.mark.parametrize("size", [(2, 2), (2, 5), (3, 3), (7, 4), (9, 10), (259, 3)])
def test_the_colors_of_a_sheet_are_colors(size):
    springs = network_of(network(**sheet(*size)).systems["s"], "systems.s").springs
    check_colors(springs, of_sheet(springs, size))
    check_colors(springs, of_sheet(springs[:, ::-1], size))


@pytest.mark.parametrize("generator", ["chain", "ring", "grid", "block", "tangle"])
def test_pieces_are_all_springs_once_and_lines_where_they_say_so(generator):
    """Generated networks lie in lines but for the springs along their rows; a color's pieces follow each other."""
    sizes = {"chain": {"count": 70, "start": [0, 0, 0], "end": [1, 0, 0]}, "ring": {"count": 70, "radius": 1.0}}
    sizes |= {"grid": {"resolution": [70, 9], "edges": [[1, 0, 0], [0, 1, 0]]}, "block": {"resolution": [9, 8, 7], "size": [1, 1, 1]}}
    keys = tangle() if generator == "tangle" else {"generator": {"type": generator, **sizes[generator]}, "stiffness": 1.0}
    springs = network_of(network(**keys).systems["s"], "systems.s").springs
    coloring = greedy(springs)
    check_colors(springs, coloring)
    found, first = pieces(coloring, springs)
    assert first[0] == 0 and first[-1] == len(found) and (np.abs(found[:, 1]) <= 64).all() and (found[:, 1] != 0).all()
    for color, (begin, end) in enumerate(zip(first, first[1:], strict=False)):
        places = [place + k for place, count in found[begin:end] for k in range(abs(count))]
        assert places == list(range(coloring.begin[color], coloring.begin[color + 1]))
    in_line = 0
    for place, count in found:
        if count > 0:
            numbers = coloring.order[place : place + count]
            assert (np.diff(numbers) == 1).all() and (np.diff(springs[numbers], axis=0) == 1).all()
            in_line += count
    share = {"chain": 0.0, "ring": 0.0, "grid": 0.7, "block": 0.7, "tangle": 0.0}[generator]
    assert share <= in_line / len(springs) <= share + 0.25
    if generator in ("grid", "block"):
        assert len(coloring.begin) - 1 == {"grid": 8, "block": 26}[generator]


def test_small_colors_in_a_row_go_together():
    assert runs([9, 8, 2, 1, 9, 1, 9], 5) == [(0, 1), (1, 2), (2, 4), (4, 5), (5, 6), (6, 7)]
    assert runs([], 5) == [] and runs([1, 1], 5) == [(0, 2)] and runs([5], 5) == [(0, 1)]


def test_a_pull_is_the_papers():
    """float32: 8 roundings of numbers of the size of the answer; stiffness up to what is rigid at any substep."""
    rng = np.random.default_rng(1)
    for _ in range(300):
        x = rng.normal(size=(2, 3)).astype(np.float32)
        w, h = rng.uniform(0.1, 3.0, 2).astype(np.float32), float(np.float32(rng.uniform(1e-3, 1e-1)))
        r, k = (float(np.float32(value)) for value in (rng.uniform(0, 3), 10 ** rng.uniform(0, 9)))
        before = x.astype(float)
        multipliers = np.array([rng.normal()])
        previous, places, velocities = multipliers.copy(), before.copy(), np.zeros((2, 3))
        twin.project(places, velocities, multipliers, 0, (0, 1, k, 0.0, r), w.astype(float), h)
        # The kernel's λ is the paper's with the other sign: a spring that pulls has a positive one.
        pull = np.array(spring_pull(*(wp.vec3(*map(float, p)) for p in x), r, k * h * h, float(w.sum()), float(-previous[0])))
        moved = np.stack([pull[:3] * w[0], -pull[:3] * w[1]])
        size = np.abs(places - before).max() + np.linalg.norm(x[1] - x[0]) + r
        assert np.abs(before + moved - places).max() < 8 * 2**-24 * size
        assert velocities == pytest.approx((places - before) / h, rel=1e-6, abs=1e-9)
        assert -pull[3] == pytest.approx((multipliers - previous)[0], rel=1e-5, abs=8 * 2**-24 * size / w.sum() * 4)


def test_pull_and_damping_have_limits():
    """No stiffness or no damping: nothing. Coincident ends: no direction. Stiff or damped beyond measure: they meet, or move together."""
    x, y, v, u = wp.vec3(0.0, 0.0, 0.0), wp.vec3(0.0, 2.0, 0.0), wp.vec3(1.0, 0.5, 0.0), wp.vec3(-1.0, 3.0, 0.0)
    assert list(spring_pull(x, y, 1.0, 0.0, 2.0, 0.0)) == [0.0] * 4
    assert list(spring_pull(x, y, 1.0, 1e12, 2.0, 0.0))[:3] == pytest.approx([0.0, 0.5, 0.0], rel=1e-6)
    assert list(spring_pull(x, x, 1.0, 1e12, 2.0, 0.0))[:3] == [0.0] * 3
    assert list(damping_impulse(x, v, y, u, 0.0, 2.0)) == [0.0] * 3 and list(damping_impulse(x, v, x, u, 1e9, 2.0)) == [0.0] * 3
    assert list(damping_impulse(x, v, y, u, 1e9, 2.0)) == pytest.approx([0.0, 2.5 / 2, 0.0], rel=1e-6)


@pytest.mark.parametrize("turns", [1, 3])
@pytest.mark.parametrize("native", [True, False])
def test_frames_of_springs_equal_the_twin(native, turns, device):
    """Each frame starts the twin from the device's state: 3 substeps of float32, |x| < 3 m, C to 2e-7 m and that over h is 4e-5 m/s."""
    net, substeps, h = tangle(), 3, 1 / 180
    net["stiffness"] = [k * 40 for k in net["stiffness"]]
    keys = {"gravity": GRAVITY, "substeps": substeps, "pins": [3, 8], "pin_motion": [MOTION], "coupling": {"alpha": ALPHA}}
    sim = simulate(device=device, native=native, **net, **keys, solver="xpbd", iterations=turns)
    springs = [
        (*pair, k, c, r) for pair, k, c, r in zip(*(net[n] for n in ("springs", "stiffness", "damping", "rest_length")), strict=True)
    ]
    mass, home, order = np.array(net["mass"]), np.array(net["points"]), greedy(np.array(net["springs"])).order
    w = 1 / mass
    w[[3, 8]] = 0.0
    times, places = [row[0] for row in MOTION["keyframes"]], np.array([row[1] for row in MOTION["keyframes"]])

    def held(t):
        return {3: home[3] + [np.interp(t, times, places[:, axis]) for axis in range(3)], 8: home[8]}

    assert np.abs(state(sim)[0] - home).max() < 1e-7 and not state(sim)[1].any()
    for index in range(12):
        pins = [held((index * substeps + s + 1) * h) for s in range(substeps)]
        x, v = twin.frame(*state(sim), springs, order, w, lambda x, v: np.tile(GRAVITY, (len(x), 1)), ALPHA / mass, h, pins, turns)
        sim.step_frame()
        assert np.abs(state(sim)[0] - x).max() < 4e-6 and np.abs(state(sim)[1] - v).max() < 4e-4, index


@pytest.mark.parametrize("turns", [1, 3])
@pytest.mark.parametrize("native", [True, False])
def test_frames_of_cloth_equal_the_twin(native, turns, device):
    """As above, with the wind across the sheet; twelve springs to a point, fifteen colors one after the other."""
    nx, ny, alpha, wind, substeps, h = 7, 6, 0.003, np.array([0.5, 0.2, 3.0]), 3, 1 / 180
    flow = {"flow": [{"type": "uniform", "velocity": wind.tolist()}]}
    keys = {"gravity": GRAVITY, "substeps": substeps, "air": 2.0, "drag": alpha, "pins": ["left", [6, 4]], "iterations": turns}
    sim = simulate(**sheet(nx, ny, **keys), device=device, native=native, more=flow)
    spec = sim.scene.systems["s"]
    net, mass = network_of(spec, "systems.s"), sim.frame()["s"].mass.astype(float)
    springs = [(*pair, k, c, r) for pair, k, c, r in zip(net.springs, *spring_numbers(spec, net), strict=True)]
    order, held, w = of_sheet(net.springs, (nx, ny)).order, spec.pinned(spec.pins), 1 / mass
    w[held] = 0.0

    def outer(x, v):
        return GRAVITY + sheets.pull(nx, ny, x, v, wind, 2.0 / 0.5, h) * (w > 0)[:, None]

    pins = [{i: net.points[i] for i in held}] * substeps
    for index in range(12):
        x, v = twin.frame(*state(sim), springs, order, w, outer, alpha / mass, h, pins, turns)
        sim.step_frame()
        assert np.abs(state(sim)[0] - x).max() < 4e-6 and np.abs(state(sim)[1] - v).max() < 4e-4, index
    assert np.abs(state(sim)[0] - net.points).max() > 0.05


def hashes_of(scene, seconds: float) -> set[str]:
    """State hashes of a scene run natively and plainly, by one and more cores."""
    hashes = set()
    for native, threads in ((True, 1), (True, 2), (True, 5), (False, 1), (False, 3)):
        sim = Simulation(scene, device="cpu", threads=threads, native=native)
        sim.run(seconds)
        assert np.isfinite(state(sim)[0]).all()
        hashes.add(sim.state_hash())
    return hashes


@pytest.mark.parametrize("turns", [1, 2])
@pytest.mark.parametrize("worth", [1, 40, 10**6])
@pytest.mark.parametrize("count", [2, 65, 500])
def test_parts_and_plain_kernels_share_their_bits(count, worth, turns, monkeypatch):
    """However many colors a launch takes, and whoever takes them."""
    monkeypatch.setattr("warpsim.launch.PARALLEL_FROM", 0)
    monkeypatch.setattr("warpsim.systems.solvers.xpbd.WORTH_A_LAUNCH", {True: worth, False: 40})
    wind = {"flow": [{"type": "uniform", "velocity": [1, 0, {"sine": {"amplitude": 1, "period": 0.1}}]}]}
    pins = {"pins": [1], "pin_motion": [{"displacement": [{"expression": "sin(9*t)"}, 0, 0]}]}
    keys = {"gravity": GRAVITY, "coupling": {"viscosity": 1e-2}, "radius": 0.1, "solver": "xpbd", "iterations": turns}
    assert len(hashes_of(network(**tangle(count, 3 * count), **pins, **keys, more=wind), 0.1)) == 1


@pytest.mark.parametrize("worth", [1, 10**6])
@pytest.mark.parametrize("generator", ["block", "grid"])
def test_lines_of_generated_networks_share_their_bits(generator, worth, monkeypatch):
    monkeypatch.setattr("warpsim.launch.PARALLEL_FROM", 0)
    monkeypatch.setattr("warpsim.systems.solvers.xpbd.WORTH_A_LAUNCH", {True: worth, False: 40})
    sizes = {"grid": {"resolution": [70, 9], "edges": [[1, 0, 0], [0, 0.2, 0]]}, "block": {"resolution": [17, 6, 5], "size": [1, 0.3, 0.3]}}
    keys = {"mass": 0.01, "stiffness": 300.0, "damping": 0.05, "pins": ["left"], "gravity": GRAVITY, "solver": "xpbd", "iterations": 2}
    assert len(hashes_of(network(generator={"type": generator, **sizes[generator]}, **keys), 0.1)) == 1


@pytest.mark.parametrize("turns", [1, 2])
@pytest.mark.parametrize("size", [(2, 2), (63, 3), (64, 4), (65, 9), (66, 6), (67, 5), (130, 11), (3, 70), (256, 3), (257, 3), (515, 6)])
def test_strips_of_a_sheet_share_their_bits(size, turns, monkeypatch):
    monkeypatch.setattr("warpsim.launch.PARALLEL_FROM", 0)
    more = {
        "flow": [{"type": "uniform", "velocity": [1, 0, {"sine": {"amplitude": 4, "period": 0.1}}]}],
        "colliders": [{"type": "sphere", "center": [0.7, -1.0, 0.0], "radius": 0.3}],
    }
    scene = network(**sheet(*size, pins=["top"], air=1.0, drag=1e-4, gravity=GRAVITY, substeps=3, iterations=turns), more=more)
    assert len(hashes_of(scene, 0.1)) == 1


@pytest.mark.parametrize("native", [True, False])
@pytest.mark.parametrize("size", [(9, 6), (258, 3)])
def test_a_sheet_is_the_same_spring_by_spring(size, native, monkeypatch):
    """The way of sheets whose springs change one by one: the same colors in the same order, rest lengths a rounding apart."""
    ways, counts = [], []
    for in_rows in (True, False):
        monkeypatch.setattr(Xpbd, "_in_rows", in_rows)
        sim = simulate(**sheet(*size, pins=["top"], gravity=GRAVITY, substeps=3), native=native)
        counts.append(sum(stage.name == "damping" for stage in sim._graph.stages))
        sim.run(0.1)
        ways.append(state(sim)[0])
    assert np.abs(ways[0] - ways[1]).max() < 2e-5 and counts[0] != counts[1]


def test_a_hub_with_many_spokes_is_one_run_of_colors():
    """Each of 3000 springs is a color of its own: which is not worth 3000 launches. One after the other they rock the hub a little."""
    angle = 2 * np.pi * np.arange(3000) / 3000
    points = [[0.0, 0.0, 0.0], *np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=1).tolist()]
    springs = [[0, i + 1] for i in range(3000)]
    sim = simulate(points=points, springs=springs, stiffness=1e4, rest_length=0.9, mass=[1e3, *[0.1] * 3000], solver="xpbd", substeps=2)
    assert sum(stage.name == "springs" for stage in sim._graph.stages) < 10
    sim.run(0.5)
    x, _ = state(sim)
    assert np.abs(x[0]).max() < 0.01 and np.linalg.norm(x[1:] - x[0], axis=1) == pytest.approx(np.full(3000, 0.9), abs=0.05)


@pytest.mark.parametrize("strained", [{"strain_limit": 0.2}, {"tear": 0.15}])
def test_all_parts_at_once_share_their_bits(strained, monkeypatch):
    """Hinges, a strain limit or tearing, layers that meet, a collider and wind, by one core and more, natively and plainly."""
    monkeypatch.setattr("warpsim.launch.PARALLEL_FROM", 0)
    more = {
        "flow": [{"type": "uniform", "velocity": [0, {"sine": {"amplitude": 9, "period": 0.1}}, 3]}],
        "colliders": [{"type": "sphere", "center": [0.7, -0.4, 0.1], "radius": 0.3}],
    }
    keys = {
        "edges": [[1.4, 0, 0], [0, -1.0, 0]],
        "bending": {"stiffness": 1e-4, "damping": 1e-6},
        "self_collision": True,
    }
    pull = [{"pins": ["right"], "keyframes": [[0, [0, 0, 0]], [0.2, [-0.9, 0, 0]], [0.4, [2, 0, 0]]]}]
    keys |= {"pins": ["left", "right"], "pin_motion": pull, "air": 1.0, "gravity": GRAVITY, "substeps": 4} | strained
    assert len(hashes_of(network(**sheet(24, 17, **keys), more=more), 0.4)) == 1
