"""Files that hold no grid of velocities: told at the file's place in the scene, in words, whatever is in them; nothing in them is run."""

import io
import pickle
import struct
import zipfile

import numpy as np
import pytest
import warp as wp

from tests.physics.test_grids import write_nvdb
from warpsim import Scene, SceneError, Simulation
from warpsim.memory import estimate_memory

GOOD = np.ones((3, 4, 5, 3), np.float32)


def scene(path, **keys) -> Scene:
    flow = {"type": "grid", "file": str(path), "size": [1, 1, 1], **keys}
    return Scene.model_validate({"name": "x", "flow": [{"type": "uniform", "velocity": [0, 0, 0]}, flow]})


def refusal(path, **keys) -> str:
    with pytest.raises(SceneError) as refused:
        Simulation(scene(path, **keys), device="cpu", threads=1)
    (problem,) = refused.value.problems
    assert problem.path == "flow.1.file" and problem.message.startswith(f"{path.name}: "), problem
    return problem.headline


def npz(path, **arrays):
    np.savez(path, **arrays)
    return path


@pytest.mark.parametrize(
    ("velocity", "words"),
    [
        (GOOD[..., :2], "shape (3, 4, 5, 2); a grid of velocities has shape (nx, ny, nz, 3)"),
        (GOOD[0], "shape (4, 5, 3)"),
        (GOOD[:0], "no node"),
        (GOOD.astype(complex), "real numbers"),
        (GOOD.astype("U3"), "real numbers"),
        (np.where(np.arange(5)[:, None] == 3, np.nan, GOOD), "velocity at node [0, 0, 3] is not finite"),
        (np.where(np.arange(3) == 1, 1e300, GOOD.astype(float)), "is not finite"),
    ],
    ids=lambda value: str(value)[:20] if isinstance(value, str) else "",
)
def test_arrays_that_are_no_grid(velocity, words, tmp_path):
    assert words in refusal(npz(tmp_path / "w.npz", velocity=velocity))


def test_an_array_of_another_name_is_suggested(tmp_path):
    said = refusal(npz(tmp_path / "w.npz", velocty=GOOD, pressure=GOOD))
    assert 'has no array "velocity"; it has velocty, pressure' in said and "did you mean velocty" in said
    Simulation(scene(tmp_path / "w.npz", array="velocty"), device="cpu", threads=1)


def test_pickles_are_not_loaded(tmp_path):
    class Trap:
        def __reduce__(self):
            return (open, (str(tmp_path / "sprung"), "w"))

    with zipfile.ZipFile(tmp_path / "w.npz", "w") as archive:
        content = io.BytesIO()
        np.lib.format.write_array_header_1_0(content, {"descr": "|O", "fortran_order": False, "shape": (1, 1, 1, 3)})
        archive.writestr("velocity.npy", content.getvalue() + pickle.dumps(Trap()))
    assert "pickled objects, which are never loaded" in refusal(tmp_path / "w.npz")
    assert not (tmp_path / "sprung").exists()


def test_a_promise_of_too_much_is_refused_before_it_is_read(tmp_path):
    with zipfile.ZipFile(tmp_path / "w.npz", "w") as archive:
        content = io.BytesIO()
        np.lib.format.write_array_header_1_0(content, {"descr": "<f4", "fortran_order": False, "shape": (10_000, 10_000, 10_000, 3)})
        archive.writestr("velocity.npy", content.getvalue())
    assert "1000000000000 nodes; at most 67108864 are taken" in refusal(tmp_path / "w.npz")
    with pytest.raises(SceneError, match="at most"):
        estimate_memory(scene(tmp_path / "w.npz"))


def test_a_damaged_zip_is_no_npz_file(tmp_path, rng):
    """Cut anywhere, or with bytes changed: refused in words, or (where it does not matter) read."""
    whole = npz(tmp_path / "good.npz", velocity=GOOD).read_bytes()
    path = tmp_path / "w.npz"
    for cut in (*range(0, 200, 7), len(whole) // 2, len(whole) - 3):
        path.write_bytes(whole[:cut])
        assert "is not a zip file of arrays" in refusal(path)
    for _ in range(60):
        bad = bytearray(whole)
        bad[rng.integers(len(bad))] ^= 1 << rng.integers(8)
        path.write_bytes(bad)
        try:
            Simulation(scene(path), device="cpu", threads=1)
        except SceneError as error:
            assert "w.npz" in str(error)
    path.write_text("velocity: 3\n")
    assert "is not a zip file of arrays" in refusal(path)


def test_a_damaged_nanovdb_file_is_refused(tmp_path, rng):
    write_nvdb(tmp_path / "good.nvdb", GOOD, "zip")
    whole, path = (tmp_path / "good.nvdb").read_bytes(), tmp_path / "w.nvdb"
    for cut in (0, 10, 100, 200, 900, len(whole) - 3):
        path.write_bytes(whole[:cut])
        assert "NanoVDB" in refusal(path)
    write_nvdb(tmp_path / "plain.nvdb", GOOD)
    plain = (tmp_path / "plain.nvdb").read_bytes()
    for source in (whole, plain):
        for _ in range(40):
            bad = bytearray(source)
            bad[rng.integers(min(len(bad), 1200))] ^= 1 << rng.integers(8)  # headers, tree, root: what is structure
            path.write_bytes(bad)
            try:
                Simulation(scene(path), device="cpu", threads=1)
            except SceneError as error:
                assert "w.nvdb" in str(error)


def test_other_nanovdb_grids_are_refused(tmp_path):
    density = wp.Volume.load_from_numpy(np.ones((8, 8, 8), np.float32), bg_value=0.0, device="cpu")
    density.save_to_nvdb(tmp_path / "w.nvdb")
    assert "of type float; velocities are of type Vec3f" in refusal(tmp_path / "w.nvdb")
    write_nvdb(tmp_path / "b.nvdb", GOOD)
    blosc = bytearray((tmp_path / "b.nvdb").read_bytes())
    struct.pack_into("<H", blosc, 14, 2)
    (tmp_path / "b.nvdb").write_bytes(blosc)
    assert "Blosc" in refusal(tmp_path / "b.nvdb")
    write_nvdb(tmp_path / "n.nvdb", np.where(np.arange(3) == 1, np.nan, GOOD))
    assert "is not finite" in refusal(tmp_path / "n.nvdb")


def test_an_npz_file_needs_a_size(tmp_path):
    npz(tmp_path / "w.npz", velocity=GOOD)
    with pytest.raises(ValueError, match="give its size"):
        scene(tmp_path / "w.npz", size=None)
