"""The door of the viewer's server: how fast strangers come in, and how many stand inside.

A connection costs the run about a millisecond of Python's one lock.  A storm of them is therefore let in at a walking pace:
those who wait stand in the short queue of the operating system, which costs nothing.  A page needs a dozen connections.
"""

import copy
import errno
import socket
import time

import tornado.httpserver
from tornado.ioloop import IOLoop
from tornado.iostream import IOStream

# Connections of any kind: a storm must not use up the file descriptors that the run needs.
MOST_CONNECTIONS = 64
# So many come in at once (a page opens up to seven), then so many a second.
BURST = 40
ARRIVALS_PER_SECOND = 40
# Then a connection is closed after its answer, so that a flood of requests is as slow as a flood of connections.
REQUESTS_PER_CONNECTION = 3
# Short: whoever is beyond it tries again by itself after a second, and nobody waits here longer than that.
QUEUE = 32
_FULL = (errno.EMFILE, errno.ENFILE, errno.ENOBUFS, errno.ENOMEM)


class Server(tornado.httpserver.HTTPServer):
    """An HTTP server that hangs up on its oldest idle connection rather than hold too many."""

    viewers: list = []

    def handle_stream(self, stream, address) -> None:
        """Take a connection in."""
        held = [s for s in getattr(self, "_held", []) if not s.closed()]
        if len(held) >= MOST_CONNECTIONS:
            watching = {client.stream for client in self.viewers}
            idle = next(s for s in held if s not in watching)
            idle.close()
            held.remove(idle)
        self._held = [*held, stream]
        super().handle_stream(stream, address)

    def start_request(self, server_conn, request_conn):
        """Take a request on a connection in."""
        served = server_conn.served = getattr(server_conn, "served", 0) + 1
        if served >= REQUESTS_PER_CONNECTION:
            request_conn.params = copy.copy(request_conn.params)
            request_conn.params.no_keep_alive = True
        return super().start_request(server_conn, request_conn)


class Door:
    """Hands the connections of the listening `sockets` to `server`, no faster than ARRIVALS_PER_SECOND for long."""

    def __init__(self, server: Server, sockets: list[socket.socket]):
        self._server, self._sockets = server, sockets
        self._loop = IOLoop.current()
        self._allowance, self._counted_at = float(BURST), time.monotonic()
        self._waiting = None
        self._closed = False
        for listening in sockets:
            listening.listen(QUEUE)
        self._open()

    def close(self) -> None:
        """Stop listening."""
        self._closed = True
        if self._waiting is None:
            self._shut()
        else:
            self._loop.remove_timeout(self._waiting)
        for listening in self._sockets:
            listening.close()

    def _open(self) -> None:
        self._waiting = None
        for listening in self._sockets:
            self._loop.add_handler(listening, self._answer, IOLoop.READ)

    def _shut(self) -> None:
        for listening in self._sockets:
            self._loop.remove_handler(listening)

    def _answer(self, listening: socket.socket, events: int) -> None:
        """Let in who waits, one at a time, so that the loop serves its pages in between."""
        now = time.monotonic()
        self._allowance = min(float(BURST), self._allowance + (now - self._counted_at) * ARRIVALS_PER_SECOND)
        self._counted_at = now
        if self._allowance >= 1.0:
            try:
                connection, address = listening.accept()
            except OSError as error:  # gone again, or this process may open no more files
                if error.errno in _FULL:
                    self._pause(1.0)
                return
            self._allowance -= 1.0
            connection.setblocking(False)
            self._server.handle_stream(IOStream(connection), address)
        if self._allowance < 1.0 and not self._closed:
            self._pause((1.0 - self._allowance) / ARRIVALS_PER_SECOND)

    def _pause(self, seconds: float) -> None:
        self._shut()
        self._waiting = self._loop.call_later(seconds, self._open)
