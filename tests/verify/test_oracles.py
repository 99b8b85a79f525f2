"""Every kind of oracle passes where its law holds, and fails where the scene is 1 % off what it states."""

import numpy as np
import pytest

import warpsim
from tests.verify.scenes import EXACT, found, scene
from warpsim.scene.oracles import Oracle
from warpsim.verify import verify_scene
from warpsim.verify.registry import MEASURERS, TOGETHER

VORTEX = {"type": "vortex", "axis": [0, 0, 1], "circulation": 2.0}
SOURCE = {"type": "source", "axis": [0, 0, 1], "rate": 1.5}
WIND = {"type": "uniform", "velocity": [3.0, 0, 0]}
SPRING = {"type": "attractor", "strength": 4.0, "law": "spring"}
SPINNER = {"type": "cylinder", "axis": [0, 0, 1], "radius": 0.5, "circulation": 1.5}
ROUND = {"center": [0.1, 0, 0], "axis": [0, 0, 1], "radius": 0.5}
THROWN = {"system": "p", "start": [0, 1, 0], "velocity": [1, 4, 0], "mass": 1.0}
CIRCLING = {"system": "p", "start": [0.5, 0, 0], "velocity": [0, 1, 0], "mass": 1.0}
TEN = {"emitters": [{"rate": 1000.0, "lifetime": 0.5, "velocity": {"cone": 40, "speed": {"mean": 2, "spread": 1}}}]}
ONE = {"emitters": [{"shape": {"type": "point", "center": [1, 0, 0]}, "mass": 1.0, "burst": {"count": 1}}]}
LAWFUL = {  # kind -> the oracle, its surroundings, and what in them to change by 1 %
    "velocity": ({"point": [0.5, 0, 0], "expect": [0, 2 / np.pi, 0]}, {"flow": [VORTEX]}, ("flow", 0, "circulation")),
    "curl": ({"point": [0.5, 0, 0], "expect": [0, 0, 2.5]}, {"flow": [{"type": "rotation", "axis": [0, 0, 1], "angular_velocity": 1.25}]},
             ("flow", 0, "angular_velocity")),
    "circulation": ({**ROUND, "expect": 2.0}, {"flow": [VORTEX, SOURCE, WIND]}, ("flow", 0, "circulation")),
    "flux": ({**ROUND, "expect": 1.5}, {"flow": [VORTEX, SOURCE, WIND]}, ("flow", 1, "rate")),
    "discharge": ({**ROUND, "axis": [1, 0, 0], "expect": 0.75 * np.pi}, {"flow": [WIND]}, ("flow", 0, "velocity", 0)),
    "pressure_force": ({"axis": [0, 0, 1], "radius": 0.5, "density": 1.2, "expect": [0, -3.6 * 1.5, 0]},
                       {"flow": [WIND], "obstacles": [SPINNER]},
                       ("flow", 0, "velocity", 0)),
    "streamline": ({"start": [0.5, 0, 0], "length": np.pi, "expect": [0.5, 0, 0]}, {"flow": [VORTEX]}, None),
    "terminal_speed": ({"system": "p", "mass": 1.0, "at": 9}, {"coupling": {"alpha": 2.0}, "flow": [WIND]}, ("gravity", 1)),
    "relaxation": ({**THROWN, "at": 0.5}, {"coupling": {"alpha": 2.0}, "flow": [WIND]}, ("systems", "p", "coupling", "alpha")),
    "arc": ({**THROWN, "at": 0.5}, {"solver": "verlet", "coupling": {"alpha": 2.0}, "flow": [WIND]}, ("gravity", 1)),
    "orbit": ({**CIRCLING, "force": 0}, {"solver": "verlet", "gravity": [0, 0, 0], "forces": [SPRING]}, ("forces", 0, "strength")),
    "position": ({**THROWN, "at": 0.5, "expect": [0.5, 3 - 9.81 / 8, 0]}, {"motion": "ballistic"}, ("gravity", 1)),
    "energy": ({**THROWN, "at": 0.5, "expect": 8.5 + 9.81}, {"solver": "verlet"}, ("gravity", 1)),
    "momentum": ({**THROWN, "of": "particle", "at": 0.5, "expect": [1, 4 - 9.81 / 2, 0]}, {}, ("gravity", 1)),
    "bounce_height": ({**THROWN, "at": 3.0}, {"solver": "verlet", "colliders": [{"type": "plane", "restitution": 0.8}]},
                      ("colliders", 0, "restitution")),
    "convergence_order": ({"system": "p", "solver": "heun", "tolerance": 0.15}, {"gravity": [0, 0, 0], "forces": [SPRING], **ONE}, None),
    "live_count": ({"system": "p", "at": 2.0, "expect": 500, "tolerance": 2.0}, TEN, ("systems", "p", "emitters", 0, "lifetime", "mean")),
    "size": ({"system": "p", "at": 0.5, "expect": 1.0}, {"gravity": [0, 0, 0], "emitters": [
        {"shape": {"type": "point"}, "burst": {"count": 4000}, "lifetime": 9, "velocity": {"cone": 180, "speed": 2.0}}]},
             ("systems", "p", "emitters", 0, "velocity", "speed", "mean")),
}  # fmt: skip


def changed(document: dict, path: tuple, factor: float) -> dict:
    """Return the document with the number at a path multiplied."""
    if not path:
        return document * factor
    part, *rest = path
    copy = list(document) if isinstance(document, (list, tuple)) else dict(document)
    copy[part] = changed(copy[part], tuple(rest), factor)
    return copy


def stated(kind: str) -> tuple[dict, dict]:
    oracle, surroundings, _ = LAWFUL[kind]
    return {"type": kind, "tolerance": EXACT, **oracle}, surroundings


def test_every_kind_has_a_measurer():
    assert {spec.model_fields["type"].default for spec in Oracle.__subclasses__()} == set(MEASURERS) and set(TOGETHER) <= set(MEASURERS)


@pytest.mark.parametrize("kind", LAWFUL)
def test_an_oracle_passes_where_its_law_holds(kind):
    oracle, surroundings = stated(kind)
    (finding,) = found(oracle, **surroundings)
    assert finding.verdict == "pass", finding


@pytest.mark.parametrize("kind", [kind for kind in LAWFUL if LAWFUL[kind][2]])
def test_an_oracle_fails_where_the_scene_is_one_percent_off(kind):
    """A number stated for the scene as it was; laws that follow the scene's numbers are tested by changing formulas."""
    oracle, surroundings = stated(kind)
    (finding,) = found(oracle, **surroundings)
    expect = np.asarray(finding.expected).tolist()
    document = changed(scene({**oracle, "expect": expect}, **surroundings).model_dump(by_alias=True), LAWFUL[kind][2], 1.01)
    (finding,) = verify_scene(type(scene())(**document), "cpu", threads=1)
    assert finding.verdict == "fail", finding


def test_divergence_is_zero_away_from_sources():

    quiet = {"type": "divergence", "point": [0.5, 0.25, 0.125], "tolerance": 1e-3}
    (finding,) = found(quiet, flow=[SOURCE, VORTEX, WIND])
    assert finding.verdict == "pass" and finding.expected == 0.0


def test_a_streamline_ends_on_its_plane():
    """Round an ideal vortex from (0.5, 0, 0) to the plane x = 0: a quarter of a circle."""
    oracle = {"type": "streamline", "start": [0.5, 0, 0], "length": 2, "plane": [0, 0, 0], "expect": [0, 0.5, 0], "tolerance": 1e-4}
    (finding,) = found(oracle, flow=[VORTEX])
    assert finding.verdict == "pass", finding
    (finding,) = found({**oracle, "plane": [9, 0, 0]}, flow=[VORTEX])
    assert finding.verdict == "fail" and np.isnan(finding.error)


def test_the_particles_of_a_system_together():
    momentum = {"type": "momentum", "system": "p", "release": 0.8, "at": 1.0, "tolerance": 1e-6}
    energy = {"type": "energy", "of": "system", "system": "p", "release": 0.8, "at": 1.0, "tolerance": {"relative": 1e-4}}
    place = {"type": "position", "of": "system", "system": "p", "release": 0.8, "at": 1.0, "expect": [0, 0, 0], "tolerance": 2.0}
    findings = found(momentum, energy, place, solver="verlet", **TEN)
    assert [finding.verdict for finding in findings] == ["pass"] * 3, findings
    assert findings[0].remark == "of 300 particles"


def test_what_has_no_law_fails_and_says_why():
    oracles = [
        {"type": "terminal_speed", "system": "p", "at": 1, "tolerance": 1},
        {"type": "relaxation", "system": "p", "at": 1, "tolerance": 1},
        {"type": "orbit", "system": "p", "flow": 0, "tolerance": 1},
        {"type": "arc", "system": "p", "at": 1, "tolerance": 1},
        {"type": "momentum", "system": "p", "at": 1, "tolerance": 1},
        {"type": "energy", "of": "system", "system": "p", "at": 1, "tolerance": 1},
        {"type": "bounce_height", "system": "p", "at": 1, "tolerance": 1},
    ]
    around = {"obstacles": [{"type": "wall", "center": [0, -9, 0]}], "colliders": [{"type": "sphere", "center": [0, -9, 0], "radius": 1}]}
    wild = [{**SPRING, "strength": {"sine": {"amplitude": 1, "period": 3}}}]
    findings = found(*oracles, flow=[WIND], forces=wild, **around, **TEN)
    assert all(finding.verdict == "fail" and finding.remark for finding in findings), findings


def test_an_order_that_cannot_be_measured_fails_and_says_why():
    order = {"type": "convergence_order", "system": "p", "tolerance": 1}
    (noise,) = found(order, flow=[{"type": "curl_noise", "amplitude": 1.0, "length": 1.0}], coupling="tracer", **ONE)
    (stranger,) = found({**order, "solver": "verlet"}, flow=[WIND], coupling="tracer", **ONE)
    assert noise.verdict == stranger.verdict == "fail" and noise.remark and "no solver" in stranger.remark


def test_a_hash_of_another_kind_of_device_is_skipped_and_said_to_be():
    oracle = {"type": "hash", "at": 0.1, "device": "cuda", "expect": "0" * 32}
    (finding,) = found(oracle)
    assert finding.verdict == "skipped" and "cuda" in finding.remark


def test_a_hash_is_that_of_the_scene_without_test_particles():
    import warpsim

    stated = scene(**TEN)
    simulation = warpsim.Simulation(stated, device="cpu", threads=1)
    simulation.seek(6)
    oracles = {"type": "hash", "at": 0.1, "expect": simulation.state_hash()}, {"type": "arc", "system": "p", "at": 1, "tolerance": 1}
    assert [finding.verdict for finding in found(*oracles, **TEN)] == ["pass", "pass"]


def test_a_scene_that_blows_up_is_not_measured():
    wild = {"forces": [{**SPRING, "strength": 1e9}], "emitters": [{"burst": {"count": 1}, "shape": {"type": "point", "center": [1, 0, 0]}}]}
    count = {"type": "live_count", "system": "p", "at": 1, "tolerance": 1}
    flow = {"type": "divergence", "point": [1, 1, 1], "tolerance": 1}
    findings = found(count, flow, {**count, "at": 0.0}, **wild)
    assert [finding.verdict for finding in findings] == ["unmeasured", "pass", "pass"] and "unstable" in findings[0].remark


def test_children_of_events_are_counted_where_it_is_said_how_many():
    """Of one emitter alone, too: the system whose events it hears stays. Without `expect` there is no law."""
    parent = {"type": "particles", "emitters": [{"burst": {"count": 5}, "lifetime": 0.5}]}
    child = {"type": "particles", "emitters": [{"rate": 100}, {"on": {"event": "death", "of": "p"}, "burst": {"count": 7}}]}
    counts = [
        {"type": "live_count", "system": "c", "at": 0.6, "tolerance": 0, **more} for more in ({"emitter": 1, "expect": 35}, {"expect": 95})
    ]
    counts.append({"type": "live_count", "system": "c", "emitter": 1, "at": 0.6, "tolerance": 0})
    document = {"name": "stated", "systems": {"p": parent, "c": child}, "verify": counts}
    one, both, lawless = verify_scene(warpsim.Scene.model_validate(document), "cpu", threads=1)
    assert (one.verdict, both.verdict, lawless.verdict) == ("pass", "pass", "fail") and "say what to expect" in lawless.remark
