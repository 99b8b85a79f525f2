"""The command line: `python -m warpsim VERB`, one small module per verb. None imports Warp, NumPy or the viewer before it needs them."""

import atexit
import gc
import os
import signal
import sys
from contextlib import suppress
from typing import Annotated, NoReturn


def main(arguments: list[str] | None = None) -> int:
    """Run the command line (default: sys.argv) and return its exit code, see `warpsim.cli.outcome.Exit`."""
    if arguments is None:
        signal.signal(signal.SIGINT, _leave)
        gc.set_threshold(*_RARELY)
    from warpsim.cli.outcome import exit_code_of

    # Not typer's standalone mode: it would turn Ctrl-C into exit code 1. This way a verb's return value is the exit code.
    return exit_code_of(lambda: _application()(args=arguments, prog_name="warpsim", standalone_mode=False))


def live() -> NoReturn:
    """Be a process that runs the command line, to its end.

    What is due at an end is done, but nothing is taken apart: that costs half a second (two and more on a busy machine), and would wait
    for compilers that an interrupted run has left at work.
    """
    code = main()
    for stream in (sys.stdout, sys.stderr):
        with suppress(OSError, ValueError):  # main has told by its code where standard output takes nothing
            stream.flush()
    with suppress(OSError):  # a compiler that is at work misses its precompiled header from here on, and need not say so
        os.dup2(os.open(os.devnull, os.O_WRONLY), 2)
    atexit._run_exitfuncs()
    os._exit(code)


def _leave(number: int, frame) -> None:
    """Leave at once: until a run takes the signals over there is nothing to save, and an exception within an import can be lost."""
    os._exit(130)


def _application():
    """Return the typer application. Its help is plain text: rendering it with rich costs more than all the rest of `--help`."""
    import typer

    from warpsim.cli import converge, doctor, info, list, new, run, schema, streamlines, validate, verify, view

    app = typer.Typer(
        add_completion=False, no_args_is_help=True, rich_markup_mode=None, pretty_exceptions_enable=False, context_settings=_HELP_OPTIONS
    )

    @app.callback(epilog="A scene is a YAML file or the name of a shipped scene (see `list`).  Try: warpsim run campfire")
    def top(version: Annotated[bool, typer.Option("--version", callback=_print_version, is_eager=True, help="Print the version.")] = False):
        """Procedural animation as text: particles in exact flow fields, on a GPU or on all CPU cores."""

    app.command("run")(run.run)
    app.command("view")(view.view)
    app.command("list")(list.list_scenes)
    app.command("info")(info.info)
    app.command("new")(new.new)
    app.command("validate")(validate.validate)
    app.command("verify")(verify.verify)
    app.command("converge")(converge.converge)
    app.command("streamlines")(streamlines.streamlines)
    app.command("schema")(schema.schema)
    app.command("doctor")(doctor.doctor)
    return app


_RARELY = (100_000, 20, 20)  # as Python has it, a third of what loading Warp and the kernels takes were searches for garbage in them
_HELP_OPTIONS = {"help_option_names": ["-h", "--help"]}


def _print_version(wanted: bool) -> None:
    if wanted:
        from warpsim import __version__

        print(f"warpsim {__version__}")
        sys.exit(0)
