"""The launch layer: frames finish whatever happens to the threads around them."""

import os
import signal
import threading
from types import SimpleNamespace

import pytest
import warp as wp

from benchmarks.cases import flag
from benchmarks.cloth import sheet
from tests.simulation.networks import network, tangle
from tests.simulation.scenes import scene
from warpsim import Simulation, launch
from warpsim.crew import BrokenFrame
from warpsim.kernels import crew as meeting


@pytest.fixture
def parallel(monkeypatch):
    """Use all cores however few particles there are."""
    monkeypatch.setattr(launch, "PARALLEL_FROM", 0)


def hash_after(frame_count: int, threads: int) -> str:
    sim = Simulation(scene(), device="cpu", threads=threads)
    for _ in range(frame_count):
        sim.step_frame()
    return sim.state_hash()


@pytest.mark.parametrize("threads", [2, 3, 5, 16])
def test_any_number_of_cores_gives_the_same_bits(parallel, threads):
    assert hash_after(20, threads) == hash_after(20, 1)


def test_an_interrupted_frame_is_finished_and_counted(parallel):
    sim = Simulation(scene(), device="cpu", threads=2)
    before = signal.signal(signal.SIGALRM, signal.default_int_handler)
    interrupts = 0
    try:
        for k in range(300):
            try:
                signal.setitimer(signal.ITIMER_REAL, 1e-6 * (20 + k % 300))
                sim.step_frame()
                signal.setitimer(signal.ITIMER_REAL, 0)
            except KeyboardInterrupt:
                interrupts += 1
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0)
        signal.signal(signal.SIGALRM, before)
    sim.settle()
    assert interrupts > 10
    assert sim.state_hash() == hash_after(sim.index, 1)


def test_frames_run_in_a_forked_child(parallel):
    sim = Simulation(scene(), device="cpu", threads=2)
    sim.step_frame()
    expected = hash_after(2, 1)
    child = os.fork()
    if child == 0:
        signal.alarm(20)
        sim.step_frame()
        os._exit(0 if sim.state_hash() == expected else 1)
    assert os.waitpid(child, 0)[1] == 0


def test_a_failing_core_does_not_hang_the_others(parallel):
    sim = Simulation(scene(), device="cpu", threads=2)
    sim._graph._graphs[2][1] = SimpleNamespace(apic_state=0)  # what Warp refuses to replay
    with pytest.raises(BrokenFrame):
        sim.step_frame()


def test_stages_timed_one_by_one_advance_the_same_frame():
    sim, other = Simulation(scene(), device="cpu", threads=1), Simulation(scene(), device="cpu", threads=1)
    for _ in range(3):
        times = sim.time_stages()
        other.step_frame()
    assert set(times) == {"clock", "environment", "plan", "emit", "advance", "remove"} and min(times.values()) > 0.0
    assert sim.state_hash() == other.state_hash()


def test_small_populations_use_one_core():
    sim = Simulation(scene(), device="cpu", threads=2)
    sim.run(0.1)
    assert sim.cores == 1


def test_networks_use_as_many_cores_as_their_substeps_are_worth():
    """A sheet's frame of 0.12 ms is too little for two cores that meet twice a substep, a flag's of 0.25 ms is not."""
    nets = {"tangle": network(**tangle()), "sheet": sheet(32), "flag": flag().scene}
    loads = {name: next(iter(Simulation(scene, device="cpu", threads=1).systems.values())).load for name, scene in nets.items()}
    assert loads["tangle"] == 0 < loads["sheet"] < launch.PARALLEL_FROM < loads["flag"]


@pytest.mark.skipif(not hasattr(os, "sched_getaffinity"), reason="this system does not say where threads may run")
def test_cores_that_wait_for_each_other_are_different_ones(monkeypatch):
    """Only while a frame has all of them; a thread that works alone goes where the system likes."""
    cores = os.sched_getaffinity(0)
    sim = Simulation(scene(), device="cpu", threads=len(cores))
    monkeypatch.setattr(launch, "PARALLEL_FROM", 0)
    for _ in range(3):
        sim.step_frame()
    crew = [thread for thread in threading.enumerate() if thread.name == "warpsim-core-1"]
    assert {sorted(cores)[-1]} in [os.sched_getaffinity(thread.native_id) for thread in crew] or len(cores) != 2
    assert os.sched_getaffinity(0) == cores, "the caller's own thread is where it was"


def meetings_of(substeps: int, solver: str, monkeypatch) -> int:
    """How often each of two cores waits for the other in a frame."""
    waits, start = [], wp.launch
    with monkeypatch.context() as patch:
        patch.setattr(wp, "launch", lambda kernel, *rest, **keys: (waits.append(kernel), start(kernel, *rest, **keys)))
        keys = tangle(100, 200) | {"solver": solver, "pins": [1, 2], "substeps": substeps}
        Simulation(network(**keys), device="cpu", threads=2)
    return waits.count(meeting.resolve_barrier) // 2


@pytest.mark.parametrize("solver", ["semi_implicit_euler", "verlet", "drift_kick"])
def test_cores_meet_twice_a_substep(solver, monkeypatch):
    """After the springs and after the pins: kicks, advance and pins keep to the points of their core."""
    assert meetings_of(9, solver, monkeypatch) - meetings_of(4, solver, monkeypatch) == 2 * 5
