"""Laws of events: how many children, where and when, how fast, of which color; and that nothing else can change them."""

import numpy as np
import pytest

import warpsim
from tests.reference import birth, events
from tests.reference.emission import random_key

G = np.array([0.0, -9.81, 0.0])
START = {"direction": [0.3, 1.0, -0.2], "cone": 40, "speed": {"mean": 9.0, "spread": 2.0}}
ROCKETS = {"rate": 37.0, "lifetime": {"mean": 0.5, "spread": 0.2}, "velocity": START, "mass": 1.0}
BURST = {"velocity": {"cone": 180, "speed": {"mean": 3.0, "spread": 1.0}}, "lifetime": 100.0, "mass": 1.0}


def family(child: dict, parent: dict = ROCKETS, fps=60, capacity=5000, motion="ballistic", **more) -> warpsim.Scene:
    """Rockets and, written before them, the children that they have; the children fly in straight lines."""
    still = {"gravity": False}
    children = {"type": "particles", "capacity": capacity, "motion": "ballistic", "feels": still, "emitters": [{**BURST, **child}]}
    moves = {"motion": motion} if motion == "ballistic" else {"solver": motion}
    rockets = {"type": "particles", "capacity": 200, **moves, "emitters": [parent]}
    document = {"name": "law", "seed": 5, "time": {"fps": fps, "substeps": 2}, "systems": {"c": children, "p": rockets}}
    return warpsim.Scene.model_validate(document | more)


def listening(event: str, count: int, share: float = 0.0, **keys) -> dict:
    return {"on": {"event": event, "of": "p", "inherit": {"velocity": share, **keys}}, "burst": {"count": count}}


def simulate(scene, device="cpu", native=True, threads=1, seconds=1.5) -> warpsim.Simulation:
    simulation = warpsim.Simulation(scene, device=device, native=native, threads=threads)
    simulation.run(seconds)
    return simulation


def rocket(n: int, at: str) -> tuple[float, np.ndarray, np.ndarray, int]:
    """Return the moment, place and velocity of birth or death of the n-th rocket, and its lineage; from the twin alone."""
    key = random_key(5, "p", 0)
    born = birth_moments(n + 1)[n]
    velocity = birth.velocity(START, key, n)
    t = birth.lifetime(ROCKETS["lifetime"], key, n) if at == "death" else 0.0
    return born + t, velocity * t + 0.5 * G * t * t, velocity + G * t, events.lineage(key, n)


def birth_moments(count: int) -> list[float]:
    from tests.reference.emission import Planner

    return [moment for moment, _ in Planner(ROCKETS, random_key(5, "p", 0), 1.0 / INTERVAL).births(10.0)[:count]]


INTERVAL = 0.1
ROCKETS["rate"] = {"mean": 37.0, "interval": INTERVAL}  # the same births at any frame rate


@pytest.mark.parametrize("event", ["birth", "death"])
@pytest.mark.parametrize("native", [True, False])
def test_every_event_has_its_children(event, native, device):
    """Exactly count for each birth, each death; none is lost between frames, none is counted twice."""
    sim = simulate(family(listening(event, 7)), device, native)
    p, c = (sim.statistics()[name] for name in ("p", "c"))
    happened = p["born"] if event == "birth" else p["born"] - p["live"]
    assert happened > 30 and c["born"] == c["live"] == c["children"] == 7 * happened and c["refused"] == 0


@pytest.mark.parametrize("fps", [24, 60, 97])
@pytest.mark.parametrize("motion", ["ballistic", "verlet"])
@pytest.mark.parametrize("event", ["birth", "death"])
def test_place_moment_velocity_and_identity_are_those_of_the_event(event, motion, fps, device):
    """To float32: ages up to 1.5 s and places within 30 m resolve 2e-7 s and 2e-6 m; speeds of 12 m/s over those moments 1e-5 m.

    Verlet is exact in free fall, also for the part of a substep up to a death.
    """
    sim = simulate(family(listening(event, 3, share=0.25), fps=fps, motion=motion), device, seconds=1.0)
    c = sim.frame()["c"]
    key, emitter = random_key(5, "c", 0), {**BURST, **listening(event, 3, share=0.25)}
    expected = {}
    for n in range(60):
        moment, place, velocity, name = rocket(n, event)
        if moment <= sim.time:
            for j in range(3):
                ordinal = events.child_ordinal(name, 0, 3, j)
                at, speed = events.child(emitter, key, ordinal, place, velocity)
                age = sim.time - moment
                expected[age, ordinal] = (*(at + speed * age), *speed, age)
    expected = np.array([expected[k] for k in sorted(expected)])
    got = np.column_stack([c.position, c.velocity, c.age]).astype(float)
    assert len(got) == len(expected) > 30
    by = np.lexsort(np.round([got[:, 4], got[:, 3]], 3))
    to = np.lexsort(np.round([expected[:, 4], expected[:, 3]], 3))
    np.testing.assert_allclose(got[by], expected[to], atol=2e-5)


def children_by_value(sim, name="c") -> list[bytes]:
    c = sim.frame()[name]
    return sorted(row.tobytes() for row in np.column_stack([c.velocity, c.lifetime, c.mass]))


@pytest.mark.parametrize("event", ["birth", "death"])
def test_the_same_children_at_any_frame_rate(event):
    """Without inheritance a child's velocity, lifetime and mass are made of its ordinal alone: to the bit."""
    keys = {"mass": {"mean": 1.0, "spread": 0.5}, "lifetime": {"mean": 50.0, "spread": 20.0}}
    runs = [children_by_value(simulate(family({**listening(event, 5), **keys}, fps=fps), seconds=1.0)) for fps in (10, 30, 60, 200)]
    assert runs[0] == runs[1] == runs[2] == runs[3] and len(runs[0]) > 50


def test_grandchildren_are_the_same_at_any_frame_rate():
    """A lineage knows no order of births: two emitters, whose births interleave differently at each frame rate, and two generations."""

    def scene(fps):
        parent = {**ROCKETS, "rate": {"mean": 50.0, "interval": 0.05}}
        document = family(listening("death", 2), parent, fps).model_dump(mode="json", by_alias=True)
        document["systems"]["p"]["emitters"].append(document["systems"]["p"]["emitters"][0])
        document["systems"]["c"]["emitters"][0]["lifetime"] = {"mean": 0.2, "spread": 0.1}
        last = {**BURST, "on": {"event": "death", "of": "c", "inherit": {"velocity": 0.0}}, "burst": {"count": 2}}
        document["systems"]["last"] = {"type": "particles", "capacity": 5000, "emitters": [last], "feels": {"gravity": False}}
        return warpsim.Scene.model_validate(document)

    runs = [children_by_value(simulate(scene(fps), seconds=1.0), "last") for fps in (20, 60, 140)]
    assert runs[0] == runs[1] == runs[2] and len(runs[0]) > 50


def test_births_without_room_are_counted_and_change_no_other():
    few, all_ = (simulate(family({**listening("death", 9), "lifetime": 0.3}, capacity=n)) for n in (60, 5000))
    a, b = few.statistics()["c"], all_.statistics()["c"]
    assert a["refused"] > 0 == b["refused"] and a["born"] + a["refused"] == b["born"] and a["children"] == a["born"]
    few, all_ = (dict(zip(sim.frame()["c"].id.tolist(), sim.frame()["c"].velocity.tolist(), strict=True)) for sim in (few, all_))
    assert few.items() <= all_.items() and len(few) > 10


def test_a_frame_may_hold_three_generations():
    """Lives of 1 ms at 10 frames per second: rocket, star and crackle are born and die within one frame."""
    brief = {"rate": 100.0, "lifetime": 1e-3, "velocity": START}
    document = family({**listening("death", 3), "lifetime": 1e-3}, brief, fps=10).model_dump(mode="json", by_alias=True)
    last = {"on": {"event": "death", "of": "c"}, "burst": {"count": 2}, "lifetime": 50.0}
    document["systems"]["last"] = {"type": "particles", "emitters": [last]}
    sim = simulate(warpsim.Scene.model_validate(document), seconds=2.0)
    counts = {name: numbers["born"] for name, numbers in sim.statistics().items()}
    assert counts["p"] >= 199 and counts["last"] == sim.statistics()["last"]["live"]
    assert abs(counts["c"] - 3 * counts["p"]) <= 3 and abs(counts["last"] - 2 * counts["c"]) <= 6


def test_colors_are_drawn_inherited_and_multiplied():
    red, green = [1.0, 0.0, 0.0, 1.0], [0.0, 1.0, 0.0, 0.5]
    parent = {**ROCKETS, "color": [red, green], "lifetime": 100.0}
    child = {**listening("birth", 2, color=True), "color": [1.0, 0.4, 0.2]}
    sim = simulate(family(child, parent))
    p, c = sim.frame()["p"], sim.frame()["c"]
    key = random_key(5, "p", 0)
    own = np.rint(255 * np.array([events.tint([red, green], key, n) for n in p.id.tolist()])).astype(np.uint8)
    assert (p.color == own).all() and len(np.unique(p.color, axis=0)) == 2
    expected = events.multiply(np.repeat(own, 2, axis=0), np.array([255, 102, 51, 255], np.uint8))
    assert (c.color == expected).all()
    assert (c.packed().color == expected).all(), "the look is white"


def test_leaving_the_world_is_no_death():
    """A world of 2 m that rockets leave, with the policy kill: children of those only that died inside."""
    scene = family(listening("death", 1), limits={"extent": 2.0, "unstable": "kill"})
    sim = simulate(scene)
    p, c = (sim.statistics()[name] for name in ("p", "c"))
    assert p["killed"] > 5 and c["born"] == p["born"] - p["live"] - p["killed"] > 0


@pytest.mark.parametrize("event", ["birth", "death"])
def test_parts_and_plain_kernels_share_their_bits(event, monkeypatch):
    monkeypatch.setattr("warpsim.launch.PARALLEL_FROM", 0)
    child = {**listening(event, 5, share=0.7, color=True), "shape": {"type": "sphere", "radius": 0.1}, "lifetime": 0.4}
    parent = {**ROCKETS, "rate": 3000.0, "color": ["#f00", "#0f0"]}
    scene = family(child, parent, capacity=3000).model_copy()
    ways = ((True, 1), (True, 2), (True, 3), (False, 1), (False, 3))
    assert len({simulate(scene, native=native, threads=n, seconds=0.7).state_hash() for native, n in ways}) == 1


def test_going_back_and_forth_gives_the_same_state():
    sim = simulate(family(listening("death", 4, share=1.0)), seconds=1.0)
    expected = sim.state_hash()
    sim.seek(20)
    sim.seek(60)
    assert sim.state_hash() == expected


def test_the_share_may_change_while_it_runs():
    sim = simulate(family(listening("death", 1, share=1.0)), seconds=0.0)
    sim.change("systems.c.emitters.0.on.inherit.velocity", 0.0)
    sim.run(1.0)
    fixed = simulate(family(listening("death", 1, share=0.0)), seconds=1.0)
    assert (sim.frame()["c"].velocity == fixed.frame()["c"].velocity).all() and sim.frame()["c"].count > 10


def splashing(child: dict, colliders, fps=60, drops=None, **more) -> warpsim.Scene:
    """Drops that fall on colliders in vacuum, and what splashes up, in straight lines through everything."""
    drops = drops or {"burst": {"count": 50}, "shape": {"type": "box", "center": [0, 2, 0], "size": [1, 1, 1]}, "lifetime": 100.0}
    still = {"gravity": False, "colliders": False}
    children = {"type": "particles", "capacity": 5000, "motion": "ballistic", "feels": still, "emitters": [{**BURST, **child}]}
    rain = {"type": "particles", "capacity": 200, "solver": "verlet", "emitters": [drops]}
    document = {"name": "law", "seed": 5, "time": {"fps": fps, "substeps": 2}, "colliders": colliders}
    return warpsim.Scene.model_validate(document | {"systems": {"c": children, "p": rain}} | more)


GROUND = {"type": "plane", "restitution": 0.5, "friction": 0.0}


@pytest.mark.parametrize("fps", [30, 60, 144])
@pytest.mark.parametrize("native", [True, False])
def test_a_splash_is_where_and_when_the_drop_falls(fps, native, device):
    """√(2 y/g) after the start, to 2e-6 s and 1e-5 m: Verlet is exact under gravity, float32 is not; three children at rest each."""
    child = {**listening("collision", 3), "velocity": None}
    drops = {"burst": {"count": 50}, "shape": {"type": "box", "center": [0, 2, 0], "size": [1, 1, 1]}, "lifetime": 0.65}
    sim = simulate(splashing(child, [GROUND], fps, drops), device, native, seconds=0.72 if fps != 30 else 22 / 30)
    key = random_key(5, "p", 0)
    places = np.array([birth.position(drops["shape"], key, (1 << 40) + j) for j in range(50)])
    fall = np.sqrt(2.0 * places[:, 1] / 9.81)
    hit = fall < 0.65
    exact = np.repeat(np.column_stack([places[:, 0], places[:, 2], sim.time - fall])[hit], 3, axis=0)
    c = sim.frame()["c"]
    got = np.column_stack([c.position[:, 0], c.position[:, 2], c.age]).astype(float)
    assert hit.sum() > 20 and len(got) == len(exact)
    order, to = (np.lexsort(np.round(a[:, :2].T, 4)) for a in (got, exact))
    np.testing.assert_allclose(got[order], exact[to], atol=1e-5)
    assert np.abs(c.position[:, 1]).max() < 1e-4


def test_bounces_below_the_least_speed_are_not_heard():
    """A ball with restitution ½ from 2 m strikes at 6.26, 3.13, 1.57, 0.78, 0.39 … m/s: of 1 m/s and more there are three."""
    drops = {"burst": {"count": 1}, "shape": {"type": "point", "center": [0, 2, 0]}, "lifetime": 100.0}
    for least, count in ((None, 5), (1.0, 3), (3.0, 2), (7.0, 0)):
        child = {**listening("collision", 2), "velocity": None}
        child["on"] = child["on"] | ({} if least is None else {"min_speed": least})
        sim = simulate(splashing(child, [GROUND], drops=drops), seconds=3.0)
        born = sim.statistics()["c"]["born"]
        assert born == 2 * count if least else born >= 2 * count, least


def test_what_is_inherited_of_a_collision_runs_along_the_surface():
    """A drop that flies at 45° into the ground: 3 m/s along it, and nothing into it; with a share of ½ half of it."""
    velocity = {"direction": [1, -1, 0], "speed": 3.0 * np.sqrt(2.0)}
    drops = {"burst": {"count": 1}, "shape": {"type": "point", "center": [0, 1, 0]}, "velocity": velocity, "lifetime": 100.0}
    child = {**listening("collision", 1, share=0.5), "velocity": None}
    sim = simulate(splashing(child, [GROUND], drops=drops, gravity=[0, 0, 0]), seconds=0.5)
    assert sim.frame()["c"].velocity == pytest.approx(np.array([[1.5, 0.0, 0.0]]), abs=1e-6)


def test_children_of_a_collision_may_leave_along_the_normal():
    """Round a sphere, with axes: surface, each child's own velocity, straight up, is along the normal: along its place from the center."""
    ball = {"type": "sphere", "center": [0, -1, 0], "radius": 1.0}
    child = listening("collision", 1)
    child["on"] = child["on"] | {"axes": "surface"}
    sim = simulate(splashing({**child, "velocity": {"speed": 2.0}, "lifetime": 0.2}, [ball]), seconds=0.6)
    c = sim.frame()["c"]
    start = c.position - c.velocity * c.age[:, None]
    assert c.count > 5 and np.abs(np.linalg.norm(start - [0, -1, 0], axis=1) - 1.0).max() < 1e-4
    np.testing.assert_allclose(c.velocity, 2.0 * (start - [0, -1, 0]), atol=1e-3)


def test_a_collider_that_kills_makes_a_death_in_its_place():
    """Within a few skins of the ground (2e-5 m at a meter, kernels/clearance.py)."""
    ground = {"type": "plane", "action": "kill"}
    sim = simulate(splashing({**listening("death", 2), "velocity": None}, [ground]), seconds=1.0)
    c = sim.frame()["c"]
    assert sim.statistics()["p"]["live"] == 0 and c.count == 100 and np.abs(c.position[:, 1]).max() < 1e-4


def test_collisions_share_their_bits(monkeypatch):
    monkeypatch.setattr("warpsim.launch.PARALLEL_FROM", 0)
    drops = {"rate": 2000.0, "shape": {"type": "box", "center": [0, 1, 0], "size": [2, 1, 2]}, "lifetime": 0.8}
    child = {**listening("collision", 4, share=0.5), "shape": {"type": "sphere", "radius": 0.02}, "lifetime": 0.3}
    child["on"] = child["on"] | {"axes": "surface", "min_speed": 0.5}
    scene = splashing(child, [GROUND, {"type": "sphere", "radius": 0.5}], drops=drops)
    ways = ((True, 1), (True, 2), (True, 3), (False, 1), (False, 3))
    assert len({simulate(scene, native=native, threads=n, seconds=0.8).state_hash() for native, n in ways}) == 1


def test_collisions_are_the_same_after_going_back():
    sim = simulate(splashing(listening("collision", 2), [GROUND]), seconds=1.0)
    expected = sim.state_hash()
    sim.seek(25)
    sim.seek(60)
    assert sim.state_hash() == expected and sim.statistics()["c"]["children"] > 50


def test_events_of_particles_that_act_on_each_other_share_their_bits(monkeypatch):
    """With neighbors every substep is a launch of its own; children by a method with a history; births, deaths and bounces all heard."""
    monkeypatch.setattr("warpsim.launch.PARALLEL_FROM", 0)
    cloud = {
        "rate": 700.0,
        "shape": {"type": "sphere", "radius": 0.5},
        "lifetime": {"mean": 0.3, "spread": 0.2},
        "velocity": BURST["velocity"],
    }
    emitters = [{**BURST, "lifetime": 0.3, **listening(event, 2, share=0.5)} for event in ("birth", "death", "collision")]
    children = {"type": "particles", "solver": "abm_pece_4", "feels": {"forces": False}, "emitters": emitters}
    document = {
        "name": "law",
        "forces": [{"type": "pairwise", "strength": 0.001, "radius": 0.3}],
        "colliders": [{**GROUND, "center": [0, -0.6, 0]}],
    }
    document |= {"systems": {"c": children, "p": {"type": "particles", "capacity": 2000, "emitters": [cloud]}}}
    scene = warpsim.Scene.model_validate(document)
    runs = [simulate(scene, native=native, threads=n, seconds=0.5) for native, n in ((True, 1), (True, 3), (False, 1), (False, 2))]
    assert len({sim.state_hash() for sim in runs}) == 1
    p, c = (runs[0].statistics()[name] for name in ("p", "c"))
    assert c["children"] > 2 * (p["born"] + p["born"] - p["live"]), "some bounced"
