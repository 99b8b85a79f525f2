"""The server beside a run: one daemon thread with its own event loop, one slot for the latest frame, the pages that watch."""

import asyncio
import errno
import ipaddress
import logging
import socket
import threading

import tornado.netutil
import tornado.web

from warpsim.observers.viewer.client import Client
from warpsim.observers.viewer.controls import Inbox
from warpsim.observers.viewer.door import Door, Server
from warpsim.observers.viewer.pages import Asset, asset_paths
from warpsim.observers.viewer.protocol import LONGEST_REPLY

DEFAULT_PORT = 7000
_PORTS_TRIED = 100
# More pages than a person has eyes for, and few enough to bound the memory that pages which stop reading can hold.
MOST_CLIENTS = 16
# Seconds for the head of a request, all of it; whoever dribbles it byte by byte is cut off.
_HEAD_SECONDS = 5
_GOING_AWAY = 1001
_PARTING_SECONDS = 0.05

# Without a handler Python would print each malformed request of a stranger on the run's terminal.
logging.getLogger("tornado").addHandler(logging.NullHandler())


class Hub:
    """Serves the page and hands every client the latest frame when it has drawn the one before.

    Threads: `offer`, `note`, `hungry`, `count` and `close` belong to the run's thread; all else runs on the loop.
    """

    def __init__(self, stage: list[bytes], inbox: Inbox, host: str, port: int, token: str | None = None):
        self.stage, self.inbox, self._token = stage, inbox, token
        self.notes: dict[str, tuple[int, bytes]] = {}
        self.note_number = 0
        self.latest: tuple[int, bytes] = (0, b"")
        self.hungry = False
        self.greeted = threading.Event()
        self._clients: list[Client] = []
        self._assets = asset_paths()
        sockets = bind(host, port, open_to_others=token is not None)
        self.port = sockets[0].getsockname()[1]
        self._loop: asyncio.AbstractEventLoop | None = None
        self._ready = threading.Event()
        self._thread = threading.Thread(target=lambda: asyncio.run(self._serve(sockets)), name="warpsim viewer", daemon=True)
        self._thread.start()
        self._ready.wait()

    # ---- called by the run

    @property
    def number(self) -> int:
        """Number of the latest frame; 0 before the first."""
        return self.latest[0]

    @property
    def count(self) -> int:
        """Pages that have said hello and are still there."""
        return sum(client.greeted for client in tuple(self._clients))

    def offer(self, message: bytes, number: int) -> None:
        """Put a packed frame in the slot, over the one before it."""
        self.latest = (number, message)
        self.hungry = False  # until the loop has served those who waited
        self._call(self._wake_all)

    def note(self, key: str, command: bytes) -> None:
        """Send a command to every page, and to each that comes later; a later one under the same key takes its place."""
        number = self.note_number + 1
        # A new dictionary: the loop may be walking through the old one.
        self.notes = {**{k: v for k, v in self.notes.items() if k != key}, key: (number, command)}
        self.note_number = number
        self._call(self._wake_all)

    def close(self) -> None:
        """Say goodbye to the pages, stop listening, and wait for the thread."""
        self._call(self._stop.set)
        self._thread.join(3.0)

    def _call(self, function) -> None:
        try:
            self._loop.call_soon_threadsafe(function)
        except RuntimeError:
            pass  # closed already

    # ---- on the loop

    def enter(self, client: Client) -> None:
        if len(self._clients) >= MOST_CLIENTS:
            # Out goes whoever never introduced itself, else whoever has been silent longest.
            quietest = min(self._clients, key=lambda c: (c.greeted, c.heard))
            self.leave(quietest)
            quietest.stream.close()
        self._clients.append(client)

    def leave(self, client: Client) -> None:
        if client in self._clients:
            self._clients.remove(client)
            self.take_stock()

    def take_stock(self) -> None:
        """Work out whether anybody would be sent a new frame at once."""
        self.hungry = any(client.hungry() for client in self._clients)
        if any(client.greeted for client in self._clients):
            self.greeted.set()
        else:
            self.greeted.clear()

    def _wake_all(self) -> None:
        for client in self._clients:
            client.wake.set()

    async def _serve(self, sockets: list[socket.socket]) -> None:
        self._loop = asyncio.get_running_loop()
        self._stop = asyncio.Event()
        application = tornado.web.Application(
            [(r"/stream", Client, {"hub": self}), (r"/(.*)", Asset, {"paths": self._assets})],
            log_function=lambda request: None,
            websocket_max_message_size=LONGEST_REPLY,
            websocket_ping_interval=10,
            websocket_ping_timeout=10,
            token=self._token,
        )
        server = Server(application, idle_connection_timeout=_HEAD_SECONDS, max_body_size=0, max_header_size=16384)
        server.viewers = self._clients
        door = Door(server, sockets)
        self._ready.set()
        await self._stop.wait()
        door.close()
        for client in self._clients:
            client.close(_GOING_AWAY, "the run has ended")
        if self._clients:
            await asyncio.sleep(_PARTING_SECONDS)
        for client in tuple(self._clients):
            client.stream.close()  # not even reading its goodbye
        # A browser would else wait on a kept-alive connection that nobody serves.
        await asyncio.wait_for(server.close_all_connections(), 1.0)


def bind(host: str, port: int, open_to_others: bool = False) -> list[socket.socket]:
    """Return listening sockets on `port` of a loopback address, or on the next free port; port 0 means any.

    Binding is the test of whether a port is free, so any number of runs may start at once.
    Raises ValueError for an address that other machines can reach, unless it is `open_to_others`; OSError where nothing can be bound.
    """
    if not open_to_others and not ipaddress.IPv4Address(host).is_loopback:
        raise ValueError(f"without a token the viewer listens on this machine only, not on {host}")
    candidates = [0] if port == 0 else [*range(port, min(port + _PORTS_TRIED, 65536)), 0]
    for candidate in candidates:
        try:
            return tornado.netutil.bind_sockets(candidate, address=host)
        except OSError as error:
            if error.errno not in (errno.EADDRINUSE, errno.EACCES) or candidate == candidates[-1]:
                raise
    raise AssertionError("unreachable: the last candidate returns or raises")
