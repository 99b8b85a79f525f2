"""Strengths that vary in time: keyframes, sines and formulas against their twins, and every operation of a formula."""

import math
import random

import numpy as np
import pytest
import warp as wp

from tests.reference import programs, signals
from warpsim.kernels import expressions
from warpsim.kernels.signals import Signals, sample_signal
from warpsim.scene.expressions import DEEPEST_STACK, LONGEST_PROGRAM, OPERATIONS, PLACE, compile_expression
from warpsim.scene.strengths import Formula, Keyframes, Sine
from warpsim.signals import SignalTable

FORMS = {"keyframes": Keyframes, "sine": Sine, "expression": Formula}
KNOTS = ((-1.0, 2.0), (0.0, -1.0), (0.25, 4.0), (3.0, 0.5))


@wp.kernel
def sample_signals(table: Signals, times: wp.array[wp.float64], value_out: wp.array2d[wp.float64]):
    i, j = wp.tid()
    value_out[i, j] = sample_signal(table, i, times[j])


def sampled(strengths, times, device) -> np.ndarray:
    """Return the device's values, (strengths, times)."""
    table = SignalTable()
    for strength in strengths:
        form = next(iter(strength)) if isinstance(strength, dict) else None
        table.add(FORMS[form].model_validate(strength) if form else strength)
    out = wp.zeros((len(strengths), len(times)), dtype=wp.float64, device=device)
    inputs = [table.tables(device), wp.array(times, dtype=wp.float64, device=device), out]
    wp.launch(sample_signals, out.shape, inputs, device=device)
    return out.numpy()


def test_every_form_has_a_twin_and_every_operation_too():
    assert set(signals.SIGNALS) == set(FORMS)
    assert set(programs.OPERATIONS) | {"constant", *PLACE} == set(OPERATIONS)
    assert list(expressions.ARITIES.items()) == list(OPERATIONS.items()), (
        "the scene's operations and the device's are the same, in one order"
    )


def test_signals_equal_the_twin(device):
    """To 1e-14 of the amplitudes: a handful of float64 operations; the sine's angle of up to 300 rad is rounded to 3e-14."""
    strengths = [
        3.5,
        {"keyframes": KNOTS},
        {"keyframes": KNOTS[:1]},
        {"sine": {"mean": 1.0, "amplitude": 2.0, "period": 0.7, "phase": 0.3}},
        {"sine": {"amplitude": -1.0, "period": 3.0}},
        {"expression": "2 + t^2*sin(3*t)"},
    ]
    times = np.concatenate([np.linspace(-5.0, 30.0, 257), [knot[0] for knot in KNOTS]])
    got = sampled(strengths, times, device)
    for row, strength in zip(got, strengths, strict=True):
        exact = np.array([signals.sample(strength, t) for t in times])
        np.testing.assert_allclose(row, exact, rtol=1e-13, atol=2e-13)


def test_keyframes_hit_their_knots_and_stay_outside(device):
    got = sampled([{"keyframes": KNOTS}], [-1e6, -1.0, 0.0, 0.125, 0.25, 3.0, 1e6], device)[0]
    assert got.tolist() == [2.0, 2.0, -1.0, 1.5, 4.0, 0.5, 0.5]


SAMPLES = {
    "power": ["t^3", "t^-2", "(t+5)^0.5", "2^t", "t^2.5", "(-2)^3"],
    "divide": ["1/(t+10)"],
    "log": ["log(t+10)", "log(1e-300)", "log(1e300)"],
    "sqrt": ["sqrt(t+10)"],
    "exp": ["exp(t)", "exp(-800)", "exp(700)"],
    "tan": ["tan(t/7)"],
    "tanh": ["tanh(t)", "tanh(1e4)", "tanh(-1e4)"],
    "mod": ["mod(t, 2)", "mod(-t, 2)", "mod(t, -2)", "mod(t, 0.3)"],
    "step": ["step(1, t)", "step(t, 1)"],
    "smoothstep": ["smoothstep(-1, 2, t)", "smoothstep(2, -1, t)"],
    "clamp": ["clamp(t, -1, 2)", "clamp(t, 2, 2)"],
    "min": ["min(t, 1)"],
    "max": ["max(t, 1)"],
    "floor": ["floor(t)", "floor(-t)"],
    "abs": ["abs(t)"],
    "constant": ["pi", "e", "1e-3"],
}
TIMES = [*np.linspace(-4.0, 4.0, 33).tolist(), 100.0, 1e3]


@pytest.mark.parametrize("name", [name for name in OPERATIONS if name not in "xyz"])
def test_operation_equals_the_twin(name, device):
    """Relative 1e-13: the angles and exponents, up to 1e3, are rounded to 1e-13; not a number stays so, and the finite is finite."""
    unary, binary = {"t": "t", "negate": "-t"}, {"add": "t+2", "subtract": "t-2", "multiply": "t*3"}
    texts = SAMPLES.get(name) or [({**unary, **binary}).get(name, f"{name}(t)")]
    got = sampled([{"expression": text} for text in texts], TIMES, device)
    for row, text in zip(got, texts, strict=True):
        exact = [programs.evaluate(compile_expression(text), t) for t in TIMES]
        np.testing.assert_allclose(row, exact, rtol=1e-13, atol=1e-13, err_msg=text)


@pytest.mark.parametrize("text", ["log(-1)", "sqrt(-1)", "(-2)^0.5", "exp(log(-1))", "0*log(-1)", "min(log(-1), 1) + log(-1)", "mod(1, 0)"])
def test_what_is_not_real_is_not_a_number(text, device):
    """A number out of nowhere would be believed; not a number is caught as unstable."""
    assert np.isnan(sampled([{"expression": text}], [0.0], device)).all()


def random_text(pick: random.Random, depth: int) -> str:
    """Write a random formula that stays real and of moderate size."""
    if depth == 0:
        return pick.choice(["t", "pi", "e", f"{pick.uniform(0.1, 3.0):.3f}"])
    a, b, c = (random_text(pick, depth - 1) for _ in range(3))
    unary = [f"sin({a})", f"cos({a})", f"tanh({a})", f"abs({a})", f"-({a})", f"exp(-abs({a}))", f"sqrt(abs({a}))", f"log(1+abs({a}))"]
    binary = [f"({a}+{b})", f"({a}-{b})", f"({a})*({b})", f"({a})/(2+abs({b}))", f"min({a},{b})", f"max({a},{b})", f"(1+abs({a}))^0.7"]
    return pick.choice([*unary, *binary, f"smoothstep(0,4+abs({c}),{a})", f"clamp({a},-2,2)"])


def test_random_programs_equal_the_twin(device):
    """200 formulas of up to 256 instructions. Cancellation may amplify: relative to the largest value the stack ever held, 1e-11."""
    pick, texts = random.Random(3), []
    while len(texts) < 200:
        text = random_text(pick, pick.randint(1, 4))
        if len(text) <= 2000:
            texts.append(text)
    times = np.linspace(-3.0, 7.0, 21)
    got = sampled([{"expression": text} for text in texts], times, device)
    exact = np.array([[programs.evaluate(compile_expression(text), t) for t in times] for text in texts])
    np.testing.assert_allclose(got, exact, rtol=1e-11, atol=1e-11)


def test_the_deepest_and_the_longest_program_run(device):
    deep = "".join(f"({k}+" for k in range(1, DEEPEST_STACK)) + "t" + ")" * (DEEPEST_STACK - 1)
    long = "t" + "+1" * ((LONGEST_PROGRAM - 1) // 2)
    got = sampled([{"expression": deep}, {"expression": long}], [0.5], device)[:, 0]
    assert got.tolist() == [sum(range(1, DEEPEST_STACK)) + 0.5, (LONGEST_PROGRAM - 1) // 2 + 0.5]
    assert math.isfinite(got[0])
