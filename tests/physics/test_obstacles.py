"""Obstacles: nothing flows through them, whatever the flow; the classical facts about a cylinder in a stream.

The circle theorem and the mirror are exact; what is measured is float32: a dozen roundings of 6e-8 of the terms that cancel at the surface.
"""

import numpy as np
import pytest

from tests.physics.scenes import scene, simulate, start
from tests.reference.flow import Primitive
from tests.reference.obstacles import before_walls, round_cylinder
from warpsim import Simulation, load_scene
from warpsim.changes import FixedField
from warpsim.images import CylinderImages, WallImages
from warpsim.scene.obstacles import Cylinder, Wall

AXIS, ALONG = np.array([1, 2, -2]) / 3, np.array([2, 1, 2]) / 3
SIDE = np.cross(AXIS, ALONG)
CENTER, RADIUS, SPEED = np.array([0.3, -0.2, 0.5]), 0.6, 1.3
THETA = np.linspace(0.0, 2.0 * np.pi, 721)
OUTWARD = np.outer(np.cos(THETA), ALONG) + np.outer(np.sin(THETA), SIDE)
SURFACE = CENTER + RADIUS * OUTWARD + 0.7 * AXIS


def line(kind: str, place, **keys) -> dict:
    return {"type": kind, "center": (CENTER + place).tolist(), "axis": AXIS.tolist()} | keys


STREAM = {"type": "uniform", "velocity": (SPEED * ALONG + 0.4 * AXIS).tolist()}
FLOWS = {
    "uniform": STREAM,
    "source": line("source", 1.1 * SIDE - 0.3 * AXIS, rate=2.0),
    "vortex": line("vortex", -1.2 * ALONG, circulation=-3.0),
    "opposite": line("vortex", 0.9 * ALONG + 0.4 * SIDE, circulation=2.0) | {"axis": (-AXIS).tolist()},
    "rankine": line("vortex", 0.8 * SIDE, circulation=2.0, core={"model": "rankine", "radius": 0.5}),
    "lamb_oseen": line("vortex", 0.8 * SIDE, circulation=2.0, core={"model": "lamb_oseen", "radius": 0.5}),
    "scully": line("vortex", 0.8 * SIDE, circulation=2.0, core={"model": "scully", "radius": 0.5}),
    "doublet": line("doublet", 0.7 * ALONG - 0.7 * SIDE, direction=(SIDE + 0.3 * ALONG).tolist(), strength=0.7),
}
CYLINDER = {"type": "cylinder", "center": CENTER.tolist(), "axis": (3.0 * AXIS).tolist(), "radius": RADIUS}


def probe(flow, *obstacles):
    return simulate(flow=flow, obstacles=obstacles).flow


def twin_of(document: dict) -> Primitive:
    fields = {key: document[key] for key in ("center", "axis", "direction") if key in document}
    strength = next(document[key] for key in ("velocity", "rate", "circulation", "strength") if key in document)
    return Primitive(document["type"], tuple(strength) if isinstance(strength, list) else strength, **fields)


@pytest.mark.parametrize("names", [*([name] for name in FLOWS), list(FLOWS)], ids="-".join)
@pytest.mark.parametrize("circulation", [0.0, 1.5])
def test_nothing_flows_through_a_cylinder(names, circulation):
    """With every core, and along the axis the stream goes on as it was."""
    flow = probe([FLOWS[name] for name in names], CYLINDER | {"circulation": circulation})
    velocity = flow.sample(SURFACE).astype(float)
    assert np.linalg.norm(velocity, axis=1).max() > 0.1, "there is a flow"
    assert np.abs((velocity * OUTWARD).sum(axis=1)).max() < 1e-5 * SPEED
    assert np.abs(velocity @ AXIS - (0.4 if "uniform" in names else 0.0)).max() < 1e-5 * SPEED
    assert abs(flow.flux(CENTER, AXIS, 1.0001 * RADIUS)) < 1e-5


def test_the_flow_round_a_cylinder_is_that_of_the_circle_theorem(rng):
    ideal = [document for document in FLOWS.values() if "core" not in document]
    flow = probe(ideal, CYLINDER | {"circulation": 1.5})
    angle, distance = rng.uniform(0, 2 * np.pi, 300), RADIUS * rng.uniform(1.0, 4.0, 300)
    points = CENTER + np.outer(distance * np.cos(angle), ALONG) + np.outer(distance * np.sin(angle), SIDE)
    points = (points + np.outer(rng.uniform(-1, 1, 300), AXIS)).astype(np.float32)
    twins = [twin_of(document) for document in ideal]
    exact = np.array([round_cylinder(twins, CENTER, AXIS, RADIUS, 1.5, x) for x in points])
    # a place is known to 6e-8 of 3 m; 0.02 m from a singularity, the nearest point drawn here, that is 1e-5 of it
    np.testing.assert_allclose(flow.sample(points), exact, rtol=3e-5, atol=3e-6)


def test_the_circulation_round_a_cylinder_is_its_own():
    """Of a vortex outside it the images add up to none; that is theirs as far as its core stays away."""
    flow = probe([FLOWS["uniform"], FLOWS["vortex"], FLOWS["opposite"], FLOWS["doublet"]], CYLINDER | {"circulation": 1.5})
    assert flow.circulation(CENTER, AXIS, 1.001 * RADIUS) == pytest.approx(1.5, abs=1e-5)
    assert flow.circulation(CENTER, AXIS, 5.0) == pytest.approx(1.5 - 3.0 - 2.0, abs=1e-4)


def test_the_speed_on_a_cylinder_in_a_stream_is_twice_the_streams_at_its_sides():
    velocity = probe([{"type": "uniform", "velocity": (SPEED * ALONG).tolist()}], CYLINDER).sample(SURFACE).astype(float)
    assert np.abs(np.linalg.norm(velocity, axis=1) - 2.0 * SPEED * np.abs(np.sin(THETA))).max() < 1e-5 * SPEED


@pytest.mark.parametrize("share", [0.3, 0.8, -0.8])
def test_stagnation_points_move_with_the_circulation(share):
    """sin θ = Γ/(4πUR), θ from downstream, right-handed about the axis like Γ."""
    stream = [{"type": "uniform", "velocity": (SPEED * ALONG).tolist()}]
    flow = probe(stream, CYLINDER | {"circulation": share * 4.0 * np.pi * SPEED * RADIUS})
    around = np.cross(AXIS, OUTWARD)
    speed = (flow.sample(SURFACE).astype(float) * around).sum(axis=1)
    exact = np.sort(np.mod([np.arcsin(share), np.pi - np.arcsin(share)], 2.0 * np.pi))
    assert np.abs(flow.sample([CENTER + RADIUS * (np.cos(t) * ALONG + np.sin(t) * SIDE) for t in exact])).max() < 1e-5 * SPEED
    crossings = np.flatnonzero(np.sign(speed[:-1]) != np.sign(speed[1:]))
    found = [THETA[k] + (THETA[k + 1] - THETA[k]) * speed[k] / (speed[k] - speed[k + 1]) for k in crossings]
    # linear between samples half a degree apart: (1/2) tan θ (π/720)² of an angle at most, 1.3e-5; and the rounding of the speeds
    np.testing.assert_allclose(found, exact, atol=3e-5)


def test_with_more_circulation_the_stagnation_point_leaves_the_cylinder():
    """At θ = ±90°, r/R = s + √(s² − 1), s = Γ/(4πUR) > 1."""
    for s in (1.5, -1.5):
        circulation = s * 4.0 * np.pi * SPEED * RADIUS
        flow = probe([{"type": "uniform", "velocity": (SPEED * ALONG).tolist()}], CYLINDER | {"circulation": circulation})
        r = RADIUS * (abs(s) + np.sqrt(s * s - 1.0))
        assert np.abs(flow.sample([CENTER + np.sign(s) * r * SIDE])).max() < 1e-5 * SPEED
        assert np.linalg.norm(flow.sample(SURFACE), axis=1).min() > 0.5 * SPEED


WALL = {"type": "wall", "center": [0.2, -0.4, 0.1], "normal": (2.0 * SIDE).tolist()}
OTHER = {"type": "wall", "center": [-1.0, 0.3, 0.2], "normal": ALONG.tolist()}
FLOOR = {"type": "wall", "center": [0.0, -2.0, 0.0], "normal": AXIS.tolist()}
POINT = {"type": "point_source", "center": (CENTER + 0.4 * SIDE).tolist(), "rate": -2.5}
BEFORE = {name: FLOWS[name] for name in ("uniform", "source", "rankine", "lamb_oseen", "scully")} | {
    "vortex": line("vortex", 0.4 * SIDE, circulation=-3.0),
    "doublet": line("doublet", 0.7 * SIDE + 0.2 * ALONG, direction=(SIDE + 0.3 * ALONG).tolist(), strength=0.7),
    "slanting": line("vortex", 0.5 * SIDE, circulation=1.0) | {"axis": (AXIS + 0.4 * ALONG).tolist()},
    "standing": line("vortex", 0.2 * SIDE + 0.5 * ALONG, circulation=1.0) | {"axis": SIDE.tolist()},
    "point_source": POINT,
    "vortex_segment": {
        "type": "vortex_segment",
        "start": (CENTER + 0.4 * SIDE).tolist(),
        "end": (CENTER + 0.9 * SIDE + 0.6 * ALONG - 0.3 * AXIS).tolist(),
        "circulation": 3.0,
        "core": {"model": "lamb_oseen", "radius": 0.4},
    },
    "vortex_ring": {
        "type": "vortex_ring",
        "center": (CENTER + 0.9 * SIDE).tolist(),
        "normal": (SIDE + ALONG).tolist(),
        "radius": 0.5,
        "circulation": 3.0,
        "core": {"model": "scully", "radius": 0.2},
    },
    "traveling": line("vortex", 0.35 * SIDE, circulation=3.0, travel=[{"expression": f"t*({x:.6f})"} for x in (0.4 * SIDE + 0.2 * ALONG)]),
}


def on_wall(wall: dict, rng) -> np.ndarray:
    """Points of a wall, not farther out than 3 m, where the flow is strong enough to tell something from nothing."""
    n = np.asarray(wall["normal"]) / np.linalg.norm(wall["normal"])
    free = rng.uniform(-2.0, 2.0, (400, 3))
    return np.asarray(wall["center"]) + free - np.outer(free @ n, n)


@pytest.mark.parametrize("names", [*([name] for name in BEFORE), list(BEFORE)], ids=lambda names: "-".join(names)[:24])
def test_nothing_flows_through_a_wall(names, rng):
    flow = probe([BEFORE[name] for name in names], WALL)
    velocity = flow.sample(on_wall(WALL, rng)).astype(float)
    assert np.linalg.norm(velocity, axis=1).max() > 0.1, "there is a flow"
    assert np.abs(velocity @ SIDE).max() < 1e-5 * SPEED
    assert np.abs(flow.sample(on_wall(WALL, rng), time=1.7).astype(float) @ SIDE).max() < 1e-5 * SPEED


@pytest.mark.parametrize("walls", [[WALL], [WALL, OTHER], [OTHER, WALL, FLOOR]], ids=len)
def test_the_flow_before_walls_is_the_mirrored_one(walls, rng):
    """Among three walls no line has both sides free: there, what has no axis."""
    names = ["uniform", "source", "vortex", "doublet", "point_source"] if len(walls) < 3 else ["uniform", "point_source"]
    names += ["slanting", "standing"] if len(walls) == 1 else []
    documents = [BEFORE[name] for name in names]
    flow = probe(documents, *walls)
    points = (CENTER + 2.0 * SIDE + rng.uniform(-0.4, 0.4, (200, 3)) @ np.array([AXIS, SIDE, ALONG])).astype(np.float32)
    twins = [twin_of(document) for document in documents]
    planes = [(wall["center"], wall["normal"]) for wall in walls]
    exact = np.array([standing_alone(twins, planes, x) for x in points])
    np.testing.assert_allclose(flow.sample(points), exact, rtol=3e-5, atol=5e-6)
    for wall in walls:
        through = flow.sample(on_wall(wall, rng)).astype(float) @ (np.asarray(wall["normal"]) / np.linalg.norm(wall["normal"]))
        assert np.abs(through).max() < 1e-5 * SPEED


def standing_alone(twins, planes, x) -> np.ndarray:
    """The twin, which knows of lines that stand on a wall only that they are left alone."""
    standing = [p for p in twins if p.type == "vortex" and abs(np.dot(p.axis, SIDE)) > 0.999]
    rest = [p for p in twins if p not in standing]
    return before_walls(rest, planes, x) + before_walls(standing, [], x)


@pytest.mark.parametrize("share", [0.0, 0.4, -0.9, 1.7])
def test_a_turning_cylinder_is_lifted_and_not_dragged(share):
    """Kutta and Joukowski: ρ Γ U × a; d'Alembert: nothing along the stream. Rounding: 1e-7 of the pressures, 2ρU²(1 + Γ/4πUR)² times 2R."""
    density, circulation = 1.2, share * 4.0 * np.pi * SPEED * RADIUS
    stream = SPEED * ALONG
    flow = probe([{"type": "uniform", "velocity": stream.tolist()}], CYLINDER | {"circulation": circulation})
    force = flow.pressure_force(CENTER, AXIS, RADIUS, density)
    scale = 4.0 * density * SPEED**2 * (1.0 + abs(share)) ** 2 * RADIUS
    assert np.abs(force - density * circulation * np.cross(stream, AXIS)).max() < 1e-6 * scale


def test_a_source_draws_a_cylinder_to_it():
    """Force ρV²/(2π) R²/(b(b² − R²)) towards a source at distance b, whatever its sign: by Blasius' theorem."""
    for rate in (2.0, -2.0):
        flow = probe(
            [{"type": "source", "center": [1.5, 0, 0], "axis": [0, 0, 1], "rate": rate}],
            CYLINDER | {"center": [0, 0, 0], "axis": [0, 0, 1]},
        )
        expect = 1.2 * rate**2 / (2.0 * np.pi) * RADIUS**2 / (1.5 * (1.5**2 - RADIUS**2))
        assert flow.pressure_force([0, 0, 0], [0, 0, 1], RADIUS, 1.2) == pytest.approx([expect, 0, 0], abs=1e-6)


def test_foeppls_vortices_stand_behind_the_cylinder():
    """Where r² − R² = 2ry, with 2πU(r² − R²)²(r² + R²)/r⁵: the flow is at rest in their cores. Source: Föppl 1913."""
    document = load_scene("cylinder_flow")
    wind, above, below = document.flow
    r, R = np.hypot(*above.center[:2]), document.obstacles[0].radius
    assert r * r - R * R == pytest.approx(2.0 * r * above.center[1], rel=1e-7)
    strength = 2.0 * np.pi * wind.velocity[0] * (r * r - R * R) ** 2 * (r * r + R * R) / r**5
    assert below.circulation == -above.circulation == pytest.approx(strength, rel=1e-7)
    sim = Simulation(document.model_copy(update={"systems": {}}), device="cpu", threads=1)
    assert np.abs(sim.flow.sample([above.center, below.center])).max() < 1e-6  # terms of 5 m/s that cancel


def test_a_segment_that_stands_on_a_wall_goes_on_behind_it():
    """Its image is its continuation: together they are one segment of twice the length."""
    up = {"type": "vortex_segment", "start": [0.3, 0, 0], "end": [0.3, 1, 0], "circulation": 2.0}
    points = np.random.default_rng(4).uniform([-1, 0, -1], [1, 2, 1], (100, 3))
    whole = probe([up | {"start": [0.3, -1, 0]}]).sample(points)
    np.testing.assert_allclose(probe([up], {"type": "wall"}).sample(points), whole, rtol=1e-5, atol=1e-6)


def test_the_pair_of_the_wall_scene_goes_where_the_flow_carries_it():
    """Each vortex moves with the flow in its middle, which is that of the other and of the images; differences over 2 ms, h²x‴/6."""
    document = load_scene("wall").model_copy(update={"systems": {}, "verify": ()})
    sim = Simulation(document, device="cpu", threads=1)
    a, rate = 0.7, 3.0 / (4.0 * np.pi * 0.7**2)

    def place(t):
        s = rate * (t - 5.0) / np.hypot(1.0, rate * (t - 5.0))
        return np.array([a / np.sqrt(1.0 - s), a / np.sqrt(1.0 + s), 0.0])

    for t in (0.0, 2.0, 5.0, 6.5, 9.0):
        speed = (place(t + 0.001) - place(t - 0.001)) / 0.002
        # the middle lies within 1e-6 m (the rate has eight digits in the scene); there the flow changes by Γ/(2πR²) = 21/s times that
        assert sim.flow.sample([place(t)], time=t)[0] == pytest.approx(speed, abs=1e-4)


def test_strengths_that_vary_are_answered_at_every_moment():
    """A wind that turns, a vortex and a circulation that swing."""
    wind = {"type": "uniform", "velocity": [{"expression": "cos(t)"}, {"expression": "sin(t)"}, 0.0]}
    swing = {"type": "vortex", "center": [0, 2, 0], "axis": [0, 0, 1], "circulation": {"sine": {"amplitude": 2.0, "period": 3.0}}}
    body = {"type": "cylinder", "axis": [0, 0, 1], "radius": 1.0, "circulation": {"keyframes": [[0, 0], [4, 8]]}}
    flow = probe([wind, swing], body)
    outward = np.stack([np.cos(THETA), np.sin(THETA), 0.0 * THETA], axis=1)
    for t in (0.0, 0.7, 2.0, 4.0):
        velocity = flow.sample(outward, time=t).astype(float)
        assert np.abs((velocity * outward).sum(axis=1)).max() < 1e-5
        assert flow.circulation([0, 0, 0], [0, 0, 1], 1.001, time=t) == pytest.approx(2.0 * t, abs=1e-5)


def test_a_change_while_it_runs_moves_the_images():
    document = scene(start([0, 3, 0]), flow=[{"name": "wind"} | STREAM], obstacles=[{"name": "body"} | CYLINDER], coupling="tracer")
    sim = Simulation(document, device="cpu", threads=1)
    sim.step_frame()
    sim.change("obstacles.body.radius", 0.9)
    sim.change("flow.wind.velocity.0", 2.0)
    sim.change("obstacles.body.circulation", 1.0)
    velocity = sim.flow.sample(CENTER + 0.9 * OUTWARD).astype(float)
    assert np.abs((velocity * OUTWARD).sum(axis=1)).max() < 2e-5
    fresh = probe([STREAM | {"velocity": [2.0, *STREAM["velocity"][1:]]}], CYLINDER | {"radius": 0.9, "circulation": 1.0})
    assert np.array_equal(sim.flow.sample(SURFACE), fresh.sample(SURFACE))
    sim.step_frame()
    with pytest.raises(FixedField, match="answers"):
        sim.change("obstacles.body.answers", False)


def test_tracers_pass_a_cylinder_without_touching_it(rng):
    """The streamline that parts at the front stays outside: 5 s of rk4 at 1/240 s, whose error h^4 v^(5) is below 1e-8 m a second."""
    points = [start([-2.0, y, 0.0]) for y in np.linspace(-1.0, 1.0, 41)]
    sim = simulate(
        *points,
        flow=[{"type": "uniform", "velocity": [1.0, 0, 0]}],
        obstacles=[{"type": "cylinder", "axis": [0, 0, 1], "radius": 0.6, "circulation": 2.0}],
        coupling="tracer",
    )
    for frame in sim.frames(300):
        assert np.linalg.norm(frame["p"].position[:, :2], axis=1).min() > 0.6 - 1e-5


def test_who_feels_some_of_the_flow_feels_its_images():
    """The obstacle's own circulation goes by its name, like a primitive."""
    flow = [
        {"name": "wind", "type": "uniform", "velocity": [1, 0, 0]},
        {"type": "source", "center": [0, 3, 0], "axis": [0, 0, 1], "rate": 9},
    ]
    body = {"name": "body", "type": "cylinder", "axis": [0, 0, 1], "radius": 0.5, "circulation": 1.0}
    still = body | {"circulation": 0.0}
    cases = [
        (True, flow, body),
        (["wind"], flow[:1], still),
        (["wind", "body"], flow[:1], body),
        ([1], flow[1:], still),
        (["body"], [], body),
    ]
    for feels, felt, obstacle in [*cases, (False, [], still), ([], [], still)]:
        sim = simulate(start([0, 1, 0]), flow=flow, obstacles=[body], coupling="tracer", feels={"flow": feels})
        assert sim.frame()["p"].velocity[0] == pytest.approx(probe(felt, obstacle).sample([[0, 1, 0]])[0], abs=1e-6), feels


def test_answers_leaves_the_rest_of_the_flow_alone():
    flow = [{"name": "wind", "type": "uniform", "velocity": [1, 0, 0]}, {"name": "turn", "type": "rotation", "angular_velocity": 1.0}]
    body = {"type": "cylinder", "axis": [0, 0, 1], "radius": 0.5, "answers": ["wind"]}
    points = [[0.5, 0, 0], [1, 2, 3]]
    both = probe(flow, body).sample(points)
    assert both == pytest.approx(probe(flow[:1], body | {"answers": True}).sample(points) + probe(flow[1:]).sample(points), abs=1e-6)
    assert np.array_equal(probe(flow, body | {"answers": False}).sample(points), probe(flow).sample(points))


def test_every_kind_that_an_obstacle_answers_has_its_image():
    assert set(CylinderImages.formulas) == Cylinder.answerable
    wall = Wall()
    assert {"uniform", *WallImages(wall).gains} == Wall.answerable
