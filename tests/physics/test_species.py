"""Species: a flock attends to whom its matrix says and to nobody else, in any order of systems; swimmers are carried by what flows."""

import numpy as np
import pytest

from tests.reference import flock as twin
from warpsim import Scene, SceneError, Simulation

BOX = {"min": [0, 0, 0], "max": [4, 4, 4], "boundary": "contain"}
RING = {**BOX, "boundary": "periodic"}
FLOCK = {"type": "flock", "count": 120, "domain": BOX, "perception": {"radius": 1.2, "field_of_view": 300}, "speed": [0.5, 2]}
PREY = {**FLOCK, "attends": {"hunters": {"separation": 3.0, "radius": 2.0, "field_of_view": 360}}}
HUNTERS = {**FLOCK, "count": 5, "attends": {"prey": {"cohesion": 2.0, "alignment": {"weight": 0.5, "radius": 1.0}, "radius": 2.5}}}
STRANGERS = {**FLOCK, "count": 60}


def simulate(systems, device="cpu", **way):
    more = {key: way.pop(key) for key in ("flow", "fps") if key in way}
    time = {"fps": more.pop("fps", 60), "substeps": 2}
    return Simulation(Scene.model_validate({"name": "species", "seed": 4, "time": time, "systems": systems, **more}), device=device, **way)


def states(sim, *names):
    return [array for name in names for array in (sim.frame()[name].position, sim.frame()[name].velocity)]


@pytest.mark.parametrize("domain", [BOX, RING])
def test_forces_are_those_of_all_pairs_that_attend(domain, device):
    """float32, as in test_flock.py."""
    prey, hunters = ({**one, "domain": domain} for one in (PREY, HUNTERS))
    if domain is RING:
        hunters["attends"] = {"prey": {**hunters["attends"]["prey"], "radius": 2.0}}
    sim = simulate({"prey": prey, "hunters": hunters}, device=device)
    period = (4, 4, 4) if domain is RING else (0, 0, 0)
    x = {name: sim.frame()[name].position.astype(float) for name in ("prey", "hunters")}
    v = {name: sim.frame()[name].velocity.astype(float) for name in ("prey", "hunters")}
    matrix = {
        "prey": ("hunters", twin.Rules(2.0, 360, {"separation": 3.0, "cohesion": 0.0, "alignment": 0.0}, period=period)),
        "hunters": (
            "prey",
            twin.Rules(
                hunters["attends"]["prey"]["radius"],
                300,
                {"separation": 0.0, "cohesion": 2.0, "alignment": 0.5},
                {"alignment": 1.0},
                period,
            ),
        ),
    }
    for name, (other, rules) in matrix.items():
        expected = twin.forces(x[name], v[name], twin.Rules(1.2, 300, period=period))
        expected += twin.forces_of_others(x[name], v[name], x[other], v[other], rules)
        found = sim.systems[name].steering.numpy()[:, : len(expected)].T
        assert np.abs(found - expected).max() < 2e-4 and np.abs(expected).max() > 0.5


def test_those_it_does_not_attend_to_change_no_bit(device):
    both = {"prey": PREY, "hunters": HUNTERS}
    found = []
    for systems in (both, {"strangers": STRANGERS, **both}, {**both, "strangers": {**STRANGERS, "attends": {"prey": {"cohesion": 1}}}}):
        sim = simulate(systems, device=device)
        for _ in range(20):
            sim.step_frame()
        found.append(states(sim, "prey", "hunters"))
    for others in found[1:]:
        assert all((a == b).all() for a, b in zip(found[0], others, strict=True))


def test_the_order_of_systems_does_not_matter(device):
    found = []
    for systems in ({"prey": PREY, "hunters": HUNTERS}, {"hunters": HUNTERS, "prey": PREY}):
        sim = simulate(systems, device=device)
        for _ in range(20):
            sim.step_frame()
        found.append(states(sim, "prey", "hunters"))
    assert all((a == b).all() for a, b in zip(*found, strict=True))


def test_parts_and_plain_kernels_share_their_bits(monkeypatch):
    monkeypatch.setattr("warpsim.launch.PARALLEL_FROM", 0)
    hashes = set()
    for native, threads in ((True, 1), (True, 2), (True, 3), (False, 1)):
        sim = simulate({"prey": PREY, "hunters": HUNTERS, "strangers": STRANGERS}, native=native, threads=threads)
        for _ in range(10):
            sim.step_frame()
        hashes.add(sim.state_hash())
    assert len(hashes) == 1


def test_prey_keeps_away_from_who_hunts_it():
    """How many prey are within 0.8 m of a hunter that chases them, in the mean over 5 s after the first: with fear less than half."""
    found = {}
    for fear in (0.0, 20.0):
        prey = {**PREY, "attends": {"hunters": {"separation": fear, "radius": 2.0}}}
        sim, near = simulate({"prey": prey, "hunters": {**HUNTERS, "count": 2}}), []
        for index in range(360):
            sim.step_frame()
            x, y = sim.frame()["prey"].position, sim.frame()["hunters"].position
            near += [(np.linalg.norm(x[:, None] - y[None], axis=2) < 0.8).sum()] if index > 60 else []
        found[fear] = np.mean(near)
    assert found[20.0] < 0.5 * found[0.0]


def test_a_flock_in_a_current_moves_as_one_in_still_water_carried_along(device):
    """Places in float32 up to 20 m for 2 s: roundings of 1e-6 a frame, and what they grow to among 40 neighbors."""
    still = {**FLOCK, "domain": {**BOX, "boundary": "none"}, "coupling": {"alpha": 0.3}, "turn_rate": 90, "count": 40}
    still["perception"] = {"radius": 1.2}  # all round: a view goes by the course over ground, which a current changes
    frames = []
    for current in (0.0, 2.0):
        sim = simulate({"fish": still}, flow=[{"type": "uniform", "velocity": [current, 0, 0]}], device=device)
        fish = sim.systems["fish"].population
        velocity = fish.field("velocity").numpy()
        velocity[0, :40] += current
        fish.field("velocity").assign(velocity)
        for _ in range(120):
            sim.step_frame()
        frames.append(sim.frame()["fish"].position.astype(float) - [2.0 * current, 0, 0])
    assert np.abs(frames[0] - frames[1]).max() < 5e-3


@pytest.mark.parametrize(
    ("systems", "words"),
    [
        ({"prey": {**PREY, "attends": {"hunter": {}}}, "hunters": HUNTERS}, 'there is no other flock "hunter"'),
        ({"prey": {**PREY, "attends": {"prey": {}}}}, "attends to itself by its own"),
        ({"prey": {**PREY, "domain": RING}, "hunters": HUNTERS}, "must share one periodic domain"),
        ({"prey": {**PREY, "attends": {"hunters": {"cohesion": {"weight": 1, "radius": 3}}}}, "hunters": FLOCK}, "nobody farther"),
    ],
)
def test_mistakes(systems, words):
    with pytest.raises(Exception, match=words):
        simulate(systems)
    assert SceneError


def test_of_another_flock_only_the_nearest_count(tmp_path, device):
    """A hunter at the origin goes for the mean of the nearest of three: a sum of three at most and a quotient, 3 roundings of 4 m."""
    prey = np.array([[3, 0, 0], [0, 2, 0], [0, 0, 4]], np.float32)
    for name, place in (("prey", prey), ("hunters", np.zeros((1, 3), np.float32))):
        np.savez(tmp_path / f"{name}.npz", position=place, velocity=np.zeros_like(place))
    alone = {"type": "flock", "perception": {"radius": 5.0}}
    for nearest, way in ((None, [1, 2 / 3, 4 / 3]), (1, [0, 2, 0]), (2, [1.5, 1, 0])):
        attention = {"cohesion": 1, **({"nearest": nearest} if nearest else {})}
        hunters = {**alone, "count": 1, "start": {"file": str(tmp_path / "hunters.npz")}, "attends": {"prey": attention}}
        systems = {"prey": {**alone, "count": 3, "start": {"file": str(tmp_path / "prey.npz")}}, "hunters": hunters}
        sim = simulate(systems, device=device)
        assert np.abs(sim.systems["hunters"].steering.numpy()[:, 0] - way).max() < 1e-6
