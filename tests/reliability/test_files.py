"""Whole files: whatever fails, and whenever, what stood under a name is untouched or complete."""

import errno
import os

import pytest

from warpsim import files
from warpsim.files import LineFile, sweep, whole_file, write_text

DISK_CALLS = ("write", "fsync", "replace")


class FailingSystem:
    """The `os` module, except that the n-th call that touches the disk fails: no room, or half of it written and then no room."""

    def __init__(self, fails_at: int, half: bool = False):
        self.calls, self.fails_at, self.half = 0, fails_at, half

    def __getattr__(self, name):
        return self._guarded(name) if name in DISK_CALLS else getattr(os, name)

    def _guarded(self, name):
        def call(*arguments):
            self.calls += 1
            if self.calls == self.fails_at:
                if name == "write" and self.half and len(arguments[1]) > 1:
                    return os.write(arguments[0], arguments[1][: len(arguments[1]) // 2])
                raise OSError(errno.ENOSPC, "No space left on device")
            if self.calls == self.fails_at + 1 and self.half:
                raise OSError(errno.ENOSPC, "No space left on device")
            return getattr(os, name)(*arguments)

        return call


@pytest.fixture
def failing(monkeypatch):
    def install(fails_at: int, half: bool = False) -> FailingSystem:
        system = FailingSystem(fails_at, half)
        monkeypatch.setattr(files, "os", system)
        return system

    return install


def names(folder):
    return sorted(path.name for path in folder.iterdir())


def test_a_whole_file_appears_at_the_end(tmp_path):
    path = tmp_path / "a.bin"
    with whole_file(path) as file:
        file.write(b"x" * 100_000)
        assert not path.exists()
    assert path.read_bytes() == b"x" * 100_000 and names(tmp_path) == ["a.bin"]


@pytest.mark.parametrize("half", [False, True])
@pytest.mark.parametrize("old", [None, "old text"])
def test_every_failure_leaves_the_old_or_the_new(tmp_path, failing, old, half):
    path, new = tmp_path / "a.txt", "new text " * 10_000
    reached_end = False
    for n in range(1, 50):
        path.unlink(missing_ok=True)
        if old is not None:
            path.write_text(old)
        system = failing(n, half)
        try:
            write_text(path, new)
        except OSError as error:
            assert error.filename == str(path) and error.errno == errno.ENOSPC
            # Only the last call, the flush of the folder, comes when the new file already has its name.
            assert (path.read_text() if path.exists() else None) in (old, new)
        else:
            reached_end = reached_end or system.calls < n
            assert path.read_text() == new
        assert names(tmp_path) in ([], ["a.txt"]), "no temporary is left behind"
    assert reached_end


def test_an_error_in_the_block_leaves_the_old(tmp_path):
    path = tmp_path / "a.txt"
    write_text(path, "old")
    with pytest.raises(KeyboardInterrupt), whole_file(path) as file:
        file.write(b"half of")
        raise KeyboardInterrupt
    assert path.read_text() == "old" and names(tmp_path) == ["a.txt"]


def test_sweep_takes_temporaries_and_nothing_else(tmp_path):
    for name in (".frame.npz.123.partial", "my.partial", ".hidden", "frame.npz"):
        (tmp_path / name).write_text("x")
    assert [path.name for path in sweep(tmp_path)] == [".frame.npz.123.partial"]
    assert names(tmp_path) == [".hidden", "frame.npz", "my.partial"]


def test_lines_survive_a_failure_whole(tmp_path, failing):
    path = tmp_path / "lines"
    lines = LineFile(path)
    lines.append("first")
    for half in (False, True):
        for n in (1, 2):
            failing(n, half)
            with pytest.raises(OSError, match="lines"):
                lines.append("second")
            assert path.read_text() == "first\n"
    failing(100)
    lines.append("third")
    lines.close()
    assert path.read_text() == "first\nthird\n"


@pytest.mark.parametrize("torn", ["", "half a li", "x" * 10_000])
@pytest.mark.parametrize("whole", ["", "one\n", "one\n" + "y" * 9_000 + "\n"])
def test_a_torn_tail_is_cut_at_the_next_start(tmp_path, whole, torn):
    path = tmp_path / "lines"
    path.write_text(whole + torn)
    lines = LineFile(path)
    assert path.read_text() == whole
    lines.append("two")
    lines.close()
    assert path.read_text() == whole + "two\n"


def test_a_line_is_one_write(tmp_path, failing):
    lines = LineFile(tmp_path / "lines")
    system = failing(100)
    lines.append("z" * 100_000)
    assert system.calls == 2, "one write, one flush: nothing a reader could see in between"
    lines.close()
