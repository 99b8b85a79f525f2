"""Frame: what observers see of a simulation at one moment, read-only, fetched from the device on first use and then kept."""

from collections.abc import Callable, Iterator

import numpy as np


class SystemFrame:
    """One system's live particles in order of birth. Arrays are copies, read-only, and stay as they are when the simulation moves on."""

    def __init__(
        self, fetch, fields: tuple[str, ...], pack, count, index: int, fps: float, topology: dict[str, np.ndarray] | None = None, torn=None
    ):  # torn() tells which springs of the topology are torn; None: they do not tear
        self._fetch, self._fields, self._pack, self._count, self._index, self._fps = fetch, fields, pack, count, index, fps
        self._topology, self._fetch_torn = topology, torn
        self._arrays: dict[str, np.ndarray] = {}
        self._past = False

    def _get(self, name: str) -> np.ndarray:
        if name not in self._arrays:
            array = np.ascontiguousarray(self._fetch(name).T)
            array.flags.writeable = False
            self._arrays[name] = array
        return self._arrays[name]

    def keep(self) -> None:
        """Fetch everything now, before the simulation moves on."""
        for name in (
            "position",
            "velocity",
            "birth_frame",
            "birth_age",
            "lifetime",
            "mass",
            "radius",
            "id",
            "tint",
            "swimming",
            "neighbors",
        ):
            if name in self._fields:
                self._get(name)
        if self.tears:
            self.torn  # noqa: B018 — fetches it
        self._past = True

    def packed(self, limit: int | None = None):
        """Return the particles as the viewer draws them (PackedPoints), at most about `limit`.

        Raises RuntimeError once the simulation has moved on: only the present is packed, on the device.
        """
        if self._past:
            raise RuntimeError("packed() speaks of the present frame, and the simulation has moved on")
        return self._pack(self._index, limit)

    @property
    def count(self) -> int:
        """Number of live particles."""
        return len(self._get("lifetime")) if "lifetime" in self._arrays else self._count()

    @property
    def is_network(self) -> bool:
        """Whether springs join its points, which then neither come nor go."""
        return self._topology is not None

    @property
    def topology(self) -> dict[str, np.ndarray]:
        """What joins its points as it began, the same in every frame: springs int32 (m, 2), triangles int32 (k, 3); none for particles."""
        return self._topology or {"springs": np.zeros((0, 2), np.int32), "triangles": np.zeros((0, 3), np.int32)}

    @property
    def tears(self) -> bool:
        """Whether its springs may break."""
        return self._fetch_torn is not None

    @property
    def torn(self) -> np.ndarray:
        """bool (m,): which of the springs of `topology` are torn at this moment."""
        if not self.tears:
            return np.zeros(len(self.topology["springs"]), bool)
        if "torn" not in self._arrays:
            array = np.array(self._fetch_torn(), bool)
            array.flags.writeable = False
            self._arrays["torn"] = array
        return self._arrays["torn"]

    @property
    def lost(self) -> np.ndarray:
        """bool (k,): which of the triangles of `topology` are gone at this moment: those with a torn edge."""
        if not self.tears:
            return np.zeros(len(self.topology["triangles"]), bool)
        return np.append(self.torn, False)[self.topology["edges"]].any(axis=1)

    @property
    def springs(self) -> np.ndarray:
        """int32 (m, 2): the points that each spring joins, the same in every frame unless springs tear; none for particles."""
        return self.topology["springs"][~self.torn] if self.tears else self.topology["springs"]

    @property
    def triangles(self) -> np.ndarray:
        """int32 (k, 3): the points at the corners of each triangle of the surface, the same in every frame unless springs tear."""
        return self.topology["triangles"][~self.lost] if self.tears else self.topology["triangles"]

    @property
    def position(self) -> np.ndarray:
        """float32 (n, 3) [m]."""
        return self._get("position")

    @property
    def velocity(self) -> np.ndarray:
        """float32 (n, 3) [m/s]."""
        return self._get("velocity")

    @property
    def id(self) -> np.ndarray:
        """uint64 (n,): the system's running number of births, rising."""
        words = self._get("id").astype(np.uint64)
        return words[:, 0] | (words[:, 1] << np.uint64(32))

    @property
    def age(self) -> np.ndarray:
        """float32 (n,) [s], the same arithmetic as on the device."""
        frames = (self._index - self._get("birth_frame")).astype(np.float32)
        return frames / np.float32(self._fps) + self._get("birth_age")

    @property
    def lifetime(self) -> np.ndarray:
        """float32 (n,): age at which each dies [s]."""
        return self._get("lifetime")

    @property
    def mass(self) -> np.ndarray:
        """float32 (n,) [kg]."""
        return self._get("mass")

    @property
    def radius(self) -> np.ndarray:
        """float32 (n,) [m]."""
        return self._get("radius")

    @property
    def is_flock(self) -> bool:
        """Whether they see each other: boids."""
        return "neighbors" in self._fields

    @property
    def is_carried(self) -> bool:
        """Whether they are boids in a flow, through which they move as `swimming` says."""
        return "swimming" in self._fields

    @property
    def swimming(self) -> np.ndarray:
        """float32 (n, 3): velocity of boids through the flow that carries them, without one over ground [m/s]."""
        return self._get("swimming") if self.is_carried else self.velocity

    @property
    def neighbors(self) -> np.ndarray:
        """int32 (n,): how many others each boid saw in the last substep; none without a flock."""
        return self._get("neighbors") if self.is_flock else np.zeros(self.count, np.int32)

    @property
    def has_colors(self) -> bool:
        """Whether its emitters give colors."""
        return "tint" in self._fields

    @property
    def color(self) -> np.ndarray:
        """uint8 (n, 4): red, green, blue and opacity that its emitter gave each, with which the look's are multiplied; white if none."""
        if not self.has_colors:
            return np.full((self.count, 4), 255, np.uint8)
        return self._get("tint").view(np.uint8).reshape(-1, 4)


class Frame:
    """A moment of the whole scene: `frame["sparks"].position`, `frame.time` [s], `frame.index`."""

    def __init__(self, systems: dict[str, SystemFrame], index: int, time: float, poses: Callable[[float], np.ndarray] | None = None):
        self._systems, self._index, self._time, self._poses = systems, index, time, poses

    @property
    def index(self) -> int:
        """Number of the frame; 0 is the initial state."""
        return self._index

    @property
    def time(self) -> float:
        """index/fps [s]."""
        return self._time

    @property
    def collider_poses(self) -> np.ndarray:
        """float32 (n, 7): center [m] and quaternion (x, y, z, w) of each collider of the scene."""
        return np.zeros((0, 7), np.float32) if self._poses is None else self._poses(self._time)

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the systems."""
        return tuple(self._systems)

    def __getitem__(self, name: str) -> SystemFrame:
        if name not in self._systems:
            raise KeyError(f"no system {name!r} in this frame; there are {', '.join(self._systems) or 'none'}")
        return self._systems[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self._systems)

    def __len__(self) -> int:
        return len(self._systems)

    def keep(self) -> None:
        """Fetch everything now, before the simulation moves on."""
        for system in self._systems.values():
            system.keep()
