"""Replay: the frames of a run folder, as observers see them, without computing anything again."""

import json
import zipfile
from functools import lru_cache
from pathlib import Path

import numpy as np
import warp as wp

from warpsim.frame import Frame, SystemFrame
from warpsim.kernels import emission
from warpsim.networks import Net, edges_of, network_of
from warpsim.poses import Poses
from warpsim.scene import load_scene
from warpsim.scene.springs import Network
from warpsim.systems.lasting import FOREVER
from warpsim.systems.points import PointPacker, frames_between

FRAMES_KEPT = 32  # read frames that stay in memory


class NoRun(Exception):
    """The folder holds no run, or a damaged one; the text says which file is wrong and how."""


class Recording:
    """A run folder: `scene`, `frame_count` (number of the last frame), `frame(index)`. Raises NoRun, SceneError."""

    def __init__(self, folder: Path, device: str = "cpu"):
        self.folder, self.device = Path(folder), device
        index = self.folder / "frames.jsonl"
        try:
            lines = index.read_text(encoding="utf-8").split("\n")[:-1]  # a last line without its end was under way when the run ended
            self._entries = [json.loads(line) for line in lines]
            self._files = {int(entry["index"]): self.folder / entry["file"] for entry in self._entries}
        except OSError as error:
            raise NoRun(f"{self.folder} holds no run: {index.name} cannot be read ({error.strerror})") from None
        except (ValueError, KeyError, TypeError):
            raise NoRun(f"{index} is damaged: line {len(getattr(self, '_entries', [])) + 1} is no entry of a frame") from None
        if not self._files:
            raise NoRun(f"{self.folder} holds no frame yet")
        self.scene = load_scene(self.folder / "scene.yaml")
        self.frame_count = max(self._files)
        self._poses = Poses(self.scene)
        self._packers = {name: (RecordedPopulation(device), spec.look) for name, spec in self.scene.systems.items()}
        self._nets = {name: network_of(spec, f"systems.{name}") for name, spec in self.scene.systems.items() if isinstance(spec, Network)}
        self._topology = {name: topology_of(net, self.scene.systems[name]) for name, net in self._nets.items()}
        trails = [look.trail for _, look in self._packers.values() if look.trail]
        reach = max((frames_between(trail, self.scene.time.fps) * trail.points for trail in trails), default=0)
        self._read = lru_cache(maxsize=FRAMES_KEPT + reach)(self._load)

    def frame(self, index: int) -> Frame:
        """Return a recorded frame; where one was not recorded, the nearest before it. Raises NoRun for a damaged file."""
        recorded = max((k for k in self._files if k <= index), default=min(self._files))
        arrays, fps = self._read(recorded), self.scene.time.fps
        systems = {}
        for name, (population, look) in self._packers.items():
            fields = {key.removeprefix(f"{name}."): array for key, array in arrays.items() if key.startswith(f"{name}.")}
            trail = self._trail(name, look.trail, recorded, fields) if look.trail else None
            systems[name] = recorded_system(fields, trail, population, look, recorded, fps, self._topology.get(name))
        return Frame(systems, recorded, recorded / fps, self._poses)

    def _trail(self, name: str, trail, index: int, fields: dict[str, np.ndarray]) -> np.ndarray:
        """Return the ring of last places, (3 points, n), as the run itself kept it; where a frame is missing, the next later place."""
        every = frames_between(trail, self.scene.time.fps)
        ring = np.zeros((trail.points, 3, len(fields["id"])), np.float32)
        place = fields["position"]
        for frame in range(index, (index // every - trail.points + 1) * every - 1, -1):
            if frame in self._files and frame != index:
                earlier = self._read(frame)
                place = places_of(fields["id"], earlier[f"{name}.id"], earlier[f"{name}.position"], place)
            if frame == index or (frame + 1) % every == 0:
                ring[frame // every % trail.points] = place.T
        return ring.reshape(3 * trail.points, -1)

    def _load(self, index: int) -> dict[str, np.ndarray]:
        path = self._files[index]
        try:
            with np.load(path, allow_pickle=False) as file:
                arrays = {key: file[key] for key in file.files}
            for name in self.scene.systems:
                count = len(arrays[f"{name}.id"])
                shapes = {"position": (count, 3), "velocity": (count, 3), "mass": (count,)}
                if name not in self._nets:
                    shapes |= {"age": (count,), "lifetime": (count,), "radius": (count,)}
                elif count != len(self._nets[name].points):
                    raise ValueError
                elif self.scene.systems[name].tear is not None:
                    shapes["torn"] = (len(self._nets[name].springs),)
                optional = {"color": (count, 4), "neighbors": (count,), "swimming": (count, 3)}
                shapes |= {key: shape for key, shape in optional.items() if f"{name}.{key}" in arrays}
                if any(arrays[f"{name}.{key}"].shape != shape for key, shape in shapes.items()):
                    raise ValueError
            return arrays
        except OSError as error:
            raise NoRun(f"{path} cannot be read: {error.strerror or error}") from None
        except (ValueError, KeyError, zipfile.BadZipFile):
            raise NoRun(f"{path} is damaged") from None


def places_of(ids: np.ndarray, known: np.ndarray, position: np.ndarray, otherwise: np.ndarray) -> np.ndarray:
    """Return the position (n, 3) of each id among the known ones, which rise; where it is unknown, `otherwise`."""
    if not len(known):
        return otherwise
    at = np.minimum(np.searchsorted(known, ids), len(known) - 1)
    return np.where((known[at] == ids)[:, None], position[at], otherwise)


class RecordedPopulation:
    """Stands where a population stands for the packer: one frame's arrays on a device, replaced for each frame."""

    def __init__(self, device: str):
        self.device, self._fields, self.capacity = device, {}, 0

    def take(self, fields: dict[str, np.ndarray]) -> emission.Particles:
        """Put planar arrays on the device and return them as kernels see them."""
        self._fields = {name: wp.array(np.ascontiguousarray(array), device=self.device) for name, array in fields.items()}
        particles = emission.Particles()
        for name in self._fields.keys() & emission.Particles.vars.keys():  # not the trail
            setattr(particles, name, self._fields[name])
        particles.alive = wp.zeros(1, dtype=int, device=self.device)
        return particles

    def counter(self, name: str) -> int:
        """Return the live count, the only counter of a recorded frame."""
        return self._fields["lifetime"].shape[0]

    @property
    def fields(self) -> dict[str, wp.array]:
        """What is known of the frame."""
        return self._fields

    def field(self, name: str) -> wp.array:
        """Return a field, planar."""
        return self._fields[name]


def topology_of(net: Net, spec) -> dict[str, np.ndarray]:
    """Return what joins a network's points as frames have it."""
    parts = {"springs": net.springs, "triangles": net.triangles}
    return parts if spec.tear is None else parts | {"edges": edges_of(net)}


def recorded_system(fields, trail, population: RecordedPopulation, look, index: int, fps: float, topology: dict | None) -> SystemFrame:
    """Return one system of a recorded frame; born in it, as far as ages go. A network's points are as old as the run."""
    words = fields["id"].astype(np.uint64)
    if topology is not None:
        count = len(words)
        lasting = {"age": np.full(count, index / fps), "lifetime": np.full(count, FOREVER), "radius": np.zeros(count)}
        fields = fields | lasting
    planar = {
        "position": fields["position"].astype(np.float32).T,
        "velocity": fields["velocity"].astype(np.float32).T,
        "birth_frame": np.full(len(words), index, np.int32),
        "birth_age": fields["age"].astype(np.float32),
        "id": np.stack([words & np.uint64(0xFFFFFFFF), words >> np.uint64(32)]).astype(np.uint32),
    } | {name: fields[name].astype(np.float32) for name in ("lifetime", "mass", "radius")}

    if trail is not None:
        planar["trail"] = trail
    if "neighbors" in fields:
        planar["neighbors"] = fields["neighbors"].astype(np.int32)
    if "swimming" in fields:
        planar["swimming"] = fields["swimming"].astype(np.float32).T
    if "color" in fields:
        planar["tint"] = np.ascontiguousarray(fields["color"], np.uint8).view("<u4")[:, 0]

    def pack(frame_index: int, limit: int | None):
        return PointPacker(population, population.take(planar), look, fps).pack(frame_index, limit)

    torn = (lambda: fields["torn"]) if "torn" in fields else None
    return SystemFrame(planar.__getitem__, tuple(planar), pack, lambda: len(words), index, fps, topology, torn)
