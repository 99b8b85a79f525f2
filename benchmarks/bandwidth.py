"""How fast this machine copies memory, read and written, which nothing that goes through its particles once can beat."""

from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

import numpy as np

from benchmarks.contest import Effort
from benchmarks.measure import Sample, Way, take_turns
from benchmarks.report import Report
from warpsim.launch import available_cores

COPIED = 1 << 28  # bytes: far more than any cache holds
COPIED_QUICKLY = 1 << 22


class Copy:
    """A copy of one array into another, by so many threads, each its part; NumPy lets go of the interpreter lock meanwhile."""

    def __init__(self, size: int, threads: int):
        self.source, self.target = np.ones(size // 8), np.zeros(size // 8)
        self.bytes = 2 * self.source.nbytes  # read and written
        self._parts = [slice(len(self.source) * k // threads, len(self.source) * (k + 1) // threads) for k in range(threads)]
        self._pool = ThreadPoolExecutor(threads)

    def step_frame(self) -> None:
        """Copy once."""
        list(self._pool.map(self._copy, self._parts))

    def _copy(self, part: slice) -> None:
        np.copyto(self.target[part], self.source[part])


def bandwidths(effort: Effort) -> dict[Way, Sample]:
    """Return bytes read and written per second, with one thread and with all."""
    cores, size = available_cores(), COPIED_QUICKLY if effort.quick else COPIED
    ways = [Way(f"copy, {threads} thread{'s' * (threads > 1)}", threads, native=False) for threads in sorted({1, cores})]
    copies = {way: Copy(size, way.threads) for way in ways}
    times = take_turns(copies, max(effort.least_rounds, effort.most_rounds // 2), lambda: None, frames=1, lead=1, patience=effort.patience)
    return {way: Sample([copies[way].bytes / seconds for seconds in times[way].seconds.values]) for way in ways}


@dataclass(frozen=True)
class Bandwidth:
    """The row that tells it; nothing is to reach."""

    name: str = "bandwidth"
    work: str = "copying an array larger than the caches: bytes read and written per second"

    def measure(self, report: Report, effort: Effort) -> None:
        """Copy with one thread and with all, in turns."""
        for way, rate in bandwidths(effort).items():
            report.claim(self.name, f"GB/s, {way.label}", Sample([1e-9 * value for value in rate.values]), None)


def rows(quick: bool) -> list[Bandwidth]:
    """One row."""
    return [Bandwidth()]
