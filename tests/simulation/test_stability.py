"""The stability advisor: never above what a network stands, tight on a grid, and the number that a user is told."""

import json
import subprocess
import sys

import numpy as np
import pytest

from tests.simulation.networks import network, simulate, tangle
from warpsim import SceneError, Simulation, UnstableError
from warpsim.networks import network_of, point_masses, spring_numbers
from warpsim.stability import MARGIN, advice_for, longest_substep

GRID = {"type": "grid", "resolution": [12, 9], "edges": [[1.1, 0, 0], [0, -0.8, 0]]}


def matrices(spec, net) -> tuple[np.ndarray, np.ndarray]:
    """M⁻¹K and M⁻¹C of the free points at the start, in float64; a spring's derivative by its ends."""
    stiffness, damping, rest = spring_numbers(spec, net)
    n = len(net.points)
    k, c = np.zeros((n, n, 3, 3)), np.zeros((n, n, 3, 3))
    for (i, j), ks, cs, r in zip(net.springs, stiffness, damping, rest, strict=True):
        d = net.points[j] - net.points[i]
        length = np.linalg.norm(d)
        along = np.outer(d, d) / length**2
        for matrix, block in ((k, ks * (along + (1 - r / length) * (np.eye(3) - along))), (c, cs * along)):
            for a, b, sign in ((i, i, 1), (j, j, 1), (i, j, -1), (j, i, -1)):
                matrix[a, b] += sign * block
    free = np.setdiff1d(np.arange(n), spec.pinned(spec.pins))
    mass = point_masses(spec, net)[free]
    return tuple((m[np.ix_(free, free)] / mass[:, None, None, None]).transpose(0, 2, 1, 3).reshape(3 * len(free), -1) for m in (k, c))


def growth(stiffness: np.ndarray, damping: np.ndarray, h: float) -> float:
    """Return the largest factor by which a step of h (kick, then drift) multiplies anything."""
    eye = np.eye(len(stiffness))
    kicked = np.hstack([-h * stiffness, eye - h * damping])
    step = np.vstack([np.hstack([eye, 0 * eye]) + h * kicked, kicked])
    return float(np.abs(np.linalg.eigvals(step)).max())


@pytest.mark.parametrize("seed", range(50))
def test_the_bound_is_never_above_what_a_random_network_stands(seed):
    """Stretched and slack springs, light and heavy points, pins; compressed springs push sideways and would buckle at any step."""
    net_keys = tangle(12 + seed % 9, 40, seed)
    net_keys["damping"] = [0.3 * c * (seed % 3) for c in net_keys["damping"]]
    spec = network(**net_keys, pins=[0, 5], solver="verlet").systems["s"]
    net = network_of(spec, "s")
    length = np.linalg.norm(np.diff(net.points[net.springs], axis=1)[:, 0], axis=1)
    rest = np.minimum(spec.rest_length, length).tolist()
    spec = spec.model_copy(update={"rest_length": tuple(rest)})
    stiffness, damping = matrices(spec, net)
    longest = longest_substep(spec, net)
    assert growth(stiffness, damping, 0.999 * longest) < 1 + 1e-6
    assert growth(stiffness, damping, 4 * longest) > 1, "and no more than a few times too careful"


def swings(h: float, seconds: float, **keys) -> bool:
    """Whether a slightly rumpled grid keeps its energy over many substeps of h."""
    sim = simulate(generator=GRID, stiffness=80.0, mass=0.02, solver="verlet", fps=1 / h, substeps=1, **keys)
    field = sim.systems["s"].population.field("velocity")
    rumple = field.numpy()
    rumple[:, :108] = 1e-3 * np.random.default_rng(5).normal(size=(3, 108))
    field.assign(rumple)
    before = sim.statistics()["s"]["kinetic_energy"]
    try:
        sim.run(seconds)
    except UnstableError:
        return False
    return sim.statistics()["s"]["kinetic_energy"] < 100 * before


def test_the_bound_is_within_five_percent_of_the_blow_up_of_a_grid():
    """Verlet, springs along and across the cells; 3000 substeps let 5 % beyond the bound grow by e^(0.3 · 3000)."""
    spec = network(generator=GRID, stiffness=80.0, mass=0.02, solver="verlet").systems["s"]
    longest = longest_substep(spec, network_of(spec, "s"))
    assert longest == pytest.approx((0.02 / (80.0 + 80.0)) ** 0.5, rel=1e-3), "h = √(m/(k_s + k_d)): diagonals at 45° weigh in full"
    assert swings(0.999 * longest, 3000 * longest) and not swings(1.05 * longest, 3000 * longest)


def test_auto_takes_what_the_springs_need():
    auto = simulate(generator=GRID, stiffness=800.0, mass=0.002, damping=0.01, substeps="auto", pins=["top"], gravity=(0, -9.81, 0))
    advice = auto.advice["s"]
    assert advice.sufficient and auto.systems["s"].pace.substep_count == advice.chosen
    assert 1 / 60 / advice.chosen <= MARGIN * advice.longest < 1 / 60 / (advice.chosen - 1)
    auto.run(1.0)
    assert advice_for(auto.scene.systems["s"], auto.scene, auto.systems["s"].net).chosen == advice.chosen
    auto.change("systems.s.stiffness", 80_000.0)
    assert not auto.advice["s"].sufficient and auto.advice["s"].chosen == advice.chosen
    with pytest.raises(UnstableError, match="auto counted before a number was changed"):
        auto.run(1.0)


def test_a_blow_up_names_the_number_that_helps():
    keys = {"generator": GRID, "stiffness": 2e4, "mass": 0.01, "pins": ["top"], "gravity": (0, -9.81, 0)}
    with pytest.raises(UnstableError) as unstable:
        simulate(**keys, substeps=2).run(5.0)
    least = simulate(**keys, substeps=2).advice["s"].least
    assert f"try substeps: {least} for this system, or auto" in unstable.value.suggestion
    simulate(**keys, substeps=least).run(5.0)


def test_what_no_substep_can_hold_is_refused():
    with pytest.raises(SceneError, match="substeps per frame, and a frame has at most 10000"):
        simulate(generator=GRID, stiffness=1e12, mass=1e-6, substeps="auto")
    with pytest.raises(ValueError, match="with euler whatever swings grows"):
        network(generator=GRID, stiffness=1.0, substeps="auto", solver="euler")
    with pytest.raises(SceneError, match="with euler whatever swings undamped grows"):
        simulate(generator=GRID, stiffness=1e4, mass=1e-3, damping=1e-4, substeps="auto", solver="euler")
    assert simulate(generator=GRID, stiffness=0.0, substeps="auto").advice["s"].chosen == 1


@pytest.mark.parametrize("solver", ["euler", "adams_bashforth_2", "adams_bashforth_4", "abm_pece_4", "rk4", "heun"])
def test_auto_holds_a_rumpled_net_with_the_solvers_that_ask_for_more(solver):
    """Springs with damping c = k/2000 s: auto has a number for each, with which no energy comes but, in a first frame, by 3 %."""
    keys = {"generator": GRID, "stiffness": 80.0, "mass": 0.02, "damping": 0.04, "solver": solver}
    sim = simulate(**keys, substeps="auto")
    field = sim.systems["s"].population.field("velocity")
    rumple = field.numpy()
    rumple[:, :108] = 0.1 * np.random.default_rng(5).normal(size=(3, 108))
    field.assign(rumple)
    energy = []
    for _ in range(120):
        numbers = sim.statistics()["s"]
        energy.append(numbers["kinetic_energy"] + numbers["elastic_energy"])
        sim.step_frame()
    assert max(energy) < 1.05 * energy[0] and energy[-1] < 0.9 * energy[0] and sim.advice["s"].sufficient


def test_run_and_info_tell(tmp_path):
    scene = "name: x\ntime: {substeps: 2}\nsystems:\n  net:\n    type: springs\n    stiffness: 2000\n    mass: 0.01\n"
    scene += "    generator: {type: chain, count: 5, start: [0, 0, 0], end: [1, 0, 0]}\n"
    (tmp_path / "x.yaml").write_text(scene)

    def say(*words) -> str:
        line = [sys.executable, "-m", "warpsim", *words]
        return subprocess.run(line, capture_output=True, text=True, check=True).stdout

    path = str(tmp_path / "x.yaml")
    assert "net: stable for sure from 8 substeps per frame on" in say("run", path, "--viewer", "none", "--frames", "1")
    assert "stable for sure from 8 substeps per frame on, of 0.00224 s at most; it has 2" in say("info", path)
    assert json.loads(say("info", path, "--json"))["stability"]["net"]["least_substeps"] == 8


def test_the_advice_knows_the_network_of_a_simulation():
    sim = Simulation(network(**tangle()), device="cpu")
    assert sim.advice["s"].longest == longest_substep(sim.scene.systems["s"], sim.systems["s"].net)
