"""Collisions where they are hard: thin walls, movers, edges, births inside, what kills and what sticks, tracers, meshes."""

import numpy as np
import pytest

from tests.meshes import hourglass
from tests.physics.scenes import emitter, simulate, start, state
from tests.reference.collision import gap, rotation
from warpsim.meshes import load_mesh

G = 9.81
WALL = {"type": "box", "size": [0.001, 10, 10], "restitution": 0.5}
ASKEW = [10.0, 20.0, 33.0]


def shower(count: int, speed: float = 100.0) -> dict:
    place = {"type": "box", "center": [-2.5, 0, 0], "size": [0.5, 3, 3]}
    return emitter(count, shape=place, velocity={"direction": [1, 0, 0], "speed": speed, "cone": 10})


def obj(folder, vertices, triangles) -> str:
    lines = [f"v {x:.9g} {y:.9g} {z:.9g}" for x, y, z in vertices] + ["f " + " ".join(str(k + 1) for k in face) for face in triangles]
    (folder / "mesh.obj").write_text("\n".join(lines) + "\n")
    return str(folder / "mesh.obj")


def slab(folder, size) -> str:
    """A box as a mesh."""
    corners = 0.5 * np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]) * size
    faces = [
        (0, 1, 3),
        (0, 3, 2),
        (4, 7, 5),
        (4, 6, 7),
        (0, 5, 1),
        (0, 4, 5),
        (2, 3, 7),
        (2, 7, 6),
        (0, 2, 6),
        (0, 6, 4),
        (1, 5, 7),
        (1, 7, 3),
    ]
    return obj(folder, corners, faces)


# ---- no way through


@pytest.mark.parametrize("native", [True, False])
@pytest.mark.parametrize("way", ["straight", "askew", "mesh", "moving"])
def test_nothing_passes_a_thin_wall(way, native, tmp_path):
    """100 m/s, 60 frames per second, one substep each: 1.7 m of way through 1 mm. The ADR tells of a million; here are some thousand."""
    wall = dict(WALL)
    if way != "straight":
        wall["rotation"] = ASKEW
    if way == "mesh":
        wall = {"type": "mesh", "file": slab(tmp_path, WALL["size"]), "rotation": ASKEW, "restitution": 0.5}
    if way == "moving":
        wall["motion"] = {"center": [{"expression": "-5*t"}, 0, 0], "rotation": [10, 20, {"expression": "33 + 200*t"}]}
    sim = simulate(shower(5000), colliders=[wall], substeps=1, native=native)
    sim.run(0.1)
    x, t = state(sim)[0], sim.time
    place, turned = ([-5 * t, 0, 0], [10, 20, 33 + 200 * t]) if way == "moving" else ([0, 0, 0], wall.get("rotation", [0, 0, 0]))
    q = (x - place) @ rotation(turned)
    assert len(q) == 5000 and (q[:, 0] < 0.0).all()
    assert (np.linalg.norm(q, axis=1) < 25).all(), "and none is thrown out"


@pytest.mark.parametrize("shape", ["sphere", "capsule", "box"])
def test_nobody_leaves_a_container_that_shakes(shape):
    """With many impacts per substep at its ends: 30 m/s in 1 m at 60 steps per second."""
    room = {"type": shape, "side": "inside", "restitution": 0.9, "friction": 0.1}
    room |= {"sphere": {"radius": 0.5}, "capsule": {"start": [-0.3, 0, 0], "end": [0.3, 0, 0], "radius": 0.4}, "box": {"size": [1, 1, 1]}}[
        shape
    ]
    room["motion"] = {"center": [{"sine": {"amplitude": 0.2, "period": 0.5}}, 0, 0], "rotation": [0, 0, {"expression": "100*t"}]}
    born = emitter(1000, shape={"type": "sphere", "radius": 0.1}, velocity={"cone": 180, "speed": 30.0})
    sim = simulate(born, colliders=[room], gravity=(0, -G, 0), substeps=1)
    sim.run(2.0)
    x, t = state(sim)[0], sim.time
    q = (x - [0.2 * np.sin(4 * np.pi * t), 0, 0]) @ rotation([0, 0, 100 * t])
    solid = room | {"half": [0.3, 0.0, 0.0]}
    assert len(q) == 1000 and min(gap(solid, point) for point in q) > -1e-4


def test_sand_stays_in_the_hourglass():
    """Through the neck, over facets and edges, while the glass turns over: nobody gets out."""
    mesh = load_mesh(hourglass.PLACE, "here")
    glass = {"type": "mesh", "file": str(hourglass.PLACE), "side": "inside", "friction": 0.2, "restitution": 0.1}
    glass["motion"] = {"rotation": {"keyframes": [[1, [0, 0, 0]], [2, [0, 0, 180]]]}}
    born = emitter(2000, shape={"type": "sphere", "center": [0, 0.6, 0], "radius": 0.3})
    sim = simulate(born, colliders=[glass], gravity=(0, -G, 0), substeps=2)
    sim.run(3.0)
    x = state(sim)[0]
    r = np.hypot(x[:, 0], x[:, 2])
    assert len(x) == 2000 and (r < hourglass.radius(x[:, 1]) + 1e-3).all() and (np.abs(x[:, 1]) < hourglass.HEIGHT + 1e-4).all()
    assert mesh.closed and (x[:, 1] < 0).mean() > 0.2


# ---- movers


def test_a_rising_floor_adds_twice_its_speed():
    """Relative to the floor -3 becomes 3; the floor's own speed is a difference of places over half a substep: 1e-6 of them."""
    floor = {"type": "plane", "restitution": 1, "friction": 0, "motion": {"center": {"keyframes": [[0, [0, 0, 0]], [10, [0, 10, 0]]]}}}
    sim = simulate(start((0, 1, 0), (0.5, -2, 0)), colliders=[floor])
    sim.run(1.0)
    assert state(sim)[1][0] == pytest.approx([0.5, 4.0, 0.0], abs=1e-5)


def test_a_turntable_holds_a_grain_while_friction_can():
    """It stays where it is on the table iff ω² r < μ g; else it slides outward, and turns less than the table."""
    for friction, stays in ((0.5, True), (0.35, False)):
        table = {
            "type": "plane",
            "friction": friction,
            "restitution": 0,
            "motion": {"rotation": [0, {"expression": f"{np.degrees(2.0)}*t"}, 0]},
        }
        sim = simulate(start((1.0, 1e-6, 0), (0, 0, -2.0)), colliders=[table], gravity=(0, -G, 0), solver="verlet")
        sim.run(2.0)
        (x,), (v,) = state(sim)
        r = np.hypot(x[0], x[2])
        if stays:  # born at the speed of the table, it slips for a moment until the contact is made
            assert r == pytest.approx(1.0, abs=1e-3) and v == pytest.approx([-2.0 * -x[2], 0, -2.0 * x[0]], abs=1e-3)
            assert np.arctan2(-x[2], x[0]) % (2 * np.pi) == pytest.approx(4.0, abs=1e-3)
        else:
            assert r > 1.5


def test_a_swinging_box_hits_with_the_speed_of_its_surface():
    """At rest, struck by the long side: twice the surface's normal velocity there, ω times the distance along the side."""
    paddle = {"type": "box", "size": [2, 0.1, 1], "friction": 0, "restitution": 1, "motion": {"rotation": [0, 0, {"expression": "90*t"}]}}
    sim = simulate(start((0.8, 0.5, 0)), colliders=[paddle], substeps=8)
    sim.run(1.0)
    along = np.sqrt(0.8**2 + 0.5**2 - 0.05**2)
    assert np.linalg.norm(state(sim)[1][0]) == pytest.approx(2 * np.pi / 2 * along, rel=2e-3)


# ---- what kills and what sticks


def test_a_killer_kills_at_the_impact():
    """Its ordinal is gone at the first frame after; nobody is counted as unstable."""
    sim = simulate(start((0, 1, 0)), colliders=[{"type": "plane", "action": "kill"}], gravity=(0, -G, 0), solver="verlet")
    living = [frame["p"].count for frame in sim.frames(40)]
    assert living.index(0) == int(np.sqrt(2 / G) * 60) and sim.statistics()["p"]["killed"] == 0


@pytest.mark.parametrize("native", [True, False])
def test_what_sticks_rides_along(native):
    """Within a few skins (2e-5 m); speeds are differences of places over half a substep."""
    ball = {
        "type": "sphere",
        "radius": 0.5,
        "action": "stick",
        "motion": {"center": [0, 0, {"expression": "t"}], "rotation": [0, {"expression": "90*t"}, 0]},
    }
    sim = simulate(start((0.2, 0.7, 0)), start((-0.2, 0.9, 0.2)), colliders=[ball], gravity=(0, -G, 0), native=native)
    sim.run(1.0)
    x1, t1 = state(sim)[0], sim.time
    sim.run(2.0)
    x2, v2 = state(sim)
    before, after = ((x - [0, 0, t]) @ rotation([0, 90 * t, 0]) for x, t in ((x1, t1), (x2, sim.time)))
    assert np.linalg.norm(before, axis=1) == pytest.approx(0.5, abs=1e-4)
    assert after == pytest.approx(before, abs=2e-4), "a rounding of 2e-7 per substep, 500 of them"
    spin = np.array([0, np.pi / 2, 0])
    assert v2 == pytest.approx(np.cross(spin, x2 - [0, 0, sim.time]) + [0, 0, 1], abs=2e-3)


# ---- born where nobody can be


@pytest.mark.parametrize("native", [True, False])
def test_who_is_born_inside_is_put_on_the_nearest_surface_and_counted(native, tmp_path):
    """Within a few skins (2e-5 m at a meter)."""
    for solid, born, expected in (
        ({"type": "sphere", "radius": 1.0}, (0.0, 0.3, 0.4), (0.0, 0.6, 0.8)),
        ({"type": "box", "size": [2, 2, 2]}, (0.2, 0.9, 0.3), (0.2, 1.0, 0.3)),
        ({"type": "sphere", "radius": 1.0, "side": "inside"}, (0.0, 3.0, 4.0), (0.0, 0.6, 0.8)),
        ({"type": "mesh", "file": slab(tmp_path, [2, 2, 2])}, (0.2, 0.9, 0.3), (0.2, 1.0, 0.3)),
        ({"type": "plane"}, (1.0, -5.0, 2.0), (1.0, 0.0, 2.0)),
    ):
        sim = simulate(start(born), start((9, 9, 9)), colliders=[solid], native=native)
        sim.step_frame()
        assert state(sim)[0][0] == pytest.approx(expected, abs=1e-4), solid
        assert sim.systems["p"].population.counter("pushed") == (2 if solid.get("side") == "inside" else 1)


def test_the_center_of_a_ball_is_no_trap():
    """Every way out is as long; a few skins (2e-5 m) from the surface."""
    sim = simulate(start((0, 0, 0)), colliders=[{"type": "sphere", "radius": 1.0}])
    sim.step_frame()
    assert state(sim)[0][0] == pytest.approx([0, 1, 0], abs=1e-4)


def test_birth_on_the_surface_is_no_way_in():
    """Half of a shower that starts on a ball's surface flies inward: it bounces at once."""
    born = emitter(2000, shape={"type": "sphere", "radius": 1.0, "fill": "surface"}, velocity={"cone": 180, "speed": 5.0})
    sim = simulate(born, colliders=[{"type": "sphere", "radius": 1.0, "restitution": 1, "friction": 0}])
    sim.run(0.5)
    x, v = state(sim)
    assert (np.linalg.norm(x, axis=1) > 1.0 - 1e-4).all() and np.linalg.norm(v, axis=1) == pytest.approx(5.0, rel=1e-4)


# ---- edges


def test_edges_and_corners_of_a_box_send_away():
    """A shower onto a corner: nobody gets in, no energy is made, and some leave in every direction."""
    box = {"type": "box", "size": [1, 1, 1], "rotation": [35.26, 0, 45], "restitution": 1, "friction": 0}
    born = emitter(
        4000, shape={"type": "box", "center": [0, 2, 0], "size": [1.5, 0.1, 1.5]}, velocity={"direction": [0, -1, 0], "speed": 4}
    )
    sim = simulate(born, colliders=[box])
    sim.run(1.0)
    x, v = state(sim)
    q = np.abs(x @ rotation(box["rotation"])).max(axis=1)
    assert (q > 0.5 - 1e-4).all() and np.linalg.norm(v, axis=1) == pytest.approx(4.0, rel=1e-5)


# ---- tracers


def test_tracers_slide_along_what_is_in_their_way():
    """Blown at 45° onto a floor they go on along it, with the wind's part along it."""
    wind = ({"type": "uniform", "velocity": [1.0, -1.0, 0.0]},)
    for solver in ("euler", "rk4"):
        sim = simulate(start((0, 0.5, 0)), colliders=[{"type": "plane"}], flow=wind, coupling="tracer", solver=solver)
        sim.run(2.0)
        assert state(sim)[0][0] == pytest.approx([2.0, 0.0, 0.0], abs=1e-4)


def test_tracers_go_round_a_ball():
    wind = ({"type": "uniform", "velocity": [1.0, 0.0, 0.0]},)
    born = emitter(300, shape={"type": "disc", "center": [-2, 0, 0], "normal": [1, 0, 0], "radius": 0.9})
    sim = simulate(born, colliders=[{"type": "sphere", "radius": 1.0}], flow=wind, coupling="tracer")
    least = min(np.linalg.norm(frame["p"].position, axis=1).min() for frame in sim.frames(300))
    assert least > 1.0 - 1e-4 and (state(sim)[0][:, 0] > 0).mean() > 0.9


# ---- meshes


def test_a_mesh_bounces_as_the_box_that_it_is(tmp_path):
    numbers = {"rotation": [10, 0, 15], "restitution": 0.6, "friction": 0.2}
    ends = []
    for solid in ({"type": "box", "size": [4, 0.5, 4]}, {"type": "mesh", "file": slab(tmp_path, [4, 0.5, 4])}):
        sim = simulate(start((0.1, 1, 0.1), (0.3, 0, 0.2)), colliders=[solid | numbers], gravity=(0, -G, 0), solver="verlet")
        sim.run(0.9)
        ends.append(np.concatenate(state(sim)))
    assert ends[1] == pytest.approx(ends[0], abs=1e-3)


def test_a_sheet_stops_from_both_sides_half_its_thickness_away(tmp_path):
    path = obj(tmp_path, [[-2, 0, -2], [2, 0, -2], [2, 0, 2], [-2, 0, 2]], [(0, 1, 2), (0, 2, 3)])
    sheet = {"type": "mesh", "file": path, "thickness": 0.02, "restitution": 0, "friction": 1}
    for way in (1.0, -1.0):
        sim = simulate(start((0.1, way, 0.3)), colliders=[sheet], gravity=(0, -way * G, 0))
        sim.run(2.0)
        (x,), (v,) = state(sim)
        assert x == pytest.approx([0.1, 0.01 * way, 0.3], abs=1e-4) and (v == 0).all()


@pytest.mark.parametrize("native", [True, False])
def test_a_cramped_tube_with_endless_friction_stays_finite(native):
    """Found by random scenes: speeds whose square is no number any more."""
    tube = {"type": "capsule", "start": [0.0057, -0.0235, 0.0101], "end": [-0.019, -0.0208, 0.0022], "radius": 0.00144}
    tube |= {"side": "inside", "restitution": 0.0, "friction": 1000.0, "rotation": [44.1, 41.3, -14.0]}
    born = emitter(300, shape={"type": "sphere", "center": [-0.007, -0.022, 0.006], "radius": 0.016}, velocity={"cone": 180, "speed": 0.36})
    sim = simulate(born, colliders=[tube], gravity=(0, -G, 0), solver="rk4", substeps=2, native=native)
    sim.run(0.2)
    assert len(state(sim)[0]) == 300 and np.isfinite(state(sim)[0]).all()
