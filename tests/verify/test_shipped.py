"""Every shipped scene proves itself: its oracles pass, give their reasons, and turn red when a formula of it is changed by 1 %.

The whole matrix of changes is `python -m tests.verify.mutations`; here a few of it, one of each family, on the first scene it concerns.
"""

import pytest

from tests.verify.mutations import MUTATIONS, ROOT, survivors
from warpsim.scene import load_scene, shipped_scenes
from warpsim.verify import verify_scene

SAMPLE = ("vortex", "restitution", "cohesion")


def leaves_to_chance(oracle) -> bool:
    """Return whether an oracle counts random numbers."""
    return getattr(oracle, "statistical", False)


@pytest.mark.parametrize("name", shipped_scenes())
def test_all_oracles_pass(name):
    scene = load_scene(name)
    found = verify_scene(scene, "cpu", threads=1)
    assert found and not [finding for finding in found if finding.verdict != "pass"]
    by_chance = [
        finding.name for finding, oracle in zip(found, scene.verify, strict=True) if not leaves_to_chance(oracle) and finding.detects
    ]
    assert not by_chance, "they would have to say so"


def test_there_are_enough_of_them_and_most_leave_nothing_to_chance():
    oracles = [oracle for name in shipped_scenes() for oracle in load_scene(name).verify]
    assert len(oracles) >= 100 and sum(not leaves_to_chance(oracle) for oracle in oracles) >= 70


@pytest.mark.parametrize("name", ["campfire", "emitter_shapes", "vortex"])
def test_what_is_measured_does_not_depend_on_the_threads(name):
    one, two = (verify_scene(load_scene(name), "cpu", threads=threads) for threads in (1, 2))
    assert [str(finding.measured) for finding in one] == [str(finding.measured) for finding in two]


@pytest.mark.parametrize("mutation", MUTATIONS, ids=lambda mutation: mutation.name)
def test_a_change_finds_its_formula(mutation):
    assert (ROOT / mutation.file).read_text().count(mutation.old) == 1
    for name, oracles in mutation.red.items():
        assert set(oracles.split()) <= {oracle.name or str(k) for k, oracle in enumerate(load_scene(name).verify)}


def test_every_scene_is_turned_red_by_some_change():
    assert len({mutation.name for mutation in MUTATIONS}) == len(MUTATIONS)
    assert set(shipped_scenes()) == {name for mutation in MUTATIONS for name in mutation.red}


@pytest.mark.parametrize("mutation", [m for m in MUTATIONS if m.name in SAMPLE], ids=lambda mutation: mutation.name)
def test_one_percent_turns_them_red(mutation, tmp_path_factory):
    """Kernels compile into a cache of their own, which the changes share."""
    folder = tmp_path_factory.getbasetemp() / "one-percent"
    folder.mkdir(exist_ok=True)
    first = dict([next(iter(mutation.red.items()))])
    assert not survivors(mutation._replace(red=first), folder)
