"""Who is born when: the device's plan against the definition, birth by birth."""

import numpy as np
import pytest

from tests.physics.scenes import emitter, simulate
from tests.reference import emission as reference
from warpsim.kernels.emission import COUNT_LAWS
from warpsim.scene.emitters import Rate

KNOTS = {"keyframes": [[0.0, 0.0], [0.5, 400.0], [1.0, 100.0]]}
CASES = {
    "constant": {"rate": 257.0},
    "slow": {"rate": 3.7},
    "frame_rate": {"rate": 60.0},
    "fast": {"rate": 20_000.0},
    "uniform": {"rate": {"mean": 500.0, "spread": 300.0}},
    "clamped": {"rate": {"mean": 100.0, "spread": 300.0}},
    "scaled_uniform": {"rate": {"mean": 500.0, "spread": 200.0, "law": "scaled_uniform"}},
    "normal": {"rate": {"mean": 500.0, "spread": 200.0, "law": "normal"}},
    "poisson": {"rate": {"mean": 500.0, "law": "poisson"}},
    "poisson_in_chunks": {"rate": {"mean": 6_000.0, "law": "poisson", "interval": 0.25}},
    "long_interval": {"rate": {"mean": 300.0, "spread": 200.0, "interval": 0.23}},
    "short_interval": {"rate": {"mean": 900.0, "spread": 400.0, "interval": 0.003}},
    "keyframes": {"rate": KNOTS},
    "sine": {"rate": {"mean": {"sine": {"mean": 100.0, "amplitude": 300.0, "period": 0.4}}, "spread": 50.0}},
    "expression": {"rate": {"expression": "500*t"}},
    "start_and_stop": {"rate": 300.0, "start": 0.105, "stop": 0.731},
    "stop_within_an_interval": {"rate": {"mean": 300.0, "interval": 0.2}, "start": 0.1, "stop": 0.55},
    "bursts": {"burst": [{"count": 7, "at": 0.0}, {"count": 3, "at": 0.1}, {"count": 5, "at": 0.2515}, {"count": 2, "at": 0.1}]},
    "rate_and_burst": {"rate": 100.0, "burst": {"count": 11, "at": 0.4}},
}


def births_of(sim, frames):
    """Return (moment, ordinal) of every birth in ids' order, and their frames; the n-th id carries the twin's n-th ordinal."""
    seen: dict[int, tuple[float, int]] = {}
    for index in range(frames + 1):
        if index:
            sim.step_frame()
        p = sim.frame()["p"]
        for number, age in zip(p.id.tolist(), p.age.tolist(), strict=True):
            seen.setdefault(number, (index / 60 - age, index))
    return [seen[number] for number in sorted(seen)], sorted(seen)


def test_every_count_law_has_a_twin():
    assert set(reference.COUNT_LAWS) == set(COUNT_LAWS) == set(Rate.model_fields["law"].annotation.__args__)


@pytest.mark.parametrize("name", CASES)
def test_births_equal_the_twin(name, device):
    """The same births in the same order, each in the frame of its moment, at its moment to 1e-6 s; ids run without a gap."""
    frames, keys = 70, CASES[name]
    sim = simulate(emitter(**keys), device=device, capacity=40_000, motion="ballistic")
    got, ids = births_of(sim, frames)
    planner = reference.Planner(keys, reference.random_key(1, "p", 0), 60)
    expected, before = [], set()
    for index in range(frames + 1):
        fresh = [birth for birth in planner.births(index / 60) if birth[1] not in before]
        before |= {ordinal for _, ordinal in fresh}
        expected += [(moment, index) for moment, _ in fresh]
    assert ids == list(range(len(expected)))
    assert [frame for _, frame in got] == [frame for _, frame in expected]
    assert np.abs(np.array([moment for moment, _ in got]) - [moment for moment, _ in expected]).max(initial=0.0) < 1e-6


def test_ordinals_are_those_of_the_twin(device):
    """Seen through the lifetimes, which the ordinal alone decides; rate and bursts count apart."""
    keys = CASES["rate_and_burst"] | {"lifetime": {"mean": 50.0, "spread": 20.0}}
    sim = simulate(emitter(**keys), device=device, motion="ballistic")
    sim.run(1.0)
    key = reference.random_key(1, "p", 0)
    by_frame = [reference.Planner(keys, key, 60).births(index / 60) for index in range(61)]
    ordinals = [ordinal for k in range(61) for _, ordinal in by_frame[k] if k == 0 or ordinal not in {n for _, n in by_frame[k - 1]}]
    from tests.reference.birth import lifetime

    np.testing.assert_allclose(sim.frame()["p"].lifetime, [lifetime(keys["lifetime"], key, n) for n in ordinals], rtol=1e-6)


def test_prewarm_begins_where_it_says(device):
    """A prewarm that is no multiple of the frame: births from −0.123 s on, a burst before it is not born."""
    keys = {"rate": 777.0, "burst": [{"count": 5, "at": -0.2}, {"count": 3, "at": -0.123}, {"count": 2, "at": 0.0}]}
    sim = simulate(emitter(**keys), device=device, prewarm=0.123, motion="ballistic")
    moments = np.sort(-sim.frame()["p"].age.astype(float))
    exact = sorted(m for m, _ in reference.Planner(keys, reference.random_key(1, "p", 0), 60, -0.123).births(0.0))
    assert sim.index == 0 and len(moments) == len(exact) == int(777 * 0.123) + 5
    assert np.abs(moments - exact).max() < 1e-6 and moments.min() == pytest.approx(-0.123, abs=1e-6)


def test_poisson_above_a_million_is_normal(device):
    """One interval of 1 s with 1.2e6 expected births: the count itself is the twin's, from rounded Box–Muller within 1."""
    keys = {"rate": {"mean": 1.2e6, "law": "poisson", "interval": 1.0}}
    sim = simulate(emitter(**keys, lifetime=1e-6), device=device, fps=2, capacity=64, motion="ballistic")
    sim.run(1.0)
    total = sum(sim.statistics()["p"][key] for key in ("born", "refused"))
    assert abs(total - reference.poisson(reference.random_key(1, "p", 0), 0, 1.2e6)) <= 1
