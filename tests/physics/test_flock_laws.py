"""Laws of flocks: what is seen and conserved, how alignment decays, where a pair rests, limits, starlings for long."""

import os

import numpy as np
import pytest

from tests.kernels.flocks import flock
from warpsim import Simulation, load_scene
from warpsim.scene import Scene

QUIET = {"separation": 0, "cohesion": 0, "alignment": 0}
STARLING_FRAMES = int(os.environ.get("WARPSIM_STARLING_FRAMES", "40"))


def ball(count, seed, radius=1.0, axes=3):
    """Points uniform in a ball, or in a disc of the plane z = 0."""
    rng = np.random.default_rng(seed)
    x = rng.normal(size=(count, 3))
    x[:, axes:] = 0.0
    return x / np.linalg.norm(x, axis=1)[:, None] * radius * rng.random((count, 1)) ** (1.0 / axes)


@pytest.mark.parametrize("half", [30.0, 90.0, 135.0, 170.0])
@pytest.mark.parametrize("axes", [2, 3])
def test_a_field_of_view_sees_its_share_of_the_plane_and_of_space(half, axes, tmp_path):
    """Half-angle θ: θ/π of a plane, (1 − cosθ)/2 of space; of 20 000 others all round, within 4 standard deviations of a binomial."""
    x, count = ball(20_000, int(half), 0.9, axes), 20_000
    v = np.zeros((count + 1, 3))
    v[0] = [0.3, -0.9, 0.4 if axes == 3 else 0.0]
    view = {"radius": 1.0, "field_of_view": 2 * half}
    sim = Simulation(flock(tmp_path, np.concatenate([[[0, 0, 0]], x]), v, perception=view, **QUIET), device="cpu")
    sim.seek(1)
    share = half / 180 if axes == 2 else (1 - np.cos(np.radians(half))) / 2
    assert abs(sim.systems["f"].population.host("neighbors")[0] / count - share) < 4 * np.sqrt(share * (1 - share) / count)


def test_separation_all_round_conserves_momentum(tmp_path):
    """With 360 degrees each sees who sees it, and pushes are opposite; a view ahead breaks that, and the sum tells."""
    x = ball(400, 1, 1.5)
    v = np.random.default_rng(2).normal(size=(400, 3))
    drift = {}
    for view in (360, 200):
        keys = QUIET | {"separation": 0.05, "perception": {"radius": 0.8, "field_of_view": view}}
        sim = Simulation(flock(tmp_path, x, v, **keys), device="cpu")
        before = sim.frame()["f"].velocity.astype(float)
        sim.seek(60)
        after = sim.frame()["f"].velocity.astype(float)
        drift[view] = np.abs((after - before).sum(axis=0)).max() / np.linalg.norm(after - before, axis=1).sum()
    # 60 roundings of 400 sums, each of some tens of pushes: 2^-24 of what acts, the root of their number times.
    assert drift[360] < 1e-6 < 1e-3 < drift[200]


def test_alignment_of_all_with_all_decays_as_exponential(tmp_path):
    """v' = w (Σ_{j≠i} v_j/(N−1) − v_i)/m: the mean stays, deviations fall as exp(−w N/(N−1) t/m); by kicks as (1 − w N h/((N−1) m))^n."""
    n, w, m, fps, steps = 50, 3.0, 1.5, 240, 240
    x, v = ball(n, 3, 0.2), np.random.default_rng(4).normal(size=(n, 3)) * 0.1 + [0.4, 0, 0.2]
    keys = QUIET | {"alignment": w, "mass": m, "perception": {"radius": 50.0}}
    sim = Simulation(flock(tmp_path, x, v, fps=fps, **keys), device="cpu")
    start = sim.frame()["f"].velocity.astype(float)
    sim.seek(steps)
    end = sim.frame()["f"].velocity.astype(float)
    assert np.abs(end.mean(axis=0) - start.mean(axis=0)).max() < 1e-6
    rate = w * n / (n - 1) / m
    before, after = start - start.mean(axis=0), end - end.mean(axis=0)
    for law, tolerance in ((1 - rate / fps) ** steps, 1e-5), (np.exp(-rate * steps / fps), 0.5 * rate**2 / fps * 1.1):
        assert np.abs(after - law * before).max() < tolerance * law * np.abs(before).max() + 1e-6


@pytest.mark.parametrize("boundary", ["none", "periodic"])
def test_who_is_alone_feels_nothing(boundary, tmp_path):
    """Two out of each other's sight go straight on, to the bit: the same kicks of nothing."""
    domain = {"min": [-8, -8, -8], "max": [8, 8, 8], "boundary": boundary}
    x, v = np.array([[-2.0, 0, 0], [2.0, 0, 0]]), np.array([[0, 0.5, 0.25], [0, -0.5, 0.25]])
    sim = Simulation(flock(tmp_path, x, v, domain=domain, fps=64), device="cpu")
    sim.seek(128)
    np.testing.assert_array_equal(sim.frame()["f"].velocity, v.astype(np.float32))
    np.testing.assert_array_equal(sim.frame()["f"].position, (x + 2 * v).astype(np.float32))  # binary fractions: no rounding


@pytest.mark.parametrize(("separation", "cohesion"), [(1.0, 1.0), (0.5, 4.0), (2.0, 1.0)])
def test_a_pair_rests_at_the_root_of_the_weights(separation, cohesion, tmp_path):
    """F = ws/d − wc d = 0 at d = √(ws/wc); alignment of 2 kg/s takes the swing away within 30 s."""
    keys = {"separation": separation, "cohesion": cohesion, "alignment": 2.0, "perception": {"radius": 4.0}}
    sim = Simulation(flock(tmp_path, [[-0.5, 0, 0.1], [0.6, 0.2, 0]], **keys), device="cpu")
    sim.seek(1800)
    x, v = sim.frame()["f"].position.astype(float), sim.frame()["f"].velocity
    assert abs(np.linalg.norm(x[1] - x[0]) - np.sqrt(separation / cohesion)) < 1e-5 and np.abs(v).max() < 1e-5


def test_two_at_one_place_part_as_far_as_documented(tmp_path):
    """As if a thousandth of the radius apart: the first kick is h ws/(m 1e-3 R) each, in opposite directions."""
    keys = QUIET | {"separation": 1e-3, "mass": 2.0, "perception": {"radius": 0.5}}
    sim = Simulation(flock(tmp_path, np.full((2, 3), 0.25), **keys), device="cpu")
    sim.seek(1)
    v = sim.frame()["f"].velocity.astype(float)
    np.testing.assert_allclose(np.linalg.norm(v, axis=1), 1e-3 / (2.0 * 60 * 1e-3 * 0.5), rtol=1e-6)
    np.testing.assert_array_equal(v[0], -v[1])


def history(sim, frames):
    """Velocities (frames + 1, n, 3), those at the start first."""
    found = [sim.frame()["f"].velocity.astype(float)]
    for _ in range(frames):
        sim.step_frame()
        found.append(sim.frame()["f"].velocity.astype(float))
    return np.array(found)


CROWD = {"perception": {"radius": 0.8}, "separation": 3, "cohesion": 3, "alignment": 3}


def test_the_largest_force_holds(tmp_path):
    """|Δv| ≤ h F/m, and is reached: nothing else acts."""
    x, v = ball(300, 5), np.random.default_rng(6).normal(size=(300, 3))
    found = history(Simulation(flock(tmp_path, x, v, max_force=1.5, mass=0.5, **CROWD), device="cpu"), 60)
    most = np.linalg.norm(np.diff(found, axis=0), axis=2).max()
    assert most == pytest.approx(1.5 / 0.5 / 60, rel=1e-4)  # differences of velocities of some m/s, rounded to 2^-23 of those


def angles(found):
    a, b = found[:-1], found[1:]
    cross, dot = np.linalg.norm(np.cross(a, b), axis=2), (a * b).sum(axis=2)
    return np.degrees(np.arctan2(cross, dot))


@pytest.mark.parametrize("substeps", [1, 3])
def test_the_largest_turn_and_the_band_of_speeds_hold(substeps, tmp_path):
    """Whatever the substeps: 90 degrees/s are 1.5 degrees a frame, reached by boids that crowd; speeds stay in the band to rounding."""
    x, v = ball(300, 7), np.random.default_rng(8).normal(size=(300, 3))
    scene = flock(tmp_path, x, v, turn_rate=90, speed=[1.0, 1.5], substeps=substeps, **CROWD)
    found = history(Simulation(scene, device="cpu"), 90)[2:]  # the first steps bring everybody into the band
    assert angles(found).max() == pytest.approx(1.5, rel=1e-3)
    speed = np.linalg.norm(found, axis=2)
    assert speed.min() > 1.0 - 1e-6 and speed.max() < 1.5 + 1e-6


def test_without_limits_nothing_is_limited(tmp_path):
    """One strong push: the velocity is what the kick makes of it."""
    keys = QUIET | {"separation": 1e4, "perception": {"radius": 1.0}}
    sim = Simulation(flock(tmp_path, [[0, 0, 0], [0.5, 0, 0]], [[1.0, 0, 0], [0, 1.0, 0]], **keys), device="cpu")
    sim.seek(1)
    np.testing.assert_allclose(sim.frame()["f"].velocity, [[1 - 2e4 / 60, 0, 0], [2e4 / 60, 1, 0]], rtol=1e-6, atol=1e-4)


def starlings(count=None, colliders=()) -> Scene:
    document = load_scene("starlings").model_dump(by_alias=True, exclude={"verify"})
    document["colliders"] = list(colliders)
    if count:
        document["systems"]["starlings"]["count"] = count
    return Scene.model_validate(document)


ROCK = {"type": "sphere", "center": [0, 30, 0], "radius": 9, "restitution": 0.2}


@pytest.mark.parametrize("colliders", [(), (ROCK,)], ids=["air", "rock"])
def test_starlings_stay_in_their_sky_their_band_and_out_of_the_rock(colliders):
    """WARPSIM_STARLING_FRAMES=2000 is the whole: 20 000 of them; here 2 000 for 40 frames, round a rock in the middle of their way."""
    sim = Simulation(starlings(None if STARLING_FRAMES >= 2000 else 2000, colliders), device="cpu")
    spec = sim.scene.systems["starlings"]
    low, high = np.float32(spec.domain.min), np.float32(spec.domain.max)
    slowest, fastest = spec.speed
    near = 0
    for index in range(STARLING_FRAMES):
        sim.step_frame()
        x, v = sim.frame()["starlings"].position, sim.frame()["starlings"].velocity.astype(float)
        assert np.isfinite(x).all() and np.isfinite(v).all(), index
        assert ((x >= low) & (x <= high)).all(), index
        speed = np.linalg.norm(v, axis=1)
        if colliders:
            gap = np.linalg.norm(x.astype(float) - ROCK["center"], axis=1) - ROCK["radius"]
            assert gap.min() > 0.0, index  # who starts in the rock is out of it after the first step
            near += int((gap < fastest / 60).sum())
            speed = speed[gap >= fastest / 60]  # the rock takes what its restitution says; the next step gives it back
        assert speed.min() > slowest * (1 - 1e-6) and speed.max() < fastest * (1 + 1e-6), index
    assert near > 0 or not colliders
