"""Frames on demand, the latest first, to pages that come, lag and vanish."""

import contextlib
import socket
import sys
import threading
import time
from urllib.parse import urlsplit

import pytest
import websocket

from tests.viewer.fake_run import DUST, dust
from tests.viewer.watcher import Watcher, eventually
from warpsim.observers.viewer import Viewer
from warpsim.observers.viewer.client import CREDIT
from warpsim.observers.viewer.door import MOST_CONNECTIONS
from warpsim.observers.viewer.hub import MOST_CLIENTS


@pytest.fixture
def viewer():
    with Viewer(DUST, port=0) as viewer:
        yield viewer


def test_nothing_is_wanted_until_a_page_says_hello(viewer):
    assert not viewer.wants_frame() and viewer.client_count == 0 and not viewer.wait_for_client(0.0)
    with Watcher(viewer.url, hello=False) as watcher:
        assert watcher.silent() and not viewer.wants_frame()
        watcher.say({"type": "hello"})
        assert viewer.wait_for_client(30.0) and viewer.client_count == 1
        assert eventually(viewer.wants_frame)


def test_a_page_gets_the_stage_then_frames(viewer):
    with Watcher(viewer.url) as watcher:
        assert eventually(viewer.wants_frame)
        viewer.publish(dust(1))
        frame = watcher.read_frame()
        assert frame.time == 1 / 60 and len(frame.blocks[0, 0]) == 1000 and frame.blocks[0, 7] == 1000
        assert watcher.commands[0] == {"type": "delete", "path": "/warpsim"}
        assert watcher.commands[-1]["type"] == "warpsim_cloud" and watcher.commands[-1]["name"] == "dust"


def test_a_late_page_gets_the_latest_frame(viewer):
    for index in range(5):
        viewer.publish(dust(index))
    with Watcher(viewer.url) as watcher:
        assert watcher.read_frame().time == 4 / 60
        assert watcher.commands and watcher.silent()


def test_a_page_that_does_not_draw_gets_two_frames_and_later_the_newest(viewer):
    with Watcher(viewer.url) as watcher:
        assert eventually(viewer.wants_frame)
        for index in range(1, 101):  # a run that publishes without asking
            viewer.publish(dust(index))
            time.sleep(0.001)
        first = [watcher.read_frame() for _ in range(CREDIT)]
        assert watcher.silent() and not viewer.wants_frame()
        watcher.ack(first[-1].number)
        assert watcher.read_frame().time == 100 / 60  # not the third: that has passed


def test_an_ack_for_the_last_frame_answers_for_those_before(viewer):
    with Watcher(viewer.url) as watcher:
        numbers = []
        for index in (1, 2):
            assert eventually(viewer.wants_frame)
            viewer.publish(dust(index))
            numbers.append(watcher.read_frame().number)
        watcher.ack(numbers[-1])
        for index in (3, 4):  # both places are free again
            assert eventually(viewer.wants_frame)
            viewer.publish(dust(index))
            watcher.read_frame()
        assert not viewer.wants_frame()


def test_a_run_behind_its_clock_is_asked_for_few_frames(viewer):
    with Watcher(viewer.url) as watcher:
        assert eventually(viewer.wants_frame)
        big, began, spent, published = dust(1, 200_000), time.perf_counter(), 0.0, 0
        while time.perf_counter() - began < 1.0:
            if viewer.wants_frame(behind=True):
                published += 1
                big.index = published
                now = time.thread_time()  # of the run's thread alone, whatever else the machine does
                viewer.publish(big)
                spent += time.thread_time() - now
                watcher.ack(watcher.read_frame().number)
                watcher.frames.clear()
        assert published >= 2 and spent < 0.2 and eventually(viewer.wants_frame)


def test_the_same_frame_is_sent_once(viewer):
    with Watcher(viewer.url) as watcher:
        assert eventually(viewer.wants_frame)
        for _ in range(3):
            viewer.publish(dust(9))
        watcher.read_frame()
        assert watcher.silent()


def test_each_page_has_its_own_pace(viewer):
    with Watcher(viewer.url) as slow, Watcher(viewer.url) as quick:
        assert eventually(lambda: viewer.client_count == 2)
        for index in range(1, 21):
            assert eventually(viewer.wants_frame)
            viewer.publish(dust(index))
            quick.ack(quick.read_frame().number)
        assert [f.time for f in quick.frames] == [index / 60 for index in range(1, 21)]
        assert [slow.read_frame().time for _ in range(CREDIT)] == [1 / 60, 2 / 60] and slow.silent()


def test_pages_that_vanish_mid_frame_are_forgotten(viewer):
    big = dust(1, 200_000)
    for index in range(10):
        watcher = Watcher(viewer.url)
        assert viewer.wait_for_client(30.0)
        big.index = index
        viewer.publish(big)
        watcher.socket.sock.recv(1000)
        watcher.reset()
        assert eventually(lambda: viewer.client_count == 0)
    assert not viewer.wants_frame()
    with Watcher(viewer.url) as polite:
        assert len(polite.read_frame().blocks[0, 0]) == 200_000


def never_reads(url: str) -> socket.socket:
    """Return a socket that has shaken hands and said hello, and reads no more."""
    watcher = Watcher(url, sockopt=[(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)])
    return watcher.socket.sock


def resident_bytes() -> int:
    """Return this process's resident memory [bytes]."""
    with open("/proc/self/statm") as file:
        return int(file.read().split()[1]) * 4096


@pytest.mark.skipif(sys.platform != "linux", reason="reads /proc")
def test_pages_that_never_read_cost_no_memory_and_no_time(viewer):
    stalled = [never_reads(viewer.url) for _ in range(8)]
    assert eventually(lambda: viewer.client_count == 8)
    frames = [dust(index, 100_000) for index in range(8)]
    before = resident_bytes()
    with Watcher(viewer.url) as polite:
        for index in range(200):
            frame = frames[index % 8]
            frame.index = index
            assert eventually(viewer.wants_frame)
            viewer.publish(frame)
            polite.ack(polite.read_frame().number)
            polite.frames.clear()
    # Each may hold one message of 1.2 MB; 200 frames for 8 pages would be 1.9 GB.
    assert resident_bytes() - before < 64e6
    for sock in stalled:
        sock.close()


def test_when_the_room_is_full_the_quietest_page_goes(viewer):
    with contextlib.ExitStack() as stack:
        first, *rest = [stack.enter_context(Watcher(viewer.url)) for _ in range(MOST_CLIENTS)]
        assert eventually(lambda: viewer.client_count == MOST_CLIENTS)
        viewer.publish(dust(1))
        first.ack(first.read_frame().number)  # the only one that draws, so not the quietest
        assert eventually(viewer.wants_frame)
        newcomer = stack.enter_context(Watcher(viewer.url))
        assert newcomer.read_frame()
        viewer.publish(dust(2))
        assert first.read_frame()
        assert rest[0].farewell() is None and viewer.client_count == MOST_CLIENTS


def storm(url: str, connections: int) -> None:
    """Connect over and over and misbehave in turn."""
    address = urlsplit(url)
    for turn in range(connections):
        with contextlib.suppress(OSError, websocket.WebSocketException):
            if turn % 5 == 0:  # half open: connects, says nothing
                socket.create_connection((address.hostname, address.port), 5).close()
            elif turn % 5 == 1:  # garbage instead of HTTP
                with socket.create_connection((address.hostname, address.port), 5) as sock:
                    sock.sendall(b"\x16\x03\x01" + bytes(range(256)) * 4)
            elif turn % 5 == 2:  # garbage instead of a reply
                Watcher(url).socket.send("]" * 100)
            elif turn % 5 == 3:
                Watcher(url).reset()
            else:
                with Watcher(url):
                    pass


def test_two_hundred_hostile_connections_leave_the_polite_page_served(viewer):
    hostile = [threading.Thread(target=storm, args=(viewer.url, 50), daemon=True) for _ in range(4)]
    for thread in hostile:
        thread.start()
    served = index = 0
    while served < 5 or any(thread.is_alive() for thread in hostile):
        # The room may be full of strangers for a moment: a page that is shown out connects again, as ours does.
        with contextlib.suppress(websocket.WebSocketException, OSError), Watcher(viewer.url) as polite:
            for _ in range(3):
                index += 1
                assert eventually(viewer.wants_frame)
                viewer.publish(dust(index))
                polite.ack(polite.read_frame().number)
            served += 1
    assert eventually(lambda: viewer.client_count == 0)


def test_idle_connections_do_not_use_up_the_descriptors(viewer):
    address = urlsplit(viewer.url)
    with contextlib.ExitStack() as stack:
        idle = [stack.enter_context(socket.create_connection((address.hostname, address.port), 30)) for _ in range(2 * MOST_CONNECTIONS)]
        with Watcher(viewer.url) as polite:
            viewer.publish(dust(1))
            assert polite.read_frame()
        idle[0].settimeout(30)
        assert idle[0].recv(1) == b""  # the oldest were shown out


def test_close_says_goodbye_frees_the_port_and_may_be_repeated(viewer):
    with Watcher(viewer.url) as watcher:
        assert viewer.wait_for_client(30.0)
        stalled = never_reads(viewer.url)
        viewer.publish(dust(1, 200_000))
        viewer.close()
        assert watcher.farewell() == 1001
        stalled.close()
    assert not viewer._hub._thread.is_alive()
    viewer.close()
    viewer.publish(dust(2))
    assert not viewer.wants_frame()
    with Viewer(DUST, port=urlsplit(viewer.url).port) as next_run:
        assert next_run.url == viewer.url


def test_a_page_left_over_finds_the_next_run_on_the_port(viewer):
    port = urlsplit(viewer.url).port
    with Watcher(viewer.url):
        viewer.wait_for_client(30.0)
        viewer.close()
    with Viewer(DUST, port=port) as second, Watcher(second.url) as watcher:
        second.publish(dust(3))
        assert watcher.read_frame().time == 3 / 60
