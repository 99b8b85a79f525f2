"""Velocities on a grid, from a file that a scene names: npz (an array of numbers) or nvdb (a NanoVDB grid of type Vec3f, made dense).

Nothing in a file is trusted: sizes are read and limited before what they promise is read, pickled objects are never loaded, and every
number must be finite.
"""

import io
import struct
import zipfile
import zlib
from math import prod
from pathlib import Path
from typing import NamedTuple

import numpy as np

from warpsim.scene import SceneError
from warpsim.scene.nearest import nearest
from warpsim.scene.problems import Problem

MOST_SAMPLES = 1 << 26  # of a grid; 768 MiB
BYTES_PER_SAMPLE = 12
NVDB_HEADER, NVDB_GRID, NVDB_BOX = 16, 176, 736  # bytes: file header, a grid's entry in it, place of the index box in a grid (NanoVDB 32)


class VelocityGrid(NamedTuple):
    """The box of a grid of velocities, from the first node to the last, as its file has it [m]."""

    nodes: tuple[int, ...]
    """Along x, y and z."""
    center: tuple[float, ...] = (0.0, 0.0, 0.0)
    size: tuple[float, ...] | None = None
    """None where the file does not say."""


class UnusableGrid(Exception):
    """What a file holds is no grid of velocities; the text says why, the suggestion what was probably meant."""

    def __init__(self, message: str, suggestion: str | None = None):
        super().__init__(message)
        self.suggestion = suggestion


def load_grid(path: Path, where: str, array: str = "velocity") -> tuple[VelocityGrid, np.ndarray]:
    """Read a grid and its velocities at the nodes, float32 (nx, ny, nz, 3) [m/s], x first.

    `where` is the file's place in the scene, for messages ("flow.0.file"), `array` the name of the array in an npz file. An axis with one
    node comes back with two equal ones, so that nothing changes along it. Raises SceneError for a file that is missing, unreadable, of
    another kind or shape, too big, or not finite.
    """
    grid, velocities = _answered(_npz if path.suffix.lower() == ".npz" else _nvdb, path, where, array)
    if not np.isfinite(velocities).all():
        wrong = np.argwhere(~np.isfinite(velocities))[0]
        raise _refusal(where, path, UnusableGrid(f"the velocity at node {wrong[:3].tolist()} is not finite"))
    for axis in range(3):
        if velocities.shape[axis] == 1:
            velocities = np.repeat(velocities, 2, axis)
    return grid._replace(nodes=velocities.shape[:3]), velocities


def grid_bytes(path: Path, where: str, array: str = "velocity") -> int:
    """Return the bytes that a grid will take, without reading its velocities. Raises SceneError as `load_grid` does."""
    shape = _answered(_npz_shape if path.suffix.lower() == ".npz" else _nvdb_shape, path, where, array)
    return BYTES_PER_SAMPLE * prod(max(2, count) for count in shape)


def _answered(read, path: Path, where: str, array: str):
    try:
        return read(path, array)
    except OSError as error:
        raise _refusal(where, path, UnusableGrid(f"cannot be read: {error.strerror or error}")) from None
    except UnusableGrid as error:
        raise _refusal(where, path, error) from None
    except MemoryError:
        raise
    except Exception as error:  # whatever zipfile, zlib, NumPy and Warp find to say about bytes that are none of theirs
        kind = "a zip file of arrays, as numpy.savez writes it" if path.suffix.lower() == ".npz" else "a NanoVDB file, or a damaged one"
        raise _refusal(where, path, UnusableGrid(f"is not {kind} ({error or type(error).__name__})")) from None


def _refusal(where: str, path: Path, error: UnusableGrid) -> SceneError:
    return SceneError([Problem(f"{path.name}: {error}", path=where, suggestion=error.suggestion)])


def _checked_shape(shape: tuple[int, ...]) -> tuple[int, ...]:
    """Return the shape (nx, ny, nz) of the nodes."""
    if len(shape) != 4 or shape[3] != 3:
        raise UnusableGrid(f"has shape {shape}; a grid of velocities has shape (nx, ny, nz, 3)")
    if not prod(shape):
        raise UnusableGrid(f"has shape {shape} and so no node at all")
    if prod(shape[:3]) > MOST_SAMPLES:
        raise UnusableGrid(f"has {prod(shape[:3])} nodes; at most {MOST_SAMPLES} are taken")
    return shape[:3]


def _npz_header(stream) -> tuple[tuple[int, ...], bool, np.dtype]:
    """Return shape, order (true: Fortran's) and type of the array that follows in a stream."""
    version = np.lib.format.read_magic(stream)
    read = np.lib.format.read_array_header_1_0 if version == (1, 0) else np.lib.format.read_array_header_2_0
    shape, fortran, dtype = read(stream)
    if dtype.hasobject:
        raise UnusableGrid("holds pickled objects, which are never loaded; save the array as numbers")
    if dtype.kind not in "fiu":
        raise UnusableGrid(f"holds {dtype}; velocities are real numbers")
    _checked_shape(shape)
    return shape, fortran, dtype


def _member(archive: zipfile.ZipFile, array: str):
    names = [name.removesuffix(".npy") for name in archive.namelist() if name.endswith(".npy")]
    if array not in names:
        known = f"it has {', '.join(names[:8])}" if names else "it has none"
        raise UnusableGrid(f'has no array "{array}"; {known}', nearest(array, names))
    return archive.open(f"{array}.npy")


def _npz_shape(path: Path, array: str) -> tuple[int, ...]:
    with zipfile.ZipFile(path) as archive, _member(archive, array) as stream:
        return _npz_header(stream)[0][:3]


def _npz(path: Path, array: str) -> tuple[VelocityGrid, np.ndarray]:
    with zipfile.ZipFile(path) as archive, _member(archive, array) as stream:
        shape, fortran, dtype = _npz_header(stream)
        size = prod(shape) * dtype.itemsize
        content = stream.read(size)
    if len(content) < size:
        raise UnusableGrid(f"ends after {len(content)} of {size} bytes")
    values = np.frombuffer(content, dtype).reshape(shape, order="F" if fortran else "C")
    with np.errstate(over="ignore"):  # what float32 cannot hold becomes infinite, and is refused as that
        return VelocityGrid(shape[:3]), np.ascontiguousarray(values, np.float32)


def _plain_nvdb(path: Path) -> bytes:
    """Return a NanoVDB file without its compression, so that no chunk grows beyond what its header promises."""
    data = path.read_bytes()
    magic, _, grid_count, codec = struct.unpack_from("<8sIHH", data)
    if not magic.startswith(b"NanoVDB"):
        raise UnusableGrid("is not a NanoVDB file")
    if codec not in (0, 1):
        raise UnusableGrid("is compressed with Blosc; write it without compression or with zip")
    entries, place = [], NVDB_HEADER
    for _ in range(grid_count):
        entries.append((place, struct.unpack_from("<Q", data, place)[0]))
        place += NVDB_GRID + struct.unpack_from("<I", data, place + 136)[0]
    if sum(size for _, size in entries) > 2 * MOST_SAMPLES * BYTES_PER_SAMPLE:
        raise UnusableGrid("holds too much: more than twice the bytes of the largest grid that is taken")
    head, grids = bytearray(data[:place]), [data[place:]]
    if codec == 1:
        struct.pack_into("<H", head, 14, 0)
        grids = []
        for entry, size in entries:
            (packed,) = struct.unpack_from("<Q", data, place)
            stream = zlib.decompressobj()
            grids.append(stream.decompress(data[place + 8 : place + 8 + packed], size + 1))
            if len(grids[-1]) != size or not stream.eof:
                raise UnusableGrid("is a damaged NanoVDB file: a grid is shorter or longer than its header says")
            struct.pack_into("<Q", head, entry + 8, size)
            place += 8 + packed
    return bytes(head) + b"".join(grids)


def _nvdb_box(file: bytes) -> tuple[tuple[int, ...], tuple[int, ...]]:
    """Return the first index of the first grid and its shape (nx, ny, nz)."""
    (grid_count,) = struct.unpack_from("<H", file, 12)
    place = NVDB_HEADER
    for _ in range(grid_count):
        place += NVDB_GRID + struct.unpack_from("<I", file, place + 136)[0]
    box = struct.unpack_from("<6i", file, place + NVDB_BOX)
    return box[:3], _checked_shape((*(max(0, last - first + 1) for first, last in zip(box[:3], box[3:], strict=True)), 3))


def _nvdb_shape(path: Path, array: str) -> tuple[int, ...]:
    return _nvdb_box(_plain_nvdb(path))[1]


def _nvdb(path: Path, array: str) -> tuple[VelocityGrid, np.ndarray]:
    """Read a NanoVDB file through wp.Volume, which checks its structure, and make its first grid dense."""
    import warp as wp

    from warpsim.kernels.grids import gather_voxels

    file = _plain_nvdb(path)
    volume = wp.Volume.load_from_nvdb(io.BytesIO(file), device="cpu")
    info = volume.get_grid_info()
    if info.type_str != "Vec3f":
        raise UnusableGrid(f"holds a grid of type {info.type_str}; velocities are of type Vec3f")
    matrix = np.array(info.transform_matrix, float).reshape(3, 3)
    spacing = matrix.diagonal()
    if (spacing <= 0.0).any() or np.abs(matrix - np.diag(spacing)).max() > 1e-6 * spacing.max():
        raise UnusableGrid("is turned or skewed; its axes must be those of the scene")
    first, shape = _nvdb_box(file)
    values = wp.zeros(shape, dtype=wp.vec3, device="cpu")
    wp.launch(gather_voxels, prod(shape), [0, volume.id, wp.vec3i(*first), values], device="cpu")
    nodes = np.array(shape)
    center = np.array(info.translation, float) + spacing * (np.array(first) + 0.5 * (nodes - 1))
    size = spacing * np.maximum(nodes - 1, 1)  # a single node is as thick as a voxel
    return VelocityGrid(shape, tuple(center.tolist()), tuple(size.tolist())), values.numpy()
