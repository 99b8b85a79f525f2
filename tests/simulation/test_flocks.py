"""Flocks as systems among others: random valid scenes, every number that may change, recordings, going back, starting anew."""

import numpy as np
import pytest

from tests.kernels.flocks import flock
from tests.scene.samples import EVERYTHING, FOLDER
from warpsim import SceneError, Simulation, launch
from warpsim.changes import FixedField
from warpsim.observers.recorder import Recorder
from warpsim.replay import Recording
from warpsim.scene import Scene, load_text, resolved_yaml

FLOCKS = ("birds", "hawks", "spins")


def round_number(value) -> float:
    return float(f"{value:.3g}")


def random_flock(rng, edge, boundary):
    """Keys of a random valid flock in a box of some edges [m]; 0: an axis that does not exist."""
    low = rng.choice([-30.0, 0.0, 2.5], 3)
    reach = round_number(rng.uniform(0.1, 0.5) * min(e for e in edge if e))
    spec = {
        "type": "flock",
        "count": int(rng.choice([0, 1, 2, 3, 40, 150])),
        "domain": {"min": low.tolist(), "max": (low + edge).tolist(), "boundary": boundary},
        "perception": {"radius": reach, "field_of_view": int(rng.choice([0, 45, 180, 300, 360]))},
        "start": {"seed": int(rng.integers(1000))},
    }
    if rng.random() < 0.3:
        spec["perception"]["nearest"] = int(rng.integers(1, 9))
    if boundary != "contain" and sum(e > 0 for e in edge) > 1 and rng.random() < 0.25:
        return spec | {"vicsek": {"speed": round_number(rng.uniform(0.1, 2)), "noise": round_number(rng.uniform(0, 6))}}
    for key in ("separation", "cohesion", "alignment"):
        if rng.random() < 0.7:
            spec[key] = {"weight": round_number(rng.uniform(-1, 3)), "radius": round_number(rng.uniform(0.3, 0.99) * reach)}
    extras = {
        "speed": sorted(map(round_number, rng.uniform(0, 3, 2))),
        "max_force": round_number(rng.uniform(0.1, 10)),
        "turn_rate": round_number(rng.uniform(5, 400)),
        "mass": round_number(rng.uniform(0.1, 3)),
        "coupling": {"alpha": round_number(rng.uniform(0.1, 1))},
        "substeps": int(rng.integers(1, 4)),
        "thickness": 0.05,
        "feels": {"gravity": True},
        "look": {"as": str(rng.choice(["birds", "fish", "points"])), "color": {"by": "neighbors", "range": [0, 9]}},
        "steering": [{"type": "seek", "target": [1, 0, {"expression": "sin(t)"}]}, {"type": "wander"}, {"type": "avoid", "radius": 0.3}],
    }
    return spec | {key: value for key, value in extras.items() if rng.random() < 0.4}


def random_scene(number) -> Scene:
    """A valid scene of two flocks in a flow, with a rock."""
    rng = np.random.default_rng([6, number])
    edge = np.where(rng.random(3) < 0.75, [round_number(e) for e in rng.uniform(0.4, 8, 3)], 0.0)
    edge[0] = edge[0] or 1.5
    boundary = str(rng.choice(["none", "contain", "periodic"]))
    systems = {name: random_flock(rng, edge, boundary) for name in ("a", "b")}
    if "vicsek" not in systems["a"] and (boundary != "periodic" or systems["a"]["domain"] == systems["b"]["domain"]):
        systems["a"]["attends"] = {"b": {"separation": 2, "cohesion": round_number(rng.uniform(-1, 1))}}
    flow = [{"type": "uniform", "velocity": [0.3, 0, 0]}]
    colliders = [{"type": "sphere", "center": [1, 0.5, 0.5], "radius": 0.4, "restitution": 0.5}] if rng.random() < 0.5 else []
    document = {"name": "random", "seed": number, "time": {"substeps": 1}, "flow": flow, "colliders": colliders, "systems": systems}
    return Scene.model_validate(document)


def check(spec, seen):
    x, v = seen.position.astype(float), seen.velocity.astype(float)
    assert seen.count == spec.count and np.isfinite(x).all() and np.isfinite(v).all()
    size = np.array(spec.domain.size)
    if spec.domain.boundary != "none":
        slack = 1e-6 * np.abs(spec.domain.max).max()  # the far corner in float32
        inside = (x >= np.array(spec.domain.min) - slack) & (x <= np.array(spec.domain.max) + slack)
        assert inside[:, size > 0].all()
    if spec.vicsek and spec.count:
        np.testing.assert_allclose(np.linalg.norm(v, axis=1), spec.vicsek.speed, rtol=1e-5)


@pytest.mark.parametrize("number", range(40))
def test_random_flocks_run_and_share_their_bits(number, monkeypatch):
    scene = random_scene(number)
    assert load_text(resolved_yaml(scene), "again") == scene
    sim = Simulation(scene, device="cpu", threads=1)
    for _ in range(10):
        sim.step_frame()
        for name, spec in scene.systems.items():
            check(spec, sim.frame()[name])
    end = sim.state_hash()
    sim.seek(3)
    sim.seek(10)
    assert sim.state_hash() == end, "going back"
    plain = Simulation(scene, device="cpu", native=False)
    plain.seek(10)
    assert plain.state_hash() == end, "plain kernels"
    monkeypatch.setattr(launch, "PARALLEL_FROM", 0)
    parted = Simulation(scene, device="cpu", threads=3)
    parted.seek(10)
    assert parted.state_hash() == end, "three parts"
    assert all(np.isfinite(list(numbers.values())).all() for numbers in sim.statistics().values())


def full_scene() -> Scene:
    """The flocks of the sample that has every key, and what they feel."""
    document = load_text(EVERYTHING, folder=FOLDER).model_dump(by_alias=True, include={"name", "seed", "colliders", "systems"})
    document["systems"] = {name: document["systems"][name] for name in FLOCKS}
    document["colliders"] = [one for one in document["colliders"] if one["type"] != "mesh"]
    for one in document["systems"].values():
        one["count"] = min(one["count"], 30)
    return Scene.model_validate(document | {"flow": [{"type": "uniform", "velocity": [0.2, 0, 0]}]})


def numbers_below(value, path):
    """Every number of a document, by its path."""
    if isinstance(value, dict):
        return [found for key, item in value.items() for found in numbers_below(item, f"{path}.{key}")]
    if isinstance(value, list | tuple):
        return [found for k, item in enumerate(value) for found in numbers_below(item, f"{path}.{k}")]
    return [(path, value)] if isinstance(value, int | float) and not isinstance(value, bool) else []


def test_every_number_that_may_change_acts_like_a_scene_built_with_it():
    scene = full_scene()
    document = scene.model_dump(by_alias=True, exclude_none=True)["systems"]
    sim, fixed, acted = Simulation(scene, device="cpu", threads=1), [], 0
    for path, value in (found for name in FLOCKS for found in numbers_below(document[name], f"systems.{name}")):
        if ".over_life." in path:  # a ramp of its own, or a color
            continue
        other = (value - 1 if value > 1 else value + 1) if isinstance(value, int) else value * 0.9 + 0.01
        sim.seek(0)
        try:
            sim.change(path, repr(other))
        except FixedField:
            fixed.append(path)
            continue
        except SceneError:  # what Vicsek's flock has no use for, and the axis that its plane does not have
            assert path.startswith("systems.spins."), path
            continue
        assert np.isfinite(sim.frame()["birds"].packed().position).all()
        sim.seek(4)
        end = sim.state_hash()
        if "domain" not in path and "look" not in path and path not in ("systems.spins.vicsek.speed",):  # where and how fast they start
            built = Simulation(sim.scene, device="cpu", threads=1)
            built.seek(4)
            assert built.state_hash() == end, path
            acted += 1
        sim.changes.clear()
    words = (".count", ".substeps", ".start.", ".points.")
    assert all(any(word in path for word in words) for path in fixed), fixed
    assert acted > 60 and "systems.birds.count" in fixed


@pytest.mark.parametrize("boundary", ["contain", "periodic"])
def test_walls_that_close_in_on_a_running_flock_find_it_within(boundary, tmp_path):
    """Who looks for neighbors takes for granted that all are in the domain; native loops and plain kernels would differ if one were not."""
    rng = np.random.default_rng(3)
    x, v = rng.uniform(0, 9, (300, 3)), rng.normal(size=(300, 3))
    scene, hashes = flock(tmp_path, x, v, domain={"min": [0, 0, 0], "max": [9, 9, 9], "boundary": boundary}, speed=[0.5, 2]), set()
    for native in (True, False):
        sim = Simulation(scene, device="cpu", threads=1, native=native)
        sim.step_frame()
        for axis, edge in enumerate((7.5, 8.0, 6.5)):
            sim.change(f"systems.f.domain.max.{axis}", edge)
        for _ in range(3):
            sim.step_frame()
        assert (sim.frame()["f"].position <= [7.5, 8.0, 6.5]).all()
        hashes.add(sim.state_hash())
    assert len(hashes) == 1


def test_a_number_is_changed_and_set_back_without_a_trace():
    """Change and change back before the next step: the same bits as never touched."""
    sim, other = (Simulation(full_scene(), device="cpu", threads=1) for _ in range(2))
    for path, value in (("perception.radius", 0.9), ("cohesion.weight", -2), ("attends.hawks.separation", 3), ("steering.roost.speed", 1)):
        sim.change(f"systems.birds.{path}", repr(value))
    for path, value in (
        ("perception.radius", 1.25),
        ("cohesion.weight", 0.95),
        ("attends.hawks.separation", 25),
        ("steering.roost.speed", 2.5),
    ):
        sim.change(f"systems.birds.{path}", repr(value))
    sim.seek(5)
    other.seek(5)
    assert sim.state_hash() == other.state_hash()


def test_a_recorded_flock_is_drawn_again_the_same(tmp_path):
    sim = Simulation(full_scene(), device="cpu", threads=1)
    recorder = Recorder(tmp_path / "run")
    recorder.begin(resolved_yaml(sim.scene))
    kept = []
    for frame in sim.frames(4):
        recorder.record(frame, sim.statistics(), sim.state_hash())
        kept.append({name: (frame[name].position, frame[name].velocity, frame[name].packed()) for name in FLOCKS})
    recorder.close()
    recording = Recording(tmp_path / "run")
    for index in (4, 1, 3):
        for name in FLOCKS:
            again, (position, velocity, packed) = recording.frame(index)[name], kept[index - 1][name]
            assert np.array_equal(again.position, position) and np.array_equal(again.velocity, velocity)
            drawn = again.packed()
            assert np.array_equal(drawn.position, packed.position) and np.array_equal(drawn.color, packed.color), (index, name)
    header = (tmp_path / "run" / "stats.csv").read_text().splitlines()[0].split(",")
    assert {f"{name}.{key}" for name in FLOCKS for key in ("order", "polarization", "milling", "nearest", "clusters")} <= set(header)


@pytest.mark.parametrize("policy", ["reset", "kill"])
def test_a_flock_that_leaves_the_world_starts_anew_as_a_whole(policy):
    """At 6 m/s and more it is beyond 20 m within 3 s and some: then it is where it began, and nobody is missing."""
    spec = {"type": "flock", "count": 9, "domain": {"min": [-1, -1, -1], "max": [1, 1, 1]}, "perception": {"radius": 0.1}, "speed": [6, 6]}
    scene = Scene.model_validate({"name": "x", "limits": {"extent": 20, "unstable": policy}, "systems": {"s": spec}})
    sim = Simulation(scene, device="cpu", threads=1)
    start, back = sim.frame()["s"].position.copy(), 0
    for _ in range(420):
        sim.step_frame()
        seen = sim.frame()["s"].position
        assert len(seen) == 9 and np.abs(seen).max() <= 20
        back += np.array_equal(seen, start)
    assert back >= 1
