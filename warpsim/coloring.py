"""Coloring: springs sorted so that no two of a color share a point, whose order then makes no difference to the bits."""

from dataclasses import dataclass

import numpy as np

from warpsim.kernels.cloth import STEPS
from warpsim.kernels.xpbd import ACROSS, ALONG, COLUMNS, DOWN, SHEET_COLORS

PIECE = 64  # springs, at most; kernels/xpbd_loops.py has the same
WORTH_A_LINE = 8  # springs side by side; fewer are fetched as if they lay anywhere


@dataclass(frozen=True, eq=False)
class Coloring:
    """The springs of a network color by color."""

    order: np.ndarray
    """int32 (m,): numbers of springs; those of a color in their own order."""
    begin: np.ndarray
    """int32 (colors + 1,): first place of each color in `order`."""


def greedy(springs: np.ndarray) -> Coloring:
    """Color springs (m, 2) in their order, each with the first color that its ends do not have yet.

    Springs side by side, (i, j), (i + 1, j + 1), …, get a color together, so that generated networks stay in rows. Where a point has d
    springs, d colors are the least; this takes fewer than 2 d springs by spring. Source: Vizing 1964 for the least; first fit.
    """
    taken = [0] * (int(springs.max(initial=-1)) + 1)  # of each point, its colors as bits
    color, ends = np.empty(len(springs), np.int64), springs.tolist()
    breaks = ~_follows(springs)
    begin = 0
    while begin < len(ends):
        reach = max(1, abs(ends[begin][1] - ends[begin][0]))  # a longer run would meet its own other ends
        end = begin + 1
        while end < len(ends) and end - begin < reach and not breaks[end]:
            end += 1
        used = 0
        for i, j in ends[begin:end]:
            used |= taken[i] | taken[j]
        bit = ~used & (used + 1)
        color[begin:end] = bit.bit_length() - 1
        for i, j in ends[begin:end]:
            taken[i] |= bit
            taken[j] |= bit
        begin = end
    return _by_color(color)


def _follows(springs: np.ndarray, numbers: np.ndarray | None = None) -> np.ndarray:
    """Return of each spring whether both its ends, and its number, are the next ones after those of the spring before it, bool (m,)."""
    numbers = np.arange(len(springs)) if numbers is None else numbers
    follows = np.zeros(len(springs), bool)
    follows[1:] = (np.diff(springs, axis=0) == 1).all(axis=1) & (np.diff(numbers) == 1)
    return follows


def pieces(coloring: Coloring, springs: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Cut each color into pieces for native loops.

    Returns int32 (pieces, 2): the first place and how many springs, up to 64, negative where they do not lie side by side; and int32
    (colors + 1): the first piece of each color.
    """
    follows, found, begin = _follows(springs[coloring.order], coloring.order), [], [0]
    for first, last in zip(coloring.begin.tolist(), coloring.begin[1:].tolist(), strict=False):
        starts = [first, *(first + 1 + np.flatnonzero(~follows[first + 1 : last])).tolist(), last] if last > first else [last]
        loose = first  # springs from here on lie scattered
        for start, stop in zip(starts, starts[1:], strict=False):
            if stop - start >= WORTH_A_LINE:
                found += [(place, -min(PIECE, start - place)) for place in range(loose, start, PIECE)]
                found += [(place, min(PIECE, stop - place)) for place in range(start, stop, PIECE)]
                loose = stop
        found += [(place, -min(PIECE, last - place)) for place in range(loose, last, PIECE)]
        begin.append(len(found))
    return np.array(found, np.int32).reshape(-1, 2), np.array(begin, np.int32)


def of_sheet(springs: np.ndarray, resolution: tuple[int, int]) -> Coloring:
    """Color the springs (m, 2) of a cloth of nx × ny points by where they begin: the colors and their order are those of its kernels."""
    nx = resolution[0]
    first, last = np.sort(springs, axis=1).T  # a spring begins in its upper row, or on its left
    step = np.stack([last % nx - first % nx, last // nx - first // nx], axis=1)
    color = np.full(len(springs), -1)
    crossing = np.where(first % nx // COLUMNS == last % nx // COLUMNS, ALONG, ACROSS)
    for number, (s, direction, remainders) in enumerate(SHEET_COLORS):
        told = (first // nx if direction == DOWN else first % nx) % 4
        right = (direction == DOWN) | (direction == crossing)
        color[(step == STEPS[s]).all(axis=1) & np.isin(told, remainders) & right] = number
    return _by_color(color, len(SHEET_COLORS))


def _by_color(color: np.ndarray, count: int = 0) -> Coloring:
    sizes = np.bincount(color, minlength=count)
    order = np.argsort(color, kind="stable")
    return Coloring(order.astype(np.int32), np.concatenate([[0], np.cumsum(sizes)]).astype(np.int32))


def runs(sizes: list[int], worth: int) -> list[tuple[int, int]]:
    """Return runs [color, end) of colors: each of at least `worth` springs alone, smaller ones that follow each other together."""
    found: list[tuple[int, int]] = []
    for color, size in enumerate(sizes):
        small = size < worth
        if small and found and sizes[color - 1] < worth:
            found[-1] = (found[-1][0], color + 1)
        else:
            found.append((color, color + 1))
    return found
