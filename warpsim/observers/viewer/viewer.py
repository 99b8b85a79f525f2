"""The viewer: shows a run in the browser, takes the wishes of those who watch, and cannot slow or stop the run."""

import ipaddress
import socket
import time

import numpy as np

from warpsim.observers.viewer.blocks import frame_blocks
from warpsim.observers.viewer.controls import Bulletin, Command, Inbox, Status, status_command
from warpsim.observers.viewer.hub import DEFAULT_PORT, Hub
from warpsim.observers.viewer.pages import checked_token
from warpsim.observers.viewer.protocol import pack_command, pack_frame
from warpsim.observers.viewer.stage import lines_command, net_commands, stage_commands

# All points go out while the run stands still, up to so many: 48 MB a frame, and a browser still turns them.
MOST_POINTS_AT_REST = 4_000_000
SHARE_OF_BUSY_RUN = 0.04


class Viewer:
    """Serves a page that shows the latest frame of a run, at `url`.

    Nothing is packed unless a page waits for it, so publish when asked:

        with Viewer(scene) as viewer:
            for frame in simulation.frames(n):
                if viewer.wants_frame():
                    viewer.publish(frame)

    Ask again after the last frame too: a page opened late, or fallen behind, waits for it.  A run that answers to the page's
    buttons and sliders tells its `Status` now and then, and takes `commands()` between frames; one that never tells has none.

    Arguments: `scene`, of which the name, camera, looks and controls are read; `host`, a loopback address, or any with a
    `token` (see `fresh_token`), which is then part of the url and asked of every page; `port`, where the search for a free
    port begins (default 7000; 0: any).  Raises ValueError for a host that other machines can reach without a token and for a
    token of less than 16 characters, OSError where no port can be bound, ModuleNotFoundError without the package meshcat.
    """

    def __init__(self, scene, host: str = "127.0.0.1", port: int | None = None, token: str | None = None):
        self._scene, self._joined = scene, False
        self._names = list(scene.systems)
        self._most_points = scene.viewer.max_points
        self._shown: tuple[int, float, bool] | None = None
        self._affordable_at = 0.0
        self._inbox, self._bulletin = Inbox(scene.sliders), Bulletin()
        token = checked_token(token)
        # 0.0.0.0 is every address of this machine; its name is the one that others know.
        name = socket.gethostname() if ipaddress.IPv4Address(host).is_unspecified else host
        self._hub = Hub(stage_commands(scene), self._inbox, host, DEFAULT_PORT if port is None else port, token)
        self.url = f"http://{name}:{self._hub.port}/" + (f"?token={token}" if token else "")

    def wants_frame(self, behind: bool = False) -> bool:
        """Return whether a page waits for a newer frame than the last one published; costs one attribute.

        A run that is `behind` its clock has no time to give away: it is asked for so few frames that packing them takes a
        SHARE_OF_BUSY_RUN of its time, and keeps its step rate.
        """
        return self._hub.hungry and not (behind and time.perf_counter() < self._affordable_at)

    def publish(self, frame, full: bool = False) -> None:
        """Show `frame` (a `warpsim.Frame`) in place of the last one; returns without waiting for any page.

        `full` is for a run that stands still: all its points, not the stable subset that `scene.viewer.max_points` allows.
        """
        moment = (frame.index, frame.time, full)
        if moment == self._shown:
            return
        began = time.perf_counter()
        self._join(frame)
        limit = MOST_POINTS_AT_REST if full else self._most_points
        number = self._hub.number + 1
        self._hub.offer(pack_frame(number, frame.time, frame_blocks(frame, self._names, limit)), number)
        self._shown = moment
        now = time.perf_counter()
        # At most half a second without a picture, however large the cloud.
        self._affordable_at = now + min((now - began) / SHARE_OF_BUSY_RUN, 0.5)

    def _join(self, frame) -> None:
        """Tell the pages, once, what joins the points of networks."""
        if not self._joined:
            self._joined = True
            for key, command in net_commands(self._scene, frame).items():
                self._hub.note(key, command)

    def commands(self) -> list[Command]:
        """Return what the pages have asked for since the last call, oldest first; never blocks."""
        commands = self._inbox.drain()
        if commands:
            self._shown = None  # the same moment may now look different
        return commands

    def tell(self, status: Status) -> None:
        """Let the pages know how the run is going; as often as you like: ten times a second goes out, and every change of state."""
        if self._bulletin.worth(status, time.monotonic()):
            self._hub.note("status", pack_command(status_command(status)))

    def show_lines(self, paths: np.ndarray, key: str = "streamlines") -> None:
        """Draw polylines, float32 (n, k, 3) [m], in place of those drawn under the same key before; sent once."""
        self._hub.note(key, pack_command(lines_command(key, paths)))

    @property
    def client_count(self) -> int:
        """Pages that are watching."""
        return self._hub.count

    def wait_for_client(self, timeout: float | None = None) -> bool:
        """Wait until a page watches, at most `timeout` [s]; return whether one does."""
        return self._hub.greeted.wait(timeout)

    def close(self) -> None:
        """Tell the pages that the run has ended and free the port; again: nothing."""
        self._hub.close()

    def __enter__(self) -> "Viewer":
        return self

    def __exit__(self, *exception) -> None:
        self.close()
