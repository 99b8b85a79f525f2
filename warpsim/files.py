"""Files that are whole at every moment, whatever is pulled: the plug, the process, or the last free byte of the disk.

A file is written under a temporary name, flushed to the disk and renamed over its final name; the folder is flushed too, because a rename
lives in the folder. A growing text is appended one whole line at a time. Nothing else in the program writes files.
"""

import io
import os
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

PARTIAL = ".partial"  # a temporary is `.NAME.PID.partial`: hidden from listings, recognized when swept


class _RawFile(io.FileIO):
    """A file whose every write is one `os.write`, so that a test can let any single one of them fail."""

    def write(self, data) -> int:
        return os.write(self.fileno(), data)


@contextmanager
def whole_file(path: Path) -> Iterator[io.BufferedRandom]:
    """Yield a binary file that appears under `path`, complete and on the disk, when the block ends without an error.

    Any error (OSError with the final path as its file name, or whatever the block raises) leaves what stood under `path` untouched.
    """
    temporary = path.with_name(f".{path.name}.{os.getpid()}{PARTIAL}")
    try:
        with io.BufferedRandom(_RawFile(temporary, "x+")) as file:
            yield file
            file.flush()
            os.fsync(file.fileno())
        os.replace(temporary, path)
        sync_folder(path.parent)
    except BaseException as error:
        with suppress(OSError):
            temporary.unlink(missing_ok=True)
        if isinstance(error, OSError):
            raise named(error, path) from error
        raise


def write_text(path: Path, text: str) -> None:
    """Write a whole UTF-8 text file. Raises OSError; what stood there before is then untouched."""
    with whole_file(path) as file:
        file.write(text.encode())


def sync_folder(folder: Path) -> None:
    """Flush a folder's entries to the disk, so that a rename survives a power cut. Windows has no such call."""
    if os.name == "nt":
        return
    descriptor = os.open(folder, os.O_RDONLY | os.O_DIRECTORY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)


def sweep(folder: Path) -> list[Path]:
    """Remove the temporaries that killed runs left in a folder of ours; returns them."""
    stale = [path for path in sorted(folder.glob(f".*{PARTIAL}")) if path.is_file()]
    for path in stale:
        path.unlink(missing_ok=True)
    return stale


class LineFile:
    """A growing UTF-8 text file of which readers see whole lines only.

    A line is one write, flushed to the disk; a write that fails half-way is cut back. What a kill in the middle of a write could leave
    (at most one line without its end) is cut off when the file is opened again. Raises OSError with the file's name.
    """

    def __init__(self, path: Path):
        self.path = path
        self._descriptor = None
        try:
            flags = os.O_RDWR | os.O_CREAT | os.O_APPEND | getattr(os, "O_BINARY", 0)
            self._descriptor = os.open(path, flags, 0o666)
            self.length = self._cut_torn_tail()
            sync_folder(path.parent)
        except OSError as error:
            self.close()
            raise named(error, path) from error

    def append(self, line: str) -> None:
        """Append one line; its end is added here."""
        data = memoryview(f"{line}\n".encode())
        try:
            written = 0
            while written < len(data):  # once, except on a full disk, where the second write tells why the first fell short
                written += os.write(self._descriptor, data[written:])
            os.fsync(self._descriptor)
        except BaseException as error:
            with suppress(OSError):
                os.ftruncate(self._descriptor, self.length)
            if isinstance(error, OSError):
                raise named(error, self.path) from error
            raise
        self.length += len(data)

    def close(self) -> None:
        """Close the file; every line is on the disk already."""
        if self._descriptor is not None:
            os.close(self._descriptor)
            self._descriptor = None

    def _cut_torn_tail(self) -> int:
        """Cut the file after its last line end and return its length [bytes]."""
        length = end = os.fstat(self._descriptor).st_size
        while end:
            start = max(0, end - 4096)
            os.lseek(self._descriptor, start, os.SEEK_SET)  # os.pread is not everywhere; what is appended goes to the end anyway
            newline = os.read(self._descriptor, end - start).rfind(b"\n")
            if newline >= 0:
                end = start + newline + 1
                break
            end = start
        if end != length:
            os.ftruncate(self._descriptor, end)
        return end


def named(error: OSError, path: Path) -> OSError:
    """Return the error with the path a person knows, instead of a temporary name or none at all."""
    return OSError(error.errno, error.strerror or str(error), str(path))
