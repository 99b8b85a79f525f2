"""Coloring: springs sorted so that no two of a color share a point, whose order then makes no difference to the bits."""

from dataclasses import dataclass

import numpy as np

from warpsim.kernels.cloth import STEPS
from warpsim.kernels.xpbd import ACROSS, ALONG, COLUMNS, DOWN, SHEET_COLORS


@dataclass(frozen=True, eq=False)
class Coloring:
    """The springs of a network color by color."""

    order: np.ndarray
    """int32 (m,): numbers of springs; those of a color in their own order."""
    begin: np.ndarray
    """int32 (colors + 1,): first place of each color in `order`."""


def greedy(springs: np.ndarray) -> Coloring:
    """Color springs (m, 2) one after the other, each with the first color that its ends do not have yet.

    A point with d springs needs d colors; this takes fewer than 2 d. Source: Vizing 1964 for what is least; first fit for this.
    """
    taken = [0] * (int(springs.max(initial=-1)) + 1)  # of each point, its colors as bits
    color = np.empty(len(springs), np.int64)
    for k, (i, j) in enumerate(springs.tolist()):
        free = ~(taken[i] | taken[j])
        bit = free & -free
        color[k] = bit.bit_length() - 1
        taken[i] |= bit
        taken[j] |= bit
    return _by_color(color)


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
