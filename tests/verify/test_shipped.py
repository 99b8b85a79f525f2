"""Every shipped scene proves itself: its oracles pass, give their reasons, and turn red when a formula of it is changed by 1 %.

The whole matrix of changes is `python -m tests.verify.mutations`; here a few of it, one of each family.
"""

from functools import cache

import pytest

from tests.verify.mutations import MUTATIONS, ROOT, survivors
from warpsim.scene import load_scene, shipped_scenes
from warpsim.verify import verify_scene

SAMPLE = ("vortex", "restitution", "cohesion")


@cache
def findings(name: str):
    return verify_scene(load_scene(name), "cpu", threads=1)


@pytest.mark.parametrize("name", shipped_scenes())
def test_all_oracles_pass(name):
    found = findings(name)
    assert found and not [finding for finding in found if finding.verdict != "pass"]


def test_there_are_enough_of_them_and_most_leave_nothing_to_chance():
    found = [finding for name in shipped_scenes() for finding in findings(name)]
    exact = [finding for finding in found if finding.detects is None]
    print(f"\n{len(found)} oracles in {len(shipped_scenes())} scenes, {len(exact)} without chance")
    assert len(found) >= 100 and len(exact) >= 70


@pytest.mark.parametrize("name", ["campfire", "emitter_shapes", "vortex"])
def test_what_is_measured_does_not_depend_on_the_threads(name):
    again = verify_scene(load_scene(name), "cpu", threads=2)
    assert [str(finding.measured) for finding in again] == [str(finding.measured) for finding in findings(name)]


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
    assert not survivors(mutation, folder)
