"""Grip: friction that depends on where along its body a point slides; a worm that crawls by it."""

import math

import numpy as np
import pytest
import warp as wp

from tests.simulation.networks import network, simulate, state
from warpsim import Scene, Simulation, load_scene
from warpsim.kernels.response import grip_factor

GROUND = {"colliders": [{"type": "plane", "center": [0, 0, 0], "normal": [0, 1, 0], "restitution": 0, "friction": 0.5}]}
SLED = {"points": [[0.2, 0, 0], [0, 0, 0], [-0.2, 0, 0]], "springs": [[0, 1], [1, 2]], "chains": {"back": [0, 1, 2]}, "stiffness": 200.0}
GRIP = {"chain": "back", "forward": 0.2, "backward": 1.6, "sideways": 0.8}
G = 10.0


@wp.kernel(module="unique")
def sample_factors(headings: wp.array[wp.vec3], slides: wp.array[wp.vec3], grip: wp.vec3, normal: wp.vec3, factor_out: wp.array[float]):
    i = wp.tid()
    factor_out[i] = grip_factor(headings[i], grip, normal, slides[i])


def test_the_factor_is_that_of_the_angle_in_the_surface(device):
    """float32: cos² θ of vectors of any length and inclination, θ in the surface; four roundings of factors below 3."""
    rng = np.random.default_rng(6)
    heading, slide = (rng.normal(size=(100, 3)).astype(np.float32) for _ in range(2))
    arrays = [wp.array(values, dtype=wp.vec3, device=device) for values in (heading, slide)]
    factor = wp.zeros(100, dtype=float, device=device)
    wp.launch(sample_factors, 100, [*arrays, wp.vec3(0.3, 3.0, 1.0), wp.vec3(0.0, 1.0, 0.0)], [factor], device=device)
    angle = np.arctan2(heading[:, 2], heading[:, 0]) - np.arctan2(slide[:, 2], slide[:, 0])
    expected = np.where(np.cos(angle) > 0, 0.3, 3.0) * np.cos(angle) ** 2 + 1.0 * np.sin(angle) ** 2
    assert factor.numpy() == pytest.approx(expected, abs=1e-5)


@pytest.mark.parametrize(("way", "factor"), [((1, 0), 0.2), ((-1, 0), 1.6), ((0, 1), 0.8), ((0, -1), 0.8), ((1, 1), 0.5), ((-1, 1), 1.2)])
def test_a_sled_stops_after_its_own_way(way, factor):
    """v²/(2 μ f g), f by the direction of its slide: exact under constant braking, but for the contact's skin and a substep of 1/480 s."""
    sim = simulate(**SLED, damping=0.5, mass=0.1, grip=GRIP, gravity=(0, -G, 0), substeps=8, more=GROUND)
    sim.run(0.1)
    before, speed = state(sim)[0], 0.8
    velocity = np.zeros((3, 64), np.float32)
    velocity[0, :3], velocity[2, :3] = speed * np.array(way) / math.hypot(*way)
    sim.systems["s"].population.field("velocity").assign(velocity)
    sim.run(2.0)
    moved = (state(sim)[0] - before)[:, [0, 2]]
    expected = speed**2 / (2 * 0.5 * factor * G) * np.array(way) / math.hypot(*way)
    assert moved == pytest.approx(np.tile(expected, (3, 1)), abs=2e-3)
    assert np.abs(state(sim)[1]).max() < 1e-6  # and stays there


def test_bristles_hold_on_a_slope_that_leads_back():
    """tan 20° = 0.36 lies between μ forward = 0.1 and μ backward = 0.8: head up it stays, head down it slides by ½ (tan − μ) g cos t²."""
    slope = math.radians(20)
    pull = (-G * math.sin(slope), -G * math.cos(slope), 0.0)
    down = SLED | {"chains": {"back": [2, 1, 0]}}
    for sled, expected in ((SLED, 0.0), (down, -0.5 * G * (math.sin(slope) - 0.1 * math.cos(slope)))):
        sim = simulate(**sled, damping=0.5, mass=0.1, grip=GRIP, gravity=pull, substeps=8, more=GROUND)
        before = state(sim)[0]
        sim.run(1.0)
        assert (state(sim)[0] - before)[:, 0] == pytest.approx(expected, abs=0.01 * abs(expected) + 2e-4)


@pytest.mark.parametrize("solver", ["semi_implicit_euler", "drift_kick", "verlet"])
def test_parts_and_plain_kernels_share_their_bits_and_earlier_frames_come_again(solver, monkeypatch):
    monkeypatch.setattr("warpsim.launch.PARALLEL_FROM", 0)
    body = {"type": "body", "head": [2, 0.05, 0], "tail": [0, 0.05, 0]}
    body["sections"] = [{"at": k / 30, "width": 0.1, "height": 0.1} for k in range(31)]
    muscle = {"chain": ["left_bottom", "right_bottom"], "wave": {"amplitude": 0.2, "period": 0.4, "wavelength": 0.7}}
    keys = {"generator": body, "mass": 0.02, "stiffness": 100.0, "damping": 0.1, "muscles": [muscle], "solver": solver}
    scene = network(**keys, grip=GRIP | {"chain": ["left_bottom", "right_top"]}, gravity=(0, -G, 0), substeps=12, more=GROUND)
    hashes = set()
    for native, threads in ((True, 1), (True, 2), (True, 3), (False, 1), (False, 3)):
        sim = Simulation(scene, device="cpu", threads=threads, native=native)
        sim.run(0.3)
        kept = {key: np.array(array) for key, array in sim.systems["s"].arrays().items()}
        sim.run(0.1)
        hashes.add(sim.state_hash())
    sim.seek(18)
    assert all((sim.systems["s"].arrays()[key] == kept[key]).all() for key in kept)
    sim.run(0.1)
    hashes.add(sim.state_hash())
    assert len(hashes) == 1


def crawl(**changes) -> np.ndarray:
    """How far the scene's worm comes in one wave of 1.6 s on flat ground, once it crawls [m]."""
    scene = load_scene("worm")
    worm = scene.systems["worm"].model_copy(update=changes)
    keys = {"systems": {"worm": worm}, "colliders": scene.colliders[:1], "time": {"fps": 60, "substeps": 40}}
    sim = Simulation(Scene.model_validate({"name": "flat", **keys}), device="cpu")
    sim.run(3.0)
    before = state(sim, "worm")[0].mean(axis=0)
    sim.run(1.6)
    return state(sim, "worm")[0].mean(axis=0) - before


def test_the_worm_crawls_by_its_bristles():
    """By growing long and short alone: a tenth of its 1.6 m per wave, hardly any without, backward if they are turned; idle it lies."""
    worm = load_scene("worm").systems["worm"]
    long, turned = worm.muscles[:1], worm.grip.model_copy(update={"forward": worm.grip.backward, "backward": worm.grip.forward})
    way = crawl(muscles=long)
    assert way[0] > 0.16 and abs(way[2]) < 0.01 * way[0]
    assert abs(crawl(muscles=long, grip=None)[0]) < 0.2 * way[0]
    assert crawl(muscles=long, grip=turned)[0] < -0.7 * way[0]
    assert np.abs(crawl(muscles=())).max() < 1e-5


def test_thick_parts_stand_and_thin_ones_slide():
    """With rings half a swing apart, what is short and thick carries the weight: a worm crawls by that alone, and by bristles besides."""
    with_bristles, without = crawl()[0], crawl(grip=None)[0]
    assert 0.2 < without < with_bristles and with_bristles > 0.28
