"""A run that answers to the page, in a thread: the playback of `run`, with nobody at a terminal."""

import threading
from types import SimpleNamespace

from warpsim.observers.viewer import Command, Viewer
from warpsim.playback import Playback


class _Nobody:
    """An audience that does not listen."""

    def note(self, text: str) -> None:
        """Forget it."""

    showing = report = end = note


class Playing:
    """Lets pages play `simulation` until the block ends; it stands still at first. `log` keeps what was asked."""

    def __init__(self, simulation, viewer: Viewer, frame_count: int = 600):
        self.log: list[Command] = []
        self._stop = SimpleNamespace(requested=False)
        drain = viewer.commands

        def commands() -> list[Command]:
            found = drain()
            self.log += found
            return found

        viewer.commands = commands
        playback = Playback(simulation, frame_count, _Nobody(), self._stop, viewer)
        self._thread = threading.Thread(target=playback.stay, daemon=True)

    def __enter__(self) -> "Playing":
        self._thread.start()
        return self

    def __exit__(self, *exception) -> None:
        self._stop.requested = True
        self._thread.join(60)
