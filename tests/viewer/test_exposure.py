"""Who may reach the viewer, and what strangers get."""

import contextlib
import http.client
import socket
import subprocess
import sys
import threading
import time
from concurrent.futures import ThreadPoolExecutor
from urllib.parse import urlsplit

import pytest
import websocket

from tests.viewer.fake_run import DUST, dust
from tests.viewer.watcher import Watcher, stream_address
from warpsim.observers.viewer import Viewer
from warpsim.observers.viewer.client import MOST_REPLIES
from warpsim.observers.viewer.door import REQUESTS_PER_CONNECTION
from warpsim.observers.viewer.pages import asset_paths, checked_token, fresh_token


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


def test_whoever_dribbles_or_never_says_hello_is_shown_out(viewer):
    address = ("127.0.0.1", urlsplit(viewer.url).port)
    with socket.create_connection(address, 30) as slow, Watcher(viewer.url, hello=False) as shy:
        slow.settimeout(0.3)
        began, request = time.monotonic(), b"GET /stream HTTP/1.1\r\n" + b"X: y\r\n" * 1000
        with contextlib.suppress(ConnectionError):
            for byte in request:
                slow.sendall(bytes([byte]))
                with contextlib.suppress(TimeoutError):
                    if slow.recv(1) == b"":
                        break
        assert time.monotonic() - began < 12
        assert shy.farewell() in (1000, 1006, None) and time.monotonic() - began < 12


def test_a_connection_serves_few_requests(viewer):
    connection = http.client.HTTPConnection(urlsplit(viewer.url).netloc, timeout=30)
    for number in range(1, REQUESTS_PER_CONNECTION + 1):
        connection.request("GET", "/stream.js")
        response = connection.getresponse()
        assert response.read() and (response.getheader("Connection") == "close") == (number == REQUESTS_PER_CONNECTION)
    assert connection.sock is None


def test_a_page_that_talks_too_much_is_shown_out(viewer):
    with Watcher(viewer.url) as watcher:
        with contextlib.suppress(OSError, websocket.WebSocketException):
            for _ in range(5 * MOST_REPLIES):
                watcher.say({"type": "step"})
        assert watcher.farewell() in (1008, None)


@pytest.fixture(scope="module")
def wide():
    """A viewer on every address of this machine; the tests reach it on one they always have."""
    with Viewer(DUST, host="0.0.0.0", port=0, token=TOKEN) as viewer:
        yield viewer


TOKEN = "abcdefghijklmnop_-0123"


def wide_address(viewer: Viewer) -> str:
    return f"127.0.0.2:{urlsplit(viewer.url).port}"


def test_the_token_is_in_the_address_and_opens_page_and_stream(wide):
    assert wide.url.endswith(f"/?token={TOKEN}")
    address = wide_address(wide)
    connection = http.client.HTTPConnection(address, timeout=30)
    connection.request("GET", f"/?token={TOKEN}")
    assert connection.getresponse().status == 200
    connection = http.client.HTTPConnection(address, timeout=30)
    connection.request("GET", "/stream.js")  # a script holds nothing of the run
    assert connection.getresponse().status == 200
    websocket.create_connection(f"ws://{address}/stream?token={TOKEN}", timeout=30, origin=f"http://{address}").close()


@pytest.mark.parametrize("query", ["", "?token=", f"?token={TOKEN[:-1]}", f"?token={TOKEN}x", "?token=%c3%a9", f"?Token={TOKEN}"])
def test_without_the_token_nothing_of_the_run_is_shown(wide, query):
    address = wide_address(wide)
    for path in ("/", "/index.html"):
        connection = http.client.HTTPConnection(address, timeout=30)
        connection.request("GET", path + query)
        assert connection.getresponse().status == 403
    with pytest.raises(websocket.WebSocketBadStatusException) as refused:
        websocket.create_connection(f"ws://{address}/stream{query}", timeout=30, suppress_origin=True)
    assert refused.value.status_code == 403


def test_with_the_token_a_foreign_origin_is_refused_all_the_same(wide):
    with pytest.raises(websocket.WebSocketBadStatusException) as refused:
        websocket.create_connection(f"ws://{wide_address(wide)}/stream?token={TOKEN}", timeout=30, origin="http://evil.example")
    assert refused.value.status_code == 403


@pytest.mark.parametrize("token", ["", "short", "a" * 15, "with space in it all", "a&b=cccccccccccccccccc"])
def test_a_poor_token_is_refused(token):
    with pytest.raises(ValueError):
        Viewer(DUST, host="0.0.0.0", port=0, token=token)


@pytest.mark.parametrize("host", ["::", "localhost", ""])
def test_with_a_token_an_address_is_still_an_address(host):
    before = threading.active_count()
    with pytest.raises(ValueError):
        Viewer(DUST, host=host, port=0, token=TOKEN)
    assert threading.active_count() == before


def test_fresh_tokens_are_good_and_differ():
    tokens = {checked_token(fresh_token()) for _ in range(100)}
    assert len(tokens) == 100


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
