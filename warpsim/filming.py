"""HTML recordings of what is shown: one that was asked for beforehand, and any number by the page's button."""

import re
from collections.abc import Callable
from pathlib import Path

MEGABYTE = 1e6


class Filming:
    """Takes the frames that are shown into an HTML recording while one is under way; one at a time.

    path: a recording that begins with the first frame; None: none before `toggle`. Packing the frames costs time, so a run without a
    recording pays nothing.
    """

    def __init__(self, scene, path: Path | None, note: Callable[[str], None]):
        self._scene, self._note = scene, note
        self._film = self._path = None
        self._asked_for = path is not None
        self._count = 0
        if path:
            self._begin(path)

    @property
    def active(self) -> bool:
        """Whether a recording is under way."""
        return self._film is not None

    def add(self, frame) -> None:
        """Take a frame that is shown now."""
        if self._film:
            self._film.add(frame)
            self._count += 1

    def toggle(self, frame) -> None:
        """Begin a recording with the present frame, in the current folder, or end the one under way."""
        if self._film is None:
            self._asked_for = False
            self._begin(_free_path(self._scene.name))
            self.add(frame)
            return
        try:
            self._finish()
        except OSError as error:  # a wish from a page must not end the run
            self._note(f"the recording is lost: {error.filename}: {error.strerror}")

    def close(self) -> None:
        """Write the recording under way. Raises OSError, but only for the one that was asked for beforehand."""
        if self._film and self._asked_for:
            self._finish()
        elif self._film:
            self.toggle(None)

    def _begin(self, path: Path) -> None:
        from warpsim.observers.html import HtmlRecording

        self._film, self._path, self._count = HtmlRecording(path, self._scene, self._scene.time.fps), path, 0

    def _finish(self) -> None:
        film, self._film = self._film, None
        film.close()
        self._note(f"recorded {self._count} frames in {self._path}, {self._path.stat().st_size / MEGABYTE:.1f} MB; open it in a browser")


def file_stem(scene_name: str) -> str:
    """Return the name of a scene as the beginning of a file's name that stays in its folder."""
    return re.sub(r"[^\w.-]+", "-", scene_name).strip("-.") or "scene"


def _free_path(scene_name: str) -> Path:
    """Return a path in the current folder under which nothing stands yet."""
    stem, number = file_stem(scene_name), 1
    while (path := Path.cwd() / f"{stem}{f'-{number}' if number > 1 else ''}.html").exists():
        number += 1
    return path
