"""Formulas of events and of their children against twins: turning to a surface, products of colors, inside and outside of meshes."""

import numpy as np
import pytest
import warp as wp

from tests import surfaces
from tests.reference import events, meshes
from warpsim.kernels.birth import turn_up_to
from warpsim.kernels.colors import multiply_colors
from warpsim.kernels.mesh_births import MeshTable, encloses
from warpsim.scene.emitters import Mesh
from warpsim.systems.mesh_births import mesh_table


@wp.kernel(enable_backward=False)
def turn_all(normals: wp.array[wp.vec3], x: wp.array[wp.vec3], turned_out: wp.array[wp.vec3]):
    i = wp.tid()
    turned_out[i] = turn_up_to(normals[i], x[i])


@wp.kernel(enable_backward=False)
def multiply_all(a: wp.array[wp.uint32], b: wp.array[wp.uint32], product_out: wp.array[wp.uint32]):
    i = wp.tid()
    product_out[i] = multiply_colors(a[i], b[i])


@wp.kernel(enable_backward=False)
def test_all(mesh: MeshTable, x: wp.array[wp.vec3], inside_out: wp.array[int]):
    i = wp.tid()
    cell = wp.cw_div(x[i] - mesh.low, mesh.step)
    inside_out[i] = int(encloses(mesh, int(cell[1]) * mesh.column_count + int(cell[2]), x[i]))


test_all.__test__ = False  # a kernel, not a test


def test_turning_up_to_a_normal_equals_the_twin(rng, device):
    """To 1e-5 where the normal points almost down, lengths to 1e-6; it is a rotation that takes +y to the normal, down included."""
    n = rng.normal(size=(500, 3))
    n[:4] = [0, 1, 0], [0, -1, 0], [1e-4, -1, 0], [0, -1, 1e-3]
    n /= np.linalg.norm(n, axis=1, keepdims=True)
    n = n.astype(np.float32)
    x = rng.normal(size=(500, 3)).astype(np.float32)
    x[250:] = 0, 1, 0
    got = wp.zeros(500, dtype=wp.vec3, device=device)
    wp.launch(turn_all, 500, [wp.array(n, dtype=wp.vec3, device=device), wp.array(x, dtype=wp.vec3, device=device), got], device=device)
    turned = got.numpy().astype(float)
    exact = np.array([events.turn_up_to(a.astype(float), b.astype(float)) for a, b in zip(n, x, strict=True)])
    assert np.abs(turned - exact).max() < 1e-5
    assert np.abs(turned[250:] - n[250:]).max() < 1e-6
    np.testing.assert_allclose(np.linalg.norm(turned, axis=1), np.linalg.norm(x, axis=1), rtol=1e-6)


def test_colors_multiply_as_the_twin_to_the_bit(rng, device):
    a, b = rng.integers(0, 256, size=(2, 1000, 4)).astype(np.uint8)
    b[:10] = 255
    words = [wp.array(np.ascontiguousarray(c).view("<u4")[:, 0], dtype=wp.uint32, device=device) for c in (a, b)]
    got = wp.zeros(1000, dtype=wp.uint32, device=device)
    wp.launch(multiply_all, 1000, [*words, got], device=device)
    product = got.numpy().view(np.uint8).reshape(-1, 4)
    assert (product == events.multiply(a, b)).all() and (product[:10] == a[:10]).all()


@pytest.mark.parametrize("turned", [False, True])
@pytest.mark.parametrize("shape", ["ring", "hollow"])
def test_inside_is_where_the_surface_winds_round(shape, turned, rng, tmp_path, device):
    """2000 places in and round a mesh, on edges and over corners of it, too; those within 1e-5 of the surface are left out."""
    hollow = np.concatenate([surfaces.block([0, 0, 0], [3, 3, 3], surfaces.uneven(4, 1.5)), surfaces.block([1, 1, 1], [2, 2, 2])[:, ::-1]])
    corners = {"ring": surfaces.ring(), "hollow": hollow}[shape] @ (surfaces.turn().T if turned else np.eye(3))
    path = surfaces.write_obj(tmp_path / "m.obj", corners)
    table = mesh_table(Mesh(file=str(path)), "shape", device)
    low, high = corners.min(axis=(0, 1)), corners.max(axis=(0, 1))
    x = rng.uniform(low, high, size=(2000, 3)).astype(np.float32)
    vertices = corners.reshape(-1, 3)
    x[:400, 1:] = vertices[rng.integers(len(vertices), size=400), 1:]  # rays through corners and along edges
    got = wp.zeros(2000, dtype=int, device=device)
    wp.launch(test_all, 2000, [table, wp.array(x, dtype=wp.vec3, device=device), got], device=device)
    winding = np.array([meshes.winding(corners, place.astype(float)) for place in x])
    clear = np.abs(winding - np.round(winding)) < 1e-3
    clear &= np.array([meshes.distance(corners, place.astype(float)) > 1e-5 for place in x])
    assert clear.sum() > 1500 and (got.numpy()[clear] == np.round(winding[clear])).all()
