"""Who may reach the viewer, and what strangers get."""

import http.client
import socket
import subprocess
import sys
import time
from concurrent.futures import ThreadPoolExecutor
from urllib.parse import urlsplit

import pytest
import websocket

from tests.viewer.fake_run import DUST, dust
from tests.viewer.watcher import Watcher, stream_address
from warpsim.observers.viewer import Viewer
from warpsim.observers.viewer.pages import asset_paths


@pytest.fixture(scope="module")
def viewer():
    with Viewer(DUST, port=0) as viewer:
        yield viewer


def get(viewer: Viewer, path: str = "/", **headers: str) -> http.client.HTTPResponse:
    """Return the answer to GET `path`, read; underscores in names of headers stand for hyphens."""
    connection = http.client.HTTPConnection(urlsplit(viewer.url).netloc, timeout=30)
    connection.putrequest("GET", path, skip_host="Host" in headers)
    for name, value in headers.items():
        connection.putheader(name.replace("_", "-"), value)
    connection.endheaders()
    response = connection.getresponse()
    response.body = response.read()
    connection.close()
    return response


@pytest.mark.skipif(sys.platform != "linux", reason="reads /proc/net")
def test_only_the_loopback_listens(viewer):
    port = urlsplit(viewer.url).port
    listening = []
    for table in ("/proc/net/tcp", "/proc/net/tcp6"):
        try:
            with open(table) as file:
                rows = [line.split() for line in file.readlines()[1:]]
        except FileNotFoundError:  # no IPv6 here
            continue
        listening += [row[1].split(":")[0] for row in rows if row[3] == "0A" and int(row[1].split(":")[1], 16) == port]
    assert listening == ["0100007F"]


@pytest.mark.parametrize("host", ["0.0.0.0", "192.168.1.2", "::", "localhost", ""])
def test_other_addresses_are_refused(host):
    with pytest.raises(ValueError):
        Viewer(DUST, host=host, port=0)


def test_the_page_and_its_scripts_are_served(viewer):
    assert b"meshcat-pane" in get(viewer).body
    page = get(viewer, "/main.min.js")
    assert page.body == asset_paths()["main.min.js"].read_bytes()  # untouched
    assert "javascript" in page.headers["Content-Type"]
    for name in ("looks.js", "cloud.js", "stage.js", "hud.js", "stream.js", "start.js"):
        assert get(viewer, f"/{name}").status == 200


@pytest.mark.parametrize("path", ["/x", "/../viewer.py", "/..%2fviewer.py", "//etc/passwd", "/static/start.js", "/main.min.js/", "/%00"])
def test_nothing_else_is_served(viewer, path):
    assert get(viewer, path).status in (400, 404)


@pytest.mark.parametrize("host", ["evil.example", "evil.example:7000", "127.0.0.1.evil.example", "", "[", "[::1]:7000", "0.0.0.0"])
def test_a_foreign_host_is_refused(viewer, host):
    assert get(viewer, Host=host).status in (400, 403)
    if host:
        with pytest.raises(websocket.WebSocketBadStatusException) as refused:
            websocket.create_connection(stream_address(viewer.url), timeout=30, suppress_origin=True, host=host)
        assert refused.value.status_code in (400, 403)


@pytest.mark.parametrize(
    "origin", ["http://evil.example", "null", "https://127.0.0.1", "http://127.0.0.1:1", "http://localhost", "file://"]
)
def test_a_foreign_origin_is_refused(viewer, origin):
    assert get(viewer, Origin=origin).status == 403
    with pytest.raises(websocket.WebSocketBadStatusException) as refused:
        websocket.create_connection(stream_address(viewer.url), timeout=30, origin=origin)
    assert refused.value.status_code == 403


def test_its_own_page_is_welcome_by_either_name_and_through_a_tunnel(viewer):
    for host in (urlsplit(viewer.url).netloc, "localhost:7000", "LOCALHOST:80", "127.0.0.1"):
        socket_ = websocket.create_connection(stream_address(viewer.url), timeout=30, host=host, origin=f"http://{host}")
        socket_.close()


@pytest.mark.parametrize(
    "message",
    ["{", "x" * 5000, "[" * 4000, '{"type": "ack", "frame": 99}', '{"type": "control", "name": "x"}', '{"type": "hello"}', b"\xc1\x00"],
)
def test_a_page_that_talks_nonsense_is_shown_out(viewer, message):
    with Watcher(viewer.url) as watcher:
        viewer.publish(dust(int(time.monotonic() * 1e6)))
        watcher.read_frame()
        watcher.socket.send(message, websocket.ABNF.OPCODE_BINARY if isinstance(message, bytes) else websocket.ABNF.OPCODE_TEXT)
        assert watcher.farewell() in (1008, 1009, None)


def test_a_message_announced_as_huge_is_not_awaited(viewer):
    with Watcher(viewer.url) as watcher:
        watcher.socket.sock.sendall(b"\x81\xff" + (2**62).to_bytes(8, "big") + b"\0\0\0\0")
        watcher.farewell()


@pytest.mark.parametrize(
    "noise",
    [
        b"\x00" * 70_000,
        b"GET / HTTP/1.1\r\n" + b"A: b\r\n" * 20_000,
        b"\x16\x03\x01\x02\x00",
        b"POST / HTTP/1.1\r\nHost: localhost\r\nContent-Length: 999999999\r\n\r\n",
    ],
)
def test_noise_on_the_line_harms_nobody(viewer, noise, capfd):
    with socket.create_connection(("127.0.0.1", urlsplit(viewer.url).port), 30) as sock:
        try:
            sock.sendall(noise)
            sock.shutdown(socket.SHUT_WR)
            while sock.recv(65536):
                pass
        except OSError:  # hung up on while it was speaking
            pass
    assert get(viewer).status == 200
    assert capfd.readouterr().err == ""  # a stranger cannot write on the run's terminal


def test_two_viewers_on_one_port_get_two_ports(viewer):
    port = urlsplit(viewer.url).port
    with Viewer(DUST, port=port) as second, Viewer(DUST, port=port) as third:
        assert len({viewer.url, second.url, third.url}) == 3
        assert get(second).status == get(third).status == 200


def test_twenty_viewers_at_once_on_the_default_port():
    with ThreadPoolExecutor(20) as pool:
        viewers = list(pool.map(lambda _: Viewer(DUST), range(20)))
    assert len({viewer.url for viewer in viewers}) == 20
    assert all(get(viewer).status == 200 for viewer in viewers)
    with ThreadPoolExecutor(20) as pool:
        list(pool.map(Viewer.close, viewers))


def test_a_process_that_forgets_to_close_ends_all_the_same():
    script = "from tests.viewer.fake_run import DUST\nfrom warpsim.observers.viewer import Viewer\nprint(Viewer(DUST, port=0).url)"
    ended = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, timeout=60)
    assert ended.returncode == 0 and ended.stdout.startswith("http://127.0.0.1:") and ended.stderr == ""


def test_meshcat_and_warp_are_not_imported():
    script = "import sys, warpsim.observers.viewer; print([m for m in ('meshcat', 'IPython', 'warp', 'zmq') if m in sys.modules])"
    assert subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, timeout=60).stdout.strip() == "[]"
