"""Contact against its twin: distances, first touches, bounces, slides, and where a moving collider is."""

import numpy as np
import pytest
import warp as wp

from tests.reference import collision as reference
from warpsim import Scene, Simulation
from warpsim.kernels import collider, contact, response
from warpsim.kernels.clearance import CLEARANCES, SKIN, measure_clearance, measure_gap
from warpsim.kernels.collider import Collider
from warpsim.kernels.collision import out_of_reach
from warpsim.kernels.contact import Touch, touch_collider

SOLIDS = {
    "plane": {"type": "plane", "normal": [1.0, 2.0, -0.5]},
    "sphere": {"type": "sphere", "radius": 0.7},
    "box": {"type": "box", "size": [1.0, 0.6, 1.4]},
    "capsule": {"type": "capsule", "half": [0.4, 0.2, -0.3], "radius": 0.35},
}
SIDES = [(kind, "outside") for kind in SOLIDS] + [(kind, "inside") for kind in ("sphere", "box", "capsule")]
each_side = pytest.mark.parametrize(("kind", "side"), SIDES)
DURATION = 0.3


def row(solid: dict, **numbers) -> Collider:
    c = Collider()
    c.kind, c.inside = list(CLEARANCES).index(solid["type"]), int(solid.get("side") == "inside")
    c.radius = solid.get("radius", 0.0)
    c.axis = wp.vec3(*solid.get("half", (0.0, 0.0, 0.0)))
    if "normal" in solid:
        c.axis = wp.normalize(wp.vec3(*solid["normal"]))
    c.half = wp.vec3(*(0.5 * edge for edge in solid.get("size", (0.0, 0.0, 0.0))))
    for name, value in numbers.items():
        setattr(c, name, value)
    return c


@wp.kernel
def measure_all(c: Collider, q: wp.array[wp.vec3], g_out: wp.array[float], bound_out: wp.array[float], n_out: wp.array[wp.vec3]):
    i = wp.tid()
    gap = measure_gap(c, q[i])
    g_out[i] = gap.g
    n_out[i] = gap.n
    bound_out[i] = measure_clearance(c, q[i])


@wp.kernel
def touch_all(c: Collider, q: wp.array[wp.vec3], w: wp.array[wp.vec3], a: wp.array[wp.vec3], skin: float, touch_out: wp.array[Touch]):
    i = wp.tid()
    touch_out[i] = touch_collider(c, q[i], w[i], a[i], wp.static(DURATION), skin)


@wp.kernel
def note_out_of_reach(c: Collider, q: wp.array[wp.vec3], w: wp.array[wp.vec3], a: wp.array[wp.vec3], out_out: wp.array[int]):
    i = wp.tid()
    out_out[i] = out_of_reach(c, q[i], (wp.length(w[i]) + 0.5 * wp.length(a[i]) * wp.static(DURATION)) * wp.static(DURATION))


def measured(solid: dict, points: np.ndarray, device) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    q = wp.array(points, dtype=wp.vec3, device=device)
    g, bound, n = (wp.zeros(len(points), dtype=kind, device=device) for kind in (float, float, wp.vec3))
    wp.launch(measure_all, len(points), [row(solid), q, g, bound, n], device=device)
    return g.numpy(), bound.numpy(), n.numpy()


@each_side
def test_gaps_and_normals_match_the_definition(kind, side, device, rng):
    """Roundings of numbers of 2 m: 1e-6. The normal's twin is a difference over 1e-6 m; beside edges of the distance it has none."""
    solid, points = SOLIDS[kind] | {"side": side}, rng.uniform(-1.2, 1.2, (200, 3))
    g, bound, n = measured(solid, points, device)
    expected = np.array([reference.gap(solid, q) for q in points])
    np.testing.assert_allclose(g, expected, atol=1e-6)
    np.testing.assert_allclose(bound, expected, atol=1e-6)
    direct = np.array([reference.normal(solid, q) for q in points])
    smooth = np.abs([np.linalg.norm(reference.normal(solid, q, 1e-3)) - 1.0 for q in points]) < 1e-9
    parallel = np.einsum("ij,ij->i", n, direct)
    assert (parallel[smooth] > 0.999).mean() > 0.97, "but for points beside a ridge of the distance"


@each_side
def test_first_touches_match_a_search(kind, side, device, rng):
    """Within the time that the skin takes at the point's normal speed, which is bounded below by taking clear hits only."""
    solid = SOLIDS[kind] | {"side": side}
    reach = 0.5 if side == "inside" else 1.5
    q = rng.uniform(-reach, reach, (400, 3))
    q = q[[reference.gap(solid, point) > 1e-3 for point in q]][:40]
    w, a = rng.normal(size=q.shape) * 2.0 - 4.0 * q, rng.normal(size=q.shape) * 10.0
    skin = SKIN * 2.0
    touches = wp.zeros(len(q), dtype=Touch, device=device)
    arrays = [wp.array(x, dtype=wp.vec3, device=device) for x in (q, w, a)]
    wp.launch(touch_all, len(q), [row(solid), *arrays, skin, touches], device=device)
    found, hits = touches.numpy(), 0
    for k in range(len(q)):
        t = reference.first_touch(solid, q[k], w[k], a[k], DURATION)
        if t is None:
            later = reference.first_touch(solid, q[k], w[k], a[k], 1.02 * DURATION)
            grazes = min(reference.gap(solid, q[k] + w[k] * s + 0.5 * a[k] * s * s) for s in np.linspace(0, DURATION, 200)) < 1e-4
            assert found[k]["t"] > DURATION or grazes or later, k
            continue
        at, v = q[k] + w[k] * t + 0.5 * a[k] * t * t, w[k] + a[k] * t
        into = -(reference.normal(solid, at) @ v)
        hits += 1
        assert found[k]["t"] <= t + 1e-6, "never late: it would be inside"
        assert found[k]["t"] == pytest.approx(t, abs=(3 * skin + 2e-6) / max(into, 0.05)), k
        assert -skin < reference.gap(solid, found[k]["q"]) < 2 * skin
    assert hits > 8


@each_side
def test_who_is_out_of_reach_is_not_touched(kind, side, device, rng):
    """A contact leaves such solids out. Ways begin at all distances up to many times their length, and lead anywhere."""
    solid = SOLIDS[kind] | {"side": side}
    q = rng.uniform(-1.0, 1.0, (4000, 3)) * (0.4 if side == "inside" else 1.5)
    speeds = rng.choice([0.02, 0.3, 3.0], (4000, 1))
    w, a = rng.normal(size=q.shape) * speeds, rng.normal(size=q.shape) * speeds * rng.choice([0.1, 5.0], (4000, 1))
    w[::2] = -q[::2] * speeds[::2]  # half of them straight for it
    arrays = [wp.array(x, dtype=wp.vec3, device=device) for x in (q, w, a)]
    touches, out = wp.zeros(len(q), dtype=Touch, device=device), wp.zeros(len(q), dtype=int, device=device)
    one = row(solid, rotation=wp.quat_identity())
    wp.launch(touch_all, len(q), [one, *arrays, SKIN * 2.0, touches], device=device)
    wp.launch(note_out_of_reach, len(q), [one, *arrays, out], device=device)
    touched, left_out = touches.numpy()["t"] <= DURATION, out.numpy() == 1
    assert not (touched & left_out).any()
    assert touched.sum() > 100 and (left_out.sum() > 100) != (side == "inside" and kind != "box")  # round rooms are never left out


def test_every_kind_has_a_clearance():
    assert [getattr(collider, name.upper()) for name in CLEARANCES] == list(range(len(CLEARANCES)))


def test_fall_time_is_the_first_root():
    """Against a search with steps of 2.5e-6 s."""
    for g0, g1, g2, level in ((1.0, -2.0, 0.0, 0.0), (1.0, 0.5, -9.81, 0.2), (0.5, -1.0, 3.0, 0.4), (2.0, 0.0, -1.0, 0.0)):
        t = contact.fall_time(g0, g1, g2, level)
        times = np.linspace(0, 5, 2_000_001)
        below = g0 + g1 * times + 0.5 * g2 * times**2 <= level
        assert t == pytest.approx(times[below.argmax()], abs=5e-6)
    assert contact.fall_time(1.0, 1.0, 0.0, 0.0) == contact.fall_time(1.0, -1.0, 1.0, 0.0) == contact.NEVER


@pytest.mark.parametrize("friction", [0.0, 0.2, 5.0])
def test_bounces_match_and_never_add_energy(friction, rng):
    for restitution in (0.0, 0.4, 1.0):
        n = rng.normal(size=3)
        n /= np.linalg.norm(n)
        w = rng.normal(size=3)
        w -= (w @ n + abs(w @ n)) * n if w @ n > 0 else 0.0
        c = row(SOLIDS["sphere"], restitution=restitution, friction=friction)
        after = np.array(response.bounce(c, wp.vec3(*w), wp.vec3(*n)))
        np.testing.assert_allclose(after, reference.bounce(w, n, restitution, friction), atol=1e-6)
        assert after @ after <= w @ w * (1 + 1e-6)


@pytest.mark.parametrize(
    ("w", "a", "brake"),
    [((1, 0, 0), (0, 0, 0), 2.0), ((1, 0, 0), (0, 0, 0), 0.3), ((0.5, 0, 0), (2, 0, 0), 1.0), ((0, 0, 0), (1, 0, 1), 2.0)],
)
def test_slides_match_small_steps(w, a, brake):
    """Along one line it is exact; the twin's last step is a part of 1e-4."""
    s = response.slide(wp.vec3(*map(float, w)), wp.vec3(*map(float, a)), brake, 0.7)
    way, last = reference.slide(w, a, brake, 0.7, steps=20_000)
    np.testing.assert_allclose(np.array(s.d), way, atol=2e-4)
    np.testing.assert_allclose(np.array(s.w), last, atol=2e-4)


def posed(rotation, time: float) -> tuple[np.ndarray, np.ndarray]:
    """The matrix and the spin [rad/s] of a collider with this rotation, by its table."""
    scene = Scene.model_validate({"name": "t", "colliders": [{"type": "plane", "motion": {"rotation": rotation}}], "systems": {"p": PLAIN}})
    sim = Simulation(scene, device="cpu", threads=1)
    sim.run(time)
    x, y, z, w = sim.frame().collider_poses[0, 3:].astype(float)
    matrix = np.array(wp.quat_to_matrix(wp.quatd(x, y, z, w))).reshape(3, 3)
    return matrix, sim.systems["p"].surroundings.colliders.numpy()["spin"][0, 0]


PLAIN = {"type": "particles", "emitters": []}


def test_rotations_are_about_x_then_y_then_z():
    matrix, spin = posed([20, -50, 110], 0.0)
    np.testing.assert_allclose(matrix, reference.rotation([20, -50, 110]), atol=3e-7)
    assert (spin == 0.0).all()


@pytest.mark.parametrize("rate", [1.0, 300.0, 20_000.0])
def test_spin_is_the_angle_over_the_time(rate):
    """Degrees per second; the last is 42° in half a substep. Roundings, and the series of the arc sine: 1e-5."""
    _, spin = posed([10, 20, {"expression": f"30 + {rate}*t"}], 0.1)
    assert spin == pytest.approx([0.0, 0.0, np.radians(rate)], rel=1e-5, abs=1e-5)


def test_a_frame_ends_where_the_twin_says():
    """A bounce within each of these frames; verlet is exact under gravity, so that only roundings and the skin differ."""
    document = {"name": "b", "colliders": [{"type": "plane", "restitution": 0.8, "friction": 0.0}]}
    emitter = {"shape": {"type": "point", "center": [0.2, 1.0, 0]}, "burst": {"count": 1}, "lifetime": 100}
    document["systems"] = {"p": {"type": "particles", "solver": "verlet", "emitters": [emitter]}}
    sim = Simulation(Scene.model_validate(document), device="cpu", threads=1)
    for frame in sim.frames(150):
        height = reference.bouncing_height(1.0, 0.8, 9.81, frame.time)
        assert frame["p"].position[0, 1] == pytest.approx(height, abs=2e-4), frame.index
