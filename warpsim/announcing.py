"""What a run tells the pages that watch it: how it goes, and the streamlines of its flow."""

import time
from collections.abc import Callable

from warpsim.reporting import Watch

STATUS_PERIOD = 0.1  # s between words while it plays; every change of mind is told at once
PACE_PERIOD = 0.5  # s over which steps per second are counted
LINES_PERIOD = 0.5  # s between streamlines while a slider moves


class Announcer:
    """Tells a viewer the status of a story, often enough for a person and no more: counting the living costs a look at the device.

    lines: returns streamlines, float32 (n, k, 3) [m], of the scene in force; None: the scene shows none.
    """

    def __init__(self, viewer, story, watch: Watch, lines: Callable[[], object] | None):
        self._viewer, self._story, self._watch, self._lines = viewer, story, watch, lines
        self._told: tuple | None = None
        self._told_at = self._lined_at = 0.0
        self._lap, self._pace = (0, time.perf_counter()), 0.0
        self._lined_scene = None

    def tell(self, moving: bool, playing: bool, speed: float, frame_count: int, recording: bool, note: str, counts: bool) -> None:
        """Tell how it goes, if there is news. counts: frames are computed, so that steps per second mean something."""
        now, story = time.perf_counter(), self._story
        choices = (playing, speed, frame_count, recording, note, story.scene, None if playing else story.index)
        if choices == self._told and not (moving and now - self._told_at >= STATUS_PERIOD):
            return
        from warpsim.observers.viewer import Status

        self._told, self._told_at = choices, now
        frames_per_second, frame = self._frames_per_second(now, moving), story.frame()
        self._viewer.tell(
            Status(
                playing=playing,
                speed=speed,
                index=story.index,
                frame_count=frame_count,
                time=story.time,
                steps_per_second=frames_per_second * steps_per_frame(story.scene) if counts else 0.0,
                real_time_factor=frames_per_second / story.scene.time.fps if counts else 0.0,
                live={name: frame[name].count for name in frame},
                values={slider.path: slider.value for slider in story.scene.sliders if slider.value is not None},
                recording=recording,
                note=note,
            )
        )

    def draw_lines(self) -> None:
        """Draw the streamlines again where the scene has changed since, not too often."""
        now, scene = time.perf_counter(), self._story.scene
        if self._lines and scene is not self._lined_scene and now - self._lined_at >= LINES_PERIOD:
            self._lined_scene, self._lined_at = scene, now
            self._viewer.show_lines(self._lines())

    def _frames_per_second(self, now: float, moving: bool) -> float:
        """Return the frames made per second of late; 0 at rest."""
        made = self._watch.made
        if not moving:
            self._lap, self._pace = (made, now), 0.0
        elif now - self._lap[1] >= PACE_PERIOD:
            self._lap, self._pace = (made, now), (made - self._lap[0]) / (now - self._lap[1])
        return self._pace


def steps_per_frame(scene) -> int:
    """Return the scene's substeps; where particles choose their own, frames are all there is to count."""
    return 1 if scene.time.substeps == "auto" else scene.time.substeps
