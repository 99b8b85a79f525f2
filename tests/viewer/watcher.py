"""A page without a browser: says hello, reads, acknowledges when told to.  Its reading of a frame is written from the
layout in the documentation, apart from the code that packs one."""

import json
import socket
import struct
import time
from types import SimpleNamespace
from urllib.parse import urlsplit

import numpy as np
import umsgpack
import websocket

PATIENCE = 120.0  # s; guards against a hang; nothing waits that long
_DTYPES = {0x12: np.uint8, 0x14: np.uint16, 0x16: np.uint32, 0x17: np.float32}


class Watcher:
    """One websocket to a viewer's `url`; `commands` and `frames` hold what has been read."""

    def __init__(self, url: str, hello: bool = True, **options):
        self.socket = websocket.create_connection(stream_address(url), timeout=PATIENCE, suppress_origin=True, **options)
        self.commands: list[dict] = []
        self.frames: list[SimpleNamespace] = []
        if hello:
            self.say({"type": "hello"})

    def say(self, reply: dict) -> None:
        """Send one reply."""
        self.socket.send(json.dumps(reply))

    def ack(self, number: int) -> None:
        """Acknowledge a frame."""
        self.say({"type": "ack", "frame": number})

    def read_frame(self) -> SimpleNamespace:
        """Return the next frame, keeping the commands before it."""
        while True:
            message = self.socket.recv()
            if isinstance(message, bytes) and message[:1] == b"\xc1":
                self.frames.append(read_frame(message))
                return self.frames[-1]
            if not message:
                raise websocket.WebSocketConnectionClosedException("closed while a frame was awaited")
            self.commands.append(umsgpack.unpackb(message))

    def silent(self, seconds: float = 0.2) -> bool:
        """Return whether nothing arrives for `seconds` [s]."""
        self.socket.settimeout(seconds)
        try:
            self.socket.recv_frame()
            return False
        except websocket.WebSocketTimeoutException:
            return True
        finally:
            self.socket.settimeout(PATIENCE)

    def farewell(self) -> int | None:
        """Read until the server hangs up; return its close code, None if it just dropped the line."""
        end = time.monotonic() + PATIENCE
        try:
            while time.monotonic() < end:
                code, data = self.socket.recv_data(control_frame=True)
                if code == websocket.ABNF.OPCODE_CLOSE:
                    return struct.unpack(">H", data[:2])[0]
        except (websocket.WebSocketConnectionClosedException, ConnectionError):
            return None
        raise AssertionError("the server holds on to the line")

    def reset(self) -> None:
        """Vanish as a killed browser does: the socket sends RST, whatever was under way."""
        self.socket.sock.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))
        self.socket.sock.close()

    def close(self) -> None:
        """Leave politely."""
        self.socket.close()

    def __enter__(self) -> "Watcher":
        return self

    def __exit__(self, *exception) -> None:
        self.socket.shutdown()


def stream_address(url: str) -> str:
    """Return the websocket's address of a viewer's `url`."""
    return f"ws://{urlsplit(url).netloc}/stream"


def read_frame(message: bytes) -> SimpleNamespace:
    """Return number, time [s] and blocks {(slot, attribute): array} of a frame; affine blocks are mapped back."""
    mark, version, blocks, number, frame_time = struct.unpack_from("<BBHId", message)
    assert (mark, version) == (0xC1, 1)
    found, at = {}, 16
    for _ in range(blocks):
        slot, attribute, dtype, width, flags, zero, count, size = struct.unpack_from("<HBBBBHII", message, at)
        at += 16
        assert at % 8 == 0 and zero == 0
        affine = np.frombuffer(message, np.float32, 6, at) if flags & 2 else None
        at += 24 if flags & 2 else 0
        array = np.frombuffer(message, _DTYPES[dtype], size // np.dtype(_DTYPES[dtype]).itemsize, at).reshape(count, width)
        if affine is not None:
            seen = array.astype(np.float64) / np.iinfo(array.dtype).max if flags & 1 else array.astype(np.float64)
            seen[:, :3] = seen[:, :3] * affine[:3] + affine[3:]
            array = seen
        found[slot, attribute] = array
        at += size + -size % 8
    assert at == len(message)
    return SimpleNamespace(number=number, time=frame_time, blocks=found)


def eventually(condition, timeout: float = PATIENCE) -> bool:
    """Return whether `condition()` comes to hold within `timeout` [s]."""
    end = time.monotonic() + timeout
    while time.monotonic() < end:
        if condition():
            return True
        time.sleep(0.005)
    return False


def watch(url: str) -> None:
    """Watch as a browser with a graphics card of its own does: draw 60 frames a second, for ever."""
    with Watcher(url) as watcher:
        while True:
            number = watcher.read_frame().number
            watcher.frames.clear()
            time.sleep(1 / 60)
            watcher.ack(number)


if __name__ == "__main__":
    import sys

    watch(sys.argv[1])
