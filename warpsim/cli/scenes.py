"""Which scene a user means: a file, or the name of a shipped scene; and whether it was edited since."""

import time
from collections.abc import Callable
from pathlib import Path

from warpsim.cli.outcome import Exit, Failure

WATCH_PERIOD = 0.2  # s between looks at the file


def found(text: str) -> Path:
    """Return the file of a scene given by path or by shipped name. Raises UnknownSceneError, or Failure (usage) for a missing file."""
    from warpsim.scene import SceneError, find_scene, load_scene

    path = find_scene(text)
    if not path.exists():
        try:
            load_scene(path)  # says so, and which file comes near
        except SceneError as error:
            raise Failure(Exit.USAGE, str(error)) from None
    return path


class SceneFile:
    """A scene file with the changes asked for on the command line; `edited` watches it."""

    def __init__(self, path: Path, changes: tuple[str, ...], seed: int | None, note: Callable[[str], None]):
        self.path, self._changes, self._seed, self._note = path, changes, seed, note
        self.scene = None
        self._looked_at = 0.0
        self._stamp = self._present_stamp()

    def load(self):
        """Load the scene and return it. Raises SceneError, OSError."""
        from warpsim.scene import load_scene

        self._stamp = self._present_stamp()
        self.scene = load_scene(self.path, overrides=self._changes, seed=self._seed)
        return self.scene

    def placing(self):
        """Return a context in which mistakes found while the scene is built get their places in the file."""
        from warpsim.scene.placing import placed_in

        return placed_in(self.path, self._changes)

    def edited(self) -> bool:
        """Return whether the file has a new version that loads, and load it. What is wrong with one that does not is noted, once."""
        if time.monotonic() - self._looked_at < WATCH_PERIOD:
            return False
        self._looked_at = time.monotonic()
        if self._present_stamp() in (None, self._stamp):
            return False
        from warpsim.scene import SceneError

        try:
            self.load()
        except (SceneError, OSError) as error:
            self._note(f"{error}\n(the run goes on with the scene as it was)")
            return False
        return True

    def _present_stamp(self) -> tuple[int, int, int] | None:
        try:
            status = self.path.stat()
        except OSError:
            return None  # an editor is just replacing it
        return status.st_mtime_ns, status.st_size, status.st_ino
