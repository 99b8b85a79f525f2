"""run: simulate a scene, show it in the browser, record it."""

import ipaddress
import re
import sys
from pathlib import Path
from typing import Annotated

import typer

from warpsim.cli.threads import Threads, thread_count
from warpsim.cli.validate import JSON

DEVICE = re.compile(r"auto|cpu|cuda(:\d+)?")
SIZE = re.compile(r"(\d{1,5})x(\d{1,5})")
LARGEST_PICTURE = 8192  # pixels to a side

ViewerName = Annotated[
    str | None,
    typer.Option("--viewer", metavar="meshcat|none", help="In the browser, or at full speed; default: meshcat, with --snapshot none."),
]
Open = Annotated[bool, typer.Option("--open", help="Open the browser.")]
Host = Annotated[
    str, typer.Option(metavar="ADDRESS", help="Address the viewer listens on; beyond this machine its link carries a secret token.")
]
Port = Annotated[int | None, typer.Option(min=0, max=65535, help="Port of the viewer; default: a free one.")]
Film = Annotated[Path | None, typer.Option("--record", metavar="FILE.html", help="Record what is shown into one HTML file.")]
Snapshot = Annotated[Path | None, typer.Option("--snapshot", metavar="FILE.png", help="Save a picture of the last frame.")]
Size = Annotated[str, typer.Option("--size", metavar="WxH", help="Size of the picture [pixels].")]


def run(
    scene: Annotated[str, typer.Argument(metavar="SCENE", help="A scene file or the name of a shipped scene.")],
    device: Annotated[str, typer.Option(metavar="auto|cpu|cuda:N", help="Where to compute.")] = "auto",
    viewer: ViewerName = None,
    open_browser: Open = False,
    host: Host = "127.0.0.1",
    port: Port = None,
    frames: Annotated[int | None, typer.Option(min=0, metavar="N", help="Frames to run; default: the scene's duration.")] = None,
    seed: Annotated[int | None, typer.Option(metavar="N", help="Seed, instead of the scene's.")] = None,
    overrides: Annotated[
        list[str] | None, typer.Option("--set", metavar="PATH=VALUE", help="Change a value: systems.fire.capacity=500. Repeatable.")
    ] = None,
    changes: Annotated[
        Path | None, typer.Option("--changes", metavar="FILE", help="Make the changes again that a recorded run kept in changes.jsonl.")
    ] = None,
    out: Annotated[Path | None, typer.Option("--out", metavar="DIR", help="Record into a new run folder.")] = None,
    overwrite: Annotated[bool, typer.Option("--overwrite", help="Let --out replace the run that the folder holds.")] = False,
    record: Film = None,
    snapshot: Snapshot = None,
    size: Size = "1280x720",
    threads: Threads = None,
    watch: Annotated[bool, typer.Option("--watch", help="Start again whenever the scene file changes.")] = False,
    json: JSON = False,
) -> int:
    """Simulate a scene: in the browser in real time, or at full speed with --viewer none."""
    from warpsim.cli.outcome import Exit, Failure

    if not DEVICE.fullmatch(device):
        raise Failure(Exit.USAGE, f"--device {device}: say auto, cpu, cuda or cuda:N")
    if watch and (out or record or snapshot):
        raise Failure(Exit.USAGE, "--watch starts again at every edit and cannot record: leave --out, --record, --snapshot or --watch away")
    if overwrite and not out:
        raise Failure(Exit.USAGE, "--overwrite is about --out: say where to record")
    shown = shows_viewer(viewer, snapshot)
    pixels = pixels_of(size)
    from warpsim.cli.progress import audience_on
    from warpsim.cli.provenance import scene_text
    from warpsim.cli.scenes import SceneFile, found
    from warpsim.cli.session import run_session
    from warpsim.runner import Picture, Settings, Showing

    audience = audience_on(sys.stderr if json else sys.stdout, open_browser)
    cores = thread_count(threads, audience.note)
    source = SceneFile(found(scene), tuple(overrides or ()), seed, audience.note)
    showing = Showing(
        viewer=shown,
        host=address_of(host),
        port=port,
        stay=watch or (shown and sys.stdout.isatty()),
        frame_count=frames,
        film=record,
        picture=Picture(snapshot, pixels) if snapshot else None,
        changed=source.edited if watch else _never,
    )
    settings = Settings(device, cores, showing, out, scene_text, overwrite, _changes_in(changes))
    return run_session(source, settings, audience, watch, json)


def address_of(host: str) -> str:
    """Return the IPv4 address that --host names."""
    from warpsim.cli.outcome import Exit, Failure

    try:
        return str(ipaddress.IPv4Address("127.0.0.1" if host == "localhost" else host))
    except ValueError:
        raise Failure(Exit.USAGE, f"--host {host}: say an IPv4 address, such as 127.0.0.1 or 0.0.0.0 for all of this machine's") from None


def shows_viewer(viewer: str | None, snapshot: Path | None) -> bool:
    """Return whether --viewer asks for the browser. Raises Failure (usage)."""
    from warpsim.cli.outcome import Exit, Failure

    if viewer not in (None, "meshcat", "none"):
        raise Failure(Exit.USAGE, f"--viewer {viewer}: say meshcat or none")
    return viewer == "meshcat" or (viewer is None and snapshot is None)


def pixels_of(text: str) -> tuple[int, int]:
    """Return width and height of --size. Raises Failure (usage)."""
    from warpsim.cli.outcome import Exit, Failure

    match = SIZE.fullmatch(text)
    if not match or not all(1 <= int(side) <= LARGEST_PICTURE for side in match.groups()):
        raise Failure(Exit.USAGE, f"--size {text}: say width x height in pixels, up to {LARGEST_PICTURE}, as in 1280x720")
    return int(match[1]), int(match[2])


def _changes_in(path: Path | None) -> tuple[tuple[int, str, str], ...]:
    if path is None:
        return ()
    from warpsim.cli.outcome import Exit, Failure
    from warpsim.observers.recorder import DamagedChanges, read_changes

    try:
        return tuple(read_changes(path))
    except DamagedChanges as error:
        raise Failure(Exit.INPUT_OUTPUT, str(error)) from None


def _never() -> bool:
    return False
