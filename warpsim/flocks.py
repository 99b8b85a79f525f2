"""Where a flock starts, from a file that the scene names; nothing in it is trusted."""

import zipfile
from math import prod
from pathlib import Path

import numpy as np

from warpsim.scene import SceneError
from warpsim.scene.nearest import nearest
from warpsim.scene.problems import Problem

FARTHEST = 1e9  # [m], [m/s]: as the scene's own numbers


def starting_state(name: str, spec, extent: float) -> tuple[np.ndarray, np.ndarray]:
    """Return position [m] and velocity [m/s] of a flock's boids, float32 (n, 3) each; zeros where the device draws them at random.

    Raises SceneError for a file that is unreadable, of another kind or shape, or not finite, and for boids beyond the scene's extent [m]
    or outside a domain that keeps them.
    """
    if spec.start.file is None:
        return np.zeros((spec.count, 3), np.float32), np.zeros((spec.count, 3), np.float32)
    where, path = f"systems.{name}.start.file", spec.start.file.path
    try:
        position, velocity = _arrays(path, spec.count)
    except OSError as error:
        raise _refusal(where, path, f"cannot be read: {error.strerror or error}") from None
    except _NoStart as error:
        raise _refusal(where, path, str(error), error.suggestion) from None
    except Exception as error:  # whatever zipfile, zlib and NumPy find to say about bytes that are none of theirs
        words = f"is not a zip file of arrays, as numpy.savez writes it ({error or type(error).__name__})"
        raise _refusal(where, path, words) from None
    for key, array in (("position", position), ("velocity", velocity)):
        _refuse(where, path, ~(np.abs(array) <= FARTHEST).all(axis=1), f"{key} of boid {{}} is not finite, or beyond {FARTHEST:g}")
    _refuse(where, path, (np.abs(position) > extent).any(axis=1), f"boid {{}} is beyond limits.extent, {extent:g} m")
    if spec.domain is not None and spec.domain.boundary != "none":
        low, high = np.float32(spec.domain.min), np.float32(spec.domain.max)
        outside = ((position < low) | (position > high)) & (high > low)  # an axis that does not exist has no walls
        _refuse(where, path, outside.any(axis=1), f"boid {{}} is outside the domain, which is {spec.domain.boundary}")
    return position, velocity


class _NoStart(Exception):
    """What a file holds is no start of a flock."""

    def __init__(self, message: str, suggestion: str | None = None):
        super().__init__(message)
        self.suggestion = suggestion


def _arrays(path: Path, count: int) -> list[np.ndarray]:
    """Return position and velocity; nothing is read before its header says that it is what it should be."""
    with zipfile.ZipFile(path) as archive:
        names = [name.removesuffix(".npy") for name in archive.namelist() if name.endswith(".npy")]
        return [_array(archive, key, names, count) for key in ("position", "velocity")]


def _array(archive: zipfile.ZipFile, key: str, names: list[str], count: int) -> np.ndarray:
    if key not in names:
        known = f"it has {', '.join(names[:8])}" if names else "it has none"
        raise _NoStart(f'has no array "{key}" ({known}): position and velocity are needed, ({count}, 3) each', nearest(key, names))
    with archive.open(f"{key}.npy") as stream:
        version = np.lib.format.read_magic(stream)
        read = np.lib.format.read_array_header_1_0 if version == (1, 0) else np.lib.format.read_array_header_2_0
        shape, fortran, dtype = read(stream)
        if dtype.hasobject:
            raise _NoStart("holds pickled objects, which are never loaded; save the arrays as numbers")
        if shape != (count, 3) or dtype.kind not in "fiu":
            raise _NoStart(f"{key} has shape {shape} of {dtype}: ({count}, 3) numbers are needed, as count says")
        size = prod(shape) * dtype.itemsize
        content = stream.read(size)
    if len(content) < size:
        raise _NoStart(f"{key} ends after {len(content)} of {size} bytes")
    values = np.frombuffer(content, dtype).reshape(shape, order="F" if fortran else "C")
    with np.errstate(over="ignore"):  # what float32 cannot hold becomes infinite, and is refused as that
        return np.ascontiguousarray(values, np.float32)


def _refuse(where: str, path: Path, wrong: np.ndarray, words: str) -> None:
    """Raise SceneError if anything is wrong with a boid; the first one's number goes into the words."""
    if wrong.any():
        raise _refusal(where, path, words.format(int(np.argmax(wrong))))


def _refusal(where: str, path: Path, message: str, suggestion: str | None = None) -> SceneError:
    return SceneError([Problem(f"{path.name}: {message}", path=where, suggestion=suggestion)])
