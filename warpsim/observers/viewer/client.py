"""One page at the other end of a websocket: what it is owed, and the pump that sends it."""

import asyncio
from collections import deque

from tornado.iostream import StreamClosedError
from tornado.websocket import WebSocketClosedError, WebSocketHandler

from warpsim.observers.viewer.controls import Command
from warpsim.observers.viewer.pages import LocalRequest
from warpsim.observers.viewer.protocol import read_reply

# Frames on their way to a page at once: one being drawn, one arriving.  More would only be lag.
CREDIT = 2
# Long enough for a large cloud through a slow tunnel; whoever reads nothing for so long is gone or hostile.
SEND_SECONDS = 20.0
HELLO_SECONDS = 5.0
# A page says at most an ack and a word per slider for each picture; more than this, for a second, is a flood.
MOST_REPLIES = 600
_POLICY_VIOLATION = 1008


class Client(LocalRequest, WebSocketHandler):
    """A page that watches.  It gets the stage after its hello, then always the latest frame, as fast as it draws.

    All of it runs on the hub's loop.  At most one message waits in the socket of a page that does not read.
    """

    def initialize(self, hub) -> None:
        self.hub = hub
        self.wake = asyncio.Event()
        self.greeted = False
        self.ready = False  # its stage is not yet set
        self.sent = 0
        self.noted = 0
        self.unanswered: deque[int] = deque()
        self.heard = 0.0
        self.second, self.replies = 0, 0

    def check_origin(self, origin: str) -> bool:
        return True  # LocalRequest.prepare has looked at it, and at Host

    def open(self) -> None:
        self.set_nodelay(True)
        self.stream = self.ws_connection.stream
        self.heard = asyncio.get_running_loop().time()
        self.hub.enter(self)
        self.pump = asyncio.ensure_future(self._pump())

    def on_close(self) -> None:
        self.hub.leave(self)
        self.pump.cancel()

    def on_message(self, message: str | bytes) -> None:
        """Take a hello, an ack or a command; whoever says anything else is no page of ours and is shown out."""
        try:
            self._count()
            reply = read_reply(message)
            if (reply is None) == self.greeted:
                raise ValueError("one hello comes first")
            if isinstance(reply, int) and reply not in self.unanswered:
                raise ValueError("no such frame on its way")
        except ValueError as mistake:
            self.close(_POLICY_VIOLATION, str(mistake)[:100])
            self.stream.close()  # at once: who floods us would go on while goodbyes are said
            return
        self.heard = asyncio.get_running_loop().time()
        if isinstance(reply, Command):
            self.hub.inbox.put(reply)
            return
        if reply is None:
            self.greeted = True
        else:
            # A page that drew frame n has done with all frames before it.
            while self.unanswered.popleft() != reply:
                pass
        self.wake.set()
        self.hub.take_stock()

    def _count(self) -> None:
        second = int(asyncio.get_running_loop().time())
        self.second, self.replies = second, 1 if second != self.second else self.replies + 1
        if self.replies > MOST_REPLIES:
            raise ValueError("too many words")

    def hungry(self) -> bool:
        """Whether a frame newer than the hub's latest would be sent at once."""
        return self.ready and len(self.unanswered) < CREDIT and self.sent == self.hub.number

    async def _pump(self) -> None:
        try:
            async with asyncio.timeout(HELLO_SECONDS):
                await self._greeting()
            for command in self.hub.stage:
                await self._send(command)
            self.ready = True
            while True:
                # A page that is hidden or lags draws nothing and owes two acks: it gets no words either.
                if len(self.unanswered) < CREDIT and self.noted != self.hub.note_number:
                    await self._send_notes()
                elif len(self.unanswered) < CREDIT and self.sent != self.hub.number:
                    await self._send_latest()
                else:
                    self.hub.take_stock()
                    await self._rest()
        except (TimeoutError, WebSocketClosedError, StreamClosedError):
            self.hub.leave(self)
            self.stream.close()

    async def _greeting(self) -> None:
        while not self.greeted:
            await self._rest()

    async def _rest(self) -> None:
        await self.wake.wait()
        self.wake.clear()

    async def _send(self, message: bytes) -> None:
        """Return when the socket has taken the message; at most one waits in it."""
        async with asyncio.timeout(SEND_SECONDS):  # not wait_for, which may swallow a cancellation (Python 3.11)
            await self.write_message(message, binary=True)

    async def _send_notes(self) -> None:
        before, self.noted = self.noted, self.hub.note_number
        for number, command in self.hub.notes.values():
            if number > before:
                await self._send(command)

    async def _send_latest(self) -> None:
        self.sent, message = self.hub.latest
        self.unanswered.append(self.sent)
        await self._send(message)
