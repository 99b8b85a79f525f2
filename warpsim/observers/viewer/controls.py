"""What a page may ask of a run, and what a run tells the pages.  Nothing else reaches a run from outside."""

import json
import math
import threading
from collections import deque
from dataclasses import asdict, dataclass, field

SLOWEST, FASTEST = 0.05, 8.0
# Frames between 0 and this number may be sought: ten weeks at 60 a second.
LAST_FRAME = 2**28
# A run that does not drain its commands must not grow: the oldest are dropped, and a slider overwrites itself.
MOST_COMMANDS = 256
# Status words that change in every frame; a person reads ten a second.
STATUS_PERIOD = 0.1

_BARE = ("play", "pause", "step", "reset", "record")


@dataclass(frozen=True)
class Command:
    """One wish of a page.

    kind: "play", "pause", "step", "reset", "record" (start or stop a recording; value None), "speed" (value in 0.05..8),
    "seek" (value: number of a frame), "set" (value: path of a control and its new number, within the control's range).
    """

    kind: str
    value: float | int | tuple | None = None


@dataclass(frozen=True)
class Status:
    """How a run is going, for the pages: numbers, and the value of each control by its path."""

    playing: bool = True
    speed: float = 1.0
    index: int = 0
    frame_count: int = 0
    time: float = 0.0  # [s]
    steps_per_second: float = 0.0
    real_time_factor: float = 0.0
    live: dict[str, int] = field(default_factory=dict)
    values: dict[str, float] = field(default_factory=dict)
    recording: bool = False
    note: str = ""


def read_command(message: dict) -> Command:
    """Return what a page asks for; a "set" still names its control by number.  Raises ValueError for anything else."""
    match message:
        case {"type": str(kind)} if kind in _BARE and len(message) == 1:
            return Command(kind)
        case {"type": "speed", "value": int() | float() as value} if len(message) == 2:
            return Command("speed", min(max(_finite(value), SLOWEST), FASTEST))
        case {"type": "seek", "value": int(value)} if len(message) == 2 and not isinstance(value, bool):
            return Command("seek", min(max(value, 0), LAST_FRAME))
        case {"type": "set", "control": int(number), "value": int() | float() as value} if len(message) == 3:
            if not isinstance(number, bool):
                return Command("set", (number, _finite(value)))
    raise ValueError("neither hello nor ack nor a command")


def _finite(value: float) -> float:
    try:
        value = float(value) if not isinstance(value, bool) else math.nan
    except OverflowError:
        value = math.inf
    if not math.isfinite(value):
        raise ValueError("not a number")
    return value


class Inbox:
    """Commands of all pages on their way to the run.  `put` is called on the viewer's loop, `drain` by the run."""

    def __init__(self, controls):
        self._controls = list(controls)
        self._commands: deque[Command] = deque(maxlen=MOST_COMMANDS)
        self._lock = threading.Lock()

    def put(self, command: Command) -> None:
        """Take a command in; one that overrides the command before it takes its place."""
        if command.kind == "set":
            number, value = command.value
            if not 0 <= number < len(self._controls):
                return  # a page of an earlier form of the scene
            control = self._controls[number]
            command = Command("set", (control.path, min(max(value, control.min), control.max)))
        with self._lock:
            if self._commands and _subject(self._commands[-1]) == _subject(command) is not None:
                self._commands.pop()
            self._commands.append(command)

    def drain(self) -> list[Command]:
        """Return the commands since the last call, oldest first."""
        if not self._commands:
            return []
        with self._lock:
            commands = list(self._commands)
            self._commands.clear()
        return commands


def _subject(command: Command) -> object:
    """Return what a later command of the same subject would override; None where each counts."""
    if command.kind == "set":
        return command.value[0]
    return ("kind", command.kind) if command.kind in ("speed", "seek") else None


class Bulletin:
    """Decides which status is worth sending: at once where a person has changed something, else ten times a second."""

    def __init__(self):
        self._told: Status | None = None
        self._told_at = -math.inf

    def worth(self, status: Status, now: float) -> bool:
        """Return whether to send `status` at the moment `now` [s], and count it as sent."""
        last = self._told
        if last is not None:
            if status == last:
                return False
            urgent = not status.playing or _choices(status) != _choices(last)
            if not urgent and now - self._told_at < STATUS_PERIOD:
                return False
        self._told, self._told_at = status, now
        return True


def _choices(status: Status) -> tuple:
    return status.playing, status.speed, status.frame_count, status.values, status.recording, status.note


def status_command(status: Status) -> dict:
    """Return the status as a command to the page; what is not a number of JSON is left out."""
    words = asdict(status)
    words["live"] = {str(name): int(count) for name, count in status.live.items()}
    words["values"] = {str(path): float(value) for path, value in status.values.items() if math.isfinite(value)}
    for name in ("time", "speed", "steps_per_second", "real_time_factor"):
        words[name] = float(words[name]) if math.isfinite(words[name]) else 0.0
    return {"type": "warpsim_status", **json.loads(json.dumps(words))}
