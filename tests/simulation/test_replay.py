"""A run folder read back: the same frames, packed the same; damage is named."""

import json

import numpy as np
import pytest

from tests.simulation.scenes import scene
from warpsim import Scene, Simulation
from warpsim.observers.recorder import Recorder
from warpsim.replay import NoRun, Recording
from warpsim.scene import resolved_yaml


@pytest.fixture
def run(tmp_path):
    """A recorded run of four frames, and its simulation's frames."""
    simulation = Simulation(scene(), device="cpu", threads=1)
    recorder = Recorder(tmp_path / "run")
    recorder.begin(resolved_yaml(simulation.scene))
    frames = [simulation.frame()]
    frames[0].keep()
    recorder.record(frames[0], simulation.statistics(), simulation.state_hash())
    packed = [None]
    for frame in simulation.frames(4):
        recorder.record(frame, simulation.statistics(), simulation.state_hash())
        packed.append(frame["p"].packed())
        frames.append(frame)
    recorder.close()
    return tmp_path / "run", frames, packed


def test_a_recording_gives_back_its_frames(run):
    folder, frames, packed = run
    recording = Recording(folder)
    assert recording.frame_count == 4 and recording.scene.name == "test"
    for k in (4, 1, 3, 2, 2):
        frame = recording.frame(k)
        assert frame.index == k and frame.time == k / 60 and frame["p"].count == frames[k]["p"].count
        for name in ("position", "velocity", "id", "age", "lifetime", "mass", "radius"):
            assert np.array_equal(getattr(frame["p"], name), getattr(frames[k]["p"], name)), name
        again = frame["p"].packed()
        assert np.array_equal(again.position, packed[k].position) and np.array_equal(again.color, packed[k].color)
    assert recording.frame(0)["p"].packed().count == 0
    assert recording.frame(99).index == 4


def test_trails_are_put_together_from_earlier_frames(tmp_path):
    simulation = Simulation(scene({"look": {"trail": {"duration": 0.1, "points": 4}}}), device="cpu", threads=1)
    recorder = Recorder(tmp_path / "run")
    recorder.begin(resolved_yaml(simulation.scene))
    packed = {}
    for index in range(16):
        simulation.seek(index)
        frame = simulation.frame()
        packed[index] = frame["p"].packed()
        recorder.record(frame, simulation.statistics(), simulation.state_hash())
    recorder.close()
    recording = Recording(tmp_path / "run")
    for index in (15, 8, 14, 3, 1):
        again, first = recording.frame(index)["p"].packed(), packed[index]
        # a newborn's first place is where it was in the frame of its birth, in both; the box is of all places
        assert np.array_equal(again.trail, first.trail) and np.array_equal(again.position, first.position), index


def test_colors_of_their_own_are_kept(tmp_path):
    """Drawn from an emitter's list, inherited by children, recorded, and drawn again the same; stats.csv counts the children."""
    parent = {"burst": {"count": 40}, "lifetime": {"mean": 0.05, "spread": 0.04}, "color": ["#ff8000", [0.2, 0.4, 1.0, 0.5]]}
    child = {"on": {"event": "death", "of": "p", "inherit": {"color": True}}, "burst": {"count": 3}}
    systems = {"p": {"type": "particles", "emitters": [parent]}, "c": {"type": "particles", "emitters": [child]}}
    simulation = Simulation(Scene.model_validate({"name": "colors", "systems": systems}), device="cpu", threads=1)
    recorder = Recorder(tmp_path / "run")
    recorder.begin(resolved_yaml(simulation.scene))
    frame = list(simulation.frames(4))[-1]
    recorder.record(frame, simulation.statistics(), simulation.state_hash())
    recorder.close()
    again = Recording(tmp_path / "run").frame(4)
    for name in ("p", "c"):
        assert frame[name].has_colors and len(np.unique(frame[name].color, axis=0)) == 2
        assert np.array_equal(again[name].color, frame[name].color)
        assert np.array_equal(again[name].packed().color, frame[name].packed().color)
    header, row = (line.split(",") for line in (tmp_path / "run" / "stats.csv").read_text().splitlines())
    assert int(row[header.index("c.children")]) == frame["c"].count > 10 and "p.children" not in header


def test_what_is_no_run_is_named(tmp_path, run):
    folder, *_ = run
    with pytest.raises(NoRun, match="holds no run"):
        Recording(tmp_path / "nothing")
    with open(folder / "frames.jsonl", "a") as file:
        file.write('{"index": 5, "fi')  # torn: the run was killed
    assert Recording(folder).frame_count == 4
    file = folder / "frames/000002.npz"
    file.write_bytes(file.read_bytes()[:-100])
    with pytest.raises(NoRun, match="000002.npz is damaged"):
        Recording(folder).frame(2)
    (folder / "frames/000003.npz").unlink()
    with pytest.raises(NoRun, match="000003.npz cannot be read"):
        Recording(folder).frame(3)
    (folder / "frames.jsonl").write_text(json.dumps({"index": 0}) + "\n")
    with pytest.raises(NoRun, match="frames.jsonl is damaged: line 2"):
        Recording(folder)
