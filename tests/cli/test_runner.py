"""The runner alone, with a simulation that only counts: the clock, the order, what is told."""

import threading
import time
from types import SimpleNamespace

import pytest

from warpsim.changes import FixedField
from warpsim.interruption import Interruption
from warpsim.observers.viewer import Command
from warpsim.playback import Playback
from warpsim.runner import save_state


class Counting:
    """Counts frames; each takes `cost` seconds and is refused births from frame 4 on."""

    def __init__(self, fps=100.0, cost=0.0):
        self.scene = SimpleNamespace(name="counting", time=SimpleNamespace(fps=fps, substeps=2), sliders=[])
        self.index, self.cost, self.changes, self.crowded_frames = 0, cost, [], 0

    @property
    def time(self):
        return self.index / self.scene.time.fps

    def step_frame(self):
        time.sleep(self.cost)
        self.index += 1

    def seek(self, index):
        self.index = index

    def frame(self):
        return type("Frame", (dict,), {"index": self.index})()

    def statistics(self):
        return {"dust": {"live": 1, "born": 1, "refused": max(0, self.index - 3), "killed": 0, "kinetic_energy": 0.0}}

    def state_hash(self):
        return f"{self.index}"


class Listener:
    def __init__(self):
        self.notes, self.reports, self.shown, self.recorded = [], [], [], []
        self.note, self.report, self.end = self.notes.append, self.reports.append, self.reports.append

    def wants_frame(self, behind=False):
        return True

    def commands(self):
        return []

    def tell(self, status):
        pass

    def publish(self, frame, full=False):
        self.shown.append((frame.index, time.perf_counter()))

    def record(self, frame, statistics, state_hash):
        self.recorded.append((frame.index, state_hash))


def play(simulation, count, viewer=False, stop=None, changed=lambda: False):
    listener = Listener()
    playback = Playback(simulation, count, listener, stop or Interruption(), listener if viewer else None, listener, changed=changed)
    return listener, playback, playback.play()


def test_every_frame_is_recorded_from_the_initial_state_on():
    listener, _, kind = play(Counting(), 5)
    assert kind == "done" and listener.recorded == [(k, f"{k}") for k in range(6)]


def test_no_frames_at_all_is_the_initial_state():
    listener, playback, kind = play(Counting(), 0)
    assert kind == "done" and listener.recorded == [(0, "0")] and playback.final_report().index == 0


def test_frame_k_is_shown_at_k_over_fps():
    began = time.perf_counter()
    listener, playback, _ = play(Counting(fps=100.0, cost=0.002), 30, viewer=True)
    assert [index for index, _ in listener.shown] == [*range(31)]
    one = listener.shown[1][1]
    early = [moment - one - (index - 1) / 100.0 for index, moment in listener.shown[1:]]
    assert min(early) > -1e-3, "never before its time"
    report = playback.final_report()
    assert 0.002 <= report.frame_time and report.frame_time * 30 < time.perf_counter() - began - 0.05, "waiting is not computing"
    assert report.speed == pytest.approx(0.01 / report.frame_time)


def test_behind_real_time_it_does_not_wait():
    _, playback, _ = play(Counting(fps=1000.0, cost=0.005), 20, viewer=True)
    assert playback._watch.waited < 1e-3


def test_overflow_is_noted_once():
    listener, playback, _ = play(Counting(cost=0.1), 8)
    playback.final_report()
    assert len(listener.notes) == 1 and "dust is full at frame" in listener.notes[0]


def test_a_signal_ends_after_the_frame():
    stop, simulation = Interruption(), Counting()
    stop.patient = True

    def step():
        simulation.index += 1
        if simulation.index == 3:
            stop._receive(2, None)

    simulation.step_frame = step
    listener, _, kind = play(simulation, 10, stop=stop)
    assert kind == "interrupted" and listener.recorded[-1] == (3, "3")


def test_signals_grow_impatient():
    stop = Interruption()
    with pytest.raises(KeyboardInterrupt):  # nothing runs yet that is worth finishing
        stop._receive(2, None)
    stop = Interruption()
    stop.patient = True
    stop._receive(2, None)
    assert stop.requested
    with pytest.raises(KeyboardInterrupt):
        stop._receive(2, None)


def test_a_change_ends_the_run():
    assert play(Counting(), 10, changed=lambda: True)[2] == "changed"


@pytest.mark.parametrize(("name", "file"), [("Camp fire", "Camp-fire"), ("../../etc/x", "etc-x"), ("...", "scene"), ("花火", "花火")])
def test_the_last_good_state_stays_in_the_folder_whatever_the_scene_is_called(tmp_path, monkeypatch, name, file):
    monkeypatch.chdir(tmp_path)
    frame = type("Frame", (dict,), {"index": 1, "time": 0.5})()
    assert save_state(frame, name, None, pytest.fail) == tmp_path / f"{file}.lastgood.npz"


class Led(Listener):
    """A viewer whose pages ask for what a script says when a frame of the story is reached: frame -> commands."""

    def __init__(self, story, wishes):
        super().__init__()
        self.story, self.wishes, self.client_count, self.told = story, dict(wishes), 1, []
        self.tell = self.told.append

    def commands(self):
        due = [index for index in self.wishes if index <= self.story.index]
        return [Command(*wish) for index in due for wish in self.wishes.pop(index)]


def led(wishes, count=100, recorder=False, **more):
    """Play a counting story with wishes; return the viewer and the playback after its end."""
    story = Counting(fps=1000.0, **more)
    viewer = Led(story, wishes)
    playback = Playback(story, count, viewer, Interruption(), viewer, viewer if recorder else None)
    return viewer, playback, playback.play()


def test_the_newest_seek_wins_and_each_step_counts():
    viewer, playback, kind = led({10: [("pause",), ("seek", 70), ("seek", 30), ("step",), ("step",)], 32: [("play",)]})
    shown = [index for index, _ in viewer.shown]
    assert kind == "done" and 32 in shown and not {20, 30, 31} & set(shown)


def test_a_recorded_story_goes_forward_only_and_whole():
    viewer, playback, kind = led({10: [("seek", 60)], 60: [("seek", 5), ("reset",)]}, recorder=True)
    assert kind == "done" and [index for index, _ in viewer.recorded] == [*range(101)]
    assert len([note for note in viewer.notes if "goes back only after its end" in note]) == 1
    assert any("goes back only" in status.note for status in viewer.told)


def test_a_long_way_is_gone_in_slices():
    stop = Interruption()
    stop.patient = True
    story = Counting(fps=1000.0, cost=0.005)
    viewer = Led(story, {3: [("seek", 10**6)]})
    playback = Playback(story, 10**5, viewer, stop, viewer)
    threading.Timer(0.5, lambda: stop._receive(2, None)).start()
    assert playback.play() == "interrupted"
    assert any(status.note == "going to frame 100000" for status in viewer.told)


def test_numbers_wait_for_the_frame_they_were_meant_for():
    story = Counting(fps=1000.0)
    made = []
    story.change = lambda path, value: made.append((story.index, path, value))
    viewer = Led(story, {10: [("set", ("a", 1.5)), ("seek", 50), ("set", ("a", 2.0)), ("set", ("b", 3.0)), ("set", ("a", 4.0))]})
    assert Playback(story, 60, viewer, Interruption(), viewer).play() == "done"
    assert made == [(10, "a", 1.5), (50, "a", 4), (50, "b", 3)]


def test_a_refused_number_is_told_once():
    story = Counting(fps=1000.0)

    def change(path, value):
        raise FixedField(f"{path} cannot change while the scene runs")

    story.change = change
    viewer = Led(story, {k: [("set", ("seed", 1.0))] for k in range(1, 90, 8)})
    assert Playback(story, 100, viewer, Interruption(), viewer).play() == "done"
    assert [note for note in viewer.notes if "seed" in note] == ["seed is refused: seed cannot change while the scene runs"]
    assert any("seed is refused" in status.note for status in viewer.told)


def test_a_crowded_machine_is_told_once():
    class Crowded(Counting):
        def step_frame(self):
            super().step_frame()
            self.crowded_frames += 1

    notes, story = [], Crowded(cost=0.005)
    ears = SimpleNamespace(note=notes.append, report=lambda report: None, end=lambda report=None: None)
    outcome = Playback(story, 150, ears, Interruption())
    outcome.play()
    assert outcome.final_report().crowded_frames == 150
    assert len([note for note in notes if "other programs use the machine" in note]) == 1
