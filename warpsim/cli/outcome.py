"""Exit codes, and how every error becomes one: a user's mistake ends in words, a bug of ours in one line and a crash report."""

import json
import os
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from enum import IntEnum
from pathlib import Path


class Exit(IntEnum):
    """What the process tells its caller."""

    OK = 0
    CHECK_FAILED = 1
    USAGE = 2
    BAD_SCENE = 3
    UNSTABLE = 4
    INPUT_OUTPUT = 5
    INTERNAL = 70  # EX_SOFTWARE of sysexits.h: a bug of warpsim, with a crash report
    INTERRUPTED = 130


class Failure(Exception):
    """An end with words for the user and an exit code."""

    def __init__(self, code: Exit, message: str):
        super().__init__(message)
        self.code = code


@contextmanager
def interruption_told() -> Iterator[None]:
    """Turn KeyboardInterrupt into words and an exit code; some versions of typer take it for themselves and say nothing."""
    try:
        yield
    except KeyboardInterrupt:
        raise Failure(Exit.INTERRUPTED, "interrupted") from None


def exit_code_of(action: Callable[[], object]) -> int:
    """Run an action that returns an exit code or None, and return the exit code, whatever happens in it."""
    _open_streams()
    try:
        code = action()
        sys.stdout.flush()
        return code or Exit.OK
    except SystemExit as end:  # typer's, at --help and where the reader of a pipe has left: then with 1, which means something else here
        return Exit.INPUT_OUTPUT if end.code else Exit.OK
    except KeyboardInterrupt:
        return _said(Exit.INTERRUPTED, "interrupted")
    except BrokenPipeError:  # the reader has left, and wants no words about it
        _abandon_output()
        return Exit.INPUT_OUTPUT
    except Failure as failure:
        return _said(failure.code, str(failure) if failure.code == Exit.INTERRUPTED else f"error: {failure}")
    except OSError as error:
        if error.filename is None:  # files are named: this was standard output, as on a full disk
            _abandon_output()
        return _said(Exit.INPUT_OUTPUT, f"error: {_located(error)}")
    except Exception as error:
        return _exit_code_of_error(error)


def _exit_code_of_error(error: Exception) -> int:
    if isinstance(error, ModuleNotFoundError) and error.name and not error.name.startswith("warpsim"):
        return _said(Exit.INPUT_OUTPUT, f"error: the package {error.name} is missing: install it with pip install warpsim")
    import typer

    if isinstance(error, typer.Abort):  # typer's word for Ctrl-C
        return _said(Exit.INTERRUPTED, "interrupted")
    if hasattr(error, "show") and hasattr(error, "exit_code"):  # its usage errors; the class lives in click or in typer, by version
        error.show()
        return Exit.USAGE
    from warpsim.scene import SceneError, UnknownSceneError

    if isinstance(error, SceneError):
        return _said(Exit.USAGE if isinstance(error, UnknownSceneError) else Exit.BAD_SCENE, str(error))
    return _crashed(error)


def _open_streams() -> None:
    """Make printing safe: a closed stream takes everything, and a character that the terminal cannot show becomes a question mark."""
    for name in ("stdout", "stderr"):
        if getattr(sys, name) is None:
            setattr(sys, name, open(os.devnull, "w"))  # noqa: SIM115  (as long as the process lives)
        if hasattr(getattr(sys, name), "reconfigure"):
            getattr(sys, name).reconfigure(errors="replace")


def _abandon_output() -> None:
    """Send the rest of standard output nowhere, because Python would fail to flush it once more at exit."""
    with suppress(OSError, ValueError):
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


def print_json(value: object) -> None:
    """Print a result for machines."""
    print(json.dumps(value, indent=2))


def _said(code: Exit, text: str) -> Exit:
    print(text, file=sys.stderr)
    return code


def _located(error: OSError) -> str:
    reason = error.strerror or str(error)
    return f"{error.filename}: {reason}" if error.filename else reason


def _crashed(error: Exception) -> Exit:
    """Write the crash report into the current folder, else the temporary one, and say so in one line."""
    import platform
    import tempfile
    import traceback

    from warpsim import __version__
    from warpsim.files import write_text

    name = time.strftime(f"warpsim-crash-%Y%m%d-%H%M%S-{os.getpid()}.txt")
    facts = f"warpsim {__version__}, Python {platform.python_version()}, {platform.platform()}\narguments: {sys.argv[1:]}\n\n"
    where = "no place to write a crash report"
    for folder in (Path.cwd(), Path(tempfile.gettempdir())):
        try:
            write_text(folder / name, facts + "".join(traceback.format_exception(error)))
            where = f"a crash report is in {folder / name}"
            break
        except OSError:
            continue
    first_line = str(error).partition("\n")[0]
    return _said(Exit.INTERNAL, f"internal error: {type(error).__name__}: {first_line} ({where}; please send it to us)")
