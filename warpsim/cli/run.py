"""run: simulate a scene, show it in the browser, record it."""

import re
import sys
from pathlib import Path
from typing import Annotated

import typer

from warpsim.cli.validate import JSON

DEVICE = re.compile(r"auto|cpu|cuda(:\d+)?")


def run(
    scene: Annotated[str, typer.Argument(metavar="SCENE", help="A scene file or the name of a shipped scene.")],
    device: Annotated[str, typer.Option(metavar="auto|cpu|cuda:N", help="Where to compute.")] = "auto",
    viewer: Annotated[str, typer.Option(metavar="meshcat|none", help="Show it in the browser, or run at full speed.")] = "meshcat",
    open_browser: Annotated[bool, typer.Option("--open", help="Open the browser.")] = False,
    port: Annotated[int | None, typer.Option(min=0, max=65535, help="Port of the viewer; default: a free one.")] = None,
    frames: Annotated[int | None, typer.Option(min=0, metavar="N", help="Frames to run; default: the scene's duration.")] = None,
    seed: Annotated[int | None, typer.Option(metavar="N", help="Seed, instead of the scene's.")] = None,
    changes: Annotated[
        list[str] | None, typer.Option("--set", metavar="PATH=VALUE", help="Change a value: systems.fire.capacity=500. Repeatable.")
    ] = None,
    out: Annotated[Path | None, typer.Option("--out", metavar="DIR", help="Record into a new run folder.")] = None,
    overwrite: Annotated[bool, typer.Option("--overwrite", help="Let --out replace the run that the folder holds.")] = False,
    threads: Annotated[int | None, typer.Option(min=1, max=1024, metavar="N", help="CPU threads; default: all cores.")] = None,
    watch: Annotated[bool, typer.Option("--watch", help="Start again whenever the scene file changes.")] = False,
    json: JSON = False,
) -> int:
    """Simulate a scene: in the browser in real time, or at full speed with --viewer none."""
    from warpsim.cli.outcome import Exit, Failure

    if not DEVICE.fullmatch(device):
        raise Failure(Exit.USAGE, f"--device {device}: say auto, cpu, cuda or cuda:N")
    if viewer not in ("meshcat", "none"):
        raise Failure(Exit.USAGE, f"--viewer {viewer}: say meshcat or none")
    if watch and out:
        raise Failure(Exit.USAGE, "--watch starts again at every edit and cannot record: leave --out or --watch away")
    if overwrite and not out:
        raise Failure(Exit.USAGE, "--overwrite is about --out: say where to record")
    from warpsim.cli.progress import PlainLines, ProgressBar
    from warpsim.cli.provenance import scene_text
    from warpsim.cli.scenes import SceneFile, found
    from warpsim.cli.session import run_session
    from warpsim.runner import Settings

    stream = sys.stderr if json else sys.stdout
    audience = (ProgressBar if stream.isatty() else PlainLines)(stream, open_browser)
    source = SceneFile(found(scene), tuple(changes or ()), seed, audience.note)
    settings = Settings(
        device=device,
        threads=threads,
        frame_count=frames,
        viewer=viewer == "meshcat",
        port=port,
        stay=watch or (viewer == "meshcat" and sys.stdout.isatty()),
        record=out,
        record_text=scene_text,
        overwrite=overwrite,
        changed=source.edited if watch else _never,
    )
    return run_session(source, settings, audience, watch, json)


def _never() -> bool:
    return False
