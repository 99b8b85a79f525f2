"""Screening: shows a recorded run, with the playback of a running one, over frames that are read instead of computed."""

from contextlib import ExitStack
from pathlib import Path

from warpsim.filming import Filming
from warpsim.interruption import Interruption
from warpsim.playback import Playback
from warpsim.reporting import Audience, Report
from warpsim.runner import Showing, built, check_outlets, finish, open_viewer, ready_device


class RecordedStory:
    """A recorded run as a story to be played."""

    def __init__(self, recording):
        self._recording = recording
        # Nothing of it can be changed, so nobody is offered a slider.
        self.scene = recording.scene.model_copy(update={"controls": ()})
        self.index = 0
        self.changes: list = []

    @property
    def time(self) -> float:
        """Time of the present frame [s]."""
        return self.index / self.scene.time.fps

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
        from warpsim.replay import Recording

        recording = Recording(folder, device)
        story = RecordedStory(recording)
        viewer = open_viewer(story.scene, showing, audience, stack)
        built(lambda: story.frame() if viewer is None else viewer.publish(story.frame()), audience)
        frame_count = recording.frame_count if showing.frame_count is None else min(showing.frame_count, recording.frame_count)
        filming = Filming(story.scene, showing.film, audience.note)
        stack.callback(filming.abandon)
        playback = Playback(story, frame_count, audience, stop, viewer, None, filming, showing.changed, instant=True, stays=showing.stay)
        stop.patient = True
        kind = playback.play()
        report = playback.final_report()
        return finish(playback, showing, kind), report
