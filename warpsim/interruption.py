"""Ctrl-C in three steps: the first signal ends the run after the frame in flight, the second at once, the third kills."""

import os
import signal
from types import FrameType

CONVENTION = 128  # a process that ends by a signal exits with 128 + its number; SIGINT and SIGTERM both count as 130 here
SIGNALS = (signal.SIGINT, signal.SIGTERM)


class Interruption:
    """Catches SIGINT and SIGTERM while the block runs; `requested` turns true at the first one.

    Until `patient` is set (while nothing runs that is worth finishing) the first signal already raises KeyboardInterrupt.
    """

    def __init__(self):
        self.count = 0
        self.patient = False
        self._previous = {}

    @property
    def requested(self) -> bool:
        """Whether the run has been asked to end."""
        return self.count > 0

    def __enter__(self):
        self._previous = {number: signal.signal(number, self._receive) for number in SIGNALS}
        return self

    def __exit__(self, *error):
        for number, handler in self._previous.items():
            signal.signal(number, handler)

    def _receive(self, number: int, frame: FrameType | None) -> None:
        self.count += 1
        if self.count >= 3:
            os._exit(CONVENTION + signal.SIGINT)
        if self.count == 2 or not self.patient:
            raise KeyboardInterrupt
