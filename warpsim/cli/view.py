"""view: replay a recorded run in the browser."""

import sys
from pathlib import Path
from typing import Annotated

import typer

from warpsim.cli.run import Film, Host, Open, Port, Size, Snapshot, ViewerName, address_of, pixels_of, shows_viewer


def view(
    folder: Annotated[Path, typer.Argument(metavar="RUN", help="A run folder, as --out of `run` makes it.")],
    viewer: ViewerName = None,
    open_browser: Open = False,
    host: Host = "127.0.0.1",
    port: Port = None,
    frames: Annotated[int | None, typer.Option(min=0, metavar="N", help="Last frame to show; default: all that were recorded.")] = None,
    record: Film = None,
    snapshot: Snapshot = None,
    size: Size = "1280x720",
) -> int:
    """Replay a recorded run in the browser: nothing is computed again."""
    from warpsim.cli.outcome import Exit, Failure

    shown = shows_viewer(viewer, snapshot)
    if not (shown or record or snapshot):
        raise Failure(Exit.USAGE, "--viewer none leaves nothing to do: say --record FILE.html or --snapshot FILE.png")
    pixels = pixels_of(size)
    from warpsim.cli.progress import audience_on
    from warpsim.cli.session import show_session
    from warpsim.runner import Picture, Showing

    showing = Showing(
        viewer=shown,
        host=address_of(host),
        port=port,
        stay=shown and sys.stdout.isatty(),
        frame_count=frames,
        film=record,
        picture=Picture(snapshot, pixels) if snapshot else None,
    )
    return show_session(folder, showing, audience_on(sys.stdout, open_browser))
