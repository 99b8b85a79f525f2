"""python -m benchmarks.viewer: the viewer in a real headless Chromium, stock Meshcat beside it, and what watching costs a run.

Drawing is excluded: the draw range is cut to one point and all else, upload and acknowledgement included, stays real, because a
software renderer would be all that is measured. Needs tests/browser.py, so it runs from a checkout.
"""

import argparse
import contextlib
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Iterator
from pathlib import Path
from statistics import median
from types import SimpleNamespace

import numpy as np
from rich.console import Console

from benchmarks.cases import million
from benchmarks.measure import Sample
from benchmarks.report import Report
from tests.browser import Browser, Page
from warpsim import Scene, Simulation
from warpsim.kernel_cache import prepare_kernel_cache
from warpsim.observers.html import HtmlRecording
from warpsim.observers.viewer import Viewer
from warpsim.observers.viewer.client import Client
from warpsim.runner import SWITCH_INTERVAL

FPS = 60.0
BARS = {100_000: "55", 1_000_000: "25"}  # frames/s
ONE_POINT = """Cloud.prototype.show = ((show) => function (parts) {
    show.call(this, parts);
    this.points.geometry.setDrawRange(0, Math.min(1, this.count));
})(Cloud.prototype.show), true"""
STOCK_ONE_POINT = """viewer.handle_command = ((take) => function (command) {
    take.call(viewer, command);
    if (command.type === "set_object") window.taken = (window.taken || 0) + 1;
    viewer.scene.traverse((thing) => { if (thing.isPoints) thing.geometry.setDrawRange(0, 1); });
})(viewer.handle_command), true"""


def cloud_scene(count: int) -> Scene:
    """A scene of one system of `count` points, by day: the glow of a night is drawing too."""
    emitter = {"burst": {"count": count}}
    look = {"as": "points", "blend": "alpha", "size": 0.01, "color": "#808080"}
    system = {"type": "particles", "capacity": count, "emitters": [emitter], "look": look}
    return Scene.model_validate({"name": f"{count} points", "viewer": {"max_points": 10_000_000}, "systems": {"cloud": system}})


class Recorded:
    """Frames made beforehand: packed points that move, so that nothing but the viewer is measured."""

    is_network = tears = False
    collider_poses = np.zeros((0, 7), np.float32)

    def __init__(self, count: int):
        rng = np.random.default_rng(count)
        self.count, self.index = count, 0
        steps = np.float32(1 / 65535), np.zeros(3, np.float32)
        self.clouds = [
            SimpleNamespace(
                count=count,
                position=rng.integers(0, 65536, (count, 4), np.uint16),
                color=rng.integers(0, 256, (count, 4), np.uint8),
                scale=np.full(3, steps[0]),
                offset=steps[1],
                size_max=0.01,
            )
            for _ in range(3)
        ]

    def __getitem__(self, name: str) -> "Recorded":
        return self

    @property
    def time(self) -> float:
        return self.index / FPS

    def packed(self, limit: int | None = None) -> SimpleNamespace:
        return self.clouds[self.index % 3]


@contextlib.contextmanager
def noted_acks() -> Iterator[list[tuple[int, float]]]:
    """Yield a list that takes (what it was, moment [s]) of whatever a page says."""
    acks, take = [], Client.on_message

    def noted(self, message):
        before = set(self.unanswered)
        take(self, message)
        acks.extend((number, time.perf_counter()) for number in before - set(self.unanswered))

    Client.on_message = noted
    try:
        yield acks
    finally:
        Client.on_message = take


def ours(browser: Browser, count: int, seconds: float) -> tuple[float, float]:
    """Return frames per second and the median time from publishing to the ack of the drawn frame [s]; a run offers 60 a second."""
    frames, published = Recorded(count), {}
    with noted_acks() as acks, Viewer(cloud_scene(count), port=0) as viewer:
        page = browser.open(viewer.url)
        page.run(ONE_POINT)
        end, due = time.perf_counter() + seconds + 1.0, time.perf_counter()
        while (now := time.perf_counter()) < end:
            if now >= due and viewer.wants_frame():
                frames.index += 1
                published[viewer._hub.number + 1] = time.perf_counter()
                viewer.publish(frames)
                due = max(due + 1.0 / FPS, now - 0.05)
            time.sleep(0.0005)
        page.command("Page.close")
    settled = [(number, moment) for number, moment in acks if moment > end - seconds]
    return len(settled) / seconds, median(moment - published[number] for number, moment in settled)


def stock(browser: Browser, count: int, seconds: float) -> float:
    """Return frames per second that stock Meshcat's page takes, with `set_object` for each frame, as its examples have it."""
    import meshcat
    import meshcat.geometry

    rng = np.random.default_rng(count)
    clouds = [(rng.random((3, count), np.float32), rng.random((3, count), np.float32)) for _ in range(3)]
    with tempfile.TemporaryFile() as noise, contextlib.redirect_stdout(open(noise.fileno(), "w", closefd=False)):
        shown = meshcat.Visualizer()
    stop = threading.Event()

    def push() -> None:
        turn = 0
        while not stop.is_set():
            place, color = clouds[turn % 3]
            shown["cloud"].set_object(meshcat.geometry.PointCloud(place, color))  # may never return: a page that dies keeps it
            turn += 1

    try:
        page = browser.open(shown.url())
        page.wait_for("typeof viewer !== 'undefined'")
        page.run(STOCK_ONE_POINT)
        threading.Thread(target=push, daemon=True).start()
        time.sleep(1.0)
        first, began = page.run("window.taken || 0"), time.perf_counter()
        time.sleep(seconds)
        taken = page.run("window.taken || 0") - first
        rate = taken / (time.perf_counter() - began)
        stop.set()
        time.sleep(0.5)
        page.command("Page.close")
        return rate
    finally:
        stop.set()
        shown.window.server_proc.kill()
        shown.window.server_proc.wait()


@contextlib.contextmanager
def watching(url: str) -> Iterator[None]:
    """Let a page of another process watch, 60 frames a second: a browser draws on a graphics card, not on the cores of the run."""
    process = subprocess.Popen([sys.executable, "-m", "tests.viewer.watcher", url], cwd=Path(__file__).parents[1])
    try:
        yield
    finally:
        process.kill()
        process.wait()


def watched(count: int, rounds: int) -> Sample:
    """Return the step rate of a run that a page watches over that of the same run alone, in turns, at full speed on one core."""
    simulation = Simulation(million(count).scene, device="cpu", threads=1)
    simulation.run(seconds=0.5)
    ratios = []
    with Viewer(simulation.scene, port=0) as viewer, watching(viewer.url):
        viewer.wait_for_client(30.0)
        for turn in range(rounds + 1):
            rates = {}
            for seen in (True, False) if turn % 2 else (False, True):
                began, steps = time.perf_counter(), 0
                while (passed := time.perf_counter() - began) < 0.4:
                    simulation.step_frame()
                    steps += 1
                    if seen and viewer.wants_frame(behind=True):  # at full speed there is no time to give away
                        viewer.publish(simulation.frame())
                rates[seen] = steps / passed
            ratios.append(rates[True] / rates[False])
    return Sample(ratios[1:])


def recording(browser: Browser, frame_count: int, count: int) -> tuple[float, float, float]:
    """Return the size of an HTML recording [MB], frames per second at which it plays, and what a frame of recording costs [s]."""
    simulation = Simulation(million(count).scene, device="cpu", threads=1)
    simulation.run(seconds=0.5)
    with tempfile.TemporaryDirectory() as folder:
        path, spent = Path(folder) / "recording.html", 0.0
        with HtmlRecording(path, simulation.scene, FPS) as film:
            for frame in simulation.frames(frame_count):
                began = time.perf_counter()
                film.add(frame)
                spent += time.perf_counter() - began
        page = browser.open(path.as_uri())
        page.run(ONE_POINT)
        page.wait_for("player.count >= 1")  # a slow page skips frames and may be at the end before it has shown ten
        rate = playing_rate(page, 0.8 * frame_count / FPS)
        page.command("Page.close")
        return path.stat().st_size / 1e6, rate, spent / frame_count


def playing_rate(page: Page, seconds: float) -> float:
    """Return how many frames of a recording its page shows a second, from its beginning."""
    page.run("player.ask({type: 'reset'}), player.ask({type: 'play'})")
    first = page.run("[player.count, performance.now()]")
    time.sleep(seconds)
    last = page.run("[player.count, performance.now()]")
    return 1000.0 * (last[0] - first[0]) / (last[1] - first[1])


def measure_viewer(report: Report, quick: bool) -> None:
    """Print all figures of the viewer."""
    counts, seconds, rounds = ((10_000,), 1.5, 2) if quick else ((10_000, 100_000, 1_000_000), 4.0, 3)
    header = ["points", "frames/s", "to reach", "publish to ack", "stock Meshcat, frames/s"]
    lines = []
    with Browser((640, 480)) as browser:
        for count in counts:
            runs = [(*ours(browser, count, seconds), stock(browser, count, seconds)) for _ in range(rounds)]
            rate, delay, theirs = (median(column) for column in zip(*runs, strict=True))
            cells = [f"{count:,}", f"{rate:.1f}", BARS.get(count, ""), f"{1e3 * delay:.1f} ms", f"{theirs:.1f}"]
            lines.append((cells, {"points": count, "frames_per_second": rate, "delay": delay, "stock": theirs}))
        what = "a run that offers 60 frames/s, in headless Chromium, one point drawn; medians"
        report.figures("viewer", what, header, lines)
        for count in counts[:2]:
            share = watched(count, 4 if quick else 20)
            text = f"{share.median:.1%} of the step rate alone, spread {share.spread:.0%}, to reach: 90 %"
            report.fact("viewer", f"{count:,} particles at full speed on one core, watched", text, share=share.median, spread=share.spread)
        frames, count = (60, 5_000) if quick else (300, 20_000)
        size, rate, cost = recording(browser, frames, count)
        text = f"{size:.1f} MB, plays {rate:.0f} frames/s from a file (to reach: 30), {1e3 * cost:.1f} ms a frame to record"
        report.fact("viewer", f"HTML recording of {frames} frames of {count:,} particles", text, megabytes=size, rate=rate, cost=cost)


def main() -> None:
    """Measure the viewer."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.viewer", description=__doc__)
    parser.add_argument("--quick", action="store_true", help="shows that it works, not how fast")
    parser.add_argument("--json", type=Path, metavar="FILE", help="write every figure as a JSON line")
    options = parser.parse_args()
    prepare_kernel_cache(print)
    sys.setswitchinterval(SWITCH_INTERVAL)  # as a run with a viewer has it
    report = Report(Console(width=None if sys.stdout.isatty() else 140))
    measure_viewer(report, options.quick)
    if options.json:
        report.write(options.json)


if __name__ == "__main__":
    main()
