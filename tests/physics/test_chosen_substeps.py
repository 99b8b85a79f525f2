"""Substeps that each particle chooses: the tolerance is kept, no more is done than it asks for, and who cannot keep it is counted."""

import numpy as np
import pytest
import warp as wp

from tests.physics.scenes import scene, simulate, start, state
from tests.reference.integration import interpolate
from warpsim.kernels.adaptive import past_at

PULL = {"type": "attractor", "center": [0, 0, 0], "strength": 1.0, "law": "inverse_square"}
WHIRL = {"type": "vortex", "axis": [0, 0, 1], "circulation": 12.0}
COMET = start((1, 0, 0), (0, 0.35, 0))  # a = 0.533 m, period 2.44 s, nearest 0.065 m: sixty times the acceleration of the start


@wp.kernel(module="tests.adaptive")
def sample_pasts(values: wp.array[wp.vec3], places: wp.array[float], past_out: wp.array[wp.vec3]):
    i = wp.tid()
    d1 = values[0] - values[1]
    d2 = d1 - (values[1] - values[2])
    d3 = d2 - ((values[1] - values[2]) - (values[2] - values[3]))
    past_out[i] = past_at(values[0], d1, d2, d3, places[i])


def test_the_past_is_read_off_its_polynomial(device):
    """Against Lagrange's through the same four values, from halved substeps to twice doubled ones; far out its terms grow to 120."""
    values = np.random.default_rng(1).normal(size=(4, 3))
    places = np.array([-0.25, -0.5, -0.75, -1.0, -1.5, -2.0, -3.0, -4.0, -6.0], np.float32)
    out = wp.zeros(len(places), dtype=wp.vec3, device=device)
    inputs = [wp.array(values, dtype=wp.vec3, device=device), wp.array(places, dtype=float, device=device), out]
    wp.launch(sample_pasts, len(places), inputs, device=device)
    expected = [interpolate([0, -1, -2, -3], values, float(s)) for s in places]
    assert np.abs(out.numpy() - expected).max() < 1e-5


def comet(tolerance: float, solver: str = "abm_pece_4", **keys):
    return simulate(COMET, forces=(PULL,), solver=solver, substeps="auto", tolerance=tolerance, max_substeps=256, **keys)


def energy(sim) -> float:
    x, v = state(sim)
    return 0.5 * (v[0] @ v[0]) - 1.0 / np.linalg.norm(x[0])


@pytest.mark.parametrize("solver", ["abm_pece_2", "abm_pece_4"])
def test_a_smaller_tolerance_is_a_smaller_error(solver):
    """Two orbits. A tenth of the tolerance is a step 10^{−1/3} or 10^{−1/5} as long, by jumps of 2, and energy 4.6 or 6.3 times as true."""
    errors = []
    for tolerance in (1e-4, 1e-5, 1e-6):
        sim = comet(tolerance, solver)
        begin = energy(sim)
        sim.run(4.8)
        errors.append(abs(energy(sim) / begin - 1.0))
        assert sim.statistics()["p"]["inexact"] == 0
    assert errors[0] < 0.03 and errors[1] < errors[0] / 2 and errors[2] < errors[0] / 10


def test_many_substeps_where_it_is_needed_and_few_elsewhere():
    sim, chosen, distances = comet(1e-6), [], []
    for _ in sim.frames(144):
        chosen.append(sim.statistics()["p"]["substeps"])
        distances.append(np.linalg.norm(state(sim)[0]))
    near, far = np.argsort(distances)[:4], np.argsort(distances)[-60:]
    assert np.mean(np.array(chosen)[near]) >= 8 and np.mean(np.array(chosen)[far]) <= 2
    assert all(value == 2.0 ** round(np.log2(value)) for value in chosen)


def test_tracers_choose_too():
    """A tight vortex, forty turns a second at the center's edge and one far out: each circle is kept to a hundred tolerances a turn."""
    emitters = [start((r, 0, 0)) for r in (0.2, 1.5)]
    sim = simulate(*emitters, flow=(WHIRL,), coupling="tracer", solver="abm_pece_4", substeps="auto", tolerance=1e-5)
    for _ in sim.frames(60):
        level = sim.systems["p"].population.host("level")
    r = np.linalg.norm(state(sim)[0], axis=1)
    assert level[0] >= level[1] + 2 and np.abs(r - [0.2, 1.5]).max() < 2e-3
    assert sim.statistics()["p"]["inexact"] == 0


def test_whom_the_most_substeps_do_not_suffice_is_counted():
    sim = simulate(COMET, forces=(PULL,), solver="abm_pece_4", substeps="auto", tolerance=1e-7, max_substeps=2)
    sim.run(2.0)
    inexact = sim.statistics()["p"]["inexact"]
    assert 10 < inexact < 120
    sim.seek(0)
    assert sim.statistics()["p"]["inexact"] < 3, "going back forgets what has not happened yet"


def test_the_tolerance_may_change_while_it_runs():
    """A slider on it: from then on the run is another one, and again the same when it is told to go back and come again."""
    sim, strict = comet(1e-4), comet(1e-6)
    sim.run(0.5)
    sim.change("systems.p.tolerance", 1e-6)
    sim.run(0.7)
    strict.run(1.2)
    chosen, expected = (each.statistics()["p"]["substeps"] for each in (sim, strict))
    before = sim.state_hash()
    sim.seek(10)
    sim.seek(72)
    assert sim.state_hash() == before and chosen > 1.0 and abs(np.log2(chosen / expected)) <= 1.0


def test_free_flight_needs_one_substep():
    """A parabola is exact: nothing to refine."""
    sim = simulate(start((0, 1, 0), (2, 6, 0)), gravity=(0, -9.81, 0), solver="abm_pece_2", substeps="auto", tolerance=1e-6)
    sim.run(1.0)
    assert sim.statistics()["p"]["substeps"] == 1.0
    assert state(sim)[0][0] == pytest.approx([2.0, 1.0 + 6.0 - 0.5 * 9.81, 0.0], abs=3e-5)


@pytest.mark.parametrize(
    ("keys", "path", "words"),
    [
        ({"substeps": "auto"}, "systems.p.substeps", "estimates its error: abm_pece_2 or abm_pece_4, not semi_implicit_euler"),
        ({"substeps": "auto", "solver": "rk4"}, "systems.p.substeps", "not rk4"),
        ({"substeps": "auto", "solver": "abm_pece_4", "max_substeps": 48}, "systems.p.max_substeps", "power of two, such as 32 or 64"),
        ({"solver": "abm_pece_4", "tolerance": 1e-3}, "systems.p.tolerance", "substeps: auto only"),
        ({"substeps": "automatic", "solver": "abm_pece_4"}, "systems.p.substeps", "auto"),
    ],
)
def test_what_does_not_go_together_is_a_mistake(keys, path, words):
    from warpsim.scene.loader import load_text

    text = (
        "name: law\ntime: {substeps: 4}\nsystems:\n  p:\n    type: particles\n    emitters: [{shape: {type: point}, burst: {count: 1}}]\n"
    )
    text += "".join(f"    {key}: {value}\n" for key, value in keys.items())
    with pytest.raises(Exception) as error:
        load_text(text)
    (problem,) = error.value.problems
    assert problem.path == path and words in problem.message and problem.line > 5


def test_a_scene_that_asks_all_its_systems_to_choose_says_which_cannot():
    assert scene(COMET, forces=(PULL,), solver="abm_pece_4", substeps="auto").time.substeps == "auto"
    assert scene(start(), motion="ballistic", substeps="auto"), "an arc in closed form has no steps to choose"
    with pytest.raises(ValueError, match=r"not verlet \(solver of p; or give systems.p.substeps\)"):
        scene(COMET, forces=(PULL,), solver="verlet", substeps="auto")
    with pytest.raises(ValueError, match="meets no colliders"):
        scene(COMET, colliders=[{"type": "sphere", "center": [0, -5, 0], "radius": 1}], solver="abm_pece_4", substeps="auto")
    with pytest.raises(ValueError, match="feel pairs"):
        pairs = {"type": "pairwise", "strength": 1.0, "radius": 1.0}
        scene(COMET, forces=[pairs], solver="abm_pece_4", substeps="auto")
