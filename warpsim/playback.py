"""Playback: takes a story through its frames, at the pace and to the places that those who watch ask for.

A story is a simulation that computes its frames, or a recorded run that reads them; the playback does not know which.
"""

import time
from collections.abc import Callable
from typing import Protocol

from warpsim.announcing import Announcer
from warpsim.changes import FixedField
from warpsim.interruption import Interruption
from warpsim.reporting import Audience, Report, Reporter, Watch
from warpsim.scene import SceneError

IDLE_SLICE = 0.02  # s of sleep between looks at the signal: a handler must not touch a lock that the sleeper may hold
SEEK_SLICE = 0.05  # s of a long way to another frame between looks at wishes and signals
FRAME_LATE = 0.01  # s after its moment from which a frame counts as late, and showing it may take little of the run's time
LAG = 0.25  # s behind its clock after which a run stops hurrying: a laptop that slept must not race through the night
CHANGE_PERIOD = 0.05  # s between changes of numbers while it plays
ABSENCE = 5.0  # s without a page after which a piped run that was paused goes on


class Story(Protocol):
    """What can be played: `scene`, number and time [s] of the present frame, the changes that belong to it.

    `crowded_frames`: how many frames had one core because other programs used the machine.
    """

    scene: object
    index: int
    time: float
    changes: list
    crowded_frames: int

    def step_frame(self) -> None:
        """Go one frame on."""

    def seek(self, index: int) -> None:
        """Go to a frame."""

    def rewind(self, index: int) -> None:
        """Go back to a frame at or before `index` that costs nothing; asked only of stories that are not instant."""

    def frame(self):
        """Return the present frame."""

    def statistics(self) -> dict[str, dict[str, float]]:
        """Return counts by system."""


def never() -> bool:
    """Return that nothing has changed."""
    return False


def reason_of(error: SceneError | FixedField) -> str:
    """Return in one line why a change does not fit."""
    return error.problems[0].message if isinstance(error, SceneError) else str(error)


class Playback:
    """Plays `story` up to frame `frame_count` and shows each frame, frame k at k/fps where there is a viewer.

    instant: the story can be at any frame at once (it is read); otherwise the way there is computed. stays: somebody sits at a terminal,
    so that a run that a page has paused waits for him. lines: returns streamlines for the viewer.
    """

    def __init__(
        self,
        story: Story,
        frame_count: int,
        audience: Audience,
        stop: Interruption,
        viewer=None,
        recorder=None,
        filming=None,
        changed: Callable[[], bool] = never,
        instant: bool = False,
        stays: bool = False,
        lines: Callable[[], object] | None = None,
    ):
        self.story, self.frame_count, self.audience, self.stop = story, frame_count, audience, stop
        self.viewer, self.recorder, self.filming, self.changed = viewer, recorder, filming, changed
        self._instant, self._stays = instant, stays
        self.playing, self.speed = True, 1.0
        self._goal: int | None = None  # the frame that was asked for
        self._values: dict[str, float] = {}  # numbers that were asked for, by path
        self._watch = Watch()
        self._reporter = Reporter(story, frame_count, audience, self._watch)
        self._anchor = (story.index, time.perf_counter())  # a frame and the moment at which it is shown
        self._kept_changes = 0
        self._note = ""
        self._refusals: set[str] = set()
        self._watched_at = self._changed_at = 0.0
        self.lines = lines
        self._announcer = Announcer(viewer, story, self._watch, lines) if viewer else None

    # ---- the two ways to be played

    def play(self) -> str:
        """Play to the last frame; return "done", "interrupted" or "changed"."""
        self._record()
        self._show()
        return self._run(to_the_end=True)

    def stay(self) -> str:
        """Keep what there is on show, and go where the pages wish, until a signal or a change; return "interrupted" or "changed".

        What is recorded was recorded: from here on nothing is.
        """
        self.recorder = None
        self.playing = False
        return self._run(to_the_end=False)

    def final_report(self) -> Report:
        """Tell and return how far the run came, with the speed of the whole of it."""
        return self._reporter.final_report()

    def _run(self, to_the_end: bool) -> str:
        self._anchor = (self.story.index, time.perf_counter())
        while not self.stop.requested:
            if self.changed():
                return "changed"
            self._obey()
            if to_the_end and self._over():
                return "done"
            if self._goal is not None:
                self._go_on_to_goal()
            elif self.playing and self.story.index < self.frame_count:
                self._play_on(reporting=to_the_end)
            else:
                self._rest(alone=to_the_end and not self._stays)
            self._tell()
        return "interrupted"

    def _over(self) -> bool:
        """Whether the last frame was shown; a piped run whose page stopped there waits for the page to go on, or to go."""
        return self.story.index >= self.frame_count and self._goal is None and (self.playing or self._stays)

    # ---- what one turn does

    def _play_on(self, reporting: bool) -> None:
        """Make the next frame and show it at its moment, unless a wish comes between."""
        self._step()
        if self._watch.made == 1:  # kernels may have been compiled meanwhile; nobody wants to catch up with that
            self._anchor = (self.story.index, time.perf_counter())
        if self.viewer:
            while (left := self._moment() - time.perf_counter()) > 0 and self.playing and self._goal is None and not self.stop.requested:
                self._watch.wait(min(left, IDLE_SLICE))
                self._obey()
            if left < -LAG:
                self._anchor = (self.story.index, time.perf_counter())
        self._show()
        if reporting:
            self._reporter.report_if_due()
        if self.story.index >= self.frame_count and not reporting:
            self.playing = False

    def _go_on_to_goal(self) -> None:
        """Go a slice of the way to the frame that was asked for, so that another wish or a signal need not wait for the whole of it."""
        story, goal = self.story, self._goal
        if self._instant:
            story.seek(goal)
        elif goal < story.index:
            story.rewind(goal)  # from there in slices
        until = time.perf_counter() + SEEK_SLICE
        while story.index < goal and time.perf_counter() < until and not self.stop.requested:
            self._step()
        if story.index == goal:
            self._goal = None
            self._make_changes(at_once=True)
            self._anchor = (goal, time.perf_counter())
            self._show()

    def _rest(self, alone: bool) -> None:
        """Stand still for a moment: pages that come late or fell behind get the frame, all of it."""
        self._publish()
        self._watch.wait(IDLE_SLICE)
        now = time.perf_counter()
        if self.viewer and self.viewer.client_count or not self._watched_at:
            self._watched_at = now
        if alone and now - self._watched_at > ABSENCE:
            self.audience.note(f"paused at frame {self.story.index} and nobody watches any more: playing on")
            self.playing, self.speed = True, 1.0
            self._anchor = (self.story.index, now)

    def _step(self) -> None:
        if self.recorder:
            self._keep_changes()
        self.story.step_frame()
        self._watch.made += 1
        self._record()

    def _moment(self) -> float:
        """Return when the present frame is due."""
        index, moment = self._anchor
        return moment + (self.story.index - index) / (self.story.scene.time.fps * self.speed)

    def _record(self) -> None:
        if self.recorder:
            self.recorder.record(self.story.frame(), self.story.statistics(), self.story.state_hash())

    def _keep_changes(self) -> None:
        """Record the changes that act in the next step, of one number the last only, before any frame that they shape."""
        last = {}
        for change in self.story.changes[self._kept_changes :]:
            if change.index > self.story.index:
                break
            last.pop(change.path, None)  # in the order in which the last words came: one path may lie within another
            last[change.path] = change
            self._kept_changes += 1
        for change in last.values():
            self.recorder.record_change(change.index, change.path, change.value)

    def _show(self) -> None:
        """Show the present frame: it is a new one."""
        if self.filming and self.filming.active:
            self.filming.add(self.story.frame())
        self._publish()

    def _publish(self) -> None:
        if self.viewer and self.viewer.wants_frame(behind=self.playing and time.perf_counter() > self._moment() + FRAME_LATE):
            self.viewer.publish(self.story.frame(), full=not self.playing)

    # ---- wishes of the pages

    def _obey(self) -> None:
        """Do what the pages have asked for."""
        if not self.viewer:
            return
        for command in self.viewer.commands():
            self._note = ""
            match (command.kind, command.value):
                case ("set", (path, value)):
                    self._values[path] = value
                case ("play", _) if not self.playing:
                    self._resume()
                case ("pause", _):
                    self.playing = False
                case ("step", _):
                    self.playing = False
                    self._ask_for((self.story.index if self._goal is None else self._goal) + 1)
                case ("reset", _):
                    self._ask_for(0)
                case ("seek", index):
                    self._ask_for(index)
                case ("speed", speed):
                    self.speed = speed
                    self._anchor = (self.story.index, time.perf_counter())
                case ("record", _) if self.filming:
                    self.filming.toggle(None if self.playing else self.story.frame())
        self._make_changes(at_once=not self.playing)

    def _resume(self) -> None:
        self.playing = True
        self._anchor = (self.story.index, time.perf_counter())
        if self.story.index >= self.frame_count:
            self._ask_for(0)

    def _ask_for(self, index: int) -> None:
        """Take a frame as the goal. While a run is recorded its story is one, and told forward."""
        self._make_changes(at_once=True)  # what was asked for before belongs to the present frame
        goal = min(index, self.frame_count)
        if self.recorder and goal < self.story.index:
            self._refuse("a run that is being recorded goes back only after its end")
        else:
            self._goal = goal if goal != self.story.index else None

    def _make_changes(self, at_once: bool) -> None:
        """Change what was asked for, once the story stands where that was meant. A dragged slider would cost a frame at every frame."""
        now = time.perf_counter()
        if self._goal is not None or not self._values or not at_once and now - self._changed_at < CHANGE_PERIOD:
            return
        self._changed_at = now
        for path, value in self._values.items():
            self._change(path, value)
        self._values.clear()

    def _change(self, path: str, value: float) -> None:
        try:
            self.story.change(path, int(value) if value == int(value) else value)
        except (SceneError, FixedField) as error:
            self._refuse(f"{path} is refused: {reason_of(error)}")

    def _refuse(self, text: str) -> None:
        """Tell the pages, and once the audience."""
        self._note = text
        if text not in self._refusals:
            self._refusals.add(text)
            self.audience.note(text)

    def _tell(self) -> None:
        if self._announcer:
            note = self._note or (f"going to frame {self._goal}" if self._goal is not None else "")
            moving = self.playing or self._goal is not None
            recording = bool(self.filming and self.filming.active)
            self._announcer.tell(moving, self.playing, self.speed, self.frame_count, recording, note, counts=not self._instant)
            self._announcer.draw_lines()
