"""Births on and in meshes: uniform whatever the triangulation, by χ², inside to the last, and where the twin has them.

χ² at p > 0.01 by the Wilson–Hilferty cube root: it is 2.33 standard deviations; seeds are fixed, so a pass stays a pass.
"""

import numpy as np
import pytest

import warpsim
from tests import surfaces
from tests.reference import meshes as reference
from tests.reference.emission import random_key
from warpsim import SceneError
from warpsim.scene.emitters import Mesh
from warpsim.systems.mesh_births import mesh_table

COUNT = 100_000


def born(path, count=COUNT, device="cpu", native=True, threads=1, **shape) -> np.ndarray:
    """Return the places of so many births, (n, 3) [m]."""
    place = {"type": "mesh", "file": str(path), **shape}
    emitter = {"shape": place, "burst": {"count": count}, "lifetime": 100.0}
    system = {"type": "particles", "capacity": count, "motion": "ballistic", "emitters": [emitter]}
    document = {"name": "law", "seed": 1, "gravity": [0, 0, 0], "systems": {"p": system}}
    simulation = warpsim.Simulation(warpsim.Scene.model_validate(document), device=device, native=native, threads=threads)
    return simulation.frame()["p"].position.astype(float)


def deviations(observed: np.ndarray, expected: np.ndarray) -> float:
    """Return by how many standard deviations χ² exceeds its mean.  Source: Wilson & Hilferty 1931."""
    assert expected.min() > 5.0
    freedom = len(expected) - 1
    chi2 = ((observed - expected) ** 2 / expected).sum()
    spread = 2.0 / (9.0 * freedom)
    return float((np.cbrt(chi2 / freedom) - (1.0 - spread)) / np.sqrt(spread))


@pytest.mark.parametrize("ratio", [1.0, 1.7])
def test_a_bad_triangulation_is_emitted_by_area(ratio, tmp_path, device):
    """Sides of a box cut into 1800 triangles from 1e-8 to 0.3 of a side, many of them slivers: equal squares get equal shares."""
    corners = surfaces.block([-1, -1, -1], [1, 1, 1], surfaces.uneven(12, ratio))
    x = born(surfaces.write_obj(tmp_path / "m.obj", corners), fill="surface", device=device)
    axis = np.argmax(np.abs(x), axis=1)
    assert np.abs(np.abs(x).max(axis=1) - 1.0).max() < 1e-6
    side = 2 * axis + (x[np.arange(COUNT), axis] > 0)
    i, j = (np.clip(np.floor(5 * (x[np.arange(COUNT), (axis + k) % 3] + 1)), 0, 9).astype(int) for k in (1, 2))
    observed = np.bincount(side * 100 + i * 10 + j, minlength=600)
    assert deviations(observed, np.full(600, COUNT / 600)) < 2.33


def test_each_triangle_gets_its_share(tmp_path, device):
    """A fan of slivers in a plane, areas over five orders of magnitude: those that expect more than 5, the rest together."""
    angle = 0.5 * np.pi * surfaces.uneven(60, 1.2)
    rim = np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=1)
    corners = np.stack([np.zeros((60, 3)), rim[:-1], rim[1:]], axis=1)
    x = born(surfaces.write_obj(tmp_path / "m.obj", corners), fill="surface", device=device)
    at = np.searchsorted(angle, np.arctan2(x[:, 1], x[:, 0]), side="right") - 1
    observed = np.bincount(np.clip(at, 0, 59), minlength=60)
    area = 0.5 * np.sin(np.diff(angle))
    expected = COUNT * area / area.sum()
    small = expected < 5.0
    together = expected[small].sum(), observed[small].sum()
    assert small.sum() > 5 and abs(together[1] - together[0]) < 4 * np.sqrt(together[0])
    assert deviations(observed[~small], expected[~small] * observed[~small].sum() / expected[~small].sum()) < 2.33


def hollow() -> tuple[np.ndarray, np.ndarray]:
    """A cube of 4 m with a cube of 2 m cut out of its middle, and a cube beside it: cells of 1 m that are inside, (n, 3)."""
    corners = [surfaces.block([0, 0, 0], [4, 4, 4], surfaces.uneven(5, 2.0)), surfaces.block([1, 1, 1], [3, 3, 3])[:, ::-1]]
    corners.append(surfaces.block([6, 1, 0], [7, 3, 4], surfaces.uneven(3, 5.0)))
    x, y, z = np.mgrid[0:8, 0:4, 0:4]
    middle = (x > 0) & (x < 3) & (y > 0) & (y < 3) & (z > 0) & (z < 3)
    inside = ((x < 4) & ~middle) | ((x == 6) & (y > 0) & (y < 3))
    return np.concatenate(corners), np.argwhere(inside)


@pytest.mark.parametrize("turned", [False, True])
def test_a_volume_with_a_hole_and_two_parts_is_filled_evenly(turned, tmp_path, device):
    """Each cubic meter inside gets the same share; with edges along the axes of the search and across them."""
    corners, inside = hollow()
    turn = surfaces.turn() if turned else np.eye(3)
    x = born(surfaces.write_obj(tmp_path / "m.obj", corners @ turn.T), fill="volume", device=device) @ turn
    cell = np.clip(np.floor(x), 0, [7, 3, 3]).astype(int)
    number = (cell[:, 0] * 4 + cell[:, 1]) * 4 + cell[:, 2]
    known = (inside[:, 0] * 4 + inside[:, 1]) * 4 + inside[:, 2]
    clear = (np.abs(x - np.round(x)) > 1e-5).all(axis=1)  # of the borders, where float32 decides
    assert np.isin(number[clear], known).all(), "none outside"
    observed = np.bincount(number, minlength=128)
    assert deviations(observed[known], np.full(len(known), COUNT / len(known))) < 2.33


@pytest.mark.parametrize("thickness", [1e-2, 1e-4])
def test_a_thin_sheet_is_filled(thickness, tmp_path):
    """Far thinner than a cell of the grid: places are drawn until they are inside."""
    x = born(surfaces.write_obj(tmp_path / "m.obj", surfaces.block([0, 0, 0], [1, 1, thickness]) @ surfaces.turn().T), 20_000)
    x = x @ surfaces.turn()
    assert (x > -1e-6).all() and (x < [1 + 1e-6, 1 + 1e-6, thickness + 1e-6]).all()
    observed = np.bincount((np.clip(x[:, 0], 0, 0.999) * 10).astype(int) * 10 + (np.clip(x[:, 1], 0, 0.999) * 10).astype(int))
    assert deviations(observed, np.full(100, 200.0)) < 2.33


@pytest.mark.parametrize("fill", ["surface", "volume"])
def test_places_equal_the_twin(fill, tmp_path, device):
    """A torus, moved, turned and scaled: to 4e-6 m, some units of float32 at 5 m; the twin tells inside from outside by solid angles."""
    path = surfaces.write_obj(tmp_path / "m.obj", surfaces.ring())
    pose = {"center": [3.0, -1.0, 2.0], "scale": 1.7, "rotation": [20.0, -35.0, 70.0]}
    spec = Mesh(file=str(path), fill=fill, **pose)
    table = mesh_table(spec, "shape", "cpu")
    corners, key = table.corners.numpy().astype(float), random_key(1, "p", 0)
    grid = None if fill == "surface" else (table.low, table.step, table.cells.numpy())
    got = born(path, 257, device, fill=fill, **pose)
    for n, place in enumerate(got):
        p = reference.on_surface(corners, key, (1 << 40) + n) if grid is None else reference.in_volume(corners, grid, key, (1 << 40) + n)
        exact = np.array(pose["center"]) + pose["scale"] * (reference.rotation(pose["rotation"]) @ p)
        assert np.abs(place - exact).max() < 4e-6, n


@pytest.mark.parametrize("fill", ["surface", "volume"])
def test_parts_and_plain_kernels_share_their_bits(fill, tmp_path, monkeypatch):
    monkeypatch.setattr("warpsim.launch.PARALLEL_FROM", 0)
    path = surfaces.write_obj(tmp_path / "m.obj", surfaces.ring())
    runs = [born(path, 1003, native=native, threads=n, fill=fill).tobytes() for native, n in ((True, 1), (True, 3), (False, 1), (False, 2))]
    assert len(set(runs)) == 1


def test_an_open_mesh_is_not_filled_but_emits_from_its_surface(tmp_path):
    path = surfaces.write_obj(tmp_path / "m.obj", surfaces.block([0, 0, 0], [1, 1, 1])[:-1])
    words = r"systems\.p\.emitters\.0\.shape\.fill: an open mesh encloses nothing: 3 of its edges .*fill: surface"
    with pytest.raises(SceneError, match=words):
        born(path, 10)
    assert len(born(path, 10, fill="surface")) == 10


def test_a_file_that_is_no_mesh_is_refused_in_words(tmp_path):
    (tmp_path / "m.obj").write_text("v 0 0 0\n")
    with pytest.raises(SceneError, match=r"systems\.p\.emitters\.0\.shape\.file: m\.obj"):
        born(tmp_path / "m.obj", 10)


def test_center_scale_and_rotation_may_change_while_it_runs(tmp_path):
    """Births after the change are where an emitter has them that began with it; the file itself is fixed."""
    path = surfaces.write_obj(tmp_path / "m.obj", surfaces.ring())
    other = surfaces.write_obj(tmp_path / "n.obj", surfaces.block([0, 0, 0], [1, 1, 1]))

    def simulation(**shape):
        emitter = {"shape": {"type": "mesh", "file": str(path), **shape}, "rate": 600, "lifetime": 100.0}
        system = {"type": "particles", "motion": "ballistic", "emitters": [emitter]}
        return warpsim.Simulation(warpsim.Scene.model_validate({"name": "x", "gravity": [0, 0, 0], "systems": {"p": system}}), device="cpu")

    changed, fixed = simulation(), simulation(scale=2.0, center=[0, 5, 0], rotation=[0, 90, 0])
    for key, value in (("scale", 2.0), ("center.1", 5.0), ("rotation.1", 90.0)):
        changed.change(f"systems.p.emitters.0.shape.{key}", value)
    for sim in (changed, fixed):
        sim.run(0.2)
    assert changed.frame()["p"].count > 100 and (changed.frame()["p"].position == fixed.frame()["p"].position).all()
    with pytest.raises(ValueError, match="cannot change while the scene runs"):
        changed.change("systems.p.emitters.0.shape.file", str(other))
