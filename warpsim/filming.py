"""HTML recordings of what is shown: one that was asked for beforehand, and any number by the page's button."""

import re
from collections.abc import Callable
from pathlib import Path

MEGABYTE = 1e6


class Filming:
    """Takes the frames that are shown into an HTML recording while one is under way; one at a time.

    path: a recording that begins with the first frame; None: none before `toggle`. lines: returns streamlines to be drawn into a
    recording, float32 (n, k, 3) [m]. Raises OSError where the recording cannot be begun.
    """

    def __init__(self, scene, path: Path | None, note: Callable[[str], None], lines: Callable[[], object] | None = None):
        self._scene, self._note, self._lines = scene, note, lines
        self._film = None
        self._asked_for = path is not None
        if path:
            self._begin(path)

    @property
    def active(self) -> bool:
        """Whether a recording is under way."""
        return self._film is not None

    def add(self, frame) -> None:
        """Take a frame that is shown now; packing it costs time."""
        if self._film:
            self._film.add(frame)

    def toggle(self, frame) -> None:
        """End the recording under way, or begin one in the current folder, with `frame` if it stands still. A wish never ends a run."""
        try:
            if self._film:
                self._finish()
            else:
                self._asked_for = False
                self._begin(_free_path(self._scene.name))
                if frame is not None:
                    self.add(frame)
        except OSError as error:
            self._note(f"the recording is lost: {error.filename}: {error.strerror}")

    def close(self) -> None:
        """Write the recording under way. Raises OSError, but only for the one that was asked for beforehand."""
        if self._film and self._asked_for:
            self._finish()
        elif self._film:
            self.toggle(None)

    def abandon(self) -> None:
        """Leave nothing of a recording that is still under way."""
        if self._film:
            self._film.abandon()
            self._film = None

    def _begin(self, path: Path) -> None:
        from warpsim.observers.html import HtmlRecording

        self._film = HtmlRecording(path, self._scene, self._scene.time.fps)
        if self._lines:
            self._film.show_lines(self._lines())

    def _finish(self) -> None:
        film, self._film = self._film, None
        film.close()
        size = film.path.stat().st_size / MEGABYTE
        self._note(f"{film.count} frames are in {film.path}, {size:.1f} MB: open it in a browser")


def file_stem(scene_name: str) -> str:
    """Return the name of a scene as the beginning of a file's name that stays in its folder."""
    return re.sub(r"[^\w.-]+", "-", scene_name).strip("-.") or "scene"


def _free_path(scene_name: str) -> Path:
    """Return a path in the current folder under which nothing stands yet."""
    stem, number = file_stem(scene_name), 1
    while (path := Path.cwd() / f"{stem}{f'-{number}' if number > 1 else ''}.html").exists():
        number += 1
    return path
