"""Cores: what this process may use, and when one does what all could, because others use them, too."""

import os
from pathlib import Path

import pytest

from warpsim import cores
from warpsim.cores import Crowding, available_cores, container_cores


def grouped(folder: Path, files: dict[str, str], own: str) -> float:
    """Cores that control groups with such files leave a process that is in such groups."""
    for name, text in files.items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_text(text)
    (folder / "own").write_text(own)
    return container_cores(folder, folder / "own")


@pytest.mark.parametrize(
    "own, files, expected",
    [
        ("0::/\n", {"cpu.max": "150000 100000\n"}, 1.5),
        ("0::/\n", {"cpu.max": "max 100000\n"}, 1 << 20),
        ("0::/a/b\n", {"a/cpu.max": "50000 100000\n", "a/b/cpu.max": "max 100000\n"}, 0.5),
        ("4:cpu,cpuacct:/x\n", {"cpu/x/cpu.cfs_quota_us": "300000\n", "cpu/x/cpu.cfs_period_us": "100000\n"}, 3.0),
        ("4:cpu,cpuacct:/of/the/host\n", {"cpu/cpu.cfs_quota_us": "25000\n", "cpu/cpu.cfs_period_us": "50000\n"}, 0.5),
        ("4:cpu:/\n", {"cpu/cpu.cfs_quota_us": "-1\n", "cpu/cpu.cfs_period_us": "100000\n"}, 1 << 20),
        ("4:memory:/x\n", {"cpu/x/cpu.cfs_quota_us": "1\n", "cpu/x/cpu.cfs_period_us": "1\n"}, 1 << 20),
        ("0::/\n", {"cpu.max": "nonsense"}, 1 << 20),
        ("", {}, 1 << 20),
    ],
)
def test_containers_leave_so_many_cores(tmp_path, own, files, expected):
    assert grouped(tmp_path, files, own) == expected


@pytest.mark.parametrize("quota, expected", [(0.2, 1), (1.0, 1), (1.5, 2), (2.0, 2), (1 << 20, None)])
def test_a_started_core_counts_as_one_but_none_is_invented(monkeypatch, quota, expected):
    monkeypatch.setattr(os, "sched_getaffinity", lambda process: {0, 3, 5}, raising=False)
    monkeypatch.setattr(cores, "container_cores", lambda: quota)
    assert available_cores() == (expected or 3)


class Machine:
    """A machine on which one core's frame takes 4 ms, that of two 2.2, or 9 while others are at work; it has a clock."""

    def __init__(self):
        self.time, self.loaded = 0.0, False
        self.crowding = Crowding(lambda: self.time)

    def frames(self, seconds: float) -> tuple[int, int]:
        """Go on for so long; return how many frames there were, and how many of them were one core's."""
        before, end = (self.crowding.frames, self.crowding.frames_alone), self.time + seconds
        while self.time < end:
            taken, share = (4e-3, 1.0) if self.crowding.one else (9e-3, 0.6) if self.loaded else (2.2e-3, 0.99)
            self.time += taken
            self.crowding.told(taken, share)
        return self.crowding.frames - before[0], self.crowding.frames_alone - before[1]


def test_a_free_machine_is_never_tried_with_one_core():
    frames, alone = Machine().frames(10.0)
    assert frames == pytest.approx(10.0 / 2.2e-3, abs=2) and alone == 0


def test_a_loaded_machine_has_one_core_at_work_and_all_of_them_when_it_is_free_again():
    machine = Machine()
    machine.frames(1.0)
    machine.loaded = True
    machine.frames(1.0)
    assert machine.crowding.alone
    frames, alone = machine.frames(20.0)
    assert frames > 0.95 * 20.0 / 4e-3, "trials take a twentieth of the time at most"
    assert frames > alone, "it did try"
    machine.loaded = False
    machine.frames(2.2)
    assert not machine.crowding.alone
    assert machine.frames(5.0)[1] == 0


def test_all_cores_are_kept_where_they_are_faster_though_others_use_them():
    """They have 0.7 of each, and that is more than one."""
    clock = [0.0]
    crowding = Crowding(lambda: clock[0])
    for _ in range(10_000):
        taken = 4e-3 if crowding.one else 3e-3
        clock[0] += taken
        crowding.told(taken, 1.0 if crowding.one else 0.7)
    assert not crowding.alone and 0 < crowding.frames_alone < 0.05 * crowding.frames


def test_a_frame_that_takes_ever_so_long_is_not_tried_often():
    clock = [0.0]
    crowding = Crowding(lambda: clock[0])
    spent = 0.0
    for _ in range(20_000):
        taken = 2e-3 if crowding.one else 0.12
        spent += 0.0 if crowding.one else taken
        clock[0] += taken
        crowding.told(taken, 1.0 if crowding.one else 0.3)
    assert crowding.alone and spent < 0.06 * clock[0]


def test_cores_that_do_not_pay_are_left_whatever_they_had():
    """Where the system tells no thread's time, or its host takes it away, the clock on the wall does: 3 ms for what one core does in 2."""
    crowding = Crowding(lambda: 0.0)
    for _ in range(100):
        crowding.told(2e-3 if crowding.one else 3e-3, 1.0, 2e-3)
    assert crowding.alone
