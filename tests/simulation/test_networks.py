"""Networks as the rest of the program sees them: frames, start and prewarm, resets, changes, memory, run folders and their replay."""

import numpy as np
import pytest

from tests.simulation.networks import network, simulate, state, tangle
from warpsim import SceneError, Simulation, UnstableError
from warpsim.networks import network_of, spring_numbers
from warpsim.observers.recorder import Recorder, save_frame
from warpsim.replay import NoRun, Recording
from warpsim.scene import load_scene
from warpsim.scene.resolved import resolved_yaml

CHAIN = {"type": "chain", "count": 5, "start": [0, 0, 0], "end": [4, 0, 0]}
RING = {"type": "ring", "count": 6, "center": [1, 2, 3], "normal": [0, 0, 2], "radius": 2.0}
GRID = {"type": "grid", "resolution": [4, 3], "corner": [0, 1, 0], "edges": [[3, 0, 0], [0, -1, 0]]}
BLOCK = {"type": "block", "resolution": [3, 4, 2], "center": [1, 1, 1], "size": [2, 3, 1]}
SOFT = {"stiffness": 20.0, "damping": 0.1, "mass": 0.1, "gravity": (0, -9.81, 0)}


def net_of(generator: dict):
    spec = network(generator=generator, stiffness=1.0).systems["s"]
    net = network_of(spec, "systems.s")
    assert (len(net.points), len(net.springs)) == (spec.point_count, spec.spring_count)
    assert len({tuple(sorted(pair)) for pair in net.springs.tolist()}) == len(net.springs), "no spring twice"
    return spec, net, spring_numbers(spec, net)[2]


def test_generators_lay_out_what_they_say():
    _, net, rest = net_of(CHAIN)
    assert net.points[:, 0].tolist() == [0, 1, 2, 3, 4] and net.springs.tolist() == [[0, 1], [1, 2], [2, 3], [3, 4]] and (rest == 1.0).all()
    _, net, rest = net_of(RING)
    assert np.linalg.norm(net.points - [1, 2, 3], axis=1) == pytest.approx(2.0) and net.points[:, 2] == pytest.approx(3.0)
    assert rest == pytest.approx(2.0) and sorted(np.bincount(net.springs.ravel()).tolist()) == [2] * 6
    _, net, rest = net_of(GRID)
    assert net.points[0].tolist() == [0, 1, 0] and net.points[5].tolist() == [1, 0.5, 0] and net.points[11].tolist() == [3, 0, 0]
    assert {round(float(r), 6) for r in rest} == {1.0, 0.5, round(1.25**0.5, 6)} and len(net.triangles) == 12
    _, net, rest = net_of(BLOCK)
    assert {round(float(r) ** 2) for r in rest} == {1, 2, 3} and net.points.min(axis=0).tolist() == [0, -0.5, 0.5]


@pytest.mark.parametrize(("generator", "name", "expected"), [
    (CHAIN, "end", [4]), (GRID, "left", [0, 4, 8]), (GRID, "right", [3, 7, 11]), (GRID, "top", [0, 1, 2, 3]),
    (GRID, "bottom", [8, 9, 10, 11]),
    (GRID, "corners", [0, 3, 8, 11]), (BLOCK, "corners", [0, 2, 9, 11, 12, 14, 21, 23]),
])  # fmt: skip
def test_groups_name_points(generator, name, expected):
    spec = network(generator=generator, stiffness=1.0, pins=[name]).systems["s"]
    assert spec.pinned(spec.pins) == expected


def test_faces_of_a_block_are_where_they_say():
    spec, net, _ = net_of(BLOCK)
    sides = {"left": (0, 0.0), "right": (0, 2.0), "bottom": (1, -0.5), "top": (1, 2.5), "back": (2, 0.5), "front": (2, 1.5)}
    for name, (axis, place) in sides.items():
        assert sorted(spec.generator.group(name)) == np.flatnonzero(np.isclose(net.points[:, axis], place)).tolist(), name


def test_a_block_is_closed_and_its_triangles_face_outward():
    _, net, _ = net_of(BLOCK)
    a, b, c = (net.points[net.triangles[:, k]] for k in range(3))
    assert np.einsum("ij,ij->", a, np.cross(b, c)) / 6 == pytest.approx(2 * 3 * 1)
    edges = np.concatenate([net.triangles[:, [0, 1]], net.triangles[:, [1, 2]], net.triangles[:, [2, 0]]])
    assert len(np.unique(edges, axis=0)) == len(edges) and {tuple(e) for e in edges.tolist()} == {(j, i) for i, j in edges.tolist()}


def test_a_mesh_gives_its_edges(tmp_path):
    (tmp_path / "tent.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\n")
    (tmp_path / "x.yaml").write_text(
        "name: x\nsystems:\n  s:\n    type: springs\n    generator: {type: mesh, file: tent.obj, scale: 2, center: [0, 5, 0]}\n"
        "    stiffness: 9\n    mass: [1, 2, 3]\n"
    )
    with pytest.raises(SceneError, match="has 3 values, but the mesh makes 4"):
        Simulation(load_scene(tmp_path / "x.yaml"), device="cpu")
    sim = Simulation(load_scene(tmp_path / "x.yaml", overrides=["systems.s.mass=1"]), device="cpu")
    s = sim.frame()["s"]
    assert s.position.tolist() == [[0, 5, 0], [0, 5, 2], [0, 7, 0], [2, 5, 0]] and len(s.springs) == 6 and s.triangles.shape == (4, 3)


def test_a_frame_shows_the_network():
    sim = simulate(generator=GRID, pins=["corners"], **SOFT)
    s = sim.frame()["s"]
    assert s.is_network and s.count == 12 and s.position.shape == s.velocity.shape == (12, 3)
    assert s.id.tolist() == list(range(12)) and s.springs.dtype == s.triangles.dtype == np.int32 and s.springs.shape == (29, 2)
    assert s.mass.tolist() == pytest.approx([0.1] * 12) and s.packed(5).count == 12 or s.packed(None).count == 12
    assert sim.statistics()["s"] | {"kinetic_energy": 0} == {
        "live": 12, "born": 12, "refused": 0, "killed": 0, "kinetic_energy": 0, "elastic_energy": pytest.approx(0.0, abs=1e-12),
    }  # fmt: skip


@pytest.mark.parametrize("solver", ["semi_implicit_euler", "euler", "drift_kick", "verlet"])
def test_nothing_moves_before_frame_zero_but_in_the_prewarm(solver):
    tense = {"generator": GRID, "rest_length": 0.1, "solver": solver, **SOFT}
    start = simulate(**tense)
    assert not state(start)[1].any() and np.abs(state(start)[0] - network_of(start.scene.systems["s"], "s").points).max() == 0
    early, late = simulate(**tense, prewarm=0.5), simulate(**tense)
    late.run(0.5)
    assert (early.frame()["s"].position == late.frame()["s"].position).all()


@pytest.mark.parametrize("policy", ["reset", "kill"])
def test_a_network_that_blows_up_starts_anew_as_a_whole(policy):
    sim = simulate(
        generator=CHAIN, stiffness=1e6, mass=0.1, gravity=(0, -9.81, 0), pins=["start"], more={"limits": {"unstable": policy, "extent": 50}}
    )
    start = sim.frame()["s"].position.copy()
    returned = 0
    for frame in sim.frames(120):
        assert np.isfinite(frame["s"].position).all() and frame["s"].count == 5
        returned += bool((frame["s"].position == start).all())
    assert returned >= 1


def test_a_blow_up_stops_at_the_last_good_frame():
    sim = simulate(generator=CHAIN, stiffness=1e6, mass=0.1, gravity=(0, -9.81, 0), pins=["start"], more={"limits": {"extent": 50}})
    with pytest.raises(UnstableError) as unstable:
        sim.run(10)
    assert np.isfinite(unstable.value.last_good["s"].position).all() and unstable.value.ids


def test_changes_act_in_place_and_seeking_back_repeats_them():
    sim = simulate(generator=GRID, pins=["top"], **SOFT)
    sim.run(0.2)
    sim.change("systems.s.stiffness", 80.0)
    sim.change("systems.s.mass", 0.2)
    sim.run(0.2)
    after = sim.state_hash()
    sim.seek(3)
    sim.seek(24)
    assert sim.state_hash() == after
    same = simulate(generator=GRID, pins=["top"], **SOFT)
    same.run(0.4)
    assert same.state_hash() != after
    for path, value in (("systems.s.generator.count", 3), ("systems.s.pins", [0, 1, 2])):
        with pytest.raises((ValueError, SceneError)):
            sim.change(path, value)


def test_a_run_folder_holds_the_network_and_gives_it_back(tmp_path):
    sim = Simulation(network(generator=GRID, pins=["top"], **SOFT, look={"trail": {"duration": 0.1}}), device="cpu")
    with_recorder = Recorder(tmp_path / "run")
    with_recorder.begin(resolved_yaml(sim.scene))
    frames = [sim.frame(), *sim.frames(5)]
    for frame in frames:
        with_recorder.record(frame, sim.statistics(), "0" * 32)
    with_recorder.close()
    with np.load(tmp_path / "run" / "topology.npz") as topology:
        assert (topology["s.springs"] == frames[0]["s"].springs).all() and (topology["s.triangles"] == frames[0]["s"].triangles).all()
    with np.load(tmp_path / "run" / "frames" / "000003.npz") as stored:
        assert sorted(stored.files) == ["index", "s.id", "s.mass", "s.position", "s.velocity", "time"]
    assert "s.elastic_energy" in (tmp_path / "run" / "stats.csv").read_text().splitlines()[0]
    recording = Recording(tmp_path / "run")
    for frame in frames:
        again = recording.frame(frame.index)["s"]
        assert (again.position == frame["s"].position).all() and (again.springs == frame["s"].springs).all() and again.is_network
        assert again.packed(None).count == 12
    np.savez(
        tmp_path / "run" / "frames" / "000002.npz",
        **{"s.id": np.arange(3), "s.position": np.zeros((3, 3)), "s.velocity": np.zeros((3, 3)), "s.mass": np.ones(3)},
    )
    with pytest.raises(NoRun, match="damaged"):
        Recording(tmp_path / "run").frame(2)


CLOTH = {"type": "cloth", "resolution": [9, 6], "edges": [[0.8, 0, 0], [0, -0.5, 0]], "structural": {"stiffness": 30.0, "damping": 0.02}}
CLOTH |= {
    "air": 0.5,
    "pins": ["left"],
    "gravity": (0, -9.81, 0),
    "substeps": 8,
    "more": {"flow": [{"type": "uniform", "velocity": [0, 0, 3]}]},
}


def test_cloth_is_a_network_to_all_who_see_it(tmp_path):
    sim = simulate(**CLOTH)
    s = sim.frame()["s"]
    assert s.is_network and s.triangles.shape == (80, 3) and s.springs.shape == (sim.scene.systems["s"].spring_count, 2)
    recorder = Recorder(tmp_path / "run")
    recorder.begin(resolved_yaml(sim.scene))
    for frame in (sim.frame(), *sim.frames(3)):
        recorder.record(frame, sim.statistics(), "0" * 32)
    recorder.close()
    again = Recording(tmp_path / "run").frame(3)["s"]
    assert (again.position == sim.frame()["s"].position).all() and (again.triangles == s.triangles).all()
    assert sim.statistics()["s"]["elastic_energy"] > 0.0


def test_what_changes_in_a_running_cloth_acts_at_once():
    """A slider moves the wind, the drag, the springs; what the arrays are built from cannot change."""
    sim = simulate(**CLOTH)
    sim.run(0.1)
    hashes = {sim.state_hash()}
    for path, value in (("air", 5.0), ("drag", 0.01), ("structural.stiffness", 60.0), ("density", 0.3), ("thickness", 0.01)):
        sim.seek(6)
        sim.changes = []
        sim._change_count = 0
        sim.change(f"systems.s.{path}", value)
        sim.run(0.1)
        if path != "thickness":  # there is nothing to keep away from
            hashes.add(sim.state_hash())
    assert len(hashes) == 5
    for path, value in (("resolution", [9, 7]), ("pins", ["right"])):
        with pytest.raises(ValueError):
            sim.change(f"systems.s.{path}", value)


def test_a_saved_frame_of_a_network_is_the_same_each_time(tmp_path):
    frame = simulate(**tangle()).frame()
    assert save_frame(tmp_path / "a.npz", frame) == save_frame(tmp_path / "b.npz", frame)
