"""Ctrl-C in three steps: the first signal ends the run after the frame in flight, the second leaves at once, the third kills.

Python calls its handlers between two steps of the main thread: a frame, a compiler or a slow disk keeps them waiting. So a thread hears
every signal where the system notes it, and ends the process where the main thread does not come to it. That is safe at any moment: what is
visible on the disk is whole (files.py, and Warp's kernel cache, whose folders are renamed when they are complete).
"""

import os
import select
import signal
import socket
import threading
import time
from collections.abc import Callable
from contextlib import suppress
from types import FrameType

CONVENTION = 128  # a process that ends by a signal exits with 128 + its number; SIGINT and SIGTERM both count as 130 here
SIGNALS = (signal.SIGINT, signal.SIGTERM)
GRACE = 1.5  # s from a first signal with nothing to finish to the end: 2 s are promised
SHORT_GRACE = 0.5  # s from a second signal, for files to be closed and a browser to be ended
SILENCE = 1.0  # s that a frame in flight may take after the signal until words tell what is waited for
WAITING = "finishing the frame and saving the state; Ctrl-C again leaves at once"


class Interruption:
    """Catches SIGINT and SIGTERM while the block runs; `requested` turns true at the first one.

    Until `patient` is set (while nothing runs that is worth finishing) the first signal already raises KeyboardInterrupt. `note` is told
    where a first signal waits for something long.
    """

    def __init__(self, note: Callable[[str], None] | None = None):
        self.patient = False
        self.note = note
        self._handled = self._sent = 0  # by Python in the main thread; by the system: two may come while one handler waits
        self._previous = {}
        self._mouth: socket.socket | None = None
        self._listener: threading.Thread | None = None

    @property
    def count(self) -> int:
        """Number of signals that have come."""
        return max(self._handled, self._sent)

    @property
    def requested(self) -> bool:
        """Whether the run has been asked to end."""
        return self.count > 0

    def __enter__(self):
        ear, self._mouth = socket.socketpair()
        self._mouth.setblocking(False)
        self._listener = threading.Thread(target=self._listen, args=(ear,), daemon=True, name="warpsim-signals")
        self._listener.start()
        self._previous = {number: signal.signal(number, self._receive) for number in SIGNALS}
        self._wakeup = signal.set_wakeup_fd(self._mouth.fileno(), warn_on_full_buffer=False)
        return self

    def __exit__(self, *error):
        signal.set_wakeup_fd(self._wakeup)
        for number, handler in self._previous.items():
            signal.signal(number, handler)
        self._mouth.close()  # the listener hears the end
        self._listener.join()

    def _receive(self, number: int, frame: FrameType | None) -> None:
        self._handled += 1
        if self.count >= 3:
            end_at_once()
        if self.count == 2 or not self.patient:
            raise KeyboardInterrupt

    def _listen(self, ear: socket.socket) -> None:
        """Hear the signals as the system notes them, until the block ends, and see to it that they are heeded in time."""
        deadline = words_due = None
        with ear:
            while True:
                waits = [moment - time.monotonic() for moment in (deadline, words_due) if moment is not None]
                if select.select([ear], [], [], max(0.0, min(waits)) if waits else None)[0]:
                    numbers = ear.recv(64)
                    if not numbers:
                        return
                    self._sent += sum(number in SIGNALS for number in numbers)
                    now = time.monotonic()
                    if self._sent >= 3:
                        end_at_once()
                    elif self._sent == 2:
                        deadline, words_due = now + SHORT_GRACE, None
                    elif self._sent == 1 and not self.patient:
                        deadline = deadline or now + GRACE
                    elif self._sent == 1:
                        words_due = words_due or now + SILENCE
                elif deadline is not None and time.monotonic() >= deadline:
                    end_at_once()
                elif words_due is not None and time.monotonic() >= words_due:
                    words_due = None
                    threading.Thread(target=self._tell, daemon=True).start()  # a pipe that nobody reads must not make this thread deaf

    def _tell(self) -> None:
        with suppress(OSError, ValueError):  # a stream that is closed by now
            if self.note:
                self.note(WAITING)


def end_at_once() -> None:
    """End the process from any thread, whatever the others do, with 130.

    Python's streams are left alone: another thread may hold their locks. A terminal gets its line and its cursor back.
    """
    for stream in (1, 2):
        with suppress(OSError):
            if os.isatty(stream):
                _say(stream, b"\r\x1b[K\x1b[?25h")
    _say(2, b"interrupted\n")
    os._exit(CONVENTION + signal.SIGINT)


def _say(stream: int, words: bytes) -> None:
    """Write to a stream that takes it now; one that does not would keep the process."""
    with suppress(OSError, ValueError):
        if os.name == "nt" or select.select([], [stream], [], 0.0)[1]:
            os.write(stream, words)
