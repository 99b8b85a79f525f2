"""The smallest run that answers to the page: a Simulation, a thread, and the viewer's commands."""

import threading
import time

from warpsim.observers.viewer import Command, Status, Viewer
from warpsim.scene.viewing import sliders_of


class Playing:
    """Plays `simulation` for a viewer in a thread of its own until the block ends; `log` keeps what was asked."""

    def __init__(self, simulation, viewer: Viewer, frame_count: int = 600, playing: bool = False):
        self.simulation, self.viewer, self.frame_count = simulation, viewer, frame_count
        self.playing, self.speed = playing, 1.0
        self.log: list[Command] = []
        self._stop = threading.Event()
        self._thread = threading.Thread(target=self._play, daemon=True)

    def _play(self) -> None:
        clock = time.monotonic()
        while not self._stop.is_set():
            for command in self.viewer.commands():
                self.log.append(command)
                self._obey(command)
            now = time.monotonic()
            if self.playing and self.simulation.index < self.frame_count and now >= clock:
                self.simulation.step_frame()
                clock = max(clock + 1 / (60 * self.speed), now - 0.1)
            self.viewer.tell(self._status())
            if self.viewer.wants_frame():
                self.viewer.publish(self.simulation.frame(), full=not self.playing)
            time.sleep(0.002)

    def _obey(self, command: Command) -> None:
        match command:
            case Command("play" | "pause" as kind):
                self.playing = kind == "play"
            case Command("step"):
                self.playing = False
                self.simulation.step_frame()
            case Command("reset"):
                self.simulation.seek(0)
            case Command("seek", index):
                self.simulation.seek(min(index, self.frame_count))
            case Command("speed", speed):
                self.speed = speed
            case Command("set", (path, value)):
                self.simulation.change(path, value)

    def _status(self) -> Status:
        scene, simulation = self.simulation.scene, self.simulation
        values = {
            slider.path: slider.value for control in scene.controls for slider in sliders_of(scene, control) if slider.value is not None
        }
        return Status(self.playing, self.speed, simulation.index, self.frame_count, simulation.time, 60.0, 1.0, values=values)

    def __enter__(self) -> "Playing":
        self._thread.start()
        return self

    def __exit__(self, *exception) -> None:
        self._stop.set()
        self._thread.join(60)
