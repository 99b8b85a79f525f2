"""Laws of vortex segments and rings: what they owe each other, the line vortex, and Kelvin's theorem."""

import math

import numpy as np
import pytest

from tests.physics.scenes import simulate, start, state
from warpsim import UnstableError

CENTER = np.array([0.3, -0.2, 0.5])
AXIS = np.array([1.0, 2.0, -2.0]) / 3.0
CORES = ("ideal", "rankine", "lamb_oseen", "scully")


def core(model: str, radius: float) -> dict:
    return {"core": {"model": model} if model == "ideal" else {"model": model, "radius": radius}}


def ring(model="ideal", radius=0.8, strength=1.7, width=0.1, **keys) -> dict:
    place = {"center": CENTER.tolist(), "normal": (3 * AXIS).tolist(), "radius": radius}
    return {"type": "vortex_ring", **place, "circulation": strength, **core(model, width), **keys}


def segment(begin, end, model="ideal", strength=1.7, width=0.1) -> dict:
    return {"type": "vortex_segment", "start": list(begin), "end": list(end), "circulation": strength, **core(model, width)}


def probe(*flow):
    return simulate(flow=flow).flow


def around(count: int, radius: float) -> tuple[np.ndarray, np.ndarray]:
    """Points on a circle about the axis, and where it goes there."""
    first = np.cross(AXIS, [0.0, 0.0, 1.0])
    first /= np.linalg.norm(first)
    angle = 2.0 * math.pi * np.arange(count) / count
    outward = np.outer(np.cos(angle), first) + np.outer(np.sin(angle), np.cross(AXIS, first))
    return CENTER + radius * outward, np.cross(AXIS, outward)


@pytest.mark.parametrize("model", ["ideal", "rankine", "lamb_oseen"])
def test_circulation_of_a_loop_through_a_ring_is_its_strength(model):
    """Scully's vorticity has no end. Lamb-Oseen's is down to e^-25 at five core radii. Loops off the line, too; none through it: none."""
    flow = probe(ring(model))
    places, tangents = around(7, 0.8)
    for place, tangent in zip(places, tangents, strict=True):
        assert flow.circulation(place, tangent, 0.5) == pytest.approx(1.7, rel=1e-5)
        assert flow.circulation(place, -tangent, 0.65) == pytest.approx(-1.7, rel=1e-5)
        assert flow.circulation(place + 0.2 * AXIS, tangent, 0.7) == pytest.approx(1.7, rel=1e-5)
        assert abs(flow.circulation(place + 0.9 * AXIS, tangent, 0.5)) < 1e-5
    assert abs(flow.circulation(CENTER + 0.2 * AXIS, AXIS, 0.8)) < 1e-6, "a ring has no swirl"


@pytest.mark.parametrize("model", CORES)
def test_flow_on_a_rings_axis(model):
    """v = Γ R²/(2 (R² + z²)^{3/2}); sixteen core radii from the circle only Scully's core is still felt, as a longer distance."""
    z = np.concatenate([np.linspace(-3.0, 3.0, 25), [50.0, -1000.0]])
    got = probe(ring(model, width=0.05)).sample(CENTER + np.outer(z, AXIS)).astype(float)
    square = 0.8**2 + z**2 + (0.05**2 if model == "scully" else 0.0)
    speed = 1.7 * 0.8**2 / (2.0 * square**1.5)
    np.testing.assert_allclose(got @ AXIS, speed, rtol=1e-5)  # z itself is rounded at 1000 m: 3 · 6e-8 · 1000
    assert (np.linalg.norm(got - np.outer(got @ AXIS, AXIS), axis=1) <= 1e-5 * speed).all()


def test_discharge_through_a_ring_does_not_depend_on_where_it_is_measured():
    """Stokes' stream function: through any surface with the same rim goes the same."""
    flow = probe(ring("lamb_oseen"))
    through = [flow.discharge(CENTER + height * AXIS, AXIS, radius) for height, radius in ((0.0, 0.5), (0.4, 0.7))]
    # the truncated cone between the two rims: Gauss's rule along its side, the trapezoid rule round it
    nodes, weights = np.polynomial.legendre.leggauss(16)
    lost = 0.0
    for node, weight in zip(nodes, weights, strict=True):
        share = 0.5 * (node + 1.0)
        radius = 0.5 + 0.2 * share
        places, tangents = around(64, radius)
        normal = 0.4 * np.cross(tangents, AXIS) - 0.2 * AXIS  # outward, as long as the side
        velocity = flow.sample(places + 0.4 * share * AXIS).astype(float)
        lost += 0.5 * weight * 2.0 * math.pi * radius * (velocity * normal).sum(axis=1).mean()
    assert through[0] == pytest.approx(through[1] + lost, rel=2e-6)
    assert abs(lost) > 0.02, "something does pass the side"


@pytest.mark.parametrize("model", CORES)
def test_a_ring_is_the_limit_of_polygons(model):
    """An inscribed polygon errs by a power series in 1/n²: two of them, extrapolated, agree with the ring to rounding."""
    rng = np.random.default_rng(4)
    points = CENTER + rng.normal(size=(300, 3))
    d = points - CENTER
    away = np.hypot(np.linalg.norm(d - np.outer(d @ AXIS, AXIS), axis=1) - 0.8, d @ AXIS)
    points = points[away > 0.4]  # where e^-16 is left of the smoothest core
    exact = probe(ring(model)).sample(points).astype(float)
    errors, polygons = [], []
    for count in (48, 96):
        corners = around(count, 0.8)[0]
        sides = [segment(a, b, model) for a, b in zip(corners, np.roll(corners, -1, axis=0), strict=True)]
        polygons.append(probe(*sides).sample(points).astype(float))
        errors.append(np.linalg.norm(polygons[-1] - exact, axis=1) / np.linalg.norm(exact, axis=1))
    assert np.median(errors[0] / errors[1]) == pytest.approx(4.0, rel=0.05)
    limit = np.linalg.norm((4.0 * polygons[1] - polygons[0]) / 3.0 - exact, axis=1) / np.linalg.norm(exact, axis=1)
    # (π/48)^4 = 2e-5 of higher order near the line, and a hundred roundings of 6e-8
    assert limit.max() < 3e-5


@pytest.mark.parametrize("model", CORES)
def test_a_long_segment_is_a_line_vortex(model):
    """cos θ = 1 − ½ (r/l)²: at 2 m from a segment of 4 km that is 5e-7."""
    line = {"type": "vortex", "center": CENTER.tolist(), "axis": AXIS.tolist(), "circulation": 1.7, **core(model, 0.3)}
    rng = np.random.default_rng(5)
    points = CENTER + rng.uniform(-1.0, 1.0, (300, 3))
    long = probe(segment(CENTER - 2000.0 * AXIS, CENTER + 2000.0 * AXIS, model, width=0.3)).sample(points).astype(float)
    exact = probe(line).sample(points).astype(float)
    close = np.linalg.norm(long - exact, axis=1) / np.linalg.norm(exact, axis=1)
    assert close.max() < 2e-5  # the rounding of x − center, 1e-7 m, against the nearest of 300 points, some cm away


def test_a_segment_is_right_beside_beyond_and_on_its_line():
    """A dozen roundings of 6e-8; far beyond the end, where cosines cancel, twice as many."""
    flow = probe(segment((0, 0, 0), (0, 0, 2)))
    speed = flow.sample([[0.5, 0, 1.0]])[0, 1]
    assert speed == pytest.approx(1.7 / (4 * math.pi * 0.5) * 2.0 / math.hypot(1.0, 0.5), rel=1e-6)
    assert flow.sample([[0.5, 0, 2.0]])[0, 1] == pytest.approx(1.7 / (4 * math.pi * 0.5) * 2.0 / math.hypot(2.0, 0.5), rel=1e-6)
    far = flow.sample([[100.0, 0, 5000.0]]).astype(float)[0, 1]
    cosines = 5000.0 / math.hypot(5000.0, 100.0) - 4998.0 / math.hypot(4998.0, 100.0)
    assert far == pytest.approx(1.7 / (4 * math.pi * 100.0) * cosines, rel=2e-6)
    assert (flow.sample([[0, 0, -3.0], [0, 0, 0], [0, 0, 1.0], [0, 0, 2.0], [0, 0, 7.0]]) == 0.0).all()


@pytest.mark.parametrize("model", CORES)
@pytest.mark.parametrize("kind", ["ring", "segment"])
def test_divergence_vanishes_inside_the_core_too(kind, model):
    """The velocity is a curl; that of the ideal line is left out near the line, where differences of 1/64 m do not see it."""
    rng = np.random.default_rng(6)
    places, _ = around(400, 0.8)
    points = places + rng.uniform(-0.25, 0.25, (400, 3))
    flow = probe(ring(model, width=0.3) if kind == "ring" else segment(CENTER - AXIS, CENTER + AXIS, model, width=0.3))
    if model in ("ideal", "rankine"):  # Rankine's velocity has a kink at the core's rim
        d = points - CENTER
        rho = np.linalg.norm(d - np.outer(d @ AXIS, AXIS), axis=1)
        away = np.hypot(rho - 0.8, d @ AXIS) if kind == "ring" else rho
        points = points[(away > 0.15) & (np.abs(away - 0.3) > 0.05)]
    scale = np.linalg.norm(flow.sample(points), axis=1) / (1 / 64)
    # rounding 1e-6 of a sample; truncation h⁴ v⁽⁵⁾/30 is 1/64⁴/30 · 120 v/0.15⁵ = 3e-3 v at the nearest, 5e-5 of the scale
    assert (np.abs(flow.divergence(points)) < 6e-5 * scale).all()


def test_a_ring_moves_itself_as_theory_says():
    """With Rosenhead's core the flow at the circle is Γ/(4πR) (ln(8R/a) − 1), to (a/R)² ln(R/a).  Source: Saffman 1992, §11.2."""
    for model, constant in (("scully", 1.0), ("rankine", 0.5), ("lamb_oseen", 1.0 - 0.5 * np.euler_gamma)):
        flow = probe(ring(model, width=0.01))
        speed = flow.sample(around(1, 0.8)[0]).astype(float)[0] @ AXIS
        theory = 1.7 / (4 * math.pi * 0.8) * (math.log(8 * 0.8 / 0.01) - constant)
        assert speed == pytest.approx(theory, rel=1e-3), model


def test_travel_moves_the_whole_and_the_radius_follows_time():
    """A ring that widens and travels is at any time the ring that stands there; a tracer before it is passed."""
    travel = [0, {"expression": "0.5*t"}, {"sine": {"amplitude": 0.3, "period": 8.0}}]
    moving = ring("scully", radius={"keyframes": [[0, 0.8], [2, 1.2]]}, travel=travel)
    flow = probe(moving)
    points = CENTER + np.random.default_rng(7).normal(size=(50, 3))
    for time in (0.0, 1.0, 2.0, 3.0):
        shift = np.array([0.0, 0.5 * time, 0.3 * math.sin(2 * math.pi * time / 8.0)])
        there = ring("scully", radius=float(np.interp(time, [0, 2], [0.8, 1.2]))) | {"center": (CENTER + shift).tolist()}
        np.testing.assert_allclose(flow.sample(points, time=time), probe(there).sample(points), rtol=2e-5, atol=2e-7)
    every = [
        {"type": "source", "rate": 1.0},
        {"type": "point_source", "rate": 1.0},
        {"type": "vortex", "circulation": 1.0},
        {"type": "doublet", "strength": 1.0},
        {"type": "rotation", "angular_velocity": 1.0},
        segment((0, 0, 0), (1, 1, 0)),
    ]
    for primitive in every:
        moved = probe(primitive | {"travel": [{"expression": "t"}, 2.0, 0.0]}).sample(points + [1.0, 2.0, 0.0], time=1.0)
        np.testing.assert_allclose(moved, probe(primitive).sample(points), rtol=3e-5, atol=1e-6, err_msg=primitive["type"])


@pytest.mark.parametrize("model", CORES)
def test_they_are_finite_at_the_ends_of_the_world(model):
    """Squares of squares of 1e9 m are 1e36, below the largest float32 of 3e38."""
    far = [[1e9, -1e9, 1e9], [1e9, 0, 0], [0, 1e9, 0], [1e-20, 0, 0], [0, 0, 0]]
    origin = {"center": [0, 0, 0], "normal": [0, 1, 0]}
    for primitive in (ring(model) | origin, ring(model, 1e-6) | origin, ring(model, 1e9) | origin, segment((0, 0, 0), (0, 1e9, 0), model)):
        assert np.isfinite(probe(primitive).sample(far)).all()


def test_a_radius_below_zero_is_no_ring_and_one_that_is_no_number_is_answered():
    flow = probe(ring(radius={"expression": "t - 1"}))
    points = CENTER + np.random.default_rng(8).normal(size=(20, 3))
    assert (flow.sample(points, time=0.5) == 0.0).all() and (flow.sample(points, time=1.0) == 0.0).all()
    assert (np.linalg.norm(flow.sample(points, time=1.5), axis=1) > 0.0).all()
    with pytest.raises(UnstableError, match="not finite"):
        simulate(start(), flow=[ring(radius={"expression": "log(0.05 - t)"})], coupling="tracer").run(0.2)


def test_a_tracer_in_the_core_travels_with_its_ring():
    """A ring that moves at the speed of the flow at its circle keeps what is in its core: for 300 frames within a tenth of the core."""
    speed = float(probe(ring("scully")).sample(around(1, 0.8)[0])[0] @ AXIS)
    place = around(1, 0.8)[0][0]
    travel = [{"expression": f"{float(speed * component)!r}*t"} for component in AXIS]
    sim = simulate(start(place), flow=[ring("scully", travel=travel)], coupling="tracer")
    for _ in range(300):
        sim.step_frame()
    assert np.linalg.norm(state(sim)[0][0] - place - AXIS * speed * 5.0) < 0.01
