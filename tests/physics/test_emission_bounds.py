"""Rates that are no numbers or beyond all bounds, and intervals without a floor: nothing hangs, nothing is lost silently."""

import numpy as np
import pytest
from pydantic import ValidationError

from tests.physics.scenes import emitter, scene, simulate


@pytest.mark.parametrize("law", ["uniform", "scaled_uniform", "normal", "poisson"])
@pytest.mark.parametrize(("text", "expected"), [("100/floor(t)", 55), ("100 + log(t - 1)", 100), ("100 + exp(800*(1 - t))", 100)])
def test_a_rate_that_was_no_number_recovers(text, expected, law):
    """Infinite, not a number, or beyond all counting at first; then about 100/s (and 50/s where floor(t) is 2)."""
    sim = simulate(emitter(rate={"mean": {"expression": text}, "law": law}, lifetime=0.05), motion="ballistic", capacity=300)
    sim.run(1.9)
    before = sim.systems["p"].population.counter("next_id")
    sim.run(1.0)
    born = sim.systems["p"].population.counter("next_id") - before
    assert abs(born - expected) <= (4 * np.sqrt(expected) if law == "poisson" else 2.0)


@pytest.mark.parametrize("law", ["uniform", "poisson"])
def test_a_rate_beyond_all_bounds_is_refused_and_counted(law):
    """1e12 per second is more than fits; beyond what can be counted it is still not silently nothing."""
    for mean in (1e12, {"expression": "exp(700)"}):
        sim = simulate(emitter(rate={"mean": mean, "law": law}), capacity=64, motion="ballistic")
        sim.run(0.05)
        assert sim.statistics()["p"]["live"] == 64 and sim.statistics()["p"]["refused"] > 1e9


def test_an_interval_has_a_floor():
    """Each interval within a frame is a row of a table: without a floor, 1e-12 s would ask for billions."""
    with pytest.raises(ValidationError):
        scene(emitter(rate={"mean": 1.0, "interval": 1e-12}))
    sim = simulate(emitter(rate={"mean": 600.0, "interval": 1e-5}), motion="ballistic")
    sim.run(0.5)
    assert sim.statistics()["p"]["live"] == 300
