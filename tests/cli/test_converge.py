"""converge: the table, the data, the picture, and its words where a scene does not suit."""

import json

import pytest

from tests.command import SPARKS, warpsim

EQUATION = """\
name: Equation
time: {duration: 10.0}
gravity: [0, 0, 0]
flow: [{type: expression, velocity: ["1", "y*x^2*exp(-x)", "0"]}]
systems:
  tracer:
    type: particles
    coupling: tracer
    emitters: [{shape: {type: point, center: [0, 0.91, 0]}, burst: {count: 1}, lifetime: 100}]
"""


@pytest.fixture
def equation(tmp_path):
    path = tmp_path / "equation.yaml"
    path.write_text(EQUATION)
    return path


def test_the_table_has_every_method_in_both_precisions(equation):
    result = warpsim("converge", equation)
    assert result.returncode == 0 and "Traceback" not in result.stderr
    lines = result.stdout.splitlines()
    rows = {line.split()[0]: line.split() for line in lines if " 64 bit " in line}
    assert set(rows) == {"euler", "rk4", "heun", *(f"adams_bashforth_{n}" for n in (2, 3, 4)), "abm_pece_2", "abm_pece_4"}
    assert rows["heun"][3] == "1.5e-02" and rows["heun"][-2:] == ["2.00", "2"]
    assert sum(" 32 bit " in line for line in lines) == len(rows)


def test_data_and_picture(equation, tmp_path):
    pytest.importorskip("matplotlib")
    picture = tmp_path / "orders.png"
    result = warpsim("converge", equation, "--solver", "abm_pece_4", "--rungs", 6, "--plot", picture, "--json")
    assert result.returncode == 0, result.stderr
    study = json.loads(result.stdout)
    assert study["form"] == "first-order" and study["steps"] == [10 / 50 / 2**k for k in range(6)]
    (method,) = study["methods"]
    assert method["order"] == pytest.approx(4.0, abs=0.15) and method["errors"][0] == pytest.approx(1.582e-4, rel=1e-3)
    assert picture.read_bytes().startswith(b"\x89PNG")


@pytest.mark.parametrize(
    ("arguments", "code", "words"),
    [
        (["--system", "nobody"], 3, "there is no system nobody; there are tracer"),
        (["--solver", "verlet"], 2, "verlet is no solver of this system"),
        (["--plot", "orders.doc"], 2, ".png"),
        (["--plot", "nowhere/orders.png"], 5, "there is no folder"),
    ],
)
def test_mistakes_end_in_words(equation, arguments, code, words):
    result = warpsim("converge", equation, *arguments)
    assert result.returncode == code and words in result.stderr and "Traceback" not in result.stderr


def test_a_scene_without_a_smooth_path_is_refused(tmp_path):
    path = tmp_path / "sparks.yaml"
    path.write_text(SPARKS.replace("type: point, center: [0, 1, 0]", "type: segment, start: [0, 1, 0], end: [1, 1, 0]"))
    result = warpsim("converge", path)
    assert result.returncode == 3 and "systems.sparks.emitters" in result.stderr


def test_a_plot_without_matplotlib_says_what_to_install(equation, tmp_path):
    (tmp_path / "matplotlib.py").write_text("raise ModuleNotFoundError(\"No module named 'matplotlib'\", name='matplotlib')\n")
    result = warpsim("converge", equation, "--plot", tmp_path / "x.png", PYTHONPATH=str(tmp_path))
    assert result.returncode == 5 and "pip install 'warpsim[plot]'" in result.stderr
