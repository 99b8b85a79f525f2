"""Neighbors cut a frame into a launch per substep; nothing of it may be seen where they do nothing."""

import pytest

from warpsim import Scene, Simulation, load_scene


def with_idle_pairs(scene: Scene) -> Scene:
    """The scene with a force between particles whose strength is zero, felt by every system whose solver allows it."""
    document = scene.model_dump(by_alias=True) | {"verify": [], "controls": []}
    place = len(document["forces"])
    document["forces"] = [*document["forces"], {"type": "pairwise", "strength": 0.0, "radius": 0.05}]
    for system in document["systems"].values():
        chosen = system["feels"]["forces"]
        if system["motion"] == "ballistic":
            system["feels"]["forces"] = False
        elif system["solver"] in (None, "semi_implicit_euler", "verlet", "euler") and chosen is not True:
            system["feels"]["forces"] = [*(chosen or ()), place]
    return Scene.model_validate(document)


@pytest.mark.parametrize("name", ["attractor", "billiard", "campfire", "colliders", "coupling", "events", "fireworks", "rain", "tornado"])
def test_idle_neighbors_change_no_bit(name):
    """Births, deaths, drag, collisions, rest on the ground and what listens to them: a launch per substep does as one for the frame."""
    scene = load_scene(name, overrides=["time.prewarm=0"])
    plain, paired = (Simulation(each, device="cpu", threads=1) for each in (scene, with_idle_pairs(scene)))
    for _ in range(4):
        plain.run(0.1)
        paired.run(0.1)
        assert paired.state_hash() == plain.state_hash()
    assert any(system.pairs for system in paired.systems.values())


def test_a_run_with_neighbors_goes_back_and_makes_its_changes_again():
    """The grid and what neighbors do are no state: made anew in every substep."""
    simulation = Simulation(load_scene("pairwise", overrides=["systems.grains.emitters.0.burst.0.count=300"]), device="cpu", threads=1)
    simulation.run(0.2)
    simulation.change("forces.charge.strength", -2e-6)
    simulation.run(0.3)
    expected = simulation.state_hash()
    simulation.seek(3)
    simulation.seek(30)
    assert simulation.state_hash() == expected
