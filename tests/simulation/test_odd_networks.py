"""Odd networks: each is refused with a message that says what is wrong, or has a defined result, and never one that is not finite."""

import math

import numpy as np
import pytest

from tests.simulation.networks import network, simulate, state
from warpsim import SceneError, Simulation
from warpsim.memory import MemoryLimitError, check_layout, estimate_memory, network_advice
from warpsim.networks import network_of
from warpsim.scene import load_scene

TET = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\n"
CLOTH = {"type": "cloth", "resolution": [9, 9], "edges": [[1, 0, 0], [0, -1, 0]], "structural": {"stiffness": 9.0}}


@pytest.mark.parametrize(("keys", "says"), [
    ({"points": [[1e8, 1, 0], [1e8, 2, 0]], "springs": [[0, 1]]}, r"point 0 starts at \[1e\+08, 1, 0\], beyond limits.extent of 1e\+06 m"),
    ({"points": [[1e5, 1, 0], [1e5 + 1e-6, 1, 0]], "springs": [[0, 1]]}, "points 0 and 1 lie 1e-06 m apart .* 32 bits tell places 0.008"),
    ({"generator": {"type": "ring", "count": 5, "center": [1e5, 0, 0], "radius": 1e-9}}, "32 bits tell places 0.008 m apart"),
    ({**CLOTH, "corner": [1e5, 0, 0], "edges": [[1e-3, 0, 0], [0, -1e-3, 0]]}, "nearer to the origin, or larger"),
])  # fmt: skip
def test_places_that_32_bits_do_not_hold_are_refused(keys, says):
    more = {} if keys.get("type") == "cloth" else {"stiffness": 5.0}
    with pytest.raises(SceneError, match=says):
        Simulation(network(**keys, **more), device="cpu")


def test_ends_that_coincide_and_only_pull_do_nothing_until_something_moves_them():
    """A spring of no length between a pin and a free point: the point falls, is pulled back, and swings about m g/k below the pin."""
    sim = simulate(points=[[0, 0, 0], [0, 0, 0]], springs=[[0, 1]], stiffness=50.0, mass=0.2, pins=[0], damping=2.0, gravity=(0, -9.81, 0))
    sim.run(10.0)
    assert state(sim)[0][1] == pytest.approx([0, -0.2 * 9.81 / 50.0, 0], abs=1e-5)


def test_a_spring_between_two_pins_holds_energy_and_moves_nothing():
    """However stiff: the advisor leaves it out, both pins stay, and it holds ½ k (d − r)²."""
    sim = simulate(
        points=[[0, 0, 0], [1.5, 0, 0], [2.5, 0, 0]], springs=[[0, 1], [1, 2]], stiffness=[1e9, 4.0], rest_length=1.0, pins=[0, 1],
        substeps="auto",
    )  # fmt: skip
    assert sim.advice["s"].chosen < 10
    sim.run(0.5)
    assert state(sim)[0] == pytest.approx(np.array([[0, 0, 0], [1.5, 0, 0], [2.5, 0, 0]]), abs=1e-6)
    assert sim.statistics()["s"]["elastic_energy"] == pytest.approx(0.5 * 1e9 * 0.25)


def test_a_network_of_pins_alone_stands_any_substep():
    sim = simulate(points=[[0, 0, 0], [1.5, 0, 0]], springs=[[0, 1]], stiffness=1e12, rest_length=1.0, pins=[0, 1], substeps="auto")
    assert sim.advice["s"].longest == math.inf
    sim.run(0.1)
    assert state(sim)[0].tolist() == [[0, 0, 0], [1.5, 0, 0]]


def mesh_scene(tmp_path, obj: str):
    (tmp_path / "m.obj").write_text(obj)
    (tmp_path / "x.yaml").write_text("name: x\nsystems:\n  s: {type: springs, generator: {type: mesh, file: m.obj}, stiffness: 5}\n")
    return load_scene(tmp_path / "x.yaml")


@pytest.mark.parametrize(("obj", "points", "springs", "triangles"), [
    (TET + "f 1 2 3\nf 1 4 2\nf 2 4 3\nf 3 4 1\n", 4, 6, 4),  # inside out
    (TET + "f 1 3 2\nf 1 2 4\nf 2 4 3\nf 3 4 1\n", 4, 6, 4),  # one triangle the wrong way round
    (TET + "f 1 3 2\nf 1 2 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\n", 4, 6, 4),  # one without an area
    (TET + "v 2 0 0\nf 1 2 3\nf 1 2 5\n", 3, 3, 1),  # a point that only a triangle without an area has
    (TET + "v -1 -1 0\nf 1 2 3\nf 1 2 4\nf 1 2 5\n", 5, 7, 3),  # three triangles on one edge, which is one spring
    (TET + "v 5 5 5\nf 1 2 3\n", 3, 3, 1),  # points that no triangle has
    (TET + "f 1 2 3\nf 1 2 3\nf 2 3 4\n", 4, 5, 3),  # a triangle twice
    ("v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1 2 3 4\n", 4, 5, 2),  # a face of four corners has one diagonal
], ids=["inverted", "half_inverted", "zero_area", "sliver", "non_manifold", "isolated", "doubled", "quad"])  # fmt: skip
def test_a_mesh_of_odd_triangles_is_a_network_of_its_edges(tmp_path, obj, points, springs, triangles):
    scene = mesh_scene(tmp_path, obj)
    net = network_of(scene.systems["s"], "systems.s")
    assert (len(net.points), len(net.springs), len(net.triangles)) == (points, springs, triangles)
    assert len(np.unique(net.springs)) == points and len(np.unique(np.sort(net.springs, axis=1), axis=0)) == springs
    sim = Simulation(scene, device="cpu")
    sim.run(0.2)
    assert np.isfinite(state(sim)[0]).all()


@pytest.mark.parametrize(("obj", "says"), [
    ("v 0 0 0\nv 1 0 0\nv 2 0 0\nf 1 2 3\n", "none of its 1 triangles has an area"),
    ("", "holds no triangles"), (TET + "l 1 2\nl 2 3\n", "holds no triangles"),
    ("v nan 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n", "not finite"), (TET + "f 1 2 9\n", "holds no OBJ mesh"),
])  # fmt: skip
def test_a_mesh_without_edges_is_refused(tmp_path, obj, says):
    with pytest.raises(SceneError, match=says) as refused:
        Simulation(mesh_scene(tmp_path, obj), device="cpu")
    assert refused.value.problems[0].path == "systems.s.generator.file"


def test_a_network_that_is_too_large_to_lay_out_is_refused_before_it_is():
    huge = network(**{**CLOTH, "resolution": [4096, 4096]})
    with pytest.raises(MemoryLimitError, match="16777216 points and 100622338 springs take about .* GiB to lay out"):
        check_layout(huge.systems, 8 << 30)
    solid = network(generator={"type": "block", "resolution": [4096, 4096, 4096], "size": [1, 1, 1]}, stiffness=1.0)
    for asked in (estimate_memory, network_advice):
        with pytest.raises(MemoryLimitError, match="lower its resolution"):  # more than any machine has
            asked(solid)
    with pytest.raises(MemoryLimitError, match="s: 81 points"):
        Simulation(network(**CLOTH, more={"limits": {"memory": 1e-6}}), device="cpu")


def test_what_the_layout_takes_is_what_is_counted(tmp_path):
    """Peak of the host's arrays while a network is laid out and advised: a tenth below what is counted for it, or more."""
    import tracemalloc

    from warpsim.memory import LAYOUT_PER_POINT, LAYOUT_PER_SPRING

    for keys in (
        {**CLOTH, "resolution": [120, 120]},
        {"generator": {"type": "chain", "count": 50_000, "start": [0, 0, 0], "end": [9, 0, 0]}},
    ):
        scene = network(**keys, **({} if "type" in keys else {"stiffness": 1.0}))
        spec = scene.systems["s"]
        tracemalloc.start()
        network_advice(scene)
        peak = tracemalloc.get_traced_memory()[1]
        tracemalloc.stop()
        assert 0.3 < peak / (LAYOUT_PER_POINT * spec.point_count + LAYOUT_PER_SPRING * spec.spring_count) < 1.0
