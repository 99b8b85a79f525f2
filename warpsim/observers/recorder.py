"""The recorder: a run folder in which every file is whole at every moment.

scene.yaml         the resolved scene, under a header of comments that tells what made the run
frames/NNNNNN.npz  per system NAME.position, NAME.velocity, … of the living particles, NAME.torn of springs that may tear, index, time [s]
frames.jsonl       one line per whole frame: its file, the file's SHA-256, live counts, state hash, and the chain of state hashes so far
topology.npz       of networks, once: NAME.springs int32 (m, 2), NAME.triangles int32 (k, 3), places in the arrays of points
stats.csv          time [s] and per system live, born, refused, killed (counts), kinetic_energy [J]; with emitters that listen: children;
                   among colliders: pushed; with substeps of their own choice: substeps (mean), inexact; of networks: elastic_energy [J]; by
                   implicit_euler: cg_iterations (per substep), cg_residual [1], cg_unconverged (substeps so far); where springs may tear:
                   torn; with a strain_limit: overlong; with self_collision: self_contacts (pairs), self_brakes (substeps); of flocks:
                   order, polarization [degrees], milling, nearest [m], clusters
assets/            copies of the files that the scene names
changes.jsonl      one line per number that was changed while it ran: before the step from frame index, path became value
lastgood.npz       the last good state of a run that was interrupted or blew up
log.txt            what the run said, with the date
"""

import csv
import hashlib
import io
import json
import re
import shutil
import time
from collections.abc import Iterable
from pathlib import Path

from warpsim.files import LineFile, sweep, whole_file, write_text

HEADER = "# A warpsim run."  # first line of scene.yaml: by it a folder is known as a run folder
CHANGES = "changes.jsonl"
TOPOLOGY = "topology.npz"
FIELDS = ("position", "velocity", "id", "age", "lifetime", "mass", "radius")
NETWORK_FIELDS = ("position", "velocity", "id", "mass")  # its points neither come nor go


class OccupiedFolder(Exception):
    """The folder holds something that a new run must not harm; the text says what, and what to do."""


class DamagedChanges(Exception):
    """A file of changes holds a line that is none; the text says which."""


class NonFiniteFrame(ArithmeticError):
    """A frame holds a number that is not finite; it is not written."""


class Recorder:
    """Records frames into a run folder. Raises OccupiedFolder, or OSError with the file's name; what is written stays whole."""

    def __init__(self, folder: Path, overwrite: bool = False):
        self.folder = folder
        prepare_folder(folder, overwrite)
        self._index = self._table = self._log = self._changes = None
        self._early: list[str] = []  # what is said before the files are open
        self._chain = ""

    @property
    def begun(self) -> bool:
        """Whether the folder is a run folder by now."""
        return self._log is not None

    def begin(self, scene_text: str, assets: Iterable[tuple[str, Path]] = ()) -> None:
        """Copy the files that the scene names, write scene.yaml, which makes the folder a run folder, and open the growing files."""
        for name, source in assets:
            (self.folder / name).parent.mkdir(parents=True, exist_ok=True)
            with source.open("rb") as original, whole_file(self.folder / name) as copy:
                shutil.copyfileobj(original, copy)
        write_text(self.folder / "scene.yaml", f"{HEADER}\n{scene_text}")
        (self.folder / "frames").mkdir(exist_ok=True)
        self._index = LineFile(self.folder / "frames.jsonl")
        self._table = LineFile(self.folder / "stats.csv")
        self._log = LineFile(self.folder / "log.txt")
        for line in self._early:
            self._log.append(line)

    def record(self, frame, statistics: dict[str, dict[str, float]], state_hash: str) -> None:
        """Write one frame: its file first, then the lines that point to it, so that no line points to nothing."""
        name = f"frames/{frame.index:06d}.npz"
        if not self._chain:
            save_topology(self.folder / TOPOLOGY, frame)
        digest = save_frame(self.folder / name, frame)
        self._chain = chained(self._chain, state_hash)
        entry = {"index": frame.index, "time": frame.time, "file": name, "sha256": digest}
        entry["live"] = {system: int(numbers["live"]) for system, numbers in statistics.items()}
        self._index.append(json.dumps(entry | {"state": state_hash, "chain": self._chain}))
        self._append_statistics(frame, statistics)

    def record_change(self, index: int, path: str, value: str) -> None:
        """Write one change of the scene, `value` as YAML, before the first frame that it shapes."""
        if self._changes is None:
            self._changes = LineFile(self.folder / CHANGES)
        self._changes.append(json.dumps({"index": index, "path": path, "value": value}))
        self.log(f"frame {index}: {path} = {value}")

    def log(self, text: str) -> None:
        """Append to log.txt, every line with the date and time of day (UTC)."""
        moment = time.strftime("%Y-%m-%dT%H:%M:%SZ", time.gmtime())
        for line in text.splitlines():
            (self._log.append if self._log else self._early.append)(f"{moment} {line}")

    def close(self) -> None:
        """Close the growing files; everything is on the disk already."""
        for file in filter(None, (self._index, self._table, self._log, self._changes)):
            file.close()

    def _append_statistics(self, frame, statistics) -> None:
        if not self._table.length:
            self._table.append(_row(["index", "time", *(f"{name}.{key}" for name in statistics for key in statistics[name])]))
        numbers = [repr(number) for numbers in statistics.values() for number in numbers.values()]
        self._table.append(_row([frame.index, repr(frame.time), *numbers]))


def read_changes(path: Path) -> list[tuple[int, str, str]]:
    """Return the changes of a run as (frame, path, value as YAML), in order. Raises OSError, DamagedChanges."""
    changes: list[tuple[int, str, str]] = []
    for number, line in enumerate(path.read_text(encoding="utf-8", errors="replace").split("\n")[:-1], 1):  # a torn last line never counted
        try:
            entry = json.loads(line)
            index, name, value = entry["index"], entry["path"], entry["value"]
            good = type(index) is int and isinstance(name, str) and isinstance(value, str | int | float) and not isinstance(value, bool)
        except (ValueError, TypeError, KeyError, RecursionError):
            good = False
        if not good or index < (changes[-1][0] if changes else 0):
            words = 'expected {"index": frame, "path": …, "value": …}, with frames from 0 on that never go back'
            raise DamagedChanges(f"{path}:{number}: {words}")
        changes.append((index, name, value if isinstance(value, str) else json.dumps(value)))
    return changes


def save_frame(path: Path, frame) -> str:
    """Write a frame as a whole npz file and return its SHA-256. Equal frames give equal bytes.

    Arrays: NAME.position, NAME.velocity float32 (n, 3) [m, m/s], NAME.id uint64 (n,), NAME.age, .lifetime [s], .mass [kg], .radius [m]
    float32 (n,) per system (of networks position, velocity, id and mass), .color uint8 (n, 4) where emitters give colors, .torn bool (m,)
    of springs that may tear, .neighbors int32 (n,) of flocks, .swimming float32 (n, 3) [m/s] of those that a flow carries, and the scalars
    index and time [s]. Raises OSError, or NonFiniteFrame before anything is written.
    """
    import numpy as np

    arrays = {}
    for name in frame:
        fields = NETWORK_FIELDS if frame[name].is_network else FIELDS
        arrays |= {f"{name}.{field}": getattr(frame[name], field) for field in fields}
    arrays |= {f"{name}.torn": frame[name].torn for name in frame if frame[name].tears}
    arrays |= {f"{name}.neighbors": frame[name].neighbors for name in frame if frame[name].is_flock}
    arrays |= {f"{name}.swimming": frame[name].swimming for name in frame if frame[name].is_carried}
    arrays |= {f"{name}.color": frame[name].color for name in frame if frame[name].has_colors}
    for key, array in arrays.items():
        if not np.isfinite(array).all():
            raise NonFiniteFrame(f"frame {frame.index}: {key} holds a number that is not finite")
    with whole_file(path) as file:
        np.savez(file, index=np.int64(frame.index), time=np.float64(frame.time), **arrays)
        file.seek(0)
        return hashlib.file_digest(file, "sha256").hexdigest()


def save_topology(path: Path, frame) -> None:
    """Write what joins the points of a frame's networks, if it has any; it is the same in every frame. Raises OSError."""
    import numpy as np

    networks = [name for name in frame if frame[name].is_network]
    if networks:
        with whole_file(path) as file:
            np.savez(file, **{f"{name}.{key}": frame[name].topology[key] for name in networks for key in ("springs", "triangles")})


def chained(previous: str, state_hash: str) -> str:
    """Return H(previous chain hash + state hash): two runs with one last chain hash went through the same states."""
    return hashlib.sha256((previous + state_hash).encode()).hexdigest()


def prepare_folder(folder: Path, overwrite: bool) -> None:
    """Make the folder fit for a new run: new, empty, or (with overwrite) cleared of the run it holds and of nothing else.

    The index goes first and the frames after it, so that no line ever points to a missing frame.
    """
    folder.mkdir(parents=True, exist_ok=True)
    if not any(path for path in folder.iterdir() if not path.name.endswith(".partial")):
        sweep(folder)
        return
    if not _is_run(folder):
        raise OccupiedFolder(f"{folder} is not empty and holds no run of warpsim: choose another folder")
    if not overwrite:
        raise OccupiedFolder(f"{folder} already holds a run: choose another folder, or say --overwrite to replace it")
    for name in ("frames.jsonl", "stats.csv", CHANGES, TOPOLOGY, "lastgood.npz", "log.txt"):
        (folder / name).unlink(missing_ok=True)
    frames = folder / "frames"
    for path in frames.glob("*.npz") if frames.is_dir() else ():
        if re.fullmatch(r"\d{6,}\.npz", path.name):
            path.unlink()
    for place in (folder, frames):
        sweep(place)


def _is_run(folder: Path) -> bool:
    try:
        with open(folder / "scene.yaml", encoding="utf-8") as file:
            return file.readline().rstrip("\n") == HEADER
    except (OSError, UnicodeDecodeError):
        return False


def _row(values: list) -> str:
    line = io.StringIO()
    csv.writer(line, lineterminator="").writerow(values)
    return line.getvalue()
