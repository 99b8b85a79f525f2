"""Pictures of what the viewer shows, by a headless Chromium of this machine that is told what to do over its DevTools protocol.

Only what a picture needs: one tab, its size, a script, a screenshot. Its Network domain stays off: it would copy every frame once more.
"""

import asyncio
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

from warpsim.files import whole_file

NAMES = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable", "chrome", "microsoft-edge", "msedge")
PLACES = (  # where it is on systems that do not put programs on the path
    "/Applications/Google Chrome.app/Contents/MacOS/Google Chrome",
    "/Applications/Chromium.app/Contents/MacOS/Chromium",
    "C:/Program Files/Google/Chrome/Application/chrome.exe",
    "C:/Program Files (x86)/Microsoft/Edge/Application/msedge.exe",
)
FLAGS = (
    "--headless=new --no-sandbox --use-angle=swiftshader --enable-unsafe-swiftshader --disable-quic --no-first-run --hide-scrollbars "
    "--disable-background-networking --disable-component-update --disable-sync --disable-dev-shm-usage --remote-debugging-port=0"
).split()
START_SECONDS = 60.0  # a browser may take to start on a busy machine
DRAW_SECONDS = 120.0  # a page may take to draw: millions of points by a software renderer
LARGEST_MESSAGE = 2**28  # bytes; a picture comes as one
DRAWN = "typeof stream !== 'undefined' && stream.frames > 0 && stream.unanswered === null"
WORDLESS = "document.body.classList.add('bare'); document.querySelectorAll('.dg').forEach((part) => { part.style.display = 'none'; })"
TWO_PICTURES_LATER = "new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(() => done(true))))"


class NoPicture(Exception):
    """The picture cannot be taken; the text says why."""


def find_browser() -> str | None:
    """Return the path of a Chromium, Chrome or Edge of this machine, None if there is none."""
    found = (shutil.which(name) for name in (*NAMES, *PLACES))
    return next((path for path in found if path), None)


def required_browser() -> str:
    """Return the path of a browser. Raises NoPicture."""
    browser = find_browser()
    if browser is None:
        raise NoPicture("--snapshot needs Chromium, Chrome or Edge, and this machine has none on its path: install one (see `doctor`)")
    return browser


def take_snapshot(url: str, path: Path, size: tuple[int, int]) -> None:
    """Save what a viewer's page at `url` shows, without its words, as a whole PNG file of `size` pixels.

    The frame must have been published. Raises NoPicture, OSError.
    """
    with tempfile.TemporaryDirectory(prefix="warpsim-browser-", ignore_cleanup_errors=True) as profile:
        command = [required_browser(), *FLAGS, f"--window-size={size[0]},{size[1]}", f"--user-data-dir={profile}", "about:blank"]
        # A session of its own, so that its many processes can be ended together, and so that Ctrl-C is ours alone.
        process = subprocess.Popen(
            command, stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, start_new_session=True
        )
        try:
            port = _port(process, Path(profile) / "DevToolsActivePort")
            picture = asyncio.run(_picture(_new_tab(port), url, size))
        finally:
            _end(process)
    with whole_file(path) as file:
        file.write(picture)


def _port(process: subprocess.Popen, told: Path) -> int:
    """Return the port at which the browser listens, which it writes into its profile."""
    end = time.monotonic() + START_SECONDS
    while time.monotonic() < end:
        if told.exists() and "\n" in (text := told.read_text()):
            return int(text.split("\n")[0])
        if process.poll() is not None:
            raise NoPicture(f"the browser {process.args[0]} ended at once, with code {process.returncode}")
        time.sleep(0.05)
    raise NoPicture(f"the browser {process.args[0]} did not start within {START_SECONDS:g} s")


def _new_tab(port: int) -> str:
    """Return the address at which a new, empty tab takes commands."""
    request = urllib.request.Request(f"http://127.0.0.1:{port}/json/new?about:blank", method="PUT")
    try:
        with urllib.request.build_opener(urllib.request.ProxyHandler({})).open(request, timeout=START_SECONDS) as response:
            return json.load(response)["webSocketDebuggerUrl"]
    except OSError as error:
        raise NoPicture(f"the browser does not answer: {error}") from None


async def _picture(tab: str, url: str, size: tuple[int, int]) -> bytes:
    from tornado.websocket import websocket_connect

    try:
        page = Page(await websocket_connect(tab, max_message_size=LARGEST_MESSAGE))
        # The window's frame takes part of --window-size; this is the picture itself.
        await page.command("Emulation.setDeviceMetricsOverride", width=size[0], height=size[1], deviceScaleFactor=1, mobile=False)
        await page.command("Page.bringToFront")  # a tab in the background draws nothing
        await page.command("Page.navigate", url=url)
        await page.wait_for(DRAWN, DRAW_SECONDS)
        await page.run(WORDLESS)
        await page.run(TWO_PICTURES_LATER)
        return base64.b64decode((await page.command("Page.captureScreenshot", format="png"))["data"])
    except TimeoutError:
        raise NoPicture("the browser stopped answering") from None


class Page:
    """One tab of the browser."""

    def __init__(self, connection):
        self._connection, self._last = connection, 0

    async def command(self, method: str, **parameters: object) -> dict:
        """Send one DevTools command and return its result. Raises NoPicture if the browser is gone or refuses, TimeoutError."""
        self._last += 1
        await self._connection.write_message(json.dumps({"id": self._last, "method": method, "params": parameters}))
        while True:
            text = await asyncio.wait_for(self._connection.read_message(), DRAW_SECONDS)
            if text is None:
                raise NoPicture("the browser ended before the picture was taken")
            answer = json.loads(text)
            if answer.get("id") == self._last:
                if "error" in answer:
                    raise NoPicture(f"the browser refuses {method}: {answer['error'].get('message')}")
                return answer["result"]

    async def run(self, script: str) -> object:
        """Return the value of a JavaScript expression, awaited if it is a promise; None where it fails."""
        answer = await self.command("Runtime.evaluate", expression=script, awaitPromise=True, returnByValue=True)
        return answer["result"].get("value")

    async def wait_for(self, condition: str, seconds: float) -> None:
        """Wait until a JavaScript condition holds. Raises NoPicture after so many seconds."""
        end = time.monotonic() + seconds
        while time.monotonic() < end:
            if await self.run(condition) is True:
                return
            await asyncio.sleep(0.05)
        raise NoPicture(f"the page has drawn nothing within {seconds:g} s (does the browser have WebGL?)")


def _end(process: subprocess.Popen) -> None:
    """End the browser with all its processes."""
    for ending in (signal.SIGTERM, getattr(signal, "SIGKILL", signal.SIGTERM)):
        try:
            os.killpg(process.pid, ending) if hasattr(os, "killpg") else process.kill()
            process.wait(5.0)
            return
        except ProcessLookupError:
            return
        except subprocess.TimeoutExpired:
            continue
