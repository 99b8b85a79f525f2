"""Files that a scene names: under its folder, of the right kind, there; and copied into a run folder under names that work from it."""

import os
from pathlib import Path

import pytest
from pydantic import Field, ValidationError

from warpsim.scene.assets import Asset, asset_path, assets_of, recorded_assets
from warpsim.scene.base import Spec
from warpsim.scene.resolved import as_plain


class Wind(Spec):
    """A part of a scene that names a file."""

    file: asset_path(".npz", ".nvdb") = Field(description="A grid.")


@pytest.fixture
def folder(tmp_path):
    """A scene's folder with a grid in a folder below, and a secret beside it."""
    (tmp_path / "scenes/grids").mkdir(parents=True)
    (tmp_path / "scenes/grids/breeze.npz").write_bytes(b"PK")
    (tmp_path / "secret.npz").write_bytes(b"PK")
    return tmp_path / "scenes"


def wind(file: str, folder: Path | None) -> Wind:
    return Wind.model_validate({"file": file}, context={"folder": folder})


def refusal(file: str, folder: Path) -> dict:
    with pytest.raises(ValidationError) as refused:
        wind(file, folder)
    (error,) = refused.value.errors()
    assert error["type"] == "asset" and error["loc"] == ("file",)
    return error["ctx"]


def test_a_file_is_found_from_the_scenes_folder(folder):
    one = wind("grids/breeze.npz", folder)
    assert one.file == "grids/breeze.npz" and one.file.path == folder / "grids/breeze.npz"
    assert one == wind("grids/../grids/breeze.npz", folder).model_copy(update={"file": Asset("grids/breeze.npz")})
    assert list(assets_of({"a": (one, 3)})) == [one.file]


def test_a_scene_built_in_python_may_name_any_file(folder):
    assert wind(str(folder.parent / "secret.npz"), None).file.path == folder.parent / "secret.npz"


@pytest.mark.parametrize("file", ["../secret.npz", "grids/../../secret.npz", "ABSOLUTE", "link.npz"])
def test_a_file_outside_the_folder_is_refused(folder, file):
    os.symlink(folder.parent / "secret.npz", folder / "link.npz")
    file = str(folder.parent / "secret.npz") if file == "ABSOLUTE" else file
    assert "must stay under the scene's folder" in refusal(file, folder)["what"]


def test_wrong_files_are_told(folder):
    missing = refusal("grids/breze.npz", folder)
    assert "no such file" in missing["what"] and missing["suggestion"] == "grids/breeze.npz"
    assert refusal("grids/breeze.obj", folder)["what"] == "must be a .npz or .nvdb file"
    (folder / "heap.npz").mkdir()
    assert "not a regular file" in refusal("heap.npz", folder)["what"]
    assert "cannot be read" in refusal("a\0b.npz", folder)["what"]
    with open(folder / "huge.npz", "wb") as huge:
        huge.truncate((1 << 30) + 1)
    assert "larger than 1024 MiB" in refusal("huge.npz", folder)["what"]


def test_a_run_folder_has_copies_under_names_that_work_from_it(folder):
    one = wind("grids/breeze.npz", folder)
    assert as_plain(one) == {"file": "grids/breeze.npz"}
    assert as_plain(one, recorded=True) == {"file": "assets/grids/breeze.npz"}
    assert recorded_assets(one) == [("assets/grids/breeze.npz", folder / "grids/breeze.npz")]
    (folder / "assets/grids").mkdir(parents=True)
    (folder / "assets/grids/breeze.npz").write_bytes(b"PK")
    assert as_plain(wind("assets/grids/breeze.npz", folder), recorded=True) == {"file": "assets/grids/breeze.npz"}, "run again from there"
