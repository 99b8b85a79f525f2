"""streamlines: the lines are streamlines, in three kinds of files, and mistakes end in words."""

import csv
import json

import numpy as np
import pytest

from tests.command import warpsim

SWIRL = "name: Swirl\nflow: [{name: swirl, type: vortex, axis: [0, 0, 1], circulation: {expression: 2 + t}}]\n"
CYLINDER = "obstacles: [{type: cylinder, axis: [0, 0, 1], radius: 0.5}, {type: wall, center: [0, -0.5, 0], answers: false}]\n"


@pytest.fixture
def folder(tmp_path):
    (tmp_path / "swirl.yaml").write_text(SWIRL)
    return tmp_path


def test_three_kinds_of_files_hold_the_same(folder):
    settings = ("--through", "1,0,0.5", "--through", "0,-2,0", "--length", 3, "--steps", 9, "--time", 1.0, "--device", "cpu")
    for kind in ("npz", "csv", "json"):
        result = warpsim("streamlines", "swirl.yaml", "--out", f"lines.{kind}", *settings, cwd=folder)
        assert result.returncode == 0 and f"2 streamlines of 10 points are in lines.{kind}" in result.stdout, result.stderr
    with np.load(folder / "lines.npz") as file:
        position, velocity, time = file["position"], file["velocity"], float(file["time"])
    assert position.shape == velocity.shape == (2, 10, 3) and position.dtype == velocity.dtype == np.float32 and time == 1.0
    assert np.abs(np.hypot(position[..., 0], position[..., 1]) - [[1.0], [2.0]]).max() < 1e-3  # circles; steps of 1/3 rad, of fourth order
    assert np.linalg.norm(velocity[0], axis=1) == pytest.approx(3.0 / (2.0 * np.pi), rel=1e-3)  # circulation 2 + t
    assert (velocity[:, :-1] * np.diff(position, axis=1)).sum(axis=2).min() > 0.0, "downstream"
    rows = list(csv.DictReader((folder / "lines.csv").open()))
    assert [int(row["line"]) for row in rows] == [0] * 10 + [1] * 10 and [int(row["point"]) for row in rows] == [*range(10)] * 2
    assert np.array_equal(np.float32([[row[key] for key in "xyz"] for row in rows]), position.reshape(-1, 3))
    assert np.array_equal(np.float32([[row[key] for key in "uvw"] for row in rows]), velocity.reshape(-1, 3))
    document = json.loads((folder / "lines.json").read_text())
    assert document["time"] == 1.0 and np.array_equal(np.float32([line["position"] for line in document["lines"]]), position)
    assert np.array_equal(np.float32([line["velocity"] for line in document["lines"]]), velocity)


def test_seeds_are_spread_and_not_inside_obstacles(folder):
    (folder / "body.yaml").write_text(SWIRL.replace("type: vortex,", "type: vortex, center: [0, 2, 0],") + CYLINDER)
    result = warpsim("streamlines", "body.yaml", "--out", "l.npz", "--count", 40, "--steps", 2, "--length", 1e-3, "--json", cwd=folder)
    assert result.returncode == 0, result.stderr
    assert json.loads(result.stdout) == {"scene": "Swirl", "file": "l.npz", "time": 0.0, "lines": 40, "points": 3}
    middle = np.load(folder / "l.npz")["position"][:, 1]
    assert len(np.unique(middle, axis=0)) == 40
    assert np.hypot(middle[:, 0], middle[:, 1]).min() >= 0.5 and middle[:, 1].min() >= -0.5


@pytest.mark.parametrize(
    ("arguments", "code", "words"),
    [
        ((), 2, "--out"),
        (("--out", "lines.txt"), 2, "must end in .npz, .csv or .json"),
        (("--out", "lines.npz", "--through", "1,2"), 2, "--through 1,2: say three numbers"),
        (("--out", "lines.npz", "--through", "1,nan,2"), 2, "say three numbers"),
        (("--out", "lines.npz", "--time", "nan"), 2, "--time must be"),
        (("--out", "lines.npz", "--length", "-1"), 2, "--length above 0"),
        (("--out", "lines.npz", "--count", "9999", "--steps", "9999"), 2, "too many"),
        (("--out", "lines.npz", "--device", "cuda:99"), 2, "cuda:99"),
        (("--out", "nowhere/lines.npz"), 5, "nowhere"),
        (("--out", "lines.npz", "--set", "flow.0.circulation=x"), 3, "circulation"),
    ],
)
def test_mistakes_end_in_words(folder, arguments, code, words):
    result = warpsim("streamlines", "swirl.yaml", *arguments, cwd=folder)
    assert result.returncode == code and words in result.stderr and "Traceback" not in result.stderr, result.stderr
    assert not list(folder.glob("lines.*"))


def test_a_flow_that_is_not_finite_is_not_written(folder):
    (folder / "wild.yaml").write_text('name: Wild\nflow: [{type: expression, velocity: ["1/(x - x)", 0, 0]}]\n')
    result = warpsim("streamlines", "wild.yaml", "--out", "lines.json", cwd=folder)
    assert result.returncode == 4 and "not finite" in result.stderr and not (folder / "lines.json").exists()
