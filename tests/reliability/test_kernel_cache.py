"""Warp's kernel cache: damaged, or in a place that cannot be written. The run goes on and says what it did."""

import os
import shutil
import stat
from pathlib import Path

import pytest

from tests.command import SPARKS, warpsim

pytestmark = pytest.mark.cpu


@pytest.fixture(scope="module")
def warm_cache(tmp_path_factory):
    """A private cache with everything that the scene needs, and the scene."""
    folder = tmp_path_factory.mktemp("warm")
    (folder / "sparks.yaml").write_text(SPARKS)
    first = run(folder)
    assert first.returncode == 0 and "compiling kernels" in first.stdout
    second = run(folder)
    assert second.returncode == 0 and "compiling" not in second.stdout
    return folder


@pytest.fixture
def folder(warm_cache, tmp_path):
    shutil.copytree(warm_cache, tmp_path / "here")
    return tmp_path / "here"


def run(folder, **more):
    return warpsim(
        "run", "sparks.yaml", "--viewer", "none", "--frames", 3, cwd=folder, **{"WARP_CACHE_PATH": str(folder / "cache"), **more}
    )


def files(folder, suffix) -> list[Path]:
    found = sorted((folder / "cache").rglob(f"*{suffix}"))
    assert found
    return found


def test_the_doctor_says_what_the_cache_holds(folder):
    from warpsim.cli.doctor import held

    (versioned,) = (folder / "cache").iterdir()
    modules = [path for path in versioned.iterdir() if path.name.startswith("wp_")]
    assert held(versioned).startswith(f"{len(modules)} modules, ") and held(folder).startswith("empty")


def test_truncated_modules_heal(folder):
    """Each is found and rebuilt in its turn."""
    victims = sorted(files(folder, ".o"), key=lambda path: path.stat().st_size)[:2]
    for path in victims:
        data = path.read_bytes()
        path.write_bytes(data[: int(len(data) * 0.6)])
    healed = run(folder)
    assert healed.returncode == 0 and "Traceback" not in healed.stderr, healed.stderr
    assert healed.stdout.count("are damaged") == 2 and all(path.parent.name in healed.stdout for path in victims)
    assert "are damaged" not in run(folder).stdout


DAMAGE = [(".o", b""), (".o", b"not an object"), (".meta", b""), (".meta", b'{"half": '), (".meta", b"\xff")]


@pytest.mark.parametrize(("suffix", "content"), DAMAGE)
def test_one_damaged_module_is_the_only_one_rebuilt(folder, suffix, content):
    victim = min(files(folder, suffix), key=lambda path: path.stat().st_size)
    others = {path: path.stat().st_mtime_ns for path in files(folder, suffix) if path != victim}
    victim.write_bytes(content)
    healed = run(folder)
    assert healed.returncode == 0 and healed.stdout.count("are damaged") == 1 and victim.parent.name in healed.stdout
    assert others == {path: path.stat().st_mtime_ns for path in files(folder, suffix) if path != victim}


def test_a_missing_file_is_made_again(folder):
    files(folder, ".o")[0].unlink()
    assert run(folder).returncode == 0


def test_a_cache_that_cannot_be_written_is_replaced(folder, tmp_path):
    """A file where the folder should be: also root, whom permissions do not stop, cannot write there."""
    (tmp_path / "file").write_text("")
    blocked = {"WARP_CACHE_PATH": str(tmp_path / "file" / "cache"), "TMPDIR": str(tmp_path / "temporary")}
    (tmp_path / "temporary").mkdir()
    said = warpsim("doctor", cwd=folder, **blocked).stdout
    assert "cannot be written" in said and "WARP_CACHE_PATH" in said
    (substitute,) = (tmp_path / "temporary").glob("warpsim-kernels-*")
    assert stat.S_IMODE(substitute.stat().st_mode) == 0o700, "compiled code is run: nobody else may put it there"
    shutil.copytree(folder / "cache", substitute, dirs_exist_ok=True)
    done = run(folder, **blocked)
    assert done.returncode == 0 and "cannot be written" in done.stdout, done.stderr
    assert "compiling" not in done.stdout, "the substitute is the same in every run"


def test_a_substitute_that_others_can_write_is_not_trusted(monkeypatch, tmp_path):
    from warpsim.kernel_cache import private_temporary_folder

    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    first = private_temporary_folder()
    assert private_temporary_folder() == first
    os.chmod(first, 0o777)
    assert private_temporary_folder() != first
    first.rmdir()
    (tmp_path / "elsewhere").mkdir(mode=0o700)
    first.symlink_to(tmp_path / "elsewhere")
    assert private_temporary_folder() != first


def test_other_errors_pass_through():
    from warpsim.kernel_cache import rebuilding

    tries = []

    def action():
        tries.append(1)
        raise ValueError("something else")

    with pytest.raises(ValueError, match="something else"):
        rebuilding(action, pytest.fail)
    assert len(tries) == 1


def test_a_cache_without_room_is_replaced_once(monkeypatch, tmp_path):
    """The room for a billion modules is asked for, of a real disk."""
    import warp as wp

    from warpsim.kernel_cache import FullCache, check_room, rebuilding

    wp.init()
    usual, notes = tmp_path / "usual", []
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    monkeypatch.setattr(wp.config, "kernel_cache_dir", str(usual))
    counts = iter([10**9, 1])
    rebuilding(lambda: check_room(next(counts)), notes.append)
    assert len(notes) == 1 and f"the kernel cache {usual} has no room left: kernels are kept in {tmp_path}/warpsim-kernels-" in notes[0]
    assert Path(wp.config.kernel_cache_dir).parent.parent == tmp_path and not list(usual.iterdir()), "the room was taken for a moment only"
    with pytest.raises(FullCache, match="WARP_CACHE_PATH") as caught:
        rebuilding(lambda: check_room(10**9), notes.append)
    assert len(notes) == 2 and caught.value.filename == wp.config.kernel_cache_dir


def test_a_disk_that_fills_while_kernels_compile(monkeypatch, tmp_path):
    """What Warp raises then names no file, and would be taken for a full standard output."""
    import errno

    import warp as wp

    from warpsim.compiling import _compile
    from warpsim.kernel_cache import FullCache

    class Module:
        def load(self, device, block_dim):
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr(wp.config, "kernel_cache_dir", str(tmp_path))
    with pytest.raises(FullCache, match="No space left on device") as caught:
        _compile(Module(), wp.get_device("cpu"), 1)
    assert caught.value.filename == str(tmp_path)
