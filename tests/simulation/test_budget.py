"""Stiffness beyond any substep budget: the message names the number to change, and with what it says the scene runs."""

import re

import pytest

from tests.simulation.networks import network, simulate
from warpsim import SceneError, Simulation, UnstableError
from warpsim.scene import load_scene

HEAD = "name: x\ntime: {substeps: auto}\nsystems:\n  s:\n"
PAIR = HEAD + "    type: springs\n    points: [[0, 1, 0], [1, 1, 0], [2, 1, 0]]\n    springs: [[0, 1], [1, 2]]\n    pins: [0]\n"
CLOTH = (
    HEAD + "    type: cloth\n    resolution: [9, 9]\n    edges: [[1, 0, 0], [0, -1, 0]]\n    structural: {stiffness: 9}\n    pins: [top]\n"
)
CASES = {  # name -> scene, path of the number, what the mass is called
    "one stiffness": (PAIR + "    stiffness: 1.0e12\n    mass: 0.3\n", "stiffness", "mass"),
    "one of a list": (PAIR + "    stiffness: [0, 1.0e12]\n    mass: [1, 1, 1.0e-3]\n", "stiffness.1", "mass"),
    "damping": (PAIR + "    stiffness: 1\n    damping: 1.0e9\n", "damping", "mass"),
    "shear": (CLOTH + "    shear: {stiffness: 1.0e12}\n", "shear.stiffness", "density"),
    "bending": (CLOTH + "    bending: {stiffness: 1.0e6}\n", "bending.stiffness", "density"),
}


@pytest.fixture
def few_substeps(monkeypatch):
    """A frame has room for 400: what is said does not depend on how many, and ten thousand take a quarter of a minute to lay out."""
    monkeypatch.setattr("warpsim.budget.MOST_SUBSTEPS", 400)
    monkeypatch.setattr("warpsim.stability.MOST_SUBSTEPS", 400)


@pytest.mark.parametrize("case", CASES)
def test_what_is_too_stiff_is_named_and_what_is_said_helps(case, tmp_path, few_substeps):
    text, path, mass = CASES[case]
    (tmp_path / "x.yaml").write_text(text)
    with pytest.raises(SceneError) as refused:
        Simulation(load_scene(tmp_path / "x.yaml"), device="cpu", threads=1)
    (problem,) = refused.value.problems
    assert problem.path == f"systems.s.{path}", str(refused.value)
    told = re.search(rf"{re.escape(path)} may be (\S+) N.* at most.*or {mass} must be (\S+) times larger", problem.message)
    value, factor = float(told[1]), float(told[2])
    assert Simulation(load_scene(tmp_path / "x.yaml", overrides=[f"systems.s.{path}={value}"]), "cpu", threads=1).advice["s"].sufficient
    spec = load_scene(tmp_path / "x.yaml").systems["s"]
    heavy = [m * factor for m in spec.mass] if isinstance(getattr(spec, mass), tuple) else getattr(spec, mass) * factor
    assert Simulation(load_scene(tmp_path / "x.yaml", overrides=[f"systems.s.{mass}={heavy}"]), "cpu", threads=1).advice["s"].sufficient
    with pytest.raises(SceneError):  # and it says no more than it must
        Simulation(load_scene(tmp_path / "x.yaml", overrides=[f"systems.s.{path}={1.1 * value}"]), device="cpu")


def test_several_stiff_kinds_are_told_to_go_down_together(tmp_path):
    (tmp_path / "x.yaml").write_text(CLOTH.replace("stiffness: 9", "stiffness: 1.0e11") + "    shear: {stiffness: 1.0e12}\n")
    with pytest.raises(
        SceneError, match=r"shear.stiffness may be \S+ N/m at most \(it is 1e\+12\), and the others like it .* times smaller"
    ):
        Simulation(load_scene(tmp_path / "x.yaml"), device="cpu")


def test_a_blow_up_that_no_substeps_help_names_the_number_too():
    sim = simulate(points=[[0, 0, 0], [1.2, 0, 0]], springs=[[0, 1]], rest_length=1.0, stiffness=1e12, mass=1e-3, pins=[0])
    with pytest.raises(UnstableError, match="stiffness may be .* at most"):
        sim.run(1.0)


def test_a_solver_without_a_limit_has_no_budget():
    scene = network(points=[[0, 0, 0], [1.2, 0, 0]], springs=[[0, 1]], stiffness=1e12, mass=1e-3, substeps="auto", solver="implicit_euler")
    assert Simulation(scene, device="cpu").advice["s"].sufficient


@pytest.mark.parametrize("formula", ["1/(t - 0.5)", "sqrt(0.4 - t)", "1e7*t"])
def test_pins_that_are_led_nowhere_are_said_to_be(formula):
    """Not finite, or beyond the extent: the run stops at the last good frame, and says whose motion it is."""
    pair = {"points": [[0, 1, 0], [1, 1, 0]], "springs": [[0, 1]], "stiffness": 10.0, "mass": 1.0, "pins": [0]}
    sim = simulate(**pair, pin_motion=[{"displacement": [{"expression": formula}, 0, 0]}])
    with pytest.raises(UnstableError, match="pin_motion") as unstable:
        sim.run(1.0)
    position = unstable.value.last_good["s"].position
    assert 0 in unstable.value.ids and abs(position).max() <= 1e6


def test_pins_that_are_led_nowhere_may_start_anew():
    pair = {"points": [[0, 1, 0], [1, 1, 0]], "springs": [[0, 1]], "stiffness": 10.0, "mass": 1.0, "pins": [0]}
    sim = simulate(**pair, pin_motion=[{"displacement": [{"expression": "sqrt(0.4 - t)"}, 0, 0]}], more={"limits": {"unstable": "reset"}})
    for frame in sim.frames(40):
        assert abs(frame["s"].position).max() < 10.0
