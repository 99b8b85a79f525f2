"""Muscles: before forces are asked for, the rest lengths of some springs are set to what they are at that moment."""

import math
from collections.abc import Iterator
from functools import cached_property
from typing import final

import numpy as np
import warp as wp

from warpsim.kernels import muscles
from warpsim.launch import Stage
from warpsim.muscles import Course, courses_of
from warpsim.networks import spring_numbers
from warpsim.signals import SignalTable
from warpsim.systems.parts.base import Part


@final
class Muscles(Part):
    """Springs of a `springs` network that pull as the time tells them."""

    def __init__(self, system):
        super().__init__(system)
        device = system.device
        self._courses = self._courses_now()
        rows, table = self._rows()
        self._signals, self._drives = table.tables(device), wp.array(rows, dtype=muscles.Drive, device=device)
        self._factor = wp.zeros(len(rows), dtype=float, device=device)
        self._half = 0.5 / (system.scene.time.fps * system.pace.substep_count)  # [s]

    @classmethod
    def wanted(cls, spec) -> bool:
        return spec.type == "springs" and bool(spec.muscles)

    def prepare(self, moment: int) -> Iterator[Stage]:
        """Yield the stages that set the rest lengths to those of a moment."""
        inputs = (moment, self._half, self.system.start_time, self._signals, self._drives, self._factor)
        yield Stage("muscles", muscles.sample_drives, len(self._drives), inputs)
        inputs = (self._fibers, self._factor, self.system.table.rest, self.system.network.rest)
        yield Stage("muscles", muscles.scatter_lengths, len(self._fibers.spring), inputs)

    def change(self) -> None:
        """Take the numbers of `system.spec`, in place."""
        self._courses = self._courses_now()
        rows, table = self._rows()
        table.write(self._signals)
        self._drives.assign(wp.array(rows, dtype=muscles.Drive, device=self._drives.device))
        self._fibers.length.assign(self._lengths())

    def rest_lengths(self, time: float, rest: np.ndarray) -> np.ndarray:
        """Return the rest length of every spring at a time [s], float64 (m,) [m]."""
        device, rest = self.system.device, rest.copy()
        now, factor = wp.array([time], dtype=wp.float64, device=device), wp.zeros_like(self._factor)
        wp.launch(muscles.sample_drives, len(self._drives), [0, 0, 0.0, now, self._signals, self._drives, factor], device=device)
        rest[self._springs] *= factor.numpy()[self._places]
        return rest

    @cached_property
    def _fibers(self) -> muscles.Fibers:
        """The springs one by one; the packed network is there only once its system is complete."""
        fibers, device = muscles.Fibers(), self.system.device
        fibers.spring = wp.array(self._springs, dtype=int, device=device)
        fibers.drive = wp.array(self._places, dtype=int, device=device)
        fibers.entry = wp.array(self.system.packed.places()[self._springs], dtype=wp.vec2i, device=device)
        fibers.length = wp.array(self._lengths(), dtype=float, device=device)
        return fibers

    @property
    def _springs(self) -> np.ndarray:
        return np.concatenate([course.springs for course in self._courses])

    @property
    def _places(self) -> np.ndarray:
        """Which row of the drives every fiber follows: one for each fiber of a wave, else one for the whole muscle."""
        places, begin = [], 0
        for muscle, course in zip(self.system.spec.muscles, self._courses, strict=True):
            count = len(course.springs)
            places.append(begin + (np.arange(count) if muscle.wave else np.zeros(count, int)))
            begin += count if muscle.wave else 1
        return np.concatenate(places)

    def _courses_now(self) -> list[Course]:
        return courses_of(self.system.spec, self.system.net)

    def _lengths(self) -> np.ndarray:
        return spring_numbers(self.system.spec, self.system.net)[2][self._springs].astype(np.float32)

    def _rows(self) -> tuple[list[muscles.Drive], SignalTable]:
        """Return the rows of all factors, and the strengths that they name."""
        rows, table = [], SignalTable()
        for muscle, course in zip(self.system.spec.muscles, self._courses, strict=True):
            drive = {"rest": -1 if muscle.rest is None else table.add(muscle.rest), "activation": table.add(muscle.activation)}
            if muscle.wave is None:
                rows.append(_row(**drive, amplitude=0.0, period=1.0, lag=0.0))
                continue
            wave = muscle.wave
            turns = course.way / wave.wavelength if wave.wavelength else np.zeros(len(course.way))
            lags = wave.phase - 2.0 * math.pi * turns
            rows += [_row(**drive, amplitude=a, period=wave.period, lag=lag) for a, lag in zip(course.amplitude, lags, strict=True)]
        return rows, table


def _row(**fields) -> muscles.Drive:
    row = muscles.Drive()
    for key, value in fields.items():
        setattr(row, key, value)
    return row
