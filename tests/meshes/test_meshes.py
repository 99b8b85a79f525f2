"""Meshes from files: the same surface from four formats, mended where that is safe, refused with words where it is not."""

import numpy as np
import pytest

from tests.meshes import hourglass
from warpsim import SceneError
from warpsim.meshes import KINDS, load_mesh, surface

trimesh = pytest.importorskip("trimesh")


def saved(folder, mesh, kind):
    path = folder / f"shape.{kind}"
    path.write_bytes(content if isinstance(content := mesh.export(file_type=kind), bytes) else content.encode())
    return path


@pytest.mark.parametrize("kind", KINDS)
def test_the_same_box_from_every_format(kind, tmp_path):
    """2 x 3 x 4, twice as large, with the corners shared however the format tells them apart."""
    mesh = load_mesh(saved(tmp_path, trimesh.creation.box((2, 3, 4)), kind), "colliders.0.file", scale=2.0)
    assert mesh.vertices.shape == (8, 3) and mesh.vertices.dtype == np.float32
    assert mesh.triangles.shape == (12, 3) and mesh.triangles.dtype == np.int32
    assert mesh.closed and (mesh.dropped, mesh.turned) == (0, 0)
    assert mesh.volume == pytest.approx(8 * 24) and mesh.area.sum() == pytest.approx(4 * 2 * (6 + 8 + 12))
    assert [list(corner) for corner in mesh.bounds] == [[-2, -3, -4], [2, 3, 4]]


@pytest.mark.parametrize(("kind", "before", "word"), [("obj", b"", b"# caf\xe9\n"), ("stl", b"solid", b" caf\xe9"), ("ply", b"ply\n", b"")])
def test_words_of_any_encoding_are_read_over(kind, before, word, tmp_path):
    """An ASCII STL's name and the comments of the others, in Latin-1; a binary PLY's numbers stay untouched."""
    path = tmp_path / f"box.{kind}"
    box = trimesh.creation.box()
    box.export(path, **({"file_type": "stl_ascii"} if kind == "stl" else {}))
    content = path.read_bytes()
    if kind == "ply":
        before, word = content[: content.index(b"element")], b"comment caf\xe9\n"
    path.write_bytes(before + word + content.removeprefix(before))
    assert load_mesh(path, "colliders.0.file").closed


def test_wrong_winding_is_mended_and_counted():
    ball = trimesh.creation.icosphere(2)
    faces = np.array(ball.faces)
    faces[::3] = faces[::3, ::-1]
    mended = surface(np.array(ball.vertices), faces)
    assert mended.closed and mended.turned == len(faces[::3]) and mended.volume == pytest.approx(ball.volume, rel=1e-6)


def test_a_mesh_inside_out_is_turned_but_a_cavity_stays():
    ball = trimesh.creation.icosphere(2)
    inside_out = surface(np.array(ball.vertices), np.array(ball.faces)[:, ::-1])
    assert inside_out.volume == pytest.approx(ball.volume, rel=1e-6) and inside_out.turned == len(ball.faces)
    shell = (np.vstack([ball.vertices, 0.5 * ball.vertices]), np.vstack([ball.faces, ball.faces[:, ::-1] + len(ball.vertices)]))
    hollow = surface(*shell)
    assert hollow.closed and hollow.turned == 0 and hollow.volume == pytest.approx(7 / 8 * ball.volume, rel=1e-6)


def test_degenerate_triangles_are_dropped_and_counted():
    box = trimesh.creation.box((1, 1, 1))
    faces = np.vstack([box.faces, [[0, 0, 1], [2, 2, 2]]])
    assert (mesh := surface(np.array(box.vertices), faces)).dropped == 2 and mesh.closed


def test_an_open_mesh_says_so():
    box = trimesh.creation.box((1, 1, 1))
    mesh = surface(np.array(box.vertices), np.array(box.faces)[1:])
    assert not mesh.closed and mesh.open_edges == 3


BAD = {
    "missing.obj": (None, "cannot be read"),
    "empty.stl": (b"", "holds no triangles"),
    "noise.ply": (b"nonsense", "holds no PLY mesh"),
    "noise.glb": (b"\x00" * 100, "holds no GLB mesh"),
    "holes.obj": (b"v 0 0 0\nv 1 0 0\nf 1 2 9\n", "shape|vertex|mesh"),
    "flat.obj": (b"v 0 0 0\nv 1 0 0\nv 2 0 0\nf 1 2 3\n", "none of its 1 triangles has an area"),
    "nan.obj": (b"v 0 0 0\nv nan 0 0\nv 0 1 0\nf 1 2 3\n", "not finite|holds no OBJ mesh"),
    "scene.blend": (b"BLENDER", "not a kind of file that is read; those are obj, stl, ply, glb"),
}


@pytest.mark.parametrize("name", BAD)
def test_what_is_no_mesh_is_refused_with_words(name, tmp_path):
    content, words = BAD[name]
    if content is not None:
        (tmp_path / name).write_bytes(content)
    with pytest.raises(SceneError, match=words) as refused:
        load_mesh(tmp_path / name, "colliders.0.file")
    assert refused.value.problems[0].path == "colliders.0.file" and name in str(refused.value)


def test_a_huge_file_is_not_read(tmp_path, monkeypatch):
    monkeypatch.setattr("warpsim.meshes.MOST_BYTES", 10)
    (tmp_path / "large.obj").write_bytes(b"v 0 0 0\n" * 10)
    with pytest.raises(SceneError, match="80 bytes; at most 10"):
        load_mesh(tmp_path / "large.obj", "colliders.0.file")
    monkeypatch.setattr("warpsim.meshes.MOST_TRIANGLES", 3)
    with pytest.raises(Exception, match="has 12 triangles; at most 3"):
        surface(np.zeros((8, 3)), np.zeros((12, 3), int))


def test_without_trimesh_the_error_says_what_to_install(tmp_path, monkeypatch):
    monkeypatch.setitem(__import__("sys").modules, "trimesh", None)
    (tmp_path / "box.obj").write_bytes(b"v 0 0 0\n")
    with pytest.raises(SceneError, match=r"pip install 'warpsim\[mesh\]'"):
        load_mesh(tmp_path / "box.obj", "colliders.0.file")


def test_the_hourglass_is_what_its_script_makes():
    """The sines of another C library may differ in their last digit."""
    made = surface(*map(np.array, hourglass.hourglass()))
    shipped = load_mesh(hourglass.PLACE, "colliders.0.file")
    np.testing.assert_array_equal(shipped.triangles.shape, made.triangles.shape)
    np.testing.assert_allclose(np.sort(shipped.vertices, axis=0), np.sort(made.vertices, axis=0), atol=1e-6)
    assert shipped.closed and shipped.turned == shipped.dropped == 0
