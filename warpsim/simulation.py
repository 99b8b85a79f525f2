"""Simulation: builds systems from a scene and advances them, frame by frame, as one captured graph."""

import json
import math
import weakref
from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import warp as wp

from warpsim.changes import Change, changed_scene
from warpsim.environment import Environment
from warpsim.frame import Frame
from warpsim.keeping import digest_of, kept, size_of, thinned
from warpsim.kernels.lifetime import advance_clock
from warpsim.launch import MOST_CORES, FrameGraph, Stage, available_cores
from warpsim.memory import check_memory, free_memory
from warpsim.poses import Poses
from warpsim.probes import FlowProbe
from warpsim.scene import Scene
from warpsim.scene.events import companies, in_order
from warpsim.stability import Advice
from warpsim.systems.cloth import Cloth
from warpsim.systems.flock import Flock
from warpsim.systems.networks import NetworkSystem
from warpsim.systems.particles import Particles
from warpsim.systems.springs import Springs

SYSTEMS = {"particles": Particles, "springs": Springs, "cloth": Cloth, "flock": Flock}
wp.config.log_level = max(wp.config.log_level, wp.LOG_WARNING)  # no banner and no line per module; set it lower afterwards to see them
SNAPSHOT_EVERY = 64  # frames between the states from which the last good one is recomputed; 1 % of a run of a million particles
LOOK_EVERY = 16  # frames between looks at the fault flags on a GPU, where looking waits for the device


class UnstableError(Exception):
    """A system left the finite world or the scene's extent; `last_good` is the frame before, where the simulation stands now."""

    def __init__(self, system: str, ids: list[int], index: int, time: float, suggestion: str):
        self.system, self.ids, self.index, self.time, self.suggestion = system, ids, index, time, suggestion
        shown = ", ".join(map(str, ids[:5])) + (f" and {len(ids) - 5} more" if len(ids) > 5 else "")
        self.last_good: Frame | None = None
        where = f"in frame {index} (t = {time:g} s), particles {shown}"
        super().__init__(f"{system}: not finite or beyond the scene's extent {where}; {suggestion}")


def resolve_device(name: str) -> str:
    """Return Warp's name for auto, cpu, cuda or cuda:N. Raises ValueError if there is no such device."""
    if name == "auto":
        name = "cuda:0" if wp.is_cuda_available() else "cpu"
    name = "cuda:0" if name == "cuda" else name
    known = [device.alias for device in wp.get_devices()]
    if name not in known:
        raise ValueError(f'there is no device "{name}"; this machine has {", ".join(known)}')
    return name


class Simulation:
    """The scene in motion. Frame 0 is the initial state; every step goes one frame on.

    device: auto, cpu, cuda or cuda:N. threads: cores to use on the CPU, default all; the bits do not depend on it.
    native=False runs the plain kernels on the CPU, for comparison. Raises MemoryLimitError before allocating too much, ValueError
    for an unknown device, UnstableError if the prewarm blows up.
    """

    def __init__(self, scene: Scene, device: str = "auto", threads: int | None = None, native: bool = True):
        self.scene, self.device = scene, resolve_device(device)
        if threads is not None and threads < 1:
            raise ValueError(f"threads must be at least 1, got {threads}")
        self.threads = min(threads or available_cores(), MOST_CORES)
        on_gpu = self.device != "cpu"
        check_memory(scene, wp.get_device(self.device).free_memory if on_gpu else free_memory(), on_gpu)
        self._fps = scene.time.fps
        self.index = -math.ceil(scene.time.prewarm * self._fps - 1e-9)
        self._clock = wp.array([self.index - 1], dtype=wp.int64, device=self.device)
        self.environment = Environment(scene, self.device)
        self._poses = Poses(scene)
        self.flow = FlowProbe(self.environment, lambda: self.time)
        made: dict[
            str, Particles | Springs | Cloth | Flock
        ] = {}  # in the order in which they move, so that each hears of the events before it
        for name in in_order(scene.systems):
            spec = scene.systems[name]
            made[name] = SYSTEMS[spec.type](name, spec, scene, self.environment, self._clock, made)
        self._order = list(made.values())
        self.systems = {name: made[name] for name in scene.systems}
        self._flocks = {name: system for name, system in made.items() if isinstance(system, Flock)}
        for system in self._flocks.values():
            system.meet(self._flocks)
        self._companies = companies(scene.systems)
        self._graph = FrameGraph(list(self._stages(native)), self.device, self.threads, native)
        self._frame: weakref.ref[Frame] | None = None
        self.index -= 1  # the opening step makes the first frame: whoever is born at that very moment is in it
        self.changes: list[Change] = []
        self._change_count = 0  # of them in effect; fewer than all after a seek back
        self._kept = [self._state()]
        while self.index < 0:
            self.step_frame()
        self._kept.clear()
        self._kept = [self._state()]  # frame 0, then later ones; the last is never ahead of the present

    def change(self, path: str, value) -> None:
        """Change a number of the running scene, as `--set path=value` would; it acts from the next step on and is logged.

        Raises SceneError if the scene would not be valid, FixedField (a ValueError) if the change needs a new start.
        """
        text = value if isinstance(value, str) else json.dumps(value)
        self._take(changed_scene(self.scene, path, text))
        self.changes = [*self.changes[: self._change_count], Change(self.index, path, text)]
        self._change_count += 1

    def _take(self, scene: Scene) -> None:
        self.scene = scene
        self.environment.change(scene)
        self._poses = Poses(scene)
        self.flow.change()
        for name, system in self.systems.items():
            system.change(scene.systems[name], scene, self.environment)

    def seek(self, index: int) -> None:
        """Go to any frame, back or forth: recomputed from the nearest earlier state, with the changes that were made on the way.

        Raises ValueError for a frame before the first.
        """
        self.rewind(index)
        while self.index < index:
            self.step_frame()

    def rewind(self, index: int) -> None:
        """Go back to the nearest kept state at or before a frame, at once; nothing happens if the present is before it.

        Raises ValueError for a frame before the first.
        """
        if index < 0:
            raise ValueError(f"there is no frame {index}: the first is 0")
        if index < self.index:
            self._keep_frame()
            self._kept = [state for state in self._kept if state["index"] <= index]  # a change may end the story of later ones
            self._restore(self._kept[-1])

    def _stages(self, native: bool) -> Iterator[Stage]:
        """Yield the frame, readable like the lecture's animation cycle."""
        yield Stage("clock", advance_clock, 1, (self._fps, self._clock, self.environment.start_time))
        for name, system in self._flocks.items():
            yield from self._of(name, system.appear(native))  # to other flocks, before any of them moves
        for system in self._order:
            yield from self._of(system.name, system.stages(native))  # emit, update, remove the expired

    def _of(self, name: str, stages: Iterator[Stage]) -> Iterator[Stage]:
        return (replace(stage, of=self._companies[name]) for stage in stages)

    def _loads(self) -> dict[str, int]:
        """Return how many elements each company of systems has."""
        loads = dict.fromkeys(self._companies.values(), 0)
        for name, system in self.systems.items():
            loads[self._companies[name]] += system.load
        return loads

    @property
    def time(self) -> float:
        """Time of the present frame, index/fps [s]."""
        return self.index / self._fps

    @property
    def cores(self) -> int:
        """Number of cores that the last step used; on a GPU 1, for the one that waits."""
        return self._graph.cores

    @property
    def crowded_frames(self) -> int:
        """Number of steps that had one core, though they were worth all, because other programs used the machine."""
        return self._graph.crowding.frames_alone

    @property
    def frame_count(self) -> int:
        """Number of the last frame of the scene's duration."""
        return round(self.scene.time.duration * self._fps)

    def step_frame(self) -> None:
        """Advance one frame. Raises UnstableError; the simulation then stands at the last good frame."""
        self._keep_frame()
        if self.index - self._kept[-1]["index"] >= (SNAPSHOT_EVERY if self.device == "cpu" else 16 * SNAPSHOT_EVERY):
            self._answer_faults()  # a GPU's flags may not have been looked at yet
            self._kept = thinned(self._kept, size_of(self._arrays()))  # before, so that there is never one more than may be
            self._kept.append(self._state())
        self._advance()
        if self.device == "cpu" or self.index % LOOK_EVERY == 0:
            self._answer_faults()

    def _advance(self) -> None:
        while self._change_count < len(self.changes) and self.changes[self._change_count].index <= self.index:
            change = self.changes[self._change_count]  # made in an earlier pass over this frame
            self._change_count += 1
            self._take(changed_scene(self.scene, change.path, change.value))
        on_cpu = self.device == "cpu"
        try:
            self._graph.run(self._loads() if on_cpu else {})
        except KeyboardInterrupt:
            self.settle()
            raise
        self.index += 1

    def frame(self) -> Frame:
        """Return the present frame; it stays as it is when the simulation moves on."""
        self._answer_faults()
        frame = self._frame() if self._frame else None
        if frame is None or frame.index != self.index:
            systems = {name: system.frame(self.index) for name, system in self.systems.items()}
            frame = Frame(systems, self.index, self.time, self._poses)
            self._frame = weakref.ref(frame)
        return frame

    def frames(self, count: int) -> Iterator[Frame]:
        """Advance `count` frames and yield each.

        A frame that is still held is fetched whole when the next one begins; where few are looked at, step_frame() is faster.
        """
        for _ in range(count):
            self.step_frame()
            yield self.frame()

    def run(self, seconds: float) -> None:
        """Advance by so many seconds, to the nearest frame."""
        for _ in range(round(seconds * self._fps)):
            self.step_frame()

    def settle(self) -> None:
        """Finish a frame that KeyboardInterrupt left under way."""
        self._graph.settle()
        self.index = int(self._clock.numpy()[0])

    def _keep_frame(self) -> None:
        """Let a frame that somebody still holds fetch its arrays before they change."""
        frame = self._frame() if self._frame else None
        if frame is not None and frame.index == self.index:
            frame.keep()
        self._frame = None  # this moment may come again, with another past

    def _state(self) -> dict:
        """Return a copy of everything the future depends on."""
        past = {"index": self.index, "scene": self.scene, "change_count": self._change_count}
        return past | {"systems": kept(self._arrays())}

    def _arrays(self) -> dict[str, dict[str, np.ndarray]]:
        """Return everything the future depends on; on the CPU the arrays themselves."""
        return {name: system.arrays() for name, system in self.systems.items()}

    def _restore(self, state: dict) -> None:
        self.index, self._change_count = state["index"], state["change_count"]
        self._clock.fill_(self.index)
        if state["scene"] is not self.scene:
            self._take(state["scene"])
        for name, system in self.systems.items():
            system.restore(state["systems"][name])

    @property
    def advice(self) -> dict[str, Advice]:
        """What the springs of each network stand, by name: the substeps per frame that it needs, and that it has."""
        return {name: system.advice for name, system in self.systems.items() if isinstance(system, NetworkSystem)}

    def state_hash(self) -> str:
        """Return a hex digest of the full state: equal for equal scene, seed and version on one kind of device."""
        return digest_of(self.index, self._arrays())

    def statistics(self) -> dict[str, dict[str, float]]:
        """Return by system: live particles, births so far, refused for want of room, killed beyond the extent, kinetic energy [J].

        Among colliders: pushed, how often a particle began inside one and was put on its surface. Where emitters listen to events:
        children, how many of the births were of these. Where particles choose their substeps: their mean number per frame, and inexact,
        in how many frames of a particle even the most substeps did not keep the tolerance.
        Of networks: elastic energy [J]. Of flocks: order, polarization [degrees], milling, nearest [m], clusters (docs/flocks.md).
        """
        result = {}
        for name, system in self.systems.items():
            p = system.population
            speed2 = (p.host("velocity").astype(float) ** 2).sum(axis=0)
            result[name] = {"live": p.counter("live"), "born": p.counter("next_id") - p.counter("refused")}
            result[name] |= {"refused": p.counter("refused"), "killed": p.counter("killed")}
            result[name]["kinetic_energy"] = float(0.5 * (p.host("mass") * speed2).sum())
            result[name] |= system.statistics()
        return result

    def time_stages(self) -> dict[str, float]:
        """Advance one frame stage by stage and return what each took [s]; for benchmarks."""
        self._keep_frame()
        times = self._graph.time_stages(self._loads())
        self.index += 1
        return times

    def _faulty(self) -> list[str]:
        return [name for name, system in self.systems.items() if system.population.counter("fault")]

    def _answer_faults(self) -> None:
        """Answer particles that left the finite world, by the scene's policy; nothing of theirs is ever shown or saved."""
        faulty = self._faulty()
        if not faulty:
            return
        if self.scene.limits.unstable != "stop":  # kill is done already, but for networks, which are reset
            for name in faulty:
                self.systems[name].reset()
            return
        self._restore(self._kept[-1])  # find the first bad frame: on a GPU it may lie some frames back
        while not self._faulty():
            self._advance()
        error = self._unstable(self._faulty()[0])
        self._restore(self._kept[-1])
        while self.index < error.index - 1:
            self._advance()
        error.last_good = self.frame()
        error.last_good.keep()
        raise error

    def _unstable(self, name: str) -> UnstableError:
        """Describe what happened in the present, bad frame."""
        system = self.systems[name]
        state = np.concatenate([system.population.host("position"), system.population.host("velocity")])
        with np.errstate(invalid="ignore"):
            good = (np.abs(state[:3]) <= self.scene.limits.extent).all(axis=0) & np.isfinite(state).all(axis=0)
        words = system.population.host("id").astype(np.uint64)
        ids = (words[0] | (words[1] << np.uint64(32)))[~good]
        return UnstableError(name, [int(i) for i in ids], self.index, self.time, system.remedy)
