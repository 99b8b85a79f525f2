"""A recording of what the viewer shows, as one HTML file that plays in any browser, from disk, without a server or a network."""

import base64
import gzip
import html
import re
import struct
from contextlib import ExitStack
from pathlib import Path

from warpsim.files import named, whole_file
from warpsim.observers.viewer.blocks import frame_blocks
from warpsim.observers.viewer.pages import asset_paths
from warpsim.observers.viewer.protocol import pack_command, pack_frame
from warpsim.observers.viewer.stage import lines_command, net_commands, stage_commands

# Quantized places are noise to a compressor; the cheapest level finds what there is to find.
_LEVEL = 1
_POLICY = "default-src 'none'; script-src 'unsafe-inline'; style-src 'unsafe-inline'; img-src data: blob:"
_SCRIPT = re.compile(r'<script src="([a-z.]+)"></script>')


class HtmlRecording:
    """Takes frames and writes them, with the page that plays them, to `path`.

        with HtmlRecording(Path("campfire.html"), scene, scene.time.fps) as recording:
            for frame in simulation.frames(300):
                recording.add(frame)

    Each frame is compressed and written when it comes, so memory does not grow; the file appears under its name when it is whole.
    `fps` is the pace at which it plays [1/s]. Raises OSError where the file cannot be begun or, from `close`, completed: a full disk
    in between does not stop a run.
    """

    def __init__(self, path: Path, scene, fps: float):
        self.path, self.count = Path(path), 0
        self._scene, self._names, self._limit = scene, list(scene.systems), scene.viewer.max_points
        self._failure: OSError | None = None
        self._closed = False
        self._stack = ExitStack()
        try:
            self._file = self._stack.enter_context(whole_file(self.path))
        except OSError as error:
            raise named(error, self.path) from error
        self._write(_page(str(scene.name), fps).encode())
        self._commands(stage_commands(scene))

    def add(self, frame) -> None:
        """Record a frame (a `warpsim.Frame`), after those that came before."""
        if self.count == 0 and (nets := net_commands(self._scene, frame)):
            self._commands(list(nets.values()))
        message = pack_frame(self.count + 1, frame.time, frame_blocks(frame, self._names, self._limit))
        self._block("frame", message, f' data-time="{float(frame.time)!r}"')
        self.count += 1

    def show_lines(self, paths, key: str = "streamlines") -> None:
        """Draw polylines, float32 (n, k, 3) [m], for the whole recording; later ones under the same key take their place."""
        self._commands([pack_command(lines_command(key, paths))])

    def close(self) -> None:
        """Complete the file; again: nothing. Raises OSError; what stood under the path before is then untouched."""
        if self._closed:
            return
        self._write(b"</body>\n</html>\n")
        self._closed = True
        if self._failure is not None:
            self._stack.__exit__(type(self._failure), self._failure, None)
            raise self._failure
        self._stack.close()

    def abandon(self) -> None:
        """Leave no file."""
        self._failure = self._failure or OSError(0, "abandoned", str(self.path))
        try:
            self.close()
        except OSError:
            pass

    def _commands(self, commands: list[bytes]) -> None:
        self._block("commands", b"".join(struct.pack("<I", len(command)) + command for command in commands))

    def _block(self, kind: str, message: bytes, attributes: str = "") -> None:
        packed = base64.b64encode(gzip.compress(message, _LEVEL, mtime=0))
        self._write(f'<script type="text/plain" class="{kind}"{attributes}>'.encode(), packed, b"</script>\n")

    def _write(self, *parts: bytes) -> None:
        if self._failure is not None or self._closed:
            return
        try:
            for part in parts:
                self._file.write(part)
        except OSError as error:
            self._failure = named(error, self.path)

    def __enter__(self) -> "HtmlRecording":
        return self

    def __exit__(self, kind, *exception) -> None:
        if kind is None:
            self.close()
        else:
            self.abandon()


def _page(name: str, fps: float) -> str:
    """Return the viewer's page with its scripts inside and the player in place of the connection, up to where the data begin."""
    assets = asset_paths()

    def inline(match: re.Match) -> str:
        source = "player.js" if match[1] == "start.js" else match[1]
        # The only words that would end a script early.
        script = assets[source].read_text(encoding="utf-8").replace("</script", "<\\/script")
        return f"<script>\n{script}\n</script>"

    page = assets["index.html"].read_text(encoding="utf-8")
    head = f'<meta charset="utf-8">\n<meta http-equiv="Content-Security-Policy" content="{_POLICY}">'
    page = page.replace('<meta charset="utf-8">', head).replace("<title>warpsim</title>", f"<title>{html.escape(name)}</title>")
    page = page.replace('<div id="bar" hidden>', f'<div id="bar" hidden data-fps="{float(fps)!r}">')
    return _SCRIPT.sub(inline, page[: page.index("</body>")])
