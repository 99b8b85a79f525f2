"""Mistakes in flocks: each named where it stands, with what is allowed; and what looks like one and has a result."""

import io
import zipfile

import numpy as np
import pytest

from warpsim import SceneError, Simulation, UnstableError
from warpsim.memory import MemoryLimitError
from warpsim.scene import load_text

BOX = "name: x\nsystems:\n  s:\n    type: flock\n    count: 30\n    domain: {min: [0, 0, 0], max: [4, 5, 6], boundary: contain}\n"
BOX += "    perception: {radius: 1}\n"
ROUND = BOX.replace("contain", "periodic")
VICSEK = ROUND + "    vicsek: {speed: 1, noise: 1}\n"
OTHER = "  o: {type: flock, count: 5, domain: {min: [0, 0, 0], max: [4, 4, 4]}, perception: {radius: 1}}\n"


@pytest.mark.parametrize(
    ("text", "line", "says", "suggestion"),
    [
        (BOX.replace("radius: 1", "radius: 0"), 7, "at least 1e-06 m, got 0", None),
        (BOX.replace("radius: 1", "radius: -1"), 7, "at least 1e-06 m, got -1", None),
        (BOX.replace("radius: 1", "radius: .nan"), 7, "not a finite number", None),
        (ROUND.replace("radius: 1", "radius: 2.1"), 7, "a periodic domain of 4 m: at most half of it, 2", None),
        (ROUND.replace("[4, 5, 6]", "[0, 5, 1.5]"), 7, "a periodic domain of 1.5 m: at most half of it, 0.75", None),
        (BOX.replace("radius: 1", "radius: 1, field_of_view: 361"), 7, "from 0 to 360 degrees, got 361", None),
        (BOX.replace("radius: 1", "radius: 1, field_of_view: -1"), 7, "from 0 to 360 degrees, got -1", None),
        (BOX.replace("radius: 1", "radius: 1, field_of_veiw: 90"), 7, "field_of_veiw", "field_of_view"),
        (BOX.replace("radius: 1", "range: 1"), 7, 'the key "radius" is missing', None),
        (BOX.replace("    perception: {radius: 1}\n", ""), 4, "perception", None),
        (BOX.replace("count: 30", "count: -1"), 5, "from 0 to 16777216, got -1", None),
        (BOX.replace("count: 30", "count: 1.5"), 5, "expected a whole number, got 1.5", None),
        (BOX.replace("count: 30", "count: 2e7"), 5, "from 0 to 16777216", None),
        (BOX.replace("max: [4, 5, 6]", "max: [4, -5, 6]"), 6, "must not be below min, -5 < 0", None),
        (ROUND.replace("max: [4, 5, 6]", "max: [0, 0, 0]"), 6, "an extent along one axis at least", None),
        (BOX.replace("max: [4, 5, 6]", "max: [4, 2e6, 6]"), 6, "beyond limits.extent, 1e+06 m", None),
        (BOX.replace("max: [4, 5, 6]", "max: [4, 1e300, 6]"), 6, "1e+09", None),
        (BOX.replace("contain", "contian"), 6, "contian", "contain"),
        (BOX.replace("    domain: {min: [0, 0, 0], max: [4, 5, 6], boundary: contain}\n", ""), 4, "a flock needs a domain", None),
        (BOX + "    separation: {weight: 1, radius: 2}\n", 8, "nobody farther than the perception's radius, 1 m, is seen", None),
        (BOX + "    separation: {weight: 1, radius: 0}\n", 8, "at least 1e-06 m", None),
        (BOX + "    cohesion: {radius: 0.5}\n", 8, "weight", None),
        (BOX + "    speed: 5\n", 8, "expected a list of 2 numbers", None),
        (BOX + "    speed: [5, 2]\n", 8, "the greatest speed is below the least, 2 < 5", None),
        (BOX + "    speed: [-1, 2]\n", 8, "0", None),
        (BOX + "    max_force: 0\n", 8, "greater than 0 N", None),
        (BOX + "    turn_rate: -3\n", 8, "greater than 0 deg/s", None),
        (BOX + "    mass: 0\n", 8, "1e-12", None),
        (BOX + "    thickness: -1\n", 8, "0", None),
        (BOX + "    solver: verlet\n", 8, "solver", None),
        (BOX + "    gravity: true\n", 8, "gravity", "feels.gravity"),
        (BOX + "    substeps: auto\n", 8, "give a number", None),
        (BOX + "time: {substeps: auto}\n", 8, "give a number (systems.s.substeps)", None),
        (BOX + "    start: {file: s.npz, speed: 3}\n", 8, "the file gives velocities: leave speed out", None),
        (BOX + "    start: {file: s.npy}\n", 8, ".npz", None),
        (BOX + "    start: {file: nowhere.npz}\n", 8, "no such file", None),
        (BOX + "    start: {file: ../s.npz}\n", 8, "under the scene's folder", None),
        (BOX + "    start: {speed: -1}\n", 8, "0", None),
        (BOX + "    look: {as: bird}\n", 8, "bird", "birds"),
        (BOX + "    look: {color: {by: sped, range: [0, 1]}}\n", 8, "sped", "speed"),
        (BOX + "    steering: [{type: seak, target: [0, 0, 0]}]\n", 8, "seak", "seek"),
        (BOX + "    steering: [{type: seek}]\n", 8, "target", None),
        (BOX + "    steering: [{type: leader, boid: 30}]\n", 8, "there is no boid 30: there are 30, counted from 0", None),
        (BOX + "    steering: [{type: leader}]\n", 8, "either the number of a boid that leads, or a target", None),
        (BOX + "    steering: [{type: path, points: [[1, 1, 1], [1, 1, 1]]}]\n", 8, "all points of the path are one", None),
        (ROUND + "    steering: [{type: contain}]\n", 8, "no walls to keep away from", None),
        (BOX + "    attends: {s: {cohesion: 1}}\n", 8, "a flock attends to itself by its own", None),
        (BOX + "    attends: {oo: {cohesion: 1}}\n" + OTHER, 8, 'no other flock "oo"', "o"),
        (BOX + "    attends: {o: {cohesion: {weight: 1, radius: 2}}}\n" + OTHER, 8, "nobody farther", None),
        (ROUND + "    attends: {o: {cohesion: 1}}\n" + OTHER, 8, "must share one periodic domain", None),
        (VICSEK + "    cohesion: 2\n", 9, "leave cohesion out", None),
        (VICSEK + "    start: {speed: 2}\n", 9, "vicsek.speed is the speed of all", None),
        (VICSEK.replace("noise: 1", "noise: 7"), 8, "from 0 to 6.28319 rad", None),
        (VICSEK.replace("[4, 5, 6]", "[4, 0, 0]"), 8, "an extent along two axes at least", None),
    ],
)
def test_a_mistake_is_named_where_it_stands(text, line, says, suggestion, tmp_path):
    np.savez(tmp_path / "s.npz", position=np.zeros((30, 3)), velocity=np.zeros((30, 3)))
    with pytest.raises(SceneError) as refused:
        load_text(text, "x.yaml", folder=tmp_path)
    problem = refused.value.problems[0]
    assert says in problem.message and problem.suggestion == suggestion and problem.line == line, str(refused.value)


def test_all_mistakes_come_at_once():
    with pytest.raises(SceneError) as refused:
        load_text(ROUND.replace("radius: 1", "radius: 3") + "    speed: [2, 1]\n    steering: [{type: leader, boid: 99}]\n", "x.yaml")
    assert {problem.line for problem in refused.value.problems} == {7, 8, 9}


@pytest.mark.parametrize("text", [
    BOX.replace("count: 30", "count: 0"),
    BOX.replace("count: 30", "count: 1"),
    BOX.replace("max: [4, 5, 6]", "max: [0, 0, 0]"),  # all at one point, as a domain has it
    BOX.replace("max: [4, 5, 6]", "max: [0.01, 0.02, 0]"),  # smaller than a cell
    ROUND.replace("radius: 1", "radius: 2"),  # one cell along each axis
    ROUND.replace("max: [4, 5, 6]", "max: [0, 5, 0]"),
    BOX.replace("radius: 1", "radius: 1e9"),
    BOX.replace("radius: 1", "radius: 1e-6"),
    ROUND.replace("radius: 1", "radius: 1e-6"),
    BOX.replace("radius: 1", "radius: 1, field_of_view: 0"),
    BOX.replace("[0, 0, 0], max: [4, 5, 6]", "[1e5, 0, 0], max: [100000.001, 1, 1]"),  # thinner than float32 tells there
    BOX + "    speed: [3, 3]\n",
    BOX + "    substeps: 2\ntime: {substeps: auto}\n",
    VICSEK.replace("[4, 5, 6]", "[4, 5, 0]").replace("noise: 1", "noise: 0"),
])  # fmt: skip
def test_what_has_a_result_is_no_mistake(text):
    sim = Simulation(load_text(text), device="cpu")
    sim.seek(5)
    spec, seen = sim.scene.systems["s"], sim.frame()["s"]
    assert np.isfinite(seen.position).all() and np.isfinite(seen.velocity).all() and seen.count == spec.count
    low, high = np.float32(spec.domain.min), np.float32(spec.domain.max)
    inside = (seen.position >= low) & (seen.position <= np.nextafter(high, np.float32(np.inf)))
    assert inside[:, np.array(spec.domain.size) > 0].all()  # an axis that does not exist has no walls


@pytest.mark.parametrize("boundary", ["contain", "periodic"])
def test_weights_that_no_step_stands_are_told_with_their_culprits(boundary):
    """Walls bring everybody back, but not before it is noticed who was not a number, or faster than any."""
    text = BOX.replace("contain", boundary) + "    separation: 1e9\n    alignment: 1e9\n    cohesion: -1e9\n"
    with pytest.raises(UnstableError, match="try substeps: 8 for this flock, a speed band or max_force") as told:
        Simulation(load_text(text), device="cpu").seek(60)
    assert told.value.ids and told.value.system == "s"


def promising(path):
    """An archive whose headers promise terabytes."""
    with zipfile.ZipFile(path, "w") as archive:
        for key in ("position", "velocity"):
            header = io.BytesIO()
            np.lib.format.write_array_header_1_0(header, {"descr": "<f4", "fortran_order": False, "shape": (10**12, 3)})
            archive.writestr(f"{key}.npy", header.getvalue() + bytes(100))


def damaged(path):
    np.savez(path, position=np.zeros((30, 3)), velocity=np.zeros((30, 3)))
    raw = bytearray(path.read_bytes())
    raw[60:90] = b"\xff" * 30
    path.write_bytes(raw)


REST = np.zeros((30, 3))
FILES = {
    "too few": ({"position": REST[1:], "velocity": REST}, "position has shape (29, 3)"),
    "flat": ({"position": REST, "velocity": REST[:, :2]}, "velocity has shape (30, 2)"),
    "nan": ({"position": np.where(np.arange(30)[:, None] == 7, np.nan, REST), "velocity": REST}, "position of boid 7 is not finite"),
    "overflow": ({"position": REST, "velocity": REST + 1e300}, "velocity of boid 0 is not finite, or beyond 1e+09"),
    "far": ({"position": REST + 2e6, "velocity": REST}, "boid 0 is beyond limits.extent, 1e+06 m"),
    "outside": ({"position": REST + [4.1, 0, 0], "velocity": REST}, "boid 0 is outside the domain, which is contain"),
    "truth": ({"position": REST.astype(bool), "velocity": REST}, "of bool"),
    "pickled": ({"position": np.full((30, 3), None), "velocity": REST}, "pickled objects, which are never loaded"),
    "other names": ({"positions": REST, "velocity": REST}, 'has no array "position" (it has positions, velocity)'),
    "none": ({}, 'has no array "position" (it has none)'),
    "garbage": (lambda path: path.write_bytes(b"garbage"), "is not a zip file of arrays"),
    "empty": (lambda path: path.write_bytes(b""), "is not a zip file of arrays"),
    "folder": (lambda path: path.mkdir(), ""),
    "promising": (promising, "position has shape (1000000000000, 3)"),
    "damaged": (damaged, "s.npz: "),
}


@pytest.mark.parametrize("kind", FILES)
def test_start_files_are_refused_in_words(kind, tmp_path):
    content, words = FILES[kind]
    path = tmp_path / "s.npz"
    np.savez(path, **content) if isinstance(content, dict) else content(path)
    with pytest.raises(SceneError) as refused:
        Simulation(load_text(BOX + "    start: {file: s.npz}\n", "x.yaml", folder=tmp_path), device="cpu")
    (problem,) = refused.value.problems
    assert problem.path == "systems.s.start.file" and words in problem.message, problem


def test_start_files_damaged_anywhere_start_or_are_refused(tmp_path):
    path, rng = tmp_path / "s.npz", np.random.default_rng(4)
    np.savez(path, position=REST, velocity=REST)
    whole = path.read_bytes()
    scene = load_text(BOX + "    start: {file: s.npz}\n", "x.yaml", folder=tmp_path)
    refused = 0
    for _ in range(60):
        raw = bytearray(whole)
        for at in rng.integers(0, len(raw), 3):
            raw[at] = rng.integers(256)
        path.write_bytes(raw[: rng.integers(1, len(raw))] if rng.random() < 0.3 else raw)
        try:
            assert np.isfinite(Simulation(scene, device="cpu").frame()["s"].position).all()
        except SceneError:
            refused += 1
    assert refused > 30


def test_five_million_boids_without_the_memory_are_refused_before_they_are_allocated():
    text = BOX.replace("count: 30", "count: 5000000") + "limits: {memory: 0.5}\n"
    with pytest.raises(MemoryLimitError, match=r"needs about 0\.8\d GiB, but 0.50 GiB its limits.memory allows.*s: 5000000 boids"):
        Simulation(load_text(text), device="cpu")
