"""Births: every shape, fill and law against the twin, from the key and the ordinal."""

import numpy as np
import pytest

from tests.physics.scenes import emitter, simulate
from tests.reference import birth as reference
from tests.reference import random as reference_random
from tests.reference.emission import random_key
from warpsim.kernels import birth
from warpsim.kernels.emission import VALUE_LAWS
from warpsim.scene.emitters import Box, Disc, Segment, Sphere
from warpsim.scene.emitters import Distribution as DistributionSpec
from warpsim.systems.emitters import random_key as device_key

CENTER = [0.5, -1.0, 2.0]
SHAPES = {
    "point": {"type": "point", "center": CENTER},
    "segment": {"type": "segment", "start": [0.0, 1.0, 2.0], "end": [3.0, -1.0, 2.5]},
    "disc": {"type": "disc", "center": CENTER, "normal": [1.0, 2.0, -0.5], "radius": 0.7},
    "sphere": {"type": "sphere", "center": CENTER, "radius": 0.7},
    "box": {"type": "box", "center": CENTER, "size": [1.0, 2.0, 0.5]},
}
FILLED = [(name, fill) for name in SHAPES for fill in (("volume", "surface") if name in ("disc", "sphere", "box") else ("volume",))]
COUNT = 257


def born(device, **keys):
    """Return frame 0 of a burst, and its key and ordinals."""
    frame = simulate(emitter(COUNT, **keys), device=device, motion="ballistic").frame()["p"]
    return frame, random_key(1, "p", 0), [(1 << 40) + j for j in range(COUNT)]


def test_every_shape_and_law_has_a_twin():
    assert set(reference.SHAPES) | {"mesh"} == set(birth.SHAPES), "the mesh's twin is in tests/reference/meshes.py"
    assert set(reference.SHAPES) == set(SHAPES) and set(reference.VALUE_LAWS) == set(VALUE_LAWS)
    assert set(VALUE_LAWS) == set(DistributionSpec.model_fields["law"].annotation.__args__)
    assert {spec.model_fields["type"].default for spec in (Box, Disc, Sphere)} == {name for name, fill in FILLED if fill == "surface"}
    assert "fill" not in Segment.model_fields


@pytest.mark.parametrize("name", ["p", "other system", "ä"])
def test_keys_are_made_of_seed_name_and_place(name):
    assert tuple(device_key(2**32 - 1, name, 3)) == random_key(2**32 - 1, name, 3)


@pytest.mark.parametrize(("name", "fill"), FILLED)
def test_position_equals_the_twin(name, fill, device):
    """To 2e-6 m: places up to 3 m off the origin are rounded to 2.4e-7, cosines of the turn are good to 4e-7 of 0.7 m."""
    shape = SHAPES[name] | ({"fill": fill} if ("disc", fill) == (name, fill) or name in ("sphere", "box") else {})
    frame, key, ordinals = born(device, shape=shape)
    exact = np.array([reference.position(shape, key, n) for n in ordinals])
    assert np.abs(frame.position - exact).max() < 2e-6


@pytest.mark.parametrize("cone", [0.0, 25.0, 90.0, 180.0])
@pytest.mark.parametrize("law", VALUE_LAWS)
def test_velocity_equals_the_twin(cone, law, device):
    """1 − cos² cancels near the axis: an error of 1.2e-7 in cos makes one of √(2.4e-7) = 5e-4 at most; elsewhere 1e-6 per sine."""
    spec = {"direction": [1.0, -2.0, 0.3], "cone": cone, "speed": {"mean": 3.0, "spread": 0.5, "law": law}}
    frame, key, ordinals = born(device, velocity=spec)
    exact = np.array([reference.velocity(spec, key, n) for n in ordinals])
    error, speed = np.linalg.norm(frame.velocity - exact, axis=1), np.linalg.norm(exact, axis=1)
    axis = np.array(spec["direction"]) / np.linalg.norm(spec["direction"])
    sine = np.linalg.norm(np.cross(exact, axis), axis=1) / speed
    assert (error < speed * (2e-6 + np.minimum(3e-7 / np.maximum(sine, 1e-9), 8e-4))).all()


def test_bulk_equals_the_twin(device):
    """Lifetimes, masses and radii by both laws: relative 1e-6 of mean + 5.8 spreads, one product and one sum of rounded numbers."""
    specs = {"lifetime": {"mean": 2.0, "spread": 0.5}, "mass": {"mean": 1e-3, "spread": 1e-4, "law": "normal"}}
    specs |= {"radius": {"mean": 1e-2, "spread": 5e-3, "law": "uniform"}}
    frame, key, ordinals = born(device, **specs)
    for quantity, spec in specs.items():
        exact = np.array([getattr(reference, quantity)(spec, key, n) for n in ordinals])
        np.testing.assert_allclose(getattr(frame, quantity), exact, rtol=2e-6, err_msg=quantity)


def test_lifetimes_and_bulk_stay_above_zero(device):
    wide = {"mean": 1e-3, "spread": 1.0, "law": "normal"}
    key = random_key(1, "p", 0)
    assert min(reference.lifetime(wide, key, (1 << 40) + j) for j in range(COUNT)) == 1e-6
    frame, _, _ = born(device, lifetime=wide, mass=wide, radius=wide)
    assert frame.count == COUNT, "even the shortest life is in the frame of its birth"
    for values, least in ((frame.lifetime, 1e-6), (frame.mass, 1e-12), (frame.radius, 1e-12)):
        assert values.min() == np.float32(least) and (values > least * 2).any()


def test_an_emitter_at_rest_gives_no_velocity(device):
    frame, _, _ = born(device)
    assert (frame.velocity == 0.0).all()


def test_channels_of_a_particle_are_independent(device):
    """20 000 births: all 66 correlations between place, velocity, life, mass and radius below 4.5/√n (p < 5e-4)."""
    spec = {"shape": SHAPES["box"], "velocity": {"cone": 180, "speed": {"mean": 1.0, "spread": 0.5}}}
    spread = {key: {"mean": 1.0, "spread": 0.5} for key in ("lifetime", "mass", "radius")}
    sim = simulate(emitter(20_000, **spec, **spread), device=device, capacity=20_000, motion="ballistic")
    p = sim.frame()["p"]
    columns = np.concatenate([p.position, p.velocity, p.lifetime[:, None], p.mass[:, None], p.radius[:, None]], axis=1).astype(float)
    both = np.concatenate([columns[:-1], columns[1:, :3]], axis=1)  # and with the place of the next ordinal
    table = np.corrcoef(both.T)
    assert np.abs(table[np.triu_indices(len(table), k=1)]).max() < 4.5 / np.sqrt(20_000)
    assert reference_random.POSITION != reference_random.VELOCITY
