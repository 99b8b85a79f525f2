"""A run as a process with a page at its websocket, driven as a person would: wishes out, status and frames back."""

import asyncio
import json
import re
import subprocess
import threading
import time
from urllib.parse import urlsplit

import numpy as np
import umsgpack
from tornado.websocket import websocket_connect

from tests.command import command, environment
from tests.viewer.watcher import read_frame

PATIENCE = 120.0  # s; guards against a hang, on a machine that compiles besides

SLIDING = """\
name: Sliding
time: {fps: 60, substeps: 2, duration: 6}
gravity: [0, 0, 0]
flow: [{name: wind, type: uniform, velocity: [0, 0, 0]}]
systems:
  dust:
    type: particles
    capacity: 8
    coupling: tracer
    emitters:
      - {shape: {type: point, center: [0, 1, 0]}, burst: {count: 1}, lifetime: 100}
      - {shape: {type: point, center: [40, 1, 0]}, burst: {count: 1}, lifetime: 100}
controls:
  - {path: flow.wind.velocity.0, min: -4, max: 4, label: wind}
"""


class Process:
    """`warpsim ARGUMENTS` as a process whose words can be waited for."""

    def __init__(self, *arguments: object, cwd):
        self.process = subprocess.Popen(
            command(*arguments),
            cwd=cwd,
            env=environment(),
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            start_new_session=True,
        )
        self.words: list[str] = []
        self._reader = threading.Thread(target=lambda: self.words.extend(iter(self.process.stdout.readline, "")), daemon=True)
        self._reader.start()

    def hears(self, pattern: str) -> re.Match:
        """Return the first match of what was said so far or soon."""
        end = time.monotonic() + PATIENCE
        while time.monotonic() < end:
            if match := re.search(pattern, "".join(self.words)):
                return match
            time.sleep(0.01)
        raise AssertionError(f"{pattern!r} was not said: {self.words}")

    @property
    def url(self) -> str:
        """Address of its viewer."""
        return self.hears(r"look at (http://\S+)").group(1)

    def end(self, timeout: float = PATIENCE) -> int:
        """Wait for the end and return the exit code."""
        code = self.process.wait(timeout)
        self._reader.join(timeout)
        return code

    def __enter__(self) -> "Process":
        return self

    def __exit__(self, *exception) -> None:
        if self.process.poll() is None:
            self.process.kill()
            self.process.wait()
        self._reader.join(5)
        self.process.stdout.close()


class Person:
    """A page in the hands of a script; every frame is acknowledged at once, as a fast browser would."""

    def __init__(self, socket):
        self._socket = socket
        self.status: dict = {}
        self.frame = None
        self.controls: list[dict] = []
        self.lines: dict | None = None

    @property
    def x(self) -> float:
        """Place of the particle that was born first [m]; 16 bits over the box of two particles make it good to a millimetre."""
        return float(np.sort(self.frame.blocks[0, 0][:, 0])[0])

    def leave(self) -> None:
        """Close the page."""
        self._socket.close()

    async def ask(self, kind: str, **words) -> None:
        """Send a wish."""
        await self._socket.write_message(json.dumps({"type": kind, **words}))

    async def until(self, condition) -> None:
        """Read until a condition of self holds."""
        end = time.monotonic() + PATIENCE
        while not condition(self):
            assert time.monotonic() < end, (self.status, self.frame and self.frame.time)
            await self.read()

    async def read(self) -> None:
        """Take the next message."""
        message = await asyncio.wait_for(self._socket.read_message(), PATIENCE)
        assert message is not None, "the run has gone"
        if message[:1] == b"\xc1":
            self.frame = read_frame(message)
            await self.ask("ack", frame=self.frame.number)
            return
        said = umsgpack.unpackb(message)
        if said["type"] == "warpsim_status":
            self.status = said
        elif said["type"] == "warpsim_controls":
            self.controls = said["controls"]
        elif said["type"] == "warpsim_lines" and said["key"] == "streamlines":
            self.lines = said

    async def stands_at(self, index: int) -> None:
        """Wait until the run says that it stands at a frame, and shows it."""
        await self.until(lambda p: not p.status.get("playing", True) and p.status["index"] == index)
        await self.until(lambda p: p.frame is not None and abs(p.frame.time - index / 60) < 1e-9)


def by_hand(url: str, script, pages: int = 1) -> None:
    """Open pages at `url` and run the coroutine function `script` with a Person for each."""

    async def session():
        people = []
        for _ in range(pages):
            people.append(Person(await websocket_connect(f"ws://{urlsplit(url).netloc}/stream", max_message_size=2**28)))
            await people[-1].ask("hello")
        await script(*people)
        for person in people:
            person.leave()

    asyncio.run(session())
