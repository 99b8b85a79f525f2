"""Weaves: the springs of a network as rows of entries, laid out so that products with its matrix read neighbors in a line.

A row of a slice of 64 points holds one spring of each point that has one there. Where the points of a slice have few different steps
(neighbor − point) between them, as in chains, sheets and blocks, a row takes the springs of one step, and its neighbors lie side by
side; elsewhere row r takes the r-th spring of each point, as in networks.packed.
"""

from dataclasses import dataclass

import numpy as np

from warpsim.networks import SLICE

SCATTERED = 1 << 30  # instead of a step: the row's neighbors lie anywhere
FEW = 2.0  # rows by step may be so many times those by turn: entries without a spring cost less than gathered neighbors


@dataclass(frozen=True, eq=False)
class Weave:
    """Rows of entries; entry (row, lane) is a spring of point 64·slice + lane, or none."""

    begin: np.ndarray
    """int32 (slices + 1): first row of each slice."""
    step: np.ndarray
    """int32 (rows,): neighbor − point for all springs of the row, or SCATTERED."""
    neighbor: np.ndarray
    """int32 (rows, 64): the other end; the point itself where there is no spring."""
    spring: np.ndarray
    """int32 (rows, 64): number of the spring, −1 where there is none."""

    @property
    def reach(self) -> int:
        """How far beyond the first and the last point a row by step may read; a multiple of 64."""
        steps = np.abs(self.step[self.step != SCATTERED])
        return SLICE * -(-int(steps.max(initial=0)) // SLICE)


def woven(point_count: int, springs: np.ndarray) -> Weave:
    """Return the springs (m, 2) of a network's points, each twice, in rows."""
    slices = max(1, -(-point_count // SLICE))
    ends, others = (springs.T[order].reshape(-1).astype(np.int64) for order in (slice(None), slice(None, None, -1)))
    number = np.tile(np.arange(len(springs)), 2)
    order = np.lexsort((number, others - ends, ends))
    ends, others, number = ends[order], others[order], number[order]
    degree = np.bincount(ends, minlength=slices * SLICE)
    turn = np.arange(len(ends)) - np.repeat(np.cumsum(degree) - degree, degree)
    most = degree.reshape(slices, SLICE).max(axis=1)
    span = 2 * slices * SLICE  # of steps
    kinds, kind = np.unique(ends // SLICE * span + others - ends + span // 2, return_inverse=True)
    different = np.bincount(kinds // span, minlength=slices)
    first = np.cumsum(different) - different
    in_line = different <= FEW * most
    in_line[ends[1:][(np.diff(ends) == 0) & (np.diff(others) == 0)] // SLICE] = False  # two springs between the same points
    width = np.where(in_line, different, most)
    begin = np.concatenate([[0], np.cumsum(width)])
    row = begin[ends // SLICE] + np.where(in_line[ends // SLICE], kind - first[ends // SLICE], turn)
    neighbor = np.arange(slices * SLICE).reshape(slices, SLICE).repeat(width, axis=0)
    spring, step = np.full_like(neighbor, -1), np.full(begin[-1], SCATTERED)
    neighbor[row, ends % SLICE], spring[row, ends % SLICE] = others, number
    by_step = in_line[ends // SLICE]
    step[row[by_step]] = (others - ends)[by_step]
    return Weave(*(array.astype(np.int32) for array in (begin, step, neighbor, spring)))
