"""How a run is told: a progress bar on a terminal, plain lines into a pipe."""

import sys
import time

from warpsim.cli.browser import opened_in_browser
from warpsim.reporting import Report

LINE_PERIOD = 2.0  # s between plain lines
BROWSER_PATIENCE = 10.0  # s a browser may take to load the page before the run goes on without it


def summary(report: Report) -> str:
    """Return a report as one line: frames, living particles, milliseconds of computing per frame, times real time."""
    live = sum(int(numbers["live"]) for numbers in report.statistics.values())
    return (
        f"frame {report.index}/{report.frame_count}  t = {report.time:.3f} s  {live} live"
        f"  {report.frame_time * 1e3:.2f} ms/frame  {report.speed:.1f}x real time"
    )


class PlainLines:
    """Tells a run in plain lines: one every two seconds and one at the end. `stream` is standard output, or the error stream where
    standard output is for a result in JSON."""

    def __init__(self, stream=None, open_browser: bool = False):
        self._stream, self._open_browser = stream or sys.stdout, open_browser
        self._told_at = time.monotonic()

    def note(self, text: str) -> None:
        """Print one line."""
        print(text, file=self._stream, flush=True)

    def showing(self, viewer) -> None:
        """Say where to look, and open the browser where that was asked for."""
        self.note(f"look at {viewer.url}")
        if not self._open_browser:
            return
        trouble = opened_in_browser(viewer.url)
        if trouble:
            self.note(f"--open: {trouble}; the run goes on, open the address yourself")
        else:
            viewer.wait_for_client(BROWSER_PATIENCE)

    def report(self, report: Report) -> None:
        """Print a report if the last line is two seconds old."""
        if time.monotonic() - self._told_at >= LINE_PERIOD:
            self._told_at = time.monotonic()
            self.note(summary(report))

    def end(self, report: Report | None = None) -> None:
        """Print the last line of a run, if there is something to tell."""
        if report:
            self.note(summary(report))


class ProgressBar(PlainLines):
    """Tells a run by a bar on a terminal; notes stand above it."""

    def __init__(self, stream=None, open_browser: bool = False):
        super().__init__(stream, open_browser)
        from rich.console import Console
        from rich.progress import BarColumn, Progress, TextColumn

        self._console = Console(file=self._stream, highlight=False, soft_wrap=True)
        columns = BarColumn(bar_width=None), TextColumn("{task.fields[words]}")
        self._progress = Progress(*columns, console=self._console, auto_refresh=False, expand=True, transient=True)
        self._task = None

    def note(self, text: str) -> None:
        """Print one line above the bar."""
        self._console.print(text, markup=False)

    def report(self, report: Report) -> None:
        """Move the bar."""
        if self._task is None:
            self._progress.start()
            self._task = self._progress.add_task("", total=report.frame_count, words="")
        self._progress.update(self._task, completed=report.index, words=summary(report))
        self._progress.refresh()

    def end(self, report: Report | None = None) -> None:
        """Take the bar away and leave the last line."""
        if self._task is not None:
            self._progress.stop()
            self._progress.remove_task(self._task)
            self._task = None
        super().end(report)


def audience_on(stream, open_browser: bool) -> PlainLines:
    """Return who tells a run on a stream: a bar on a terminal, plain lines elsewhere."""
    return (ProgressBar if stream.isatty() else PlainLines)(stream, open_browser)
