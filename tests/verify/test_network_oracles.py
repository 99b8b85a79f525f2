"""Oracles of networks: each passes where its law holds, fails where the scene is 1 % off, and says what it cannot measure."""

import math

import pytest

import warpsim
from tests.simulation.networks import network
from warpsim import SceneError
from warpsim.scene import load_scene
from warpsim.verify import verify_scene

K, M, G = 50.0, 0.4, 9.81
PAIR = {"points": [[0, 0, 0], [1.2, 0, 0]], "springs": [[0, 1]], "rest_length": 1.0, "solver": "verlet", "substeps": 32}
HANGING = {"points": [[0, 0, 0], [0, -1 - M * G / K, 0]], "springs": [[0, 1]], "rest_length": 1.0, "pins": [0], "gravity": (0, -G, 0)}
OMEGA = math.sqrt(2 * K / M)  # of the pair
PERIOD = 2 * math.pi / OMEGA
GAMMA = 0.2 / M  # half the rate c/μ of a pair with c = 0.2, μ = m/2; ω_d = √(ω² − γ²)
OFTEN = {"fps": 20 / PERIOD}  # twenty frames a swing
LAWFUL = {  # case -> the oracle, the network, and what holds it
    "period": ({"type": "period", "point": 0, "direction": [1, 0, 0], "to": 6 * PERIOD, "expect": PERIOD, "tolerance": {"relative": 2e-3}},
               {**PAIR, **OFTEN}),
    "reach": ({"type": "reach", "direction": [0, -3, 0], "at": 0.5, "expect": 1 + M * G / K, "tolerance": 1e-4}, HANGING),
    "rms_speed": ({"type": "rms_speed", "from": 1 / OFTEN["fps"], "to": 4 * PERIOD, "expect": 0.1 * OMEGA / math.sqrt(2),
                   "tolerance": {"relative": 2e-3}}, {**PAIR, **OFTEN}),
    "energy of springs": ({"type": "energy", "of": "system", "at": PERIOD, "expect": 0.5 * K * 0.2**2, "tolerance": {"relative": 1e-3}},
                          {**PAIR, **OFTEN}),
    "energy that is lost": ({"type": "energy", "of": "system", "at": 2 * math.pi / math.sqrt(OMEGA**2 - GAMMA**2),
                             "expect": 0.5 * K * 0.04 * math.exp(-4 * math.pi * GAMMA / math.sqrt(OMEGA**2 - GAMMA**2)),
                             "tolerance": {"relative": 5e-3}},
                            {**PAIR, "damping": 0.2, "fps": 20 * math.sqrt(OMEGA**2 - GAMMA**2) / (2 * math.pi)}),
}  # fmt: skip


def found(*oracles, **keys):
    scene = network(**{"mass": M, "stiffness": K, **keys}, more={"verify": [{"system": "s", **oracle} for oracle in oracles]})
    return verify_scene(scene, "cpu", threads=1)


@pytest.mark.parametrize("case", LAWFUL)
def test_it_passes_where_its_law_holds_and_fails_one_percent_off(case):
    """Stiffer by 1 %, and in a hanging spring by 3 %, of whose reach the stretch is a thirteenth."""
    oracle, keys = LAWFUL[case]
    (finding,) = found(oracle, **keys)
    assert finding.verdict == "pass", finding
    (finding,) = found(oracle, **{**keys, "stiffness": K * (1.03 if case == "reach" else 1.01)})
    assert finding.verdict == "fail", finding


def test_energy_and_momentum_of_a_free_network_stay_and_its_center_falls():
    """Without `expect`, by the law. Verlet is exact in free fall; the energy swings by (ωh)²/8 = 4e-4 of the joule that the spring holds.

    240 roundings of a speed of 5 m/s add up to 240 · 2.4e-7 m/s, which is 1.2e-5 of it.
    """
    falling = {**PAIR, "gravity": (0, -G, 0), "mass": [M, 3 * M], "substeps": 4}
    energy = {"type": "energy", "of": "system", "at": 0.5, "tolerance": 2e-3}
    momentum = {"type": "momentum", "at": 0.5, "tolerance": {"relative": 2e-5}}
    center = {"type": "position", "of": "system", "at": 0.5, "expect": [0.9, -G / 8, 0], "tolerance": 5e-5}
    assert [finding.verdict for finding in found(energy, momentum, center, **falling)] == ["pass"] * 3
    (finding,) = found({**center, "expect": [0.9, -1.01 * G / 8, 0]}, **falling)
    assert finding.verdict == "fail"


@pytest.mark.parametrize(("keys", "says"), [
    ({"damping": [0.1]}, "damping"), ({"coupling": {"alpha": 0.1}}, "coupling"), ({"tear": 0.5}, "tear"),
    ({"muscles": [{"springs": [0], "rest": {"sine": {"mean": 1, "amplitude": 0.1, "period": 1}}}]}, "muscles"),
    ({"pins": [0], "pin_motion": [{"keyframes": [[0, [0, 0, 0]], [1, [0, 1, 0]]]}]}, "pin_motion"),
])  # fmt: skip
def test_where_energy_does_not_stay_it_is_said(keys, says):
    (finding,) = found({"type": "energy", "of": "system", "at": 0.1, "tolerance": 1}, **{**PAIR, **keys})
    assert finding.verdict == "fail" and says in finding.remark and "say what to expect" in finding.remark


def test_where_momentum_does_not_stay_it_is_said():
    (finding,) = found({"type": "momentum", "at": 0.1, "tolerance": 1}, **PAIR, pins=[0])
    assert finding.verdict == "fail" and "pins" in finding.remark
    sheet = {"type": "cloth", "resolution": [3, 3], "edges": [[1, 0, 0], [0, 1, 0]], "structural": {"stiffness": 5}, "air": 0.1}
    oracles = [{"type": kind, "of": "system", "at": 0.1, "tolerance": 1} for kind in ("momentum", "energy")]
    scene = network(**sheet, more={"verify": [{"system": "s", **oracle} for oracle in oracles]})
    assert all("air" in finding.remark for finding in verify_scene(scene, "cpu", threads=1))


def test_networks_agree_where_they_are_alike():
    for factor, verdict in ((1.0, "pass"), (1.01, "fail")):
        pair = {"type": "springs", **{key: PAIR[key] for key in ("points", "springs", "rest_length")}, "mass": M}
        systems = {"s": {**pair, "stiffness": K}, "t": {**pair, "points": [[0, 2, 0], [1.2, 2, 0]], "stiffness": K * factor}}
        oracle = {"type": "agreement", "system": "s", "with": "t", "offset": [0, 2, 0], "at": 0.5, "tolerance": 1e-4}
        document = {"name": "two", "gravity": [0, 0, 0], "time": {"substeps": 8}, "systems": systems, "verify": [oracle]}
        (finding,) = verify_scene(warpsim.Scene.model_validate(document), "cpu", threads=1)
        assert finding.verdict == verdict and "at point" in finding.remark
        shorter = {**systems, "t": {**systems["t"], "points": [[0, 2, 0]], "springs": []}}
        with pytest.raises(ValueError, match="t has 1 points, and s 2"):
            warpsim.Scene.model_validate({**document, "systems": shorter})


@pytest.mark.parametrize(("oracle", "says"), [
    ({"type": "place", "point": 2, "at": 1, "expect": [0, 0, 0]}, "there is no point 2: s has 2"),
    ({"type": "reach", "system": "z", "direction": [0, 1, 0], "at": 1, "expect": 0}, "there is no network"),
    ({"type": "reach", "direction": [0, 0, 0], "at": 1, "expect": 0}, "zero"),
    ({"type": "agreement", "with": "nobody", "at": 1}, "there is no network"),
    ({"type": "rms_speed", "from": 2, "to": 1, "expect": 0}, "must come after from"),
    ({"type": "energy", "at": 1}, "say of: system"),
    ({"type": "momentum", "of": "particle", "at": 1}, "say of: system"),
    ({"type": "live_count", "at": 1}, "there is no particle system"),
])  # fmt: skip
def test_what_is_not_there_is_named(oracle, says):
    with pytest.raises((SceneError, ValueError), match=says):
        found({"tolerance": 1, **oracle}, **PAIR)


def test_a_point_that_a_mesh_does_not_make_fails_and_says_so(tmp_path):
    (tmp_path / "tent.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\n")
    (tmp_path / "x.yaml").write_text(
        "name: x\nsystems:\n  s: {type: springs, generator: {type: mesh, file: tent.obj}, stiffness: 9}\n"
        "verify: [{type: place, system: s, point: 4, at: 0, expect: [0, 0, 0], tolerance: 1},"
        " {type: period, system: s, point: 9, direction: [1, 0, 0], to: 0.1, expect: 1, tolerance: 1}]\n"
    )
    findings = verify_scene(load_scene(tmp_path / "x.yaml"), "cpu", threads=1)
    assert all(finding.verdict == "fail" and "the mesh makes fewer" in finding.remark for finding in findings)
