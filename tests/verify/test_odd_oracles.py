"""Oracles that cannot be answered fail and say why; none of them ends in a traceback, whatever it asks of the laws."""

import pytest

from tests.verify.scenes import found, scene
from warpsim import SceneError
from warpsim.scene import load_text

POINT = {"shape": {"type": "point"}, "burst": {"count": 1}}
PULL = {"type": "attractor", "strength": 1.0, "softening": 0.0, "law": "inverse_square"}
AROUND = {
    "flow": [{"type": "vortex", "circulation": 0.0}, {"type": "rotation", "angular_velocity": 0.0}],
    "forces": [PULL, {**PULL, "law": "spring", "strength": -1.0}, {**PULL, "law": "constant", "strength": 0.0}],
    "colliders": [{"type": "plane", "center": [0, 2, 0], "restitution": 0.0}],
    "emitters": [POINT],
}
ODD = [
    {"type": "orbit", "system": "p", "flow": 0, "start": [1, 0, 0]},  # nothing turns
    {"type": "orbit", "system": "p", "flow": 1, "start": [1, 0, 0]},
    {"type": "orbit", "system": "p", "force": 0},  # in the very center
    {"type": "orbit", "system": "p", "force": 0, "start": [1, 0, 0], "velocity": [0, 9, 0]},  # gone for good
    {"type": "orbit", "system": "p", "force": 1, "start": [1, 0, 0]},  # pushed away
    {"type": "orbit", "system": "p", "force": 2, "start": [1, 0, 0]},  # held by nothing
    {"type": "orbit", "system": "p", "force": 2, "start": [1, 0, 0], "expect": 0.5},  # and waited for all the same
    {"type": "bounce_height", "system": "p", "start": [0, 1, 0], "at": 1, "feels": {"flow": [], "forces": []}},  # from behind the plane
    {"type": "energy", "system": "p", "at": 1, "feels": {"forces": [0]}},  # infinite at its start
    {"type": "position", "of": "system", "system": "p", "release": 3, "at": 9, "expect": [{"expression": "sqrt(-1)"}, 0, 0]},
    {"type": "velocity", "point": [0, 0, 0], "expect": [{"expression": "1/(t - 1)"}, 0, 0], "at": 1},
    {"type": "streamline", "start": [1, 0, 0], "length": 1, "plane": [5, 0, 0], "expect": [0, 0, 0]},  # through still fluid
]


@pytest.mark.parametrize("oracle", ODD, ids=lambda oracle: oracle["type"])
def test_what_cannot_be_answered_fails(oracle):
    (finding,) = found({"tolerance": 1e-3, **oracle}, gravity=(0, -9.81, 0), **AROUND)
    assert finding.verdict == "fail" or "unstable" in finding.remark  # an unsoftened center tears the state apart


def test_a_streamline_that_does_not_reach_its_plane_says_so():
    oracle = {"type": "streamline", "start": [0, 0, 0], "length": 2, "plane": [5, 0, 0], "expect": [5, 0, 0], "tolerance": 1}
    (finding,) = found(oracle, flow=[{"type": "uniform", "velocity": [1, 0, 0]}])
    assert finding.verdict == "fail" and finding.remark == "it does not cross the plane within 2 m"


def test_a_test_particle_that_a_collider_takes_is_gone():
    floor = {"type": "plane", "center": [0, -1, 0], "action": "kill"}
    (finding,) = found({"type": "arc", "system": "p", "at": 2, "tolerance": 1e9}, colliders=[floor], emitters=[POINT])
    assert finding.verdict == "fail" and "gone" in finding.remark


def test_a_speed_longer_than_its_components_may_be():
    (finding,) = found({"type": "arc", "system": "p", "velocity": [9e8, 9e8, 9e8], "at": 1e-3, "tolerance": 1e9}, emitters=[POINT], fps=1e4)
    assert finding.verdict in ("pass", "unmeasured")


def test_more_intervals_than_can_be_counted():
    rate = {"mean": 1.0, "interval": 1e-5}
    (finding,) = found({"type": "emission_mean", "system": "p", "to": 100, "tolerance": 1}, emitters=[{"rate": rate}], fps=1)
    assert finding.verdict == "fail" and "intervals" in finding.remark


@pytest.mark.parametrize(
    "oracle",
    [
        "{type: hash, at: -1, expect: 0123456789abcdef0123456789abcdef}",
        "{type: live_count, system: p, at: -0.5, tolerance: 1}",
        "{type: emission_mean, system: p, from: -1, to: 2, tolerance: 1}",
        "{type: emission_mean, system: p, from: 2, to: 2, tolerance: 1}",
        "{type: momentum, system: p, release: -1, at: 2, tolerance: 1}",
        "{type: arc, system: p, at: 1, tolerance: -1}",
        "{type: arc, system: p, at: 1, feels: {forces: [9]}, tolerance: 1}",
        "{type: arc, system: p, at: 1}",
        "{type: uniformity, system: p, to: 1, bins: 1, tolerance: 1}",
    ],
)
def test_what_makes_no_sense_is_a_mistake_at_its_place(oracle):
    text = f"name: x\nsystems: {{p: {{type: particles, emitters: [{{rate: 1}}]}}}}\nverify:\n  - {oracle}\n"
    with pytest.raises(SceneError) as refused:
        load_text(text, "odd.yaml")
    assert {problem.line for problem in refused.value.problems} == {4}


@pytest.mark.parametrize("digest", ["abc", "X" * 32])
def test_a_hash_that_is_none_is_told_what_a_hash_is(digest):
    with pytest.raises(SceneError) as refused:
        load_text(f"name: x\nverify:\n  - {{type: hash, at: 1, expect: {digest}}}\n", "odd.yaml")
    (problem,) = refused.value.problems
    assert (problem.line, problem.path) == (3, "verify.0.expect") and "32 digits" in problem.message


def test_a_test_particle_may_be_released_before_frame_zero():
    (finding,) = found({"type": "arc", "system": "p", "release": -0.5, "at": 0.5, "tolerance": 1e-4}, emitters=[POINT], solver="verlet")
    assert finding.verdict == "pass" and finding.expected[1] == pytest.approx(-9.81 / 2)
    assert scene().time.prewarm == 0.0, "the scene itself knows nothing of it"
