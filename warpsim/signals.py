"""Signals: strengths that may vary in time as rows of tables on the device."""

from collections.abc import Sequence

import numpy as np
import warp as wp

from warpsim.kernels import expressions, signals
from warpsim.scene.strengths import Formula, Keyframes, Sine


class SignalTable:
    """Strengths that may vary in time, numbered as they are added; device arrays are made once, by `tables`."""

    def __init__(self):
        self._rows, self._knots, self._program = [], [], []

    def add(self, strength) -> int:
        """Append a strength of the scene and return its number."""
        row = signals.Signal()
        row.kind = signals.CONSTANT
        if isinstance(strength, Keyframes):
            row.kind, row.begin = signals.KEYFRAMES, len(self._knots)
            self._knots += [wp.vec2d(*knot) for knot in strength.keyframes]
            row.end = len(self._knots)
        elif isinstance(strength, Sine):
            wave = strength.sine
            row.kind = signals.SINE
            row.mean, row.amplitude, row.period, row.phase = wave.mean, wave.amplitude, wave.period, wave.phase
        elif isinstance(strength, Formula):
            row.kind = signals.FORMULA
            row.begin, row.end = self.add_program(strength.program)
        else:
            row.mean = strength
        self._rows.append(row)
        return len(self._rows) - 1

    def add_program(self, program: Sequence[tuple[str, float]]) -> tuple[int, int]:
        """Append a formula's program and return where it begins and ends."""
        begin = len(self._program)
        self._program += [(expressions.OPERATIONS[name], operand) for name, operand in program]
        return begin, len(self._program)

    def tables(self, device: str) -> signals.Signals:
        """Return the tables on the device."""
        table = signals.Signals()
        program = np.array(self._program, dtype=expressions.Instruction.numpy_dtype())
        table.rows = wp.array(self._rows, dtype=signals.Signal, device=device)
        table.knots = wp.array(self._knots, dtype=wp.vec2d, device=device)
        table.program = wp.array(program, dtype=expressions.Instruction, device=device)
        return table

    def write(self, tables: signals.Signals) -> None:
        """Overwrite device tables that are at least as long."""
        fresh = self.tables(tables.rows.device.alias)
        for name in ("rows", "knots", "program"):
            source = getattr(fresh, name)
            if len(source):
                wp.copy(getattr(tables, name), source, count=len(source))


def strength_signals(strength, table: SignalTable) -> wp.vec3i:
    """Add a strength, of one or three components, to the signals."""
    components = strength if isinstance(strength, tuple) else (strength,)
    return wp.vec3i(*[table.add(component) for component in components], *[-1] * (3 - len(components)))


def components(keyframes: Sequence[tuple[float, Sequence[float]]]) -> tuple[Keyframes, ...]:
    """Return the three strengths that keyframes of vectors, (time [s], vector) each, are made of."""
    return tuple(Keyframes(keyframes=tuple((t, vector[axis]) for t, vector in keyframes)) for axis in range(3))
