"""python -m tests.forked: a process that has imported warpsim already and lives each command line in a fork of itself.

Starting Python and importing Warp takes two seconds, a fork some milliseconds; all else is as a user has it: a process of its own with
its folder, its variables, its streams, its exit code and its end, in which Warp is initialized. One order a line on standard input, one
answer a line on standard output, as JSON.
"""

import atexit
import json
import os
import sys
import threading
import traceback

PRELOADED = (
    "warpsim.simulation",
    "warpsim.verify",
    "warpsim.observers.viewer",
    "warpsim.cli.run",
    "warpsim.cli.verify",
    "warpsim.cli.view",
)


def live(arguments: list[str], environment: dict[str, str], cwd: str, out: str, err: str) -> int:
    """Be a process with these arguments, variables and streams, to its end but for the last step; return its exit code."""
    os.environ.clear()
    os.environ.update(environment)
    os.chdir(cwd)
    for number, path, flags in ((0, os.devnull, os.O_RDONLY), (1, out, os.O_WRONLY), (2, err, os.O_WRONLY)):
        opened = os.open(path, flags)
        os.dup2(opened, number)
        os.close(opened)
    sys.argv = ["warpsim", *arguments]
    from warpsim.cli import main

    code = main()
    threading._shutdown()  # as Python ends, but without the half second of taking all that was imported apart
    atexit._run_exitfuncs()
    sys.stdout.flush()
    return code


def serve() -> None:
    """Take orders until there are none."""
    for name in PRELOADED:
        __import__(name)
    answers = os.fdopen(os.dup(1), "w", buffering=1)
    for line in iter(sys.stdin.buffer.raw.readline, b""):
        child = os.fork()
        if not child:
            code = 70
            try:
                code = live(**json.loads(line))
            except BaseException:  # main lets none through
                traceback.print_exc()
            finally:
                os._exit(code)
        _, status = os.waitpid(child, 0)
        print(os.waitstatus_to_exitcode(status), file=answers)


if __name__ == "__main__":
    serve()
