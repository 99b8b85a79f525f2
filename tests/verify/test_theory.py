"""The laws that oracles are compared with are right themselves: against numerical integration, and against the kernels' own twins."""

import math
import re

import numpy as np
import pytest

from tests.reference import signals
from tests.verify.scenes import scene
from warpsim.scene import Scene
from warpsim.scene.flow import Core
from warpsim.verify import laws
from warpsim.verify.amounts import value_at
from warpsim.verify.emission_laws import count_moments, live_count, survival

STRENGTHS = (
    2.5,
    {"keyframes": [[0.0, 1.0], [1.0, 3.0], [2.5, -1.0]]},
    {"sine": {"mean": 0.5, "amplitude": 2.0, "period": 0.7, "phase": 0.3}},
    {"expression": "2 + sin(2*pi*t)^2 - 3*exp(-t)/(1 + t) + max(t, 1) + mod(t, 0.3) + smoothstep(0, 2, t) - step(1, t)*floor(3*t)"},
    {"expression": "sqrt(abs(cos(t) - tan(t))) + log(t + 1) + tanh(t) + clamp(t, 0.5, 1) + min(t, 1)"},
)


@pytest.mark.parametrize("strength", STRENGTHS, ids=str)
@pytest.mark.parametrize("time", [0.0, 0.4, 1.0, 2.2, 7.0])
def test_a_strength_has_the_value_of_its_twin(strength, time):
    wind = {"type": "uniform", "velocity": [strength, 0, 0]}
    spec = Scene.model_validate({"name": "x", "flow": [wind]}).flow[0].velocity[0]
    assert value_at(spec, time) == pytest.approx(signals.sample(strength, time), rel=1e-12)


@pytest.mark.parametrize("text", ["1/(t-1)", "log(-1)", "sqrt(-1)", "(-1)^0.5", "0^(-1)", "exp(1e9)^9", "sin(1e400*t)", "mod(1, 0)"])
def test_what_is_not_defined_is_not_a_number_and_no_traceback(text):
    if "e400" in text:
        text = text.replace("1e400", "exp(700)^3")
    spec = Scene.model_validate({"name": "x", "flow": [{"type": "point_source", "rate": {"expression": text}}]}).flow[0].rate
    assert not math.isfinite(value_at(spec, 1.0))


def body(**keys) -> laws.Body:
    zero = np.zeros(3)
    return laws.Body(**{"x": zero, "v": zero, "m": 2.0, "radius": 0.1, "g": zero, "rate": 0.0, "wind": zero, **keys})


@pytest.mark.parametrize("rate", [0.0, 0.7, 30.0])
def test_relaxation_and_arc_solve_their_equation(rate):
    """dv/dt = g + rate (w − v), dx/dt = v by 20 000 midpoint steps: their error is below (rate h)² = 1e-6."""
    one = body(x=np.array([1.0, 2, 3]), v=np.array([4.0, -1, 0]), g=np.array([0, -9.81, 1]), wind=np.array([2.0, 0, -1]), rate=rate)
    x, v, h = one.x, one.v, 0.6 / 20_000
    for _ in range(20_000):
        middle = v + 0.5 * h * (one.g + rate * (one.wind - v))
        x, v = x + h * middle, v + h * (one.g + rate * (one.wind - middle))
    np.testing.assert_allclose(laws.velocity_after(one, 0.6), v, atol=1e-6)
    np.testing.assert_allclose(laws.place_after(one, 0.6), x, atol=1e-6)
    if rate > 20:
        still = body(g=one.g, rate=rate)
        assert np.linalg.norm(laws.velocity_after(still, 9.0)) == pytest.approx(laws.terminal_speed(still), rel=1e-12)


@pytest.mark.parametrize("law", ["constant", "inverse_square", "spring"])
def test_the_potential_of_an_attractor_is_that_of_its_force(law):
    """Its slope is the force of the kernels' twin, by a difference over 1e-6 m."""
    from tests.reference.forces import attractor

    spec = {"type": "attractor", "center": [0.3, 0, -0.2], "strength": 1.7, "law": law, "softening": 0.05}
    force = Scene.model_validate({"name": "x", "forces": [spec]}).forces[0]
    x, m, g = np.array([0.7, 0.4, 0.1]), np.array([1.0]), np.zeros(3)
    slope = [
        (laws.potential_energy((x + e)[None], m, g, [force], 0.0) - laws.potential_energy((x - e)[None], m, g, [force], 0.0))[0] / 2e-6
        for e in 1e-6 * np.eye(3)
    ]
    np.testing.assert_allclose(-np.array(slope), attractor_force(attractor, force, x), rtol=1e-6, atol=1e-9)


@pytest.mark.parametrize("law", ["constant", "inverse_square", "spring", "linear", "cosine"])
def test_the_potential_of_pairs_is_that_of_their_force(law, rng):
    """Its slope along each coordinate is the force of the kernels' twin; 300 particles are more than are worked on at a time."""
    from tests.reference.pairwise import Pair, pair_energy, pair_forces
    from warpsim.verify import pairs

    pair = Pair(-1.7, 0.4, law, 0.02)
    spec = {"type": "pairwise", "strength": pair.strength, "radius": pair.radius, "law": law, "softening": pair.softening}
    force = Scene.model_validate({"name": "x", "forces": [spec]}).forces[0]
    x = rng.normal(size=(300, 3))
    energy = pairs.pair_energy(x, [force], 0.0)
    assert energy == pytest.approx(pair_energy([pair], x), rel=1e-12)
    exact = pair_forces([pair], x)
    for i, axis in ((0, 0), (7, 1), (299, 2)):
        e = np.zeros_like(x)
        e[i, axis] = 1e-6
        slope = (pairs.pair_energy(x + e, [force], 0.0) - pairs.pair_energy(x - e, [force], 0.0)) / 2e-6
        assert -slope == pytest.approx(exact[i, axis], rel=1e-4, abs=1e-5 * abs(exact).max())


def attractor_force(twin, force, x: np.ndarray) -> np.ndarray:
    from types import SimpleNamespace

    row = SimpleNamespace(center=force.center, strength=force.strength, law=force.law, softening=force.softening)
    return np.asarray(twin(row, x))


def orbit_time(force, one: laws.Body, steps: int = 40_000) -> float:
    """The time of one turn, by leapfrog with steps of 1/40 000 of a guess: its error is 1e-8."""
    guess = laws.orbit_period(one, force, 0.0)
    h, x, v, turned = guess / steps, one.x.copy(), one.v.copy(), 0.0

    def pull(x):
        d = np.array(force.center) - x
        s = math.sqrt(d @ d + force.softening**2)
        return force.strength * d * {"constant": 1 / s, "inverse_square": 1 / s**3, "spring": 1.0}[force.law] / one.m

    for k in range(2 * steps):
        v = v + 0.5 * h * pull(x)
        before, x = x - np.array(force.center), x + h * v
        v = v + 0.5 * h * pull(x)
        after = x - np.array(force.center)
        step = math.atan2(np.linalg.norm(np.cross(before, after)), before @ after)
        if turned + step >= 2 * math.pi:
            return (k + (2 * math.pi - turned) / step) * h
        turned += step
    return math.nan


@pytest.mark.parametrize(
    ("law", "v"), [("constant", "circle"), ("inverse_square", "circle"), ("inverse_square", 0.8), ("spring", 0.3), ("spring", 2.0)]
)
def test_the_period_of_an_orbit_is_that_of_its_integration(law, v):
    spec = {"type": "attractor", "center": [0.1, 0, 0], "strength": 3.0, "law": law, "softening": 0.0 if v == 0.8 else 0.01}
    force = Scene.model_validate({"name": "x", "forces": [spec]}).forces[0]
    s = math.hypot(0.9, spec["softening"])
    circle = math.sqrt(3.0 / 2.0 * 0.81 * {"constant": 1 / s, "inverse_square": 1 / s**3, "spring": 1.0}[law])
    one = body(x=np.array([1.0, 0, 0]), v=np.array([0, circle if v == "circle" else v, 0]))
    assert laws.orbit_period(one, force, 0.0) == pytest.approx(orbit_time(force, one, 20_000), rel=1e-6)


@pytest.mark.parametrize(("height", "speed"), [(1.0, 0.0), (0.5, 3.0), (0.0, 2.0), (2.0, -1.0)])
def test_bounces_follow_each_other_as_in_small_steps(height, speed):
    """Height and speed by 40 000 steps of 1/10 000 s, turned back at the plane: good to 1e-3 s of a flight."""
    e, g, h, y, v, count, top = 0.7, 9.81, 1e-4, height, speed, 0, height + speed**2 / 19.62
    for step in range(20_000):
        if step and step % 2500 == 0 and y > 0.05:
            assert laws.height_after((height, speed, g), e, step * h) == (pytest.approx(top, rel=1e-9), count)
        y, v = y + h * v - 0.5 * g * h * h, v - g * h
        if y < 0.0 and v < 0.0:
            y, v, count, top = 0.0, -e * v, count + 1, e * e * top


def test_a_rosette_has_no_period():
    force = Scene.model_validate({"name": "x", "forces": [{"type": "attractor", "strength": 1.0}]}).forces[0]
    assert math.isnan(laws.orbit_period(body(x=np.array([1.0, 0, 0]), v=np.array([0, 0.3, 0])), force, 0.0))


@pytest.mark.parametrize(("model", "share"), [("rankine", 0.25), ("lamb_oseen", 1 - math.exp(-0.25)), ("scully", 0.2)])
def test_the_core_keeps_a_share_of_the_circulation(model, share):
    assert laws.share_of_core(Core(model=model, radius=0.2), 0.01) == pytest.approx(share, rel=1e-12)


@pytest.mark.parametrize("law", ["uniform", "scaled_uniform", "normal", "poisson"])
@pytest.mark.parametrize("spread", [0.0, 12.0, 80.0])
def test_the_moments_of_the_count_law_are_those_of_its_draws(law, spread, rng):
    """Four million draws, clamped at zero as emission does: their mean and variance stray by 1e-3."""
    emitter = scene(emitters=[{"rate": {"mean": 40.0, "spread": spread, "law": law}}]).systems["p"].emitters[0]
    n = 4_000_000
    z = {"normal": rng.standard_normal(n), "scaled_uniform": rng.uniform(-1, 1, n) * 3**0.5}.get(law, rng.uniform(-1, 1, n))
    drawn = rng.poisson(20.0, n) if law == "poisson" else np.maximum(40 + z * spread, 0) * 0.5
    mean, variance = count_moments(emitter.rate, 0.0, 0.5)
    assert mean == pytest.approx(drawn.mean(), rel=2e-3) and variance == pytest.approx(drawn.var(), rel=4e-3, abs=1e-9)


@pytest.mark.parametrize("lifetime", [0.8, {"mean": 0.8, "spread": 0.5}, {"mean": 0.8, "spread": 0.2, "law": "normal"}], ids=str)
def test_the_living_are_births_times_survival(lifetime):
    """A rate of 1000 a second: as many live as the mean lifetime says, once it is over; and a burst adds its survivors."""
    stated = scene(emitters=[{"rate": 1000.0, "lifetime": lifetime, "burst": {"count": 10, "at": 2.7}}], prewarm=1.0)
    mean, variance = live_count(stated.systems["p"].emitters, stated, 3.0)
    assert mean == pytest.approx(800 + 10 * survival(stated.systems["p"].emitters[0].lifetime, np.array([0.3]))[0], abs=0.02)
    assert 0.2 < variance < 300


def test_the_living_of_a_rate_that_begins_and_ends():
    stated = scene(
        emitters=[{"rate": {"mean": {"keyframes": [[0, 0], [2, 2000]]}, "interval": 0.1}, "start": 0.5, "stop": 1.5, "lifetime": 9}]
    )
    mean, _ = live_count(stated.systems["p"].emitters, stated, 1.25)
    assert mean == pytest.approx(500 * (1.25**2 - 0.5**2), rel=2e-3)  # the interval under way has one rate, that of its middle


def test_the_laws_never_ask_the_kernels():
    import inspect

    from warpsim.verify import amounts, emission_laws, pairs

    for module in (laws, amounts, emission_laws, pairs):
        assert not re.search(r"import.*(warp\b|kernels|simulation)", inspect.getsource(module).replace("warpsim.", "")), module
