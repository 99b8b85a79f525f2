"""Screening: shows a recorded run, with the playback of a running one, over frames that are read instead of computed."""

from contextlib import ExitStack
from functools import cached_property
from pathlib import Path

from warpsim.environment import Environment
from warpsim.filming import Filming
from warpsim.interruption import Interruption
from warpsim.playback import Playback
from warpsim.probes import FlowProbe
from warpsim.replay import Recording
from warpsim.reporting import Audience, Report
from warpsim.runner import Showing, built, check_outlets, finish, open_viewer, ready_device
from warpsim.streamlines import streamlines


class RecordedStory:
    """A recorded run as a story to be played."""

    def __init__(self, recording):
        self._recording = recording
        # Nothing of it can be changed, so nobody is offered a slider.
        self.scene = recording.scene.model_copy(update={"controls": ()})
        self.index = 0
        self.changes: list = []
        self.crowded_frames = 0

    @property
    def time(self) -> float:
        """Time of the present frame [s]."""
        return self.index / self.scene.time.fps

    @cached_property
    def flow(self):
        """The flow of the scene as it was written, without what was changed while it ran."""
        return FlowProbe(Environment(self.scene, self._recording.device), lambda: self.time)

    def step_frame(self) -> None:
        """Go to the next frame."""
        self.seek(self.index + 1)

    def seek(self, index: int) -> None:
        """Go to any frame. Raises NoRun where its file is damaged, and then stays."""
        self._recording.frame(index)
        self.index = index

    def frame(self):
        """Return the present frame."""
        return self._recording.frame(self.index)

    def statistics(self) -> dict[str, dict[str, float]]:
        """Return the living by system; a recording tells nothing more that matters here."""
        frame = self.frame()
        return {name: {"live": frame[name].count, "refused": 0} for name in frame}


def show_run(folder: Path, showing: Showing, audience: Audience, stop: Interruption) -> tuple[str, Report]:
    """Show a run folder to its last frame or to the first signal; return "done" or "interrupted", and how far it came.

    Raises NoRun for a folder that holds no run or a damaged file, SceneError, NoPicture, OSError.
    """
    check_outlets(showing)
    with ExitStack() as stack:
        device = ready_device("cpu", audience)
        recording = Recording(folder, device)
        story = RecordedStory(recording)
        viewer = open_viewer(story.scene, showing, audience, stack)
        built(lambda: story.frame() if viewer is None else viewer.publish(story.frame()), audience)
        frame_count = recording.frame_count if showing.frame_count is None else min(showing.frame_count, recording.frame_count)
        lines = (lambda: streamlines(story)) if story.scene.viewer.streamlines else None
        filming = Filming(story.scene, showing.film, audience.note, lines)
        stack.callback(filming.abandon)
        playback = Playback(
            story, frame_count, audience, stop, viewer, None, filming, showing.changed, instant=True, stays=showing.stay, lines=lines
        )
        stop.patient = True
        kind = playback.play()
        report = playback.final_report()
        return finish(playback, showing, kind), report
