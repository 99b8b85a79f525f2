"""Drive a real headless Chromium by its DevTools protocol, without a browser-automation package.

Only the Runtime, Log and Page domains are switched on.  Network, which automation packages always use, copies every
websocket message to the driver as base64 and slows a stream of frames from 27 to 5 a second.
"""

import base64
import json
import os
import shutil
import signal
import subprocess
import tempfile
import time
import urllib.request
from pathlib import Path

import websocket

_NAMES = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable", "chrome")
_FLAGS = (
    "--headless=new --no-sandbox --no-first-run --disable-quic --disable-sync --disable-background-networking "
    "--disable-component-update --disable-dev-shm-usage --disable-background-timer-throttling "
    "--disable-renderer-backgrounding --disable-backgrounding-occluded-windows --hide-scrollbars "
    "--use-gl=angle --use-angle=swiftshader --enable-unsafe-swiftshader --remote-debugging-port=0 --remote-allow-origins=*"
).split()


def find_chromium() -> str | None:
    """Return the path of an installed Chromium or Chrome, or None."""
    return next((path for path in map(shutil.which, _NAMES) if path is not None), None)


class BrowserError(RuntimeError):
    """The browser did not start, or a script in a page failed."""


class Browser:
    """A Chromium process with a profile of its own, gone with everything it wrote when the block ends.

    `size` is the picture's width and height in pixels.
    """

    def __init__(self, size: tuple[int, int] = (800, 600)):
        chromium = find_chromium()
        if chromium is None:
            raise BrowserError(f"no Chromium found; looked for {', '.join(_NAMES)}")
        self.profile = Path(tempfile.mkdtemp(prefix="chromium-"))
        command = [chromium, *_FLAGS, f"--window-size={size[0]},{size[1]}", f"--user-data-dir={self.profile}", "about:blank"]
        # A session of its own, so that its many processes can be ended together.
        self.process = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, start_new_session=True)
        self.size = size
        try:
            self.port = self._read_port()
        except BaseException:
            self.close()
            raise

    def _read_port(self, patience: float = 60.0) -> int:
        told = self.profile / "DevToolsActivePort"
        for _ in range(int(patience / 0.05)):
            if told.exists() and "\n" in (text := told.read_text()):
                return int(text.split("\n")[0])
            if self.process.poll() is not None:
                raise BrowserError(f"Chromium ended with code {self.process.returncode}")
            time.sleep(0.05)
        raise BrowserError(f"Chromium did not start within {patience} s")

    def open(self, url: str) -> "Page":
        """Open `url` in a new tab and return it when the document has loaded."""
        request = urllib.request.Request(f"http://127.0.0.1:{self.port}/json/new?about:blank", method="PUT")
        with urllib.request.urlopen(request, timeout=60) as response:
            address = json.load(response)["webSocketDebuggerUrl"]
        page = Page(address, self.size)
        page.visit(url)
        return page

    def close(self) -> None:
        """End the browser and remove its profile."""
        for ending in (signal.SIGTERM, signal.SIGKILL):
            try:
                os.killpg(self.process.pid, ending)
                self.process.wait(10)
                break
            except ProcessLookupError:
                break
            except subprocess.TimeoutExpired:
                continue
        shutil.rmtree(self.profile, ignore_errors=True)

    def __enter__(self) -> "Browser":
        return self

    def __exit__(self, *exception) -> None:
        self.close()


class Page:
    """One tab: run scripts in it, read what its console said, take its picture."""

    def __init__(self, address: str, size: tuple[int, int]):
        self._socket = websocket.create_connection(address, suppress_origin=True, timeout=120)
        self._last = 0
        self._events: list[dict] = []
        for domain in ("Page", "Runtime", "Log"):
            self.command(f"{domain}.enable")
        # The window's frame takes part of --window-size; this is the picture itself.
        self.command("Emulation.setDeviceMetricsOverride", width=size[0], height=size[1], deviceScaleFactor=1, mobile=False)
        self.command("Page.bringToFront")

    def command(self, method: str, **parameters) -> dict:
        """Send one DevTools command and return its result; events that arrive meanwhile are kept."""
        self._last += 1
        self._socket.send(json.dumps({"id": self._last, "method": method, "params": parameters}))
        while True:
            message = json.loads(self._socket.recv())
            if message.get("id") != self._last:
                self._events.append(message)
            elif "error" in message:
                raise BrowserError(f"{method}: {message['error']}")
            else:
                return message["result"]

    def visit(self, url: str) -> None:
        """Go to `url` and wait until its document has loaded."""
        self.run("window.stale = true")
        self.command("Page.navigate", url=url)
        self.wait_for("window.stale === undefined && document.readyState === 'complete'")

    def reload(self) -> None:
        """Load the page again and wait until its document has loaded."""
        self.run("window.stale = true")
        self.command("Page.reload")
        self.wait_for("window.stale === undefined && document.readyState === 'complete'")

    def run(self, script: str):
        """Return the value of a JavaScript expression, awaited if it is a promise."""
        answer = self.command("Runtime.evaluate", expression=script, awaitPromise=True, returnByValue=True)
        if "exceptionDetails" in answer:
            details = answer["exceptionDetails"]
            raise BrowserError(details.get("exception", {}).get("description", details["text"]))
        return answer["result"].get("value")

    def wait_for(self, condition: str, timeout: float = 120.0) -> None:
        """Wait until a JavaScript condition holds; raise BrowserError after `timeout` [s]."""
        end = time.monotonic() + timeout
        while time.monotonic() < end:
            try:
                if self.run(condition):
                    return
            except BrowserError:  # between two documents there is no context to ask
                pass
            time.sleep(0.05)
        raise BrowserError(f"not true within {timeout} s: {condition}")

    def complaints(self) -> list[str]:
        """Return what the page has complained of so far: exceptions, console errors and warnings, failed requests."""
        self.run("0")
        found = []
        for event in self._events:
            parameters = event.get("params", {})
            match event.get("method"):
                case "Runtime.exceptionThrown":
                    details = parameters["exceptionDetails"]
                    found.append(details.get("exception", {}).get("description", details["text"]))
                case "Runtime.consoleAPICalled" if parameters["type"] in ("error", "warning", "assert"):
                    found.append(" ".join(str(a.get("value", a.get("description"))) for a in parameters["args"]))
                case "Log.entryAdded" if parameters["entry"]["level"] in ("error", "warning"):
                    found.append(f"{parameters['entry']['text']} {parameters['entry'].get('url', '')}".strip())
        return found

    def picture(self) -> bytes:
        """Return what the page shows, as PNG."""
        return base64.b64decode(self.command("Page.captureScreenshot", format="png")["data"])


def screenshot(url: str, path: str | Path, seconds: float = 3.0, size: tuple[int, int] = (1280, 720)) -> None:
    """Open a viewer's `url` in headless Chromium, let it play for `seconds` [s], and write what it shows to `path` (PNG).

    The run must go on publishing meanwhile: call this from another thread or process.  Raises BrowserError where no
    Chromium is installed or no frame arrives within a minute.
    """
    with Browser(size) as browser:
        page = browser.open(url)
        page.wait_for("typeof stream !== 'undefined' && stream.frames > 0")
        time.sleep(seconds)
        Path(path).write_bytes(page.picture())
