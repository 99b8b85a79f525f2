"""The bytes on the wire, read back by code that shares nothing with what wrote them."""

import json

import numpy as np
import pytest
import umsgpack
from hypothesis import given
from hypothesis import strategies as st

from tests.viewer.fake_run import FakeSystem, fake_scene
from tests.viewer.watcher import read_frame
from warpsim.observers.viewer.blocks import cloud_blocks
from warpsim.observers.viewer.protocol import Attribute, Block, pack_command, pack_frame, read_reply
from warpsim.observers.viewer.stage import stage_commands


@pytest.mark.parametrize("count", [0, 1, 2, 3, 257])
def test_a_frame_keeps_every_number(count, rng):
    place, color = rng.integers(0, 65536, (count, 4), np.uint16), rng.integers(0, 256, (count, 4), np.uint8)
    message = pack_frame(
        7,
        0.1,
        [
            Block(0, Attribute.POSITION, place, normalized=True),
            Block(0, Attribute.COLOR, color, normalized=True),
            Block(3, Attribute.LIVE_COUNT, np.array([count], np.uint32)),
        ],
    )
    frame = read_frame(message)
    assert (frame.number, frame.time) == (7, 0.1)
    np.testing.assert_array_equal(frame.blocks[0, 0], place)
    np.testing.assert_array_equal(frame.blocks[0, 1], color)
    assert frame.blocks[3, 7] == count


def test_positions_come_back_within_half_a_quantum(rng):
    system = FakeSystem(rng.normal(size=(500, 3)) * [1.0, 100.0, 1e-3] + [0.0, 5.0, -2.0])
    packed = read_frame(pack_frame(1, 0.0, cloud_blocks(0, system, None))).blocks[0, 0]
    quantum = np.ptp(system.position, axis=0) / 65535
    # Half a step of the quantization, and the rounding of float32 at the size of the coordinates.
    allowed = 0.5 * quantum + 2 * np.spacing(np.abs(system.position).max(axis=0))
    assert (np.abs(packed[:, :3] - system.position) <= allowed).all()


def test_the_frame_number_wraps_rather_than_fail():
    assert read_frame(pack_frame(2**32 + 5, 0.0, [])).number == 5


def test_commands_are_meshcats_and_cannot_be_taken_for_frames():
    commands = stage_commands(fake_scene({"a/b": ("sprites", "additive"), "<b>": ("points", "alpha")}, None, 'x"</script>'))
    assert all(command[0] != 0xC1 for command in commands)
    read = [umsgpack.unpackb(command) for command in commands]
    assert {c["type"] for c in read} == {"delete", "set_property", "set_transform", "warpsim_scene", "warpsim_cloud", "warpsim_controls"}
    clouds = [c for c in read if c["type"] == "warpsim_cloud"]
    assert [c["slot"] for c in clouds] == [0, 1] and len({c["path"] for c in clouds}) == 2
    assert pack_command({"type": "delete", "path": "/x"})[0] != 0xC1


@pytest.mark.parametrize(
    ("systems", "gray", "sky"),
    [
        ({"sparks": ("sprites", "additive"), "stones": ("points", "alpha")}, 0.5, "night"),
        ({"stones": ("points", "alpha")}, 0.5, "day"),
        ({"snow": ("sprites", "alpha")}, 0.95, "dusk"),
        ({}, 0.5, "night"),
    ],
)
def test_the_sky_suits_what_is_shown(systems, gray, sky):
    read = [umsgpack.unpackb(command) for command in stage_commands(fake_scene(systems, gray=gray))]
    assert [c["sky"] for c in read if c["type"] == "warpsim_scene"] == [sky]


def test_replies():
    assert read_reply('{"type": "hello"}') is None
    assert read_reply('{"type": "ack", "frame": 12}') == 12


@pytest.mark.parametrize(
    "message",
    [
        b"\x00\x01",
        "",
        "null",
        "[]",
        "{}",
        '{"type": "ack"}',
        '{"type": "ack", "frame": true}',
        '{"type": "ack", "frame": 1e300}',
        '{"type": "ack", "frame": "1"}',
        '{"type": "img"}',
        "[" * 4096,
        '{"a":' * 800,
        "9" * 4096,
        "\ud800",
    ],
)
def test_other_replies_are_refused(message):
    with pytest.raises(ValueError):
        read_reply(message)


@given(st.one_of(st.text(), st.binary(), st.recursive(st.none() | st.booleans() | st.floats() | st.text(), st.lists).map(json.dumps)))
def test_any_reply_is_understood_or_refused(message):
    try:
        read_reply(message)
    except ValueError:
        pass
