"""The bytes between a run and the pages that watch it.

Three kinds of message share one websocket:

* commands to the page: msgpack maps, Meshcat's own (`set_property`, `set_transform`, ...) and some of ours (`warpsim_*`);
* frames to the page: one binary message that begins with 0xC1, the byte msgpack never uses, so the page tells them apart;
* replies from the page: JSON, `{"type": "hello"}` once, `{"type": "ack", "frame": n}` after frame n has been drawn, and the
  commands of controls.py (`{"type": "set", "control": 2, "value": 0.5}`).

A frame, little endian:

    u8 0xC1, u8 version, u16 blocks, u32 frame, f64 time [s], then each block:
    u16 slot, u8 attribute, u8 dtype, u8 item size, u8 flags (1 normalized, 2 affine), u16 0, u32 count, u32 bytes,
    [f32 scale[3], f32 offset[3] if affine], payload padded to 8 bytes

The page lays typed arrays over the payload without copying it, which the padding makes possible.
"""

import json
import struct
from dataclasses import dataclass
from enum import IntEnum

import numpy as np
import umsgpack

from warpsim.observers.viewer.controls import Command, read_command

FRAME_MARK = 0xC1
VERSION = 1
# What the page may say fits in a line; anything longer is not ours.
LONGEST_REPLY = 4096

_HEADER = struct.Struct("<BBHId")
_BLOCK = struct.Struct("<HBBBBHII")
_NORMALIZED, _AFFINE = 1, 2
# The extension codes of msgpack-lite, which Meshcat's page uses for typed arrays too.
_DTYPE_CODES = {"i1": 0x11, "u1": 0x12, "i2": 0x13, "u2": 0x14, "i4": 0x15, "u4": 0x16, "f4": 0x17}


class Attribute(IntEnum):
    """What a block of a frame holds. Codes 2 to 4 are kept for normals, indices and instance matrices."""

    POSITION = 0
    COLOR = 1
    POSES = 5  # of the colliders: center and quaternion, seven numbers each; in the slot after the last system's
    SIZE_MAX = 6  # size of a particle whose fourth position component is full [m]
    LIVE_COUNT = 7  # particles alive, which may be more than the points drawn
    TRAIL = 8  # points of all trails, oldest first, in the box of the cloud
    TRAIL_COLOR = 9  # one per trail
    TRAIL_POINTS = 10  # of each trail
    TORN = 11  # a bit for each spring of a network, first springs in low bits: whether it is torn; absent where none can be
    LOST = 12  # the same of its triangles
    HEADING = 13  # of bodies: four signed bytes each, the unit vector along which it points and the sine of its roll to the right


@dataclass(frozen=True)
class Block:
    """One array of one system: `array` has shape (n,) or (n, k); `affine` is (scale, offset), float32 (3,) each."""

    slot: int
    attribute: Attribute
    array: np.ndarray
    normalized: bool = False
    affine: tuple[np.ndarray, np.ndarray] | None = None


def pack_command(command: dict) -> bytes:
    """Pack one set-up command of plain Python values in Meshcat's message format."""
    return umsgpack.packb(command)


def pack_frame(number: int, time: float, blocks: list[Block]) -> bytes:
    """Pack frame `number` at `time` [s] into one message, with a single copy of the arrays."""
    parts = [_HEADER.pack(FRAME_MARK, VERSION, len(blocks), number & 0xFFFFFFFF, time)]
    for block in blocks:
        array = np.ascontiguousarray(block.array)
        code = _DTYPE_CODES[array.dtype.str[1:]]
        width = 1 if array.ndim == 1 else array.shape[1]
        flags = (_NORMALIZED if block.normalized else 0) | (_AFFINE if block.affine is not None else 0)
        parts.append(_BLOCK.pack(block.slot, block.attribute, code, width, flags, 0, array.shape[0], array.nbytes))
        if block.affine is not None:
            parts += [np.asarray(row, np.float32).tobytes() for row in block.affine]
        parts += [array.reshape(-1).view(np.uint8).data, bytes(-array.nbytes % 8)]
    return b"".join(parts)


def read_reply(message: str | bytes) -> int | Command | None:
    """Return the number of the frame that a page acknowledges, None for its hello, or what it asks of the run.

    Raises ValueError for anything else: only a page of this version has a reason to talk to us.
    """
    if not isinstance(message, str):
        raise ValueError("replies are text")
    try:
        reply = json.loads(message)
    except RecursionError:  # four thousand brackets
        raise ValueError("nested too deeply") from None
    match reply:
        case {"type": "hello"}:
            return None
        case {"type": "ack", "frame": int(number)} if not isinstance(number, bool):
            return number
        case dict():
            return read_command(reply)
    raise ValueError("not a reply")
