"""Steering: each behavior against its twin, at random places and at the edges of its radius; the same bits by any parts."""

import numpy as np
import pytest

from tests.kernels.flocks import flock
from tests.reference import steering as twin
from warpsim import Simulation
from warpsim.kernels.steering import BEHAVIORS
from warpsim.scene.base import kinds_of, type_name
from warpsim.scene.steering import Behavior

SILENT = {"separation": 0, "cohesion": 0, "alignment": 0, "start": None}
# At (1, 0.5, -0.5) where the opening frame begins, a frame before time 0, moving at 1 m/s along x.
COURSE = {"keyframes": [[-10, [-9 + 1 / 60, 0.5, -0.5]], [10, [11 + 1 / 60, 0.5, -0.5]]]}
GOAL, DRIFT = np.array([1, 0.5, -0.5]), np.array([1.0, 0, 0])
PATH = [[-2, 0, -2], [2, 0, -2], [2, 0, 2], [2, 0, 2], [-2, 1, 2]]
BOX = {"min": [-3, -3, -3], "max": [3, 3, 3], "boundary": "contain"}
CASES = [
    ({"type": "seek", "target": COURSE}, lambda x, v: twin.seek(x, v, 3, GOAL, DRIFT)),
    ({"type": "seek", "target": COURSE, "radius": 2}, lambda x, v: twin.seek(x, v, 3, GOAL, DRIFT, 2)),
    ({"type": "flee", "target": COURSE, "radius": 2}, lambda x, v: twin.flee(x, v, 3, GOAL, DRIFT, 2)),
    ({"type": "arrive", "target": COURSE, "radius": 2}, lambda x, v: twin.arrive(x, v, 3, GOAL, DRIFT, 2)),
    ({"type": "pursue", "target": COURSE, "horizon": 0.7}, lambda x, v: twin.pursue(x, v, 3, GOAL, DRIFT, 0.7)),
    ({"type": "evade", "target": COURSE, "radius": 2, "horizon": 0.7}, lambda x, v: twin.evade(x, v, 3, GOAL, DRIFT, 2, 0.7)),
    ({"type": "path", "points": PATH, "closed": True}, lambda x, v: twin.path(x, v, 3, PATH, True)),
    ({"type": "path", "points": PATH, "radius": 1.5, "horizon": 0}, lambda x, v: twin.path(x, v, 3, PATH, False, 1.5, 0)),
    ({"type": "leader", "target": COURSE, "distance": 1.5, "radius": 2}, lambda x, v: twin.leader(x, v, 3, GOAL, DRIFT, 1.5, 2)),
    ({"type": "contain", "radius": 1.2}, lambda x, v: twin.contain(x, v, 3, np.full(3, -3.0), np.full(3, 6.0), 1.2)),
]


def test_every_kind_has_a_kernel():
    assert {type_name(kind) for kind in kinds_of(Behavior)} == set(BEHAVIORS)


@pytest.mark.parametrize("case", range(len(CASES)))
def test_forces_equal_the_twin(case, tmp_path, device):
    """float32: a few roundings of numbers below 10, times the weight 2 and the speed 3; near a corner of a path both sides are right."""
    keys, expected = CASES[case]
    rng = np.random.default_rng(case)
    x, v = rng.uniform(-3, 3, (200, 3)).astype(np.float32), rng.normal(size=(200, 3)).astype(np.float32)
    rules = {"separation": 0, "cohesion": 0, "alignment": 0}
    sim = Simulation(flock(tmp_path, x, v, domain=BOX, speed=[0, 3], steering=[{**keys, "weight": 2}], **rules), device=device)
    found = sim.systems["f"].steering.numpy()[:, :200].T
    wanted = 2 * np.array([expected(*pair) for pair in zip(x.astype(float), v.astype(float), strict=True)])
    wrong = np.abs(found - wanted).max(axis=1) > 2e-5
    assert wrong.sum() <= (3 if keys["type"] == "path" else 0) and np.abs(wanted).max() > 1


def test_steering_adds_up_and_any_parts_share_its_bits(tmp_path, monkeypatch):
    monkeypatch.setattr("warpsim.launch.PARALLEL_FROM", 0)
    rng = np.random.default_rng(1)
    x, v = rng.uniform(-3, 3, (300, 3)), rng.normal(size=(300, 3))
    behaviors = [case[0] for case in CASES] + [{"type": "wander"}, {"type": "avoid"}, {"type": "leader", "boid": 7}]
    more = {"colliders": [{"type": kind, **where} for kind, where in SOLIDS.items()]}
    scene = flock(tmp_path, x, v, domain=BOX, speed=[0.5, 3], steering=behaviors, more=more, substeps=2)
    hashes = set()
    for native, threads in ((True, 1), (True, 2), (True, 3), (False, 1)):
        sim = Simulation(scene, device="cpu", threads=threads, native=native)
        for _ in range(8):
            sim.step_frame()
        hashes.add(sim.state_hash())
    assert len(hashes) == 1


SOLIDS = {
    "plane": {"center": [0, -2.5, 0], "normal": [0, 1, 0]},
    "sphere": {"center": [1, 1, 1], "radius": 0.5},
    "box": {"center": [-1, 0, 1], "size": [0.5, 2, 0.5], "rotation": [0, 30, 0]},
    "capsule": {"start": [0, -2, -1], "end": [0, 2, -1], "radius": 0.3},
}
