"""A machine that others use, too: real processes that compute without end beside a run. No speed is asserted: more may be at work."""

import os
import subprocess
import sys
import time
from contextlib import ExitStack, contextmanager

import pytest

from benchmarks.cloth import sheet
from warpsim import Simulation, cores, launch
from warpsim.cores import available_cores

SPINNING = "while True: pass"
pytestmark = pytest.mark.skipif(available_cores() < 2, reason="one core has nobody to wait for")


@contextmanager
def others(count: int):
    """So many processes that compute without end; they end with the block."""
    with ExitStack() as stack:
        for _ in range(count):
            process = subprocess.Popen([sys.executable, "-c", SPINNING])
            stack.callback(process.wait)
            stack.callback(process.kill)
        time.sleep(0.2)  # until they are at it
        yield


def step_until(sim: Simulation, done, seconds: float) -> bool:
    """Step until something holds, at most so long; return whether it did."""
    end = time.perf_counter() + seconds
    while time.perf_counter() < end and not done():
        for _ in range(20):
            sim.step_frame()
    return done()


def test_one_core_goes_on_alone_while_all_are_busy_and_the_bits_do_not_tell(monkeypatch):
    """Twice as many spinning processes as cores: threads that wait for each other at 35 meetings a frame have no chance."""
    monkeypatch.setattr(launch, "PARALLEL_FROM", 1e-9)
    monkeypatch.setattr(launch, "best_plan", lambda work, meetings, count: launch.joint(list(work), count))  # however slow the machine
    sim, alone = Simulation(sheet(48), device="cpu", threads=2), Simulation(sheet(48), device="cpu", threads=1)
    with others(2 * available_cores()):
        assert step_until(sim, lambda: sim.crowded_frames > 50, 60.0), "it falls back to one core"
    for _ in range(min(sim.index, 300)):
        alone.step_frame()
    sim.seek(alone.index)
    assert sim.state_hash() == alone.state_hash()


def test_all_cores_are_tried_again_when_others_have_gone():
    """By the clock of a machine that is loaded for the first minute; the real one may have other work, and nobody could tell."""
    clock = [0.0]
    crowding = cores.Crowding(lambda: clock[0])
    for _ in range(100_000):
        loaded = clock[0] < 60.0
        taken, share = (4e-3, 1.0) if crowding.one else (2e-2, 0.5) if loaded else (2.2e-3, 0.98)
        clock[0] += taken
        crowding.told(taken, share)
        if not loaded and not crowding.alone:
            break
    assert 60.0 < clock[0] < 60.0 + 5.0 * cores.LONGEST_HOLD + 1.0


STORY = """
import os, warpsim
from warpsim import launch
from tests.simulation.scenes import scene
launch.PARALLEL_FROM = 0
sim = warpsim.Simulation(scene(), device="cpu")
sim.run(0.2)
print(sim.threads, sim.state_hash())
"""


def told_by(command: list[str], **keys) -> list[str]:
    """What a process of its own prints of a run."""
    done = subprocess.run([*command, sys.executable, "-c", STORY], capture_output=True, text=True, check=True, timeout=100, **keys)
    return done.stdout.split()


@pytest.mark.skipif(not hasattr(os, "sched_setaffinity"), reason="this system does not say where threads may run")
def test_a_process_uses_the_cores_it_is_given_and_ends_cleanly():
    """As `taskset` gives them; the exit code is that of a crew that has gone home before its code is unloaded."""
    one = min(os.sched_getaffinity(0))
    confined = told_by([], preexec_fn=lambda: os.sched_setaffinity(0, {one}))
    free = told_by([])
    assert confined[0] == "1" and free[0] == str(min(available_cores(), launch.MOST_CORES))
    assert confined[1] == free[1]


def test_two_runs_at_once_both_end_with_the_same_bits():
    """Each would have every core; neither waits for the other without end."""
    command = [sys.executable, "-c", STORY]
    both = [subprocess.Popen(command, stdout=subprocess.PIPE, text=True) for _ in range(2)]
    told = [process.communicate(timeout=100)[0].split() for process in both]
    assert [process.returncode for process in both] == [0, 0]
    assert told[0] == told[1]
