"""The runner alone, with a simulation that only counts: the clock, the order, what is told."""

import time
from types import SimpleNamespace

import pytest

from warpsim.interruption import Interruption
from warpsim.playback import Playback
from warpsim.runner import save_state


class Counting:
    """Counts frames; each takes `cost` seconds and is refused births from frame 4 on."""

    def __init__(self, fps=100.0, cost=0.0):
        self.scene = SimpleNamespace(name="counting", time=SimpleNamespace(fps=fps, substeps=2), sliders=[])
        self.index, self.cost, self.changes = 0, cost, []

    @property
    def time(self):
        return self.index / self.scene.time.fps

    def step_frame(self):
        time.sleep(self.cost)
        self.index += 1

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

    def wants_frame(self):
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
