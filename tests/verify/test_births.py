"""Oracles of births: they pass on what emitters do, notice what they say they would, and count the scene's own births."""

import numpy as np
import pytest

from tests.verify.scenes import found, scene
from warpsim.scene import Scene
from warpsim.verify.evenness import cells_of_directions, cells_of_places

FOUR = {"sigma": 4}  # one wrong alarm in 16 000, and the seeds are fixed
SPRAY = {
    "velocity": {"direction": [1, 2, -2], "cone": 40, "speed": {"mean": 2.0, "spread": 0.5}},
    "mass": {"mean": 1.0, "spread": 0.2, "law": "normal"},
    "radius": {"mean": 0.1, "spread": 0.05},
    "lifetime": {"mean": 0.5, "spread": 0.2},
}


def emitter(**keys) -> dict:
    return {"rate": {"mean": 12_000.0, "spread": 4_000.0}, **SPRAY, **keys}


def births(kind: str, of: str, **keys) -> dict:
    return {"type": kind, "system": "p", "of": of, "from": 0.2, "to": 1.7, "tolerance": FOUR, **keys}


@pytest.mark.parametrize("kind", ["emission_mean", "emission_variance"])
def test_initial_values_have_their_mean_and_variance(kind):
    kinds = ("speed", "cosine", "mass", "radius", "lifetime")
    for finding in found(*(births(kind, of) for of in kinds), emitters=[emitter()], capacity=20_000):
        assert finding.verdict == "pass" and finding.remark.startswith("of 1") and finding.detects < 0.1 * finding.expected, finding


@pytest.mark.parametrize("law", ["uniform", "scaled_uniform", "normal", "poisson"])
@pytest.mark.parametrize("interval", [None, 0.03, 0.25])
def test_births_per_interval_have_their_mean_and_variance(law, interval):
    rate = {"mean": 4000.0, "spread": 1500.0, "law": law, "interval": interval}
    oracles = [births(kind, "count", **{"from": 0.0}, to=8.0) for kind in ("emission_mean", "emission_variance")]
    for finding in found(*oracles, emitters=[emitter(rate=rate)]):
        assert finding.verdict == "pass" and f"{int(8 / (interval or 1 / 60) + 1e-9)} intervals" in finding.remark, finding


def test_without_spread_the_count_is_exact():
    """Of 40 intervals with 12.5 births: 12 or 13 each, so that the mean is right to 1/40, and one percent more is noticed."""
    oracle = births("emission_mean", "count", tolerance=0.01, **{"from": 0.0}, to=10.0)
    (finding,) = found(oracle, emitters=[emitter(rate={"mean": 50.0, "interval": 0.25})])
    assert finding.verdict == "pass" and finding.expected == 12.5 and finding.error < 1e-9
    (finding,) = found({**oracle, "expect": 12.5}, emitters=[emitter(rate={"mean": 50.5, "interval": 0.25})])
    assert finding.verdict == "fail"
    (finding,) = found({**oracle, "type": "emission_variance"}, emitters=[emitter(rate={"mean": 50.0, "interval": 0.25})])
    assert finding.verdict == "pass" and finding.expected == 0.25, finding


def test_the_births_are_those_of_the_scene():
    """With its own random numbers, whatever the emitters beside it: as many as the scene's particles tell."""
    import warpsim

    other = emitter(rate=300.0)
    stated = scene(emitters=[other, emitter(lifetime=9.0), other], capacity=100_000)
    simulation = warpsim.Simulation(stated, device="cpu", threads=1)
    simulation.run(1.0)
    frame = simulation.frame()["p"]
    chosen = frame.lifetime == 9.0
    (mean,) = found(
        births("emission_mean", "mass", emitter=1, **{"from": 0.0}, to=1.0),
        emitters=[other, emitter(lifetime=9.0), other],
        capacity=100_000,
    )
    assert mean.remark == f"of {chosen.sum()} births" and mean.measured == pytest.approx(frame.mass[chosen].astype(float).mean(), rel=1e-9)


@pytest.mark.parametrize("fill", ["volume", "surface"])
@pytest.mark.parametrize(
    "shape", [{"type": "disc", "radius": 2, "normal": [1, 1, 1]}, {"type": "sphere", "radius": 2}, {"type": "box", "size": [1, 2, 4]}]
)
def test_shapes_and_cones_are_filled_evenly(shape, fill):
    oracle = {"type": "uniformity", "system": "p", "from": 0.0, "to": 1.0, "tolerance": FOUR}
    filled = emitter(shape={**shape, "center": [1, 2, 3], "fill": fill})
    for finding in found(oracle, {**oracle, "of": "direction"}, emitters=[filled], capacity=20_000):
        assert finding.verdict == "pass" and 0.02 < finding.detects < 0.2, finding


def test_a_segment_is_filled_evenly():
    oracle = {"type": "uniformity", "system": "p", "from": 0.0, "to": 1.0, "tolerance": FOUR}
    (finding,) = found(oracle, emitters=[emitter(shape={"type": "segment", "start": [0, 0, 0], "end": [1, 2, 3]})], capacity=20_000)
    assert finding.verdict == "pass" and finding.expected == 31, finding


def spec(**keys):
    return (
        Scene.model_validate({"name": "x", "systems": {"p": {"type": "particles", "emitters": [emitter(**keys)]}}}).systems["p"].emitters[0]
    )


def chi2(cells, vectors: np.ndarray) -> tuple[float, int]:
    total = 0.0
    for shares, numbers in zip(cells.shares, cells.number(vectors), strict=True):
        assert numbers.min() >= 0, "none is outside"
        expected = shares * len(vectors)
        total += float(((np.bincount(numbers, minlength=len(shares)) - expected) ** 2 / expected).sum())
    return total, sum(len(shares) - 1 for shares in cells.shares)


@pytest.mark.parametrize("power", [1 / 3, 1 / 2])
def test_a_ball_filled_by_another_power_is_noticed(power, rng):
    d = rng.normal(size=(20_000, 3))
    d *= 2 * rng.uniform(size=(20_000, 1)) ** power / np.linalg.norm(d, axis=1, keepdims=True)
    measured, degrees = chi2(cells_of_places(spec(shape={"type": "sphere", "radius": 2}).shape, 32), d)
    assert (abs(measured - degrees) < 4 * np.sqrt(2 * degrees)) == (power == 1 / 3)


def test_a_cone_filled_per_angle_instead_of_solid_angle_is_noticed(rng):
    angle, turn = np.radians(40) * rng.uniform(size=20_000), 2 * np.pi * rng.uniform(size=20_000)
    v = np.stack([np.sin(angle) * np.cos(turn), np.sin(angle) * np.sin(turn), np.cos(angle)], axis=1)
    measured, degrees = chi2(cells_of_directions(spec(velocity={"direction": [0, 0, 1], "cone": 40, "speed": 1}).velocity, 32), v)
    assert measured > degrees + 10 * np.sqrt(2 * degrees)


def test_the_faces_of_a_box_count_by_area(rng):
    x = np.array([1, 2, 4]) * (rng.uniform(size=(20_000, 3)) - 0.5)
    axis = rng.integers(0, 3, 20_000)  # each pair of faces as often as another: wrong
    x[np.arange(20_000), axis] = np.where(rng.uniform(size=20_000) < 0.5, -0.5, 0.5) * np.array([1, 2, 4])[axis]
    measured, degrees = chi2(cells_of_places(spec(shape={"type": "box", "size": [1, 2, 4], "fill": "surface"}).shape, 32), x)
    assert measured > degrees + 10 * np.sqrt(2 * degrees)


@pytest.mark.parametrize(
    "shape",
    [
        {"type": "disc", "radius": 2},
        {"type": "sphere", "radius": 2},
        {"type": "box", "size": [1, 2, 4]},
        {"type": "box", "size": [1, 2, 4], "fill": "surface"},
        {"type": "segment", "start": [0, 0, 0], "end": [1, 2, 3]},
    ],
    ids=str,
)
def test_births_outside_of_the_shape_are_no_chance(shape):
    cells = cells_of_places(spec(shape=shape).shape, 32)
    edge = {"segment": [1, 2, 3], "disc": [2, 0, 0], "sphere": [0, 2, 0], "box": [0.5, 1, 2]}[shape["type"]]
    numbers = cells.number(np.array([edge, np.multiply(edge, 1.01)]))
    assert all(each[0] >= 0 for each in numbers) and any(each[1] < 0 for each in numbers)


def test_what_cannot_be_told_beforehand_fails_and_says_why():
    burst = {"burst": {"count": 10}, "shape": {"type": "point"}}
    oracles = [births("emission_mean", "count"), births("emission_mean", "cosine")]
    oracles += [{"type": "uniformity", "system": "p", "of": of, "to": 1, "tolerance": FOUR} for of in ("place", "direction")]
    findings = found(*oracles, emitters=[burst])
    assert all(finding.verdict == "fail" and finding.remark for finding in findings), findings


def test_births_of_events_are_told_by_nobody():
    child = {"on": {"event": "death", "of": "p"}, "burst": {"count": 3}, "lifetime": 1}
    systems = {"p": {"type": "particles", "emitters": [emitter()]}, "q": {"type": "particles", "emitters": [child]}}
    stated = {**births("emission_mean", "mass"), "system": "q"}
    document = Scene.model_validate({"name": "x", "systems": systems, "verify": [stated]})
    assert "events" in document.verify[0].lawless(document)


def test_live_counts_of_one_emitter_and_of_all():
    long, short = emitter(rate=2000.0), emitter(rate=2000.0, lifetime=0.1)
    count = {"type": "live_count", "system": "p", "at": 1.5, "tolerance": FOUR}
    findings = found({**count, "emitter": 0}, {**count, "emitter": 1}, count, emitters=[long, short])
    assert [finding.verdict for finding in findings] == ["pass"] * 3, findings
    assert findings[0].expected == pytest.approx(1000, abs=1) and findings[1].expected == pytest.approx(200, abs=1)
    assert findings[2].measured == findings[0].measured + findings[1].measured
