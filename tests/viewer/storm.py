"""python -m tests.viewer.storm --connects 2000: a run with a viewer, a storm of hostile connections on it, and what that costs.

The storm is a process of its own, so that its work is not the run's; the figures are of steps in the same seconds of the same
machine, with and without it, in turns.
"""

import argparse
import contextlib
import json
import os
import socket
import struct
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from pathlib import Path
from urllib.parse import urlsplit

import websocket

from tests.viewer.watcher import PATIENCE, Watcher, stream_address

KINDS = ("half open", "garbage", "reset", "reset mid-frame", "never reads", "nonsense", "huge", "slow handshake", "foreign", "polite")


def misbehave(url: str, kind: str, keep: list) -> None:
    """Make one connection of a kind; what must stay open goes into `keep`."""
    address = urlsplit(url)

    def plain() -> socket.socket:
        return socket.create_connection((address.hostname, address.port), 5)

    match kind:
        case "half open":
            keep.append(plain())
        case "garbage":
            with plain() as sock:
                sock.sendall(b"\x16\x03\x01" + bytes(range(256)) * 40)
        case "reset":
            with plain() as sock:
                sock.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))
        case "reset mid-frame":
            watcher = Watcher(url)
            watcher.socket.sock.recv(100)
            watcher.reset()
        case "never reads":
            keep.append(Watcher(url, sockopt=[(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)]))
        case "nonsense":
            with Watcher(url) as watcher:
                watcher.say({"type": "set", "control": 10**6, "value": 1})
                watcher.socket.send("]" * 100)
        case "huge":
            with Watcher(url) as watcher:
                watcher.socket.sock.sendall(b"\x81\xff" + (2**62).to_bytes(8, "big") + bytes(4))
        case "slow handshake":
            sock = plain()
            sock.sendall(b"GET /stream HTTP/1.1\r\nHost: ")
            keep.append(sock)
        case "foreign":
            with contextlib.suppress(websocket.WebSocketBadStatusException):
                websocket.create_connection(stream_address(url), timeout=5, origin="http://evil.example").close()
        case "polite":
            with Watcher(url) as watcher:
                watcher.ack(watcher.read_frame().number)


def rage(url: str, first: int, last: int) -> None:
    """Connections `first` to `last` of a storm, one after the other; at most 40 of them stay open."""
    keep: list = []
    for number in range(first, last):
        with contextlib.suppress(OSError, websocket.WebSocketException):
            misbehave(url, KINDS[number % len(KINDS)], keep)
        while len(keep) > 40:
            with contextlib.suppress(OSError, websocket.WebSocketException):
                keep.pop(0).close()


@contextlib.contextmanager
def storm(url: str, connects: int, threads: int = 8) -> Iterator[subprocess.Popen]:
    """Let a storm loose in a process of its own; it has ended when the block has."""
    command = [sys.executable, "-m", "tests.viewer.storm", "--at", url, "--connects", str(connects), "--threads", str(threads)]
    process = subprocess.Popen(command, cwd=Path(__file__).parents[2], stderr=subprocess.DEVNULL)
    try:
        yield process
        process.wait(600)
    finally:
        process.kill()
        process.wait()


def attack(url: str, connects: int, threads: int) -> None:
    """What the storm's process does."""
    shares = [range(connects)[k * connects // threads : (k + 1) * connects // threads] for k in range(threads)]
    workers = [threading.Thread(target=rage, args=(url, share.start, share.stop), daemon=True) for share in shares]
    for worker in workers:
        worker.start()
    for worker in workers:
        worker.join()


def resident_bytes() -> int:
    """Return this process's resident memory [bytes]; 0 where /proc is not."""
    try:
        return int(Path("/proc/self/statm").read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE")
    except OSError:
        return 0


class Pace:
    """Steps a simulation at full speed, showing frames to whoever waits."""

    def __init__(self, simulation, viewer):
        self.simulation, self.viewer = simulation, viewer

    def rate(self, seconds: float, going=lambda: True) -> tuple[float, float, float]:
        """Return steps per second over `seconds` [s] or while `going()`, how long it took [s], and the processor time of a step [s].

        The last is what other work on the machine leaves alone: what the viewer's thread takes counts, what another process does not.
        """
        began, spent, steps = time.perf_counter(), time.process_time(), 0
        while (passed := time.perf_counter() - began) < seconds and going():
            self.simulation.step_frame()
            steps += 1
            if self.viewer.wants_frame(behind=True):  # it runs as fast as it can
                self.viewer.publish(self.simulation.frame())
        return steps / max(passed, 1e-9), passed, (time.process_time() - spent) / max(steps, 1)


def measure(connects: int, threads: int, calm_seconds: float = 4.0) -> dict[str, float]:
    """Run a scene under a storm and return the figures."""
    from warpsim import Simulation, load_scene
    from warpsim.observers.viewer import Viewer
    from warpsim.runner import SWITCH_INTERVAL

    sys.setswitchinterval(SWITCH_INTERVAL)  # as a run with a viewer has it
    simulation = Simulation(load_scene("campfire"), device="cpu", threads=1)
    with Viewer(simulation.scene, port=0) as viewer:
        pace = Pace(simulation, viewer)
        viewer.publish(simulation.frame())
        pace.rate(calm_seconds)
        before = resident_bytes()
        calm, _, cost = pace.rate(calm_seconds)
        with storm(viewer.url, connects, threads) as process:
            stormy, seconds, stormy_cost = pace.rate(600.0, lambda: process.poll() is None)
        calm_after, _, cost_after = pace.rate(calm_seconds)
        grown = resident_bytes() - before
        asked = time.perf_counter()
        stop = threading.Event()
        runner = threading.Thread(target=lambda: pace.rate(PATIENCE, lambda: not stop.is_set()))
        runner.start()
        with Watcher(viewer.url) as watcher:
            watcher.read_frame()
            served = time.perf_counter() - asked
        stop.set()
        runner.join()
    return {
        "connects": connects,
        "storm_seconds": seconds,
        "steps_per_second_calm": 0.5 * (calm + calm_after),
        "steps_per_second_storm": stormy,
        "share_kept": stormy / (0.5 * (calm + calm_after)),
        "milliseconds_of_processor_per_connection": 1e3 * stormy * seconds * (stormy_cost - 0.5 * (cost + cost_after)) / connects,
        "memory_grown_mb": grown / 1e6,
        "next_viewer_seconds": served,
    }


def main() -> None:
    """Be the storm (--at URL), or measure one."""
    parser = argparse.ArgumentParser(prog="python -m tests.viewer.storm", description=__doc__)
    parser.add_argument("--connects", type=int, default=2000)
    parser.add_argument("--threads", type=int, default=8, help="hostile connections at once")
    parser.add_argument("--at", metavar="URL", help="only make the storm, against this viewer")
    options = parser.parse_args()
    if options.at:
        attack(options.at, options.connects, options.threads)
        return
    figures = measure(options.connects, options.threads)
    print(json.dumps({key: round(value, 3) for key, value in figures.items()}, indent=1))
    bars = figures["share_kept"] >= 0.9, figures["memory_grown_mb"] <= 64, figures["next_viewer_seconds"] <= 2.0
    sys.exit(0 if all(bars) else 1)


if __name__ == "__main__":
    main()
