"""The viewer: shows a run in the browser, and cannot slow, stop or change it."""

import numpy as np

from warpsim.observers.viewer.hub import DEFAULT_PORT, Hub
from warpsim.observers.viewer.protocol import Attribute, Block, pack_frame
from warpsim.observers.viewer.stage import stage_commands

# A stable subset of a larger cloud goes out: past this many points a browser loses frames sooner than an eye misses points.
MOST_POINTS = 250_000


class Viewer:
    """Serves a page that shows the latest frame of a run, at `url`.

    Nothing is packed unless a page waits for it, so publish when asked:

        with Viewer(scene) as viewer:
            for frame in simulation.frames(n):
                if viewer.wants_frame():
                    viewer.publish(frame)

    Ask again after the last frame too: a page opened late, or fallen behind, waits for it.

    Arguments: `scene`, of which the name, the camera and the looks are read; `host`, a loopback address; `port`, where
    the search for a free port begins (default 7000; 0: any).  Raises ValueError for a host that other machines can reach,
    OSError where no port can be bound, ModuleNotFoundError without the package meshcat.
    """

    def __init__(self, scene, host: str = "127.0.0.1", port: int | None = None):
        self._names = list(scene.systems)
        self._shown: tuple[int, float] | None = None
        self._hub = Hub(stage_commands(scene), host, DEFAULT_PORT if port is None else port)
        self.url = f"http://{host}:{self._hub.port}/"

    def wants_frame(self) -> bool:
        """Return whether a page waits for a newer frame than the last one published; costs one attribute."""
        return self._hub.hungry

    def publish(self, frame) -> None:
        """Show `frame` (a `warpsim.Frame`) in place of the last one; returns without waiting for any page."""
        moment = (frame.index, frame.time)
        if moment == self._shown:
            return
        blocks: list[Block] = []
        for slot, name in enumerate(self._names):
            blocks += _cloud_blocks(slot, frame[name])
        number = self._hub.number + 1
        self._hub.offer(pack_frame(number, frame.time, blocks), number)
        self._shown = moment

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


def _cloud_blocks(slot: int, system) -> list[Block]:
    """Return the blocks of one system's points; positions are 16 bits a component in the box of the cloud."""
    cloud = system.packed(MOST_POINTS)
    # The page sees a normalized component as 0..1, so its scale is the whole box, not one step of it.
    box = (np.asarray(cloud.scale, np.float32) * np.float32(65535.0), cloud.offset)
    return [
        Block(slot, Attribute.POSITION, cloud.position[: cloud.count], normalized=True, affine=box),
        Block(slot, Attribute.COLOR, cloud.color[: cloud.count], normalized=True),
        Block(slot, Attribute.SIZE_MAX, np.array([cloud.size_max], np.float32)),
        Block(slot, Attribute.LIVE_COUNT, np.array([system.count], np.uint32)),
    ]
