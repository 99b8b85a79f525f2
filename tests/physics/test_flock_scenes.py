"""The shipped flocks: their places from a twin of whole scenes, prey that gives way, species that part or mix, a door that lets through."""

import numpy as np
import pytest

from tests.reference import flight
from warpsim import Scene, Simulation
from warpsim.scene import load_scene
from warpsim.verify import verify_scene
from warpsim.verify.flocks import company

OPEN = np.full(3, np.inf)
PAIR = {"type": "flock", "count": 3, "domain": {"min": [0, 0, 0], "max": [8, 8, 8], "boundary": "periodic"}, "perception": {"radius": 1}}


@pytest.mark.parametrize("name", ["crowd", "paths", "river_fish", "species"])
def test_places_are_those_of_the_twin(name):
    """What the scenes expect was worked out by the twin and is so again, to the last of its eight digits; school takes half a minute."""
    scene = load_scene(name)
    oracle = next(one for one in scene.verify if one.type == "place")
    sim = Simulation(scene, device="cpu", threads=1)
    places = flight.fly(sim, scene, round(oracle.at * scene.time.fps))[oracle.system]
    assert np.abs(places[oracle.point] - oracle.expect).max() < 1e-8 + 5e-9


def test_prey_gives_way_to_its_hunters_and_closes_behind_them():
    """Within twice a hunter's radius are fewer than half of the school's density; without fear about as many as round one of the prey."""
    found = {}
    for fear in ("60", "0"):
        path = f"systems.sardines.attends.hunters.separation.weight={fear}"
        sim, near = Simulation(load_scene("school", [path]), device="cpu", threads=1), []
        for index in range(600):
            sim.step_frame()
            if index >= 300 and index % 10 == 0:
                prey, hunters = (sim.frame()[each].position.astype(float) for each in ("sardines", "hunters"))
                near.append((company(prey, hunters, 1.9, OPEN), company(prey, prey[::6], 1.9, OPEN) - 1))
        theirs, own = np.mean(near, axis=0)
        found[fear] = theirs / own
    assert found["60"] < 0.5 < 2 * found["0"]


def test_company_counts_across_a_periodic_domain():
    x = np.array([[0.1, 4.0, 4.0], [7.9, 4.0, 4.0], [4.0, 4.0, 4.0]])
    assert company(x, x[:1], 0.3, OPEN) == 1.0
    assert company(x, x[:1], 0.3, np.array([8.0, np.inf, 8.0])) == 2.0
    assert np.isnan(company(x, x[:0], 1.0, OPEN))


def test_presence_is_one_among_flocks_that_ignore_each_other():
    """Two of 400 at random in one periodic box meet 400² · 4π/3/8³ = 1300 pairs a frame: 4.5 % of the ratio by chance; three times."""
    flocks = {name: {**PAIR, "count": 400, "separation": 0, "cohesion": 0, "alignment": 0} for name in ("a", "b")}
    oracle = {"type": "presence", "system": "a", "around": "b", "radius": 1.0, "to": 1.0, "every": 6, "expect": 1.0, "tolerance": 0.14}
    scene = Scene.model_validate({"name": "n", "seed": 1, "systems": flocks, "verify": [oracle]})
    (finding,) = verify_scene(scene, "cpu", threads=1)
    assert finding.verdict == "pass" and "of 11 frames" in finding.remark


@pytest.mark.parametrize("key", ["system", "around"])
def test_presence_of_a_flock_that_is_not_there_is_a_mistake(key):
    oracle = {"type": "presence", "system": "a", "around": "a", "radius": 1.0, "to": 1.0, "expect": 1.0, "tolerance": 0.1, key: "aa"}
    with pytest.raises(Exception, match='there is no flock "aa"'):
        Scene.model_validate({"name": "n", "systems": {"a": PAIR}, "verify": [oracle]})


def test_a_door_lets_through_about_as_many_as_one_of_its_width():
    """People pass 1.9 a second and meter of door (Seyfried et al. 2009), 2.3 here; boids are softer: at most 5, and never half of it."""
    sim, passed, before = Simulation(load_scene("crowd"), device="cpu", threads=1), 0, None
    for index in range(1500):
        sim.step_frame()
        x = sim.frame()["people"].position[:, 0]
        if before is not None and index >= 900:
            passed += int(((before < 0) & (x >= 0) & (np.abs(x) < 2)).sum())
        before = x
    place = sim.frame()["people"].position
    assert 1.2 < passed / 10 < 5
    assert not ((np.abs(place[:, 0]) < 0.44) & (np.abs(place[:, 2]) > 0.61)).any()  # 5 cm within the walls' 0.25 m: nobody is in them
