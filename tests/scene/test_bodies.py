"""Bodies, chains, muscles and grip in scene files: what a generator makes, and what a user is told."""

from collections import Counter

import numpy as np
import pytest

from warpsim import Scene, Simulation
from warpsim.networks import network_of
from warpsim.scene import SceneError
from warpsim.scene.springs import Springs

FISH = [(0, 0, 0), (0.14, 0.13, 0.18), (0.32, 0.19, 0.28), (0.5, 0.16, 0.25), (0.68, 0.09, 0.16), (0.84, 0.04, 0.07), (1, 0, 0.34)]


def body(sections=FISH, head=(0, 0, 0), tail=(-1, 0, 0), **keys) -> dict:
    rows = [{"at": at, "width": width, "height": height} for at, width, height in sections]
    return {"type": "body", "head": list(head), "tail": list(tail), "sections": rows, **keys}


def springs(**keys) -> Springs:
    return Springs.model_validate({"stiffness": 1.0, **keys})


@pytest.mark.parametrize(
    "sections",
    [FISH, [*FISH[:-1], (1, 0.3, 0)], [(0, 0.1, 0.2), (0.5, 0.1, 0.2), (1, 0.1, 0.2)], [(0, 0.1, 0), (0.5, 0.2, 0.2), (1, 0, 0)]],
    ids=["fish", "dolphin", "bar", "wedge"],
)
def test_a_body_is_closed_turned_outward_and_counted(sections):
    """Every edge is run through once in each direction; the volume enclosed is that of slabs whose width and height change evenly."""
    spec = springs(generator=body(sections, head=(1, 2, 3), tail=(2, 3, 5)))
    net = network_of(spec, "systems.s")
    assert (len(net.points), len(net.springs)) == (spec.point_count, spec.spring_count)
    assert len({tuple(sorted(pair)) for pair in net.springs.tolist()}) == len(net.springs)
    for facets in (net.triangles.tolist(), [corners[corners >= 0].tolist() for corners in net.facets]):
        edges = Counter(pair for corners in facets for pair in zip(corners, corners[1:] + corners[:1], strict=True))
        assert all(count == 1 and edges[pair[::-1]] == 1 for pair, count in edges.items())
    x = net.points - net.points.mean(axis=0)
    assert np.einsum("ij,ij->", x[net.triangles[:, 0]], np.cross(x[net.triangles[:, 1]], x[net.triangles[:, 2]])) > 0.0


def test_the_fish_of_1994_has_its_numbers():
    """23 masses, 91 springs; 12 of the 16 along its flanks are muscles.  Source: Tu & Terzopoulos 1994."""
    spec = springs(generator=body())
    assert (spec.point_count, spec.spring_count) == (23, 91)
    net = network_of(spec, "systems.s")
    assert net.points[1] == pytest.approx([-0.14, 0.09, 0.065])  # right, with its head to +x and its back to +y, is +z
    chains = [spec.chain_points(name) for name in spec.generator.chains]
    assert [len(chain) for chain in chains] == [5] * 4 and sorted(sum(chains, [])) == list(range(1, 21))
    assert spec.pinned(["head", "tail"]) == [0, 21, 22]
    sections = [set(section) for section in spec.generator.numbers]
    within = [k for k, pair in enumerate(net.springs.tolist()) if any(set(pair) <= section for section in sections)]
    assert spec.generator.spring_group("rings") == within and len(within) == 31


def told(**keys) -> dict[str, str]:
    """What a user is told, by path."""
    try:
        scene = Scene.model_validate({"name": "x", "systems": {"s": {"type": "springs", "stiffness": 1.0, **keys}}})
        Simulation(scene, device="cpu")
    except SceneError as error:
        return {problem.path: problem.message for problem in error.problems}
    except ValueError as error:
        return {"": str(error)}
    return {}


LINE = {"points": [[0, 0, 0], [1, 0, 0], [2, 0, 0]], "springs": [[0, 1], [1, 2]]}


@pytest.mark.parametrize(
    ("keys", "words"),
    [
        ({"muscles": [{"chain": "back", "rest": 1}]}, 'no chain "back"'),
        ({"generator": body(), "muscles": [{"chain": "left_tip", "rest": 1}]}, "chains: right_top, left_top, left_bottom, right_bottom"),
        ({"muscles": [{"springs": [2], "rest": 1}]}, "there is no spring 2: there are 2"),
        ({"muscles": [{"springs": "rungs", "rest": 1}]}, 'no group of springs "rungs"'),
        ({"generator": body(), "muscles": [{"springs": "rungs", "rest": 1}]}, "groups: all, rings"),
        ({"muscles": [{"rest": 1}]}, "give either chain or springs"),
        ({"muscles": [{"springs": "all"}]}, "give either rest or wave"),
        ({"muscles": [{"springs": "all", "rest": 1, "wave": {"amplitude": 0.1, "period": 1}}]}, "give either rest or wave, not both"),
        ({"muscles": [{"springs": "all", "rest": -1}]}, "must not be negative"),
        ({"muscles": [{"springs": [0], "wave": {"amplitude": 0.1, "period": 1, "wavelength": 1}}]}, "needs a direction"),
        ({"muscles": [{"springs": [0], "part": [0, 0.5], "rest": 1}]}, "part is for chains"),
        (
            {"muscles": [{"springs": "all", "rest": 1}, {"springs": [1], "rest": 1}]},
            "the spring of points 1 and 2 is moved by muscles.0 already",
        ),
        ({"muscles": [{"springs": [1, 1], "rest": 1}]}, "a spring is named twice"),
        ({"chains": {"leap": [0, 2]}}, "no spring joins points 0 and 2"),
        ({"chains": {"far": [1, 2, 3]}}, "there is no point 3"),
        ({"generator": body(), "chains": {"left_top": [0, 1]}}, 'the generator makes a chain "left_top"'),
        ({"generator": body(), "muscles": [{"chain": "left_top", "part": [0.4, 0.5], "rest": 1}]}, "no spring of the chain"),
        ({"triangles": [[0, 1, 3]]}, "there is no point 3"),
        ({"triangles": [[0, 1, 1]]}, "three points, each once"),
        ({"water": 1}, "the flow resists triangles, and there are none"),
        ({"grip": {"chain": "back"}}, 'no chain "back"'),
        ({"generator": body(FISH[:1] + FISH[-1:])}, "two sections make a body only if both are rectangles"),
        ({"generator": body([(0, 0, 0), (0.5, 0.1, 0), (1, 0.1, 0.1)])}, "only the ends may be an edge or a point"),
        ({"generator": body([(0, 0, 0), (0, 0.1, 0.1), (1, 0.1, 0.1)])}, "sections must follow each other"),
        ({"generator": body(tail=(0, 0, 0))}, "the body has no length"),
        ({"generator": body(up=(1, 0, 0))}, "up must lead away"),
    ],
)
def test_mistakes_are_told(keys, words):
    messages = told(**({} if "generator" in keys else LINE), **keys)
    assert any(words in message for message in messages.values()), messages


def test_muscles_of_a_chain_that_a_mesh_does_not_have(tmp_path):
    """Only the file says which points are joined: the simulation says so, with the muscle's place in the scene."""
    file = tmp_path / "tetrahedron.obj"
    file.write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 1 4 3\n")
    net = {"generator": {"type": "mesh", "file": str(file)}, "chains": {"line": [0, 1], "far": [0, 9]}}
    assert told(**net, muscles=[{"chain": "line", "rest": 1}]) == {}
    assert "no spring joins points 0 and 9" in told(**net, muscles=[{"chain": "far", "rest": 1}])["systems.s.muscles.0.chain"]
    assert "there is no spring 6" in told(**net, muscles=[{"springs": [6], "rest": 1}])["systems.s.muscles.0.springs"]
