"""Mistakes in forces between particles, told where they stand; and what is no mistake."""

import pytest

from tests.simulation.scenes import scene as simulated
from warpsim import SceneError, Simulation
from warpsim.scene import load_text

TEXT = """\
name: Pairs
forces:
  - {name: sun, type: attractor, strength: 1}
  - {name: dust, type: pairwise, law: linear, strength: -1e-3, radius: 0.1, softening: 0.01}
systems:
  p: {type: particles, solver: verlet}
  q: {type: particles, solver: rk4, feels: {forces: [sun]}}
  t: {type: particles, coupling: tracer, solver: rk4}
"""


def test_a_scene_with_pairs_is_read():
    scene = load_text(TEXT, "a.yaml")
    assert scene.forces[1].law == "linear" and scene.forces[1].softening == 0.01


@pytest.mark.parametrize(
    ("old", "new", "place", "says"),
    [
        ("radius: 0.1", "radius: 0", "a.yaml:4:72: forces.1.radius", "must be at least 1e-06 m"),
        ("radius: 0.1, ", "", "a.yaml:4:5: forces.1", 'the key "radius" is missing'),
        ("radius: 0.1", "radius: -1", "4:72", "must be at least 1e-06 m"),
        ("radius: 0.1", "radius: .nan", "4:72", "not a finite number"),
        ("radius: 0.1", "raduis: 0.1", "4:64", "did you mean radius?"),
        ("softening: 0.01", "softening: 0.1", "a.yaml:4:88: forces.1.softening", "must be less than the radius of 0.1 m"),
        ("softening: 0.01", "softening: -1", "4:88", "must be at least 0 m"),
        ("law: linear", "law: lineal", "4:39", "did you mean linear?"),
        ("strength: -1e-3, ", "", "4:5", 'the key "strength" is missing'),
        ("strength: -1e-3", "strength: 1e13", "4:57", "1e+12"),
        ("type: pairwise", "type: pairwize", "4:24", "did you mean pairwise?"),
        ("solver: verlet", "solver: rk4", "a.yaml:6:32: systems.p.solver", "rk4 asks for forces within a step"),
        ("solver: verlet", "solver: adams_bashforth_2", "6:32", "take semi_implicit_euler, verlet or euler"),
        ("forces: [sun]", "forces: [1]", "7:32", "rk4 asks for forces within a step"),
        ("forces: [sun]", "forces: [sun, dusk]", "7:59", "did you mean dust?"),
        ("[sun]}", "[sun]}, motion: ballistic", "7", "takes no solver"),
    ],
)
def test_mistakes_are_told_in_their_place(old, new, place, says):
    assert old in TEXT
    with pytest.raises(SceneError) as refused:
        load_text(TEXT.replace(old, new), "a.yaml")
    assert place in str(refused.value) and says in str(refused.value), str(refused.value)


def test_a_solver_that_never_meets_a_pair_is_no_mistake():
    for feels in ("false", "[]", "[0]", "[sun]"):
        assert load_text(TEXT.replace("forces: [sun]", f"forces: {feels}"), "a.yaml")
    assert load_text(TEXT.replace("solver: verlet", "capacity: 10"), "a.yaml"), "the default solver knows pairs"


def test_a_capacity_beyond_the_machine_is_refused_with_words():
    forces = [{"type": "pairwise", "strength": 1.0, "radius": 1.0}]
    with pytest.raises(SceneError, match="lower the capacity"):
        Simulation(simulated({"capacity": 2**27}, forces=forces, limits={"memory": 4.0}), device="cpu")


def test_the_radius_and_the_softening_may_change_but_not_the_law():
    forces = [{"type": "pairwise", "strength": 1e-9, "radius": 0.1}]
    sim = Simulation(simulated({"capacity": 100}, {"rate": 10.0}, forces=forces), device="cpu", threads=1)
    sim.change("forces.0.softening", 0.05)
    sim.change("forces.0.radius", 0.5)
    with pytest.raises(SceneError, match="less than the radius"):
        sim.change("forces.0.radius", 0.05)
    with pytest.raises(ValueError, match="cannot change while the scene runs"):
        sim.change("forces.0.law", "linear")
