"""The rows that need a GPU: memory traffic beside the device's own copy, a flock beside a published figure, launches per frame."""

from collections.abc import Callable
from dataclasses import dataclass
from unittest import mock

import warp as wp

from benchmarks.cases import drift
from benchmarks.contest import Effort, Row
from benchmarks.flocks import flock
from benchmarks.measure import Sample, Way, take_turns
from benchmarks.report import Report
from benchmarks.scaling import bytes_of
from warpsim import Simulation

COPIED = 1 << 31  # bytes: far beyond the second-level cache
SHARE = 0.7  # of the device's own copy bandwidth
STEP = 1.0  # ms, a whole step of a million boids; FLAME GPU 2 on an H100: 2.122 (A100 2.70, V100 3.72), their paper's boids at this density
NEIGHBORS = 4.0 / 3.0 * 3.141592653589793 * 2.0**3  # at density 1 within 2 m: 33
NO_GPU = "there is no CUDA device"


class DeviceCopy:
    """The device's copy of one array into another."""

    def __init__(self, size: int, device: str):
        self.source, self.target = (wp.zeros(size // 4, dtype=wp.float32, device=device) for _ in range(2))
        self.bytes = 2 * size  # read and written

    def step_frame(self) -> None:
        """Enqueue it once."""
        wp.copy(self.target, self.source)


@dataclass(frozen=True)
class OnDevice:
    """A row that is measured on a CUDA device, where there is one. `below`: the number is to stay at or under `reach`."""

    name: str
    work: str
    claim: str
    reach: float
    measured: Callable[[str, Effort], tuple[Sample, str]]  # (device, effort) -> the number, and what else there is to tell
    below: bool = False

    def measure(self, report: Report, effort: Effort) -> None:
        """Measure on the first device."""
        devices = wp.get_cuda_devices()
        if not devices:
            report.unmeasured(self.name, self.claim, self.reach, NO_GPU, self.below)
            return
        self.on(devices[0].alias, report, effort)

    def on(self, device: str, report: Report, effort: Effort) -> None:
        """Measure on a device."""
        sample, words = self.measured(device, effort)
        report.claim(self.name, self.claim, sample, self.reach, below=self.below)
        report.note(self.name, f"{wp.get_device(device).name}: {words}", device=wp.get_device(device).name)


def settled_run(scene, device: str, warmup: int) -> Simulation:
    """Return a simulation past its first frames."""
    run = Simulation(scene, device=device)
    for _ in range(warmup):
        run.step_frame()
    return run


def traffic(device: str, effort: Effort) -> tuple[Sample, str]:
    """Return which share of the copy bandwidth 16 M particles use, their state read and written once in a frame of 4 substeps."""
    run = settled_run(drift(20_000 if effort.quick else 16_000_000), device, 3)
    copy = DeviceCopy(1 << 22 if effort.quick else COPIED, device)
    times = take_turns({"run": run, "copy": copy}, effort.most_rounds, lambda: wp.synchronize_device(device), frames=10, lead=1)
    ours, theirs = times["run"].seconds, times["copy"].seconds
    share = Sample([bytes_of(run) / a * b / copy.bytes for a, b in zip(ours.values, theirs.values, strict=True)])
    return (
        share,
        f"{1e3 * ours.median:.3f} ms a frame of {bytes_of(run):,} bytes; copies go at {1e-9 * copy.bytes / theirs.median:.0f} GB/s",
    )


def boids(device: str, effort: Effort) -> tuple[Sample, str]:
    """Return how long a step of a million boids at density 1 takes [ms], of which each meets all within 2 m."""
    count = 2_000 if effort.quick else 1_000_000
    run = settled_run(flock(count, NEIGHBORS, 2.0, 360.0), device, 3)
    way = Way("gpu", 1)
    times = take_turns({way: run}, effort.most_rounds, lambda: wp.synchronize_device(device), frames=10, lead=1)[way]
    return Sample([1e3 * seconds for seconds in times.seconds.values]), f"{count:,} boids"


def launches(device: str, effort: Effort) -> tuple[Sample, str]:
    """Return how many graphs and kernels the host launches for a frame of 16 substeps."""
    run = settled_run(drift(20_000, substeps=16), device, 3)
    counted = []
    for _ in range(effort.least_rounds):
        with (
            mock.patch.object(wp, "capture_launch", wraps=wp.capture_launch) as graphs,
            mock.patch.object(wp, "launch", wraps=wp.launch) as kernels,
        ):
            run.step_frame()
        counted.append(float(graphs.call_count + kernels.call_count))
    wp.synchronize_device(device)
    return Sample(counted), "a frame of 16 substeps"


def rows(quick: bool) -> list[Row]:
    """Three rows."""
    works = (
        "16,000,000 particles, one vortex, gravity, drag, 4 substeps, nobody born or dying: bytes of state read and written once",
        "a million boids at density 1 that see all within 2 m (33 neighbors), whole step, ms",
        "what the host launches for a frame of 16 substeps",
    )
    return [
        OnDevice("gpu-uncoupled", works[0], "of the device's copy bandwidth", SHARE, traffic),
        OnDevice("gpu-flocks", works[1], "ms a step", STEP, boids, below=True),
        OnDevice("gpu-launches", works[2], "launches per frame", 1.0, launches, below=True),
    ]
