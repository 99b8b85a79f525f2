"""--threads: how many cores may work, in the user's words."""

import re
from collections.abc import Callable
from typing import Annotated

import typer

Threads = Annotated[
    str | None, typer.Option("--threads", metavar="N", help="CPU cores to use at most; default: all that this process may use.")
]


def thread_count(text: str | None, note: Callable[[str], None]) -> int | None:
    """Return the number that --threads asks for, None where it does not; more than there are are told, and are as many as there are.

    Raises Failure (usage) for what is no number of cores.
    """
    if text is None:
        return None
    from warpsim.cores import available_cores

    there = available_cores()
    if not re.fullmatch(r"0*[1-9]\d{0,8}", text):
        from warpsim.cli.outcome import Exit, Failure

        raise Failure(Exit.USAGE, f"--threads {text}: say a whole number of cores from 1 on; this process may use {there}")
    if int(text) > there:
        note(f"--threads {text}: this process may use {there} core{'s' * (there > 1)}; more threads would only wait for each other")
    return min(int(text), there)
