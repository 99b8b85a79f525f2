"""Layers of a mesh: their shares are those of places drawn evenly, and a mesh whose triangles count alike is noticed."""

from types import SimpleNamespace

import numpy as np
import pytest

from warpsim.scene import load_scene
from warpsim.verify.mesh_evenness import ACROSS, MeshLayers, turned


@pytest.fixture
def block(tmp_path):
    """A box of 1 x 2 x 4 m, one face of it cut into many slivers."""
    x, y, z = 1.0, 2.0, 4.0
    corners = [(0, 0, 0), (x, 0, 0), (x, y, 0), (0, y, 0), (0, 0, z), (x, 0, z), (x, y, z), (0, y, z)]
    quads = [(0, 3, 2, 1), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7)]
    faces = [triangle for a, b, c, d in quads for triangle in ((a, b, c), (a, c, d))]
    steps = 60  # the top, in strips that end at the corners of one side
    corners += [(x * (k / steps) ** 3, 0.0, z) for k in range(1, steps)]
    strip = [4, *range(8, 8 + steps - 1), 5]
    faces += [(strip[k], strip[k + 1], 6) for k in range(steps)] + [(4, 6, 7)]
    path = tmp_path / "block.obj"
    path.write_text("".join(f"v {a} {b} {c}\n" for a, b, c in corners) + "".join(f"f {a + 1} {b + 1} {c + 1}\n" for a, b, c in faces))
    return path


def shape(path, fill: str, **keys):
    return SimpleNamespace(
        **{"file": SimpleNamespace(path=path), "scale": 1.5, "center": (3, -1, 2), "rotation": (20, 30, -40), "fill": fill} | keys
    )


def drawn(fill: str, count: int, rng) -> np.ndarray:
    """Places drawn evenly in, or on, the box itself, laid where its mesh is."""
    u, size = rng.uniform(size=(count, 3)), np.array([1.0, 2.0, 4.0])
    if fill == "surface":
        areas = np.array([8.0, 4.0, 2.0])
        face = rng.choice(3, count, p=areas / areas.sum())
        u[np.arange(count), face] = rng.integers(0, 2, count)
    return turned(1.5 * u * size, (20, 30, -40)) + np.array([3, -1, 2])


@pytest.mark.parametrize("fill", ["surface", "volume"])
def test_shares_are_those_of_even_places(block, fill, rng):
    layers = MeshLayers(shape(block, fill), 32)
    numbers = layers.number(drawn(fill, 100_000, rng), 1e-6)
    assert numbers.min() == 0 and layers.shares == pytest.approx(1 / 32, rel=0.02) and layers.shares.sum() == pytest.approx(1.0)
    expected = 100_000 * layers.shares
    chi2 = ((np.bincount(numbers, minlength=32) - expected) ** 2 / expected).sum()
    assert abs(chi2 - 31) < 4 * np.sqrt(62)


@pytest.mark.parametrize(("fill", "whole"), [("surface", 28 * 1.5**2), ("volume", 8 * 1.5**3)])
def test_the_whole_is_area_or_volume(block, fill, whole):
    layers = MeshLayers(shape(block, fill), 8)
    assert layers.below(layers.high) == pytest.approx(whole, rel=1e-6) and layers.below(layers.low) == pytest.approx(0.0, abs=1e-6)


def test_triangles_that_count_alike_are_noticed(block, rng):
    layers = MeshLayers(shape(block, "surface"), 32)
    top = drawn("surface", 20_000, rng)
    slivers = turned(1.5 * np.stack([rng.uniform(size=20_000), 2 * rng.uniform(size=20_000), np.full(20_000, 4.0)], axis=1), (20, 30, -40))
    places = np.concatenate([top, slivers + np.array([3, -1, 2])])
    expected = len(places) * layers.shares
    assert ((np.bincount(layers.number(places, 1e-6), minlength=32) - expected) ** 2 / expected).sum() > 1000


def test_places_beyond_the_mesh_are_outside(block):
    layers = MeshLayers(shape(block, "surface"), 8)
    ends = np.outer([layers.low - 0.01, layers.low, layers.high, layers.high + 0.01], ACROSS)
    assert layers.number(ends, 1e-6).tolist() == [-1, 0, 7, -1]


def test_a_mesh_turns_as_the_emitter_does():
    from warpsim.directions import rotation_matrix

    places = np.eye(3)
    np.testing.assert_allclose(turned(places, (20, 30, -40)), places @ rotation_matrix((20, 30, -40)).T, atol=1e-12)
    assert load_scene("mesh_emitter").verify
