"""Kept states: copies of a simulation's arrays to go back to, small ones; which of them are worth their room."""

import hashlib
from collections.abc import Iterator, Mapping

import numpy as np

from warpsim.footprint import MOST_KEPT, MOST_KEPT_BYTES

Arrays = Mapping[str, Mapping[str, np.ndarray]]
"""By system and name: everything that the future depends on, on the CPU the live arrays themselves."""


class KeptArray:
    """A copy of an array, of which a row that is the same number throughout is kept as that number; iterate over its rows."""

    def __init__(self, array: np.ndarray):
        self.shape = array.shape
        self._rows = [np.array(row[:1] if is_even(row) else row) for row in array] if array.ndim == 2 else np.array(array)

    @property
    def nbytes(self) -> int:
        """Bytes that it takes."""
        return sum(row.nbytes for row in self._rows)

    def __iter__(self) -> Iterator[np.ndarray]:
        """Yield row after row, one number for a row that is the same throughout: it is broadcast where it is assigned."""
        return iter(self._rows)

    def whole(self) -> np.ndarray:
        """Return the array as it was."""
        if isinstance(self._rows, np.ndarray):
            return np.array(self._rows)
        array = np.empty(self.shape, self._rows[0].dtype) if self._rows else np.empty(self.shape)
        for row, kept in zip(array, self._rows, strict=True):
            row[:] = kept
        return array


def is_even(row: np.ndarray) -> bool:
    """Return whether a row is one number throughout, to the last bit: −0 is not 0, and NaN is itself."""
    if len(row) < 2 or row.dtype.itemsize not in (1, 2, 4, 8):
        return False
    words = row.view(f"u{row.dtype.itemsize}")
    return bool(words[0] == words[-1] and words[0] == words[len(words) // 2] and (words == words[0]).all())


def kept(arrays: Arrays) -> dict[str, dict[str, KeptArray]]:
    """Return copies of all arrays."""
    return {name: {key: KeptArray(array) for key, array in each.items()} for name, each in arrays.items()}


def size_of(state: Arrays | dict[str, dict[str, KeptArray]]) -> int:
    """Return the bytes of all its arrays."""
    return sum(array.nbytes for arrays in state.values() for array in arrays.values())


def thinned(states: list[dict], coming: int) -> list[dict]:
    """Return which states stay to make room for one more of so many bytes: of all but the first, every other goes until there is."""
    sizes = [size_of(state["systems"]) for state in states]
    while len(states) > 1 and (len(states) >= MOST_KEPT or sum(sizes) + coming > MOST_KEPT_BYTES):
        states, sizes = states[::2] if len(states) > 2 else states[:1], sizes[::2] if len(states) > 2 else sizes[:1]
    return states


def digest_of(index: int, arrays: Arrays) -> str:
    """Return a hex digest of a frame's number and of all arrays, which are read row by row where they are."""
    digest = hashlib.blake2b(str(index).encode(), digest_size=16)
    for name, each in arrays.items():
        for key, array in each.items():
            digest.update(f"{name}.{key}{array.shape}{array.dtype.str}".encode())
            for row in array if array.ndim == 2 else [array]:
                digest.update(np.ascontiguousarray(row))
    return digest.hexdigest()
