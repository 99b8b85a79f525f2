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


@dataclass(frozen=True, eq=False)
class Groups:
    """Parts of a network whose points lie close together, for the coarse level of a search."""

    group: np.ndarray
    """int32 (n,): of every point."""
    center: np.ndarray
    """int32 (groups,): the point nearest to the middle of each."""
    order: np.ndarray
    """int32 (chunks, 64): points group by group, each chunk of one group; −1: none."""
    chunk_begin: np.ndarray
    """int32 (groups + 1): first chunk of each group."""
    pair: np.ndarray
    """int32 (pairs, 2): groups that springs join, the smaller number first; twice the same: springs within it to its pins."""
    pair_begin: np.ndarray
    """int32 (pairs + 1): first of their springs in `crossing`."""
    crossing: np.ndarray
    """int32 (k, 3): point of the first group, point of the second, and the first's entry in the weave."""


def grouped(points: np.ndarray, weave: Weave, held: np.ndarray, most: int, fewest: int) -> Groups:
    """Return groups of the points (n, 3) [m]: at most so many, a power of two, each of at least so many points; one if there are fewer.

    `held`, bool (n,), tells who is pinned. Each group is halved across its longest extent until there are enough.
    """
    group, count = np.zeros(len(points), int), 1
    while 2 * count <= most and len(points) >= 2 * count * fewest:
        for g in range(count):
            mine = np.flatnonzero(group == g)
            axis = np.argmax(np.ptp(points[mine], axis=0))
            group[mine[np.argsort(points[mine, axis], kind="stable")[len(mine) // 2 :]]] = count + g
        count *= 2
    members = [np.flatnonzero(group == g) for g in range(count)]
    center = [mine[np.argmin(np.linalg.norm(points[mine] - points[mine].mean(axis=0), axis=1))] for mine in members]
    chunks = [np.pad(mine, (0, -len(mine) % SLICE), constant_values=-1).reshape(-1, SLICE) for mine in members]
    row, lane = np.nonzero(weave.spring >= 0)
    i = SLICE * (np.searchsorted(weave.begin, row, side="right") - 1) + lane
    j = weave.neighbor[row, lane]
    across = (group[i] < group[j]) | ((group[i] == group[j]) & (i < j) & (held[i] != held[j]))
    crossing = np.stack([i, j, SLICE * row + lane], axis=1)[across]
    key = (group[i] * count + group[j])[across]
    order = np.argsort(key, kind="stable")
    pairs, begin = np.unique(key[order], return_index=True)
    arrays = (group, center, np.concatenate(chunks), np.cumsum([0, *map(len, chunks)]), np.stack([pairs // count, pairs % count], axis=1))
    return Groups(*(np.asarray(array, np.int32) for array in (*arrays, [*begin, len(order)], crossing[order])))
