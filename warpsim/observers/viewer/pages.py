"""The files a browser asks for, and the check that only pages of this server may ask."""

import hmac
import importlib.util
import re
import secrets
from pathlib import Path
from urllib.parse import urlsplit

import tornado.web

_STATIC = Path(__file__).parent / "static"
_TYPES = {".html": "text/html; charset=utf-8", ".js": "text/javascript; charset=utf-8"}
# dat.gui, part of Meshcat's page, writes style elements of its own.
_POLICY = (
    "default-src 'self'; style-src 'self' 'unsafe-inline'; img-src 'self' data: blob:; "
    "connect-src 'self' ws://127.0.0.1:* ws://localhost:*{own}; frame-ancestors 'self'; base-uri 'none'; form-action 'none'"
)


# As many random characters as nobody guesses; all of them plain in an address.
_TOKEN = re.compile(r"[A-Za-z0-9_-]{16,200}\Z")


def fresh_token() -> str:
    """Return a random token for a viewer that other machines may reach."""
    return secrets.token_urlsafe(24)


def checked_token(token: str | None) -> str | None:
    """Return the token; raises ValueError for one that is short or needs quoting in an address."""
    if token is not None and not _TOKEN.match(token):
        raise ValueError("a token has 16 to 200 letters, digits, - or _")
    return token


def meshcat_script() -> Path:
    """Return the path of Meshcat's page script in the installed package, found without importing it (0.4 s, IPython)."""
    spec = importlib.util.find_spec("meshcat")
    if spec is None or spec.origin is None:
        raise ModuleNotFoundError("the viewer needs the package meshcat: pip install meshcat", name="meshcat")
    return Path(spec.origin).parent / "viewer" / "dist" / "main.min.js"


def asset_paths() -> dict[str, Path]:
    """Return what is served: the name in the address, and the file.  Nothing else can be asked for."""
    ours = {path.name: path for path in _STATIC.iterdir() if path.suffix in _TYPES}
    return {**ours, "": ours["index.html"], "main.min.js": meshcat_script()}


class LocalRequest(tornado.web.RequestHandler):
    """A request that must come from this machine's own browser, from our own page.

    The server listens on the loopback only, but any web page may send the browser there.  The name in Host foils a
    foreign name that resolves to 127.0.0.1 (its port may differ: an ssh tunnel brings its own), and an Origin, which
    browsers add to every websocket, must be the server's own.  Where others may reach the server, by whatever name, the
    page and the stream ask for the token instead; the scripts, which are in everybody's package, do not.
    """

    def secret(self) -> bool:
        """Return whether what is asked for needs the token."""
        return True

    def prepare(self) -> None:
        host = self.request.headers.get("Host", "")
        origin = self.request.headers.get("Origin")
        token = self.settings["token"]
        if token is None and _host_name(host) not in ("127.0.0.1", "localhost"):
            raise tornado.web.HTTPError(403, reason="Foreign Host")
        if token is not None and self.secret():
            given = self.get_query_argument("token", "")
            if not hmac.compare_digest(given.encode(), token.encode()):
                raise tornado.web.HTTPError(403, reason="Wrong Token")
        if origin is not None and origin.lower() != f"http://{host}".lower():
            raise tornado.web.HTTPError(403, reason="Foreign Origin")


def _host_name(host: str) -> str | None:
    try:
        return urlsplit(f"//{host}").hostname
    except ValueError:  # an unclosed bracket, say
        return None


class Asset(LocalRequest):
    """One of the page's files."""

    def initialize(self, paths: dict[str, Path]) -> None:
        self.paths = paths

    def secret(self) -> bool:
        """The page, which shows the run, and not its scripts."""
        return not self.request.path.endswith(".js")

    def get(self, name: str) -> None:
        path = self.paths.get(name)
        if path is None:
            raise tornado.web.HTTPError(404)
        self.set_header("Content-Type", _TYPES[path.suffix])
        self.set_header("Cache-Control", "no-store")
        # Not every browser counts the page's own websocket as 'self'.  A name that could not stand here is never sent by one.
        host = self.request.headers.get("Host", "")
        own = f" ws://{host}" if re.fullmatch(r"[A-Za-z0-9.:\[\]-]+", host) else ""
        self.set_header("Content-Security-Policy", _POLICY.format(own=own))
        self.set_header("Referrer-Policy", "no-referrer")
        self.set_header("X-Content-Type-Options", "nosniff")
        self.finish(path.read_bytes())
