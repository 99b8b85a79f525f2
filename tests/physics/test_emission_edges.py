"""Emission at its edges: no room left, long intervals, identities beyond 32 bits, neighbors that come and go."""

import numpy as np
import pytest

from tests.physics.scenes import POINT, emitter, scene, simulate
from warpsim import Simulation
from warpsim.kernels.emission import NEXT_ID

BORN = {
    "shape": {"type": "sphere", "radius": 1.0},
    "velocity": {"cone": 120, "speed": {"mean": 1.0, "spread": 0.5}},
    "lifetime": {"mean": 0.2, "spread": 0.1},
    "mass": {"mean": 1.0, "spread": 0.1},
    "radius": {"mean": 0.1, "spread": 0.05, "law": "normal"},
}


def values_by_id(sim) -> dict[int, bytes]:
    """Return everything that stays as it was born, by identity."""
    p = sim.frame()["p"]
    table = np.column_stack([p.velocity, p.mass, p.radius, p.lifetime]).astype(np.float32)
    return {identity: row.tobytes() for identity, row in zip(p.id.tolist(), table, strict=True)}


def test_births_without_room_are_counted_and_use_up_their_ordinals():
    """Of about 800 wanted alive 500 have room: whoever is born has the values that he has where there is room for all."""
    rate = {"rate": 4000.0, **BORN}
    narrow, wide = (simulate(emitter(**rate), capacity=capacity, substeps=1) for capacity in (500, 5000))
    refused, gaps = 0, 0
    for _ in range(60):
        narrow.step_frame()
        wide.step_frame()
        few, all_ = values_by_id(narrow), values_by_id(wide)
        assert few.items() <= all_.items()
        ids = list(few)
        gaps += int((np.diff(ids) > 1).any())
        assert ids == sorted(ids)
        statistics = narrow.statistics()["p"]
        assert statistics["live"] <= 500 and statistics["refused"] >= refused
        refused = statistics["refused"]
    assert gaps > 10 and refused > 1000, "births were refused in between, and not only once"
    assert statistics["born"] + refused == wide.statistics()["p"]["born"] == 4000


def test_a_full_house_takes_in_no_more_than_leave():
    sim = simulate(emitter(30, lifetime=0.3), emitter(100, at=0.1), capacity=64)
    sim.run(0.2)
    assert sim.statistics()["p"] | {"kinetic_energy": 0} == {"live": 64, "born": 64, "refused": 66, "killed": 0, "kinetic_energy": 0}
    sim.run(0.2)
    assert sim.frame()["p"].id.tolist() == list(range(30, 64))


def test_identities_go_on_beyond_32_bits():
    sim = simulate(emitter(rate=600.0), motion="ballistic")
    counters = sim.systems["p"].population.counters
    values = counters.numpy().copy()
    values[NEXT_ID] = 2**32 - 5
    counters.assign(values)
    sim.step_frame()
    assert sim.frame()["p"].id.dtype == np.uint64
    assert sim.frame()["p"].id.tolist() == list(range(2**32 - 5, 2**32 + 5))


@pytest.mark.parametrize(("width", "interval"), [(1.0, 10.0), (10.0, 100.0), (0.02, 200.0)])
def test_long_intervals_keep_exact_moments(width, interval):
    """A share of 10 s of which float32 keeps 1e-6: births neither leave their share nor their frame."""
    sim = simulate(emitter(rate={"mean": 1 / width, "interval": interval}), fps=10, substeps=1, motion="ballistic", capacity=100_000)
    sim.run(min(3 * width, interval) if width > 0.1 else 20.0)
    p = sim.frame()["p"]
    moments = sim.time - p.age.astype(float)
    share = moments / width - np.arange(len(moments))
    assert len(moments) in (3, int(20 / width)) and share.min() > -1e-6 / width and share.max() <= 1 + 1e-6 / width


def test_a_burst_is_the_same_at_any_frame_rate():
    """At 0.1003 s, between frames: the same particles, at the same places 0.2 s later."""
    runs = []
    for fps in (10, 24, 50, 60, 240):
        sim = simulate(emitter(257, at=0.1003, **BORN | {"lifetime": 9.0}), fps=fps, motion="ballistic", gravity=(0, -9.81, 0))
        sim.run(0.5)
        runs.append((values_by_id(sim), sim.frame()["p"]))
        assert np.abs(runs[-1][1].age - (0.5 - 0.1003)).max() < 1e-7
    for values, p in runs[1:]:
        assert values.keys() == runs[0][0].keys()
        assert np.abs(p.position - runs[0][1].position).max() < 1e-6
        assert np.array_equal(p.mass, runs[0][1].mass) and np.array_equal(p.lifetime, runs[0][1].lifetime)


def test_what_comes_after_changes_nothing_before():
    """A burst beside the rate, an emitter after, a system renamed or put before: what was there keeps its values and moments."""
    one = emitter(rate={"mean": 500.0, "spread": 200.0, "law": "poisson"}, **BORN)
    with_burst, with_other = one | {"burst": {"count": 7, "at": 0.05}}, emitter(rate=300.0, shape=POINT)
    alone, burst, other = (Simulation(scene(*e), device="cpu", threads=1) for e in ((one,), (with_burst,), (one, with_other)))
    for sim in (alone, burst, other):
        sim.run(0.15)
    kept, kept_ages = set(values_by_id(alone).values()), set(alone.frame()["p"].age.tolist())
    for sim in (burst, other):
        assert kept < set(values_by_id(sim).values()) and kept_ages < set(sim.frame()["p"].age.tolist())
    document = scene(one).model_dump(by_alias=True)
    renamed = Simulation(scene(one).model_validate(document | {"systems": {"q": document["systems"]["p"]}}), device="cpu", threads=1)
    renamed.run(0.15)
    assert not np.array_equal(renamed.frame()["q"].mass[:20], alone.frame()["p"].mass[:20]), "its name is its identity"
    both = {"q": document["systems"]["p"], "p": document["systems"]["p"], "r": document["systems"]["p"]}
    beside = Simulation(scene(one).model_validate(document | {"systems": both}), device="cpu", threads=1)
    beside.run(0.15)
    assert np.array_equal(beside.frame()["p"].position, alone.frame()["p"].position)
    assert np.array_equal(beside.frame()["q"].position, renamed.frame()["q"].position)


def test_rates_start_where_the_scene_begins_or_later():
    """A start before the beginning is the beginning; a stop before it means nothing is born."""
    born = [
        simulate(emitter(rate=600.0, **keys), prewarm=0.1).statistics()["p"]["born"] for keys in ({}, {"start": -5.0}, {"start": -0.05})
    ]
    assert born == [60, 60, 30]
    sim = simulate(emitter(rate=600.0, stop=-0.01))
    sim.run(0.1)
    assert sim.statistics()["p"]["born"] == 0


@pytest.mark.parametrize("native", [True, False])
@pytest.mark.parametrize("fps", [30, 60])
def test_an_emitter_travels_and_leaves_each_particle_where_it_was_at_its_birth(native, fps):
    """They fly at 2 m/s along z from where the emitter was, at x = 3 t, y = a sine: place and moment of birth in float32."""
    wave = {"sine": {"amplitude": 0.5, "period": 0.7}}
    keys = {"shape": POINT, "rate": 400.0, "lifetime": 9.0, "velocity": {"direction": [0, 0, 1], "speed": 2.0}}
    keys |= {"travel": [{"expression": "3*t"}, wave, 0.0]}
    sim = simulate(emitter(**keys), gravity=(0.0, 0.0, 0.0), fps=fps, native=native)
    sim.run(1.0)
    p = sim.frame()["p"]
    birth = sim.time - p.age.astype(float)
    center = np.array(POINT.get("center", (0.0, 0.0, 0.0)))
    expected = center + np.stack([3.0 * birth, 0.5 * np.sin(2.0 * np.pi * birth / 0.7), 2.0 * p.age.astype(float)], axis=1)
    assert len(birth) == 400 and np.ptp(birth) > 0.99
    # Ages are stored to 2⁻²⁴ s of a frame, rounded again when aged to 1 s: 1.2e-7 s at 3 m/s; drifting adds half an ulp a substep along z.
    assert np.abs(p.position - expected)[:, :2].max() < 1e-6 and np.abs(p.position - expected)[:, 2].max() < 240 * 2.0**-24
