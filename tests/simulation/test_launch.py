"""The launch layer: frames finish whatever happens to the threads around them."""

import os
import signal
import threading
from types import SimpleNamespace

import pytest
import warp as wp

from tests.simulation.networks import network, tangle
from tests.simulation.scenes import scene
from warpsim import Simulation, launch
from warpsim import crew as crew_module
from warpsim.crew import BrokenFrame, calls, crew
from warpsim.kernels import crew as native
from warpsim.scene import Scene
from warpsim.scene.events import companies
from warpsim.sharing import Plan

pytestmark = pytest.mark.cpu


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


def test_without_the_address_of_warps_replay_frames_are_one_cores(parallel, monkeypatch):
    expected = hash_after(20, 2)
    monkeypatch.setattr(crew_module, "can_share", lambda: False)
    monkeypatch.setattr(launch, "can_share", lambda: False)
    monkeypatch.setattr(crew_module, "_replay_with_lock", lambda: pytest.fail("called what is not there"))
    assert hash_after(20, 2) == expected


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
    sim._graph._graphs[sim._graph._joint][1] = SimpleNamespace(apic_state=0)  # what Warp refuses to replay
    with pytest.raises(BrokenFrame):
        sim.step_frame()


def test_stages_timed_one_by_one_advance_the_same_frame():
    sim, other = Simulation(scene(), device="cpu", threads=1), Simulation(scene(), device="cpu", threads=1)
    for _ in range(3):
        times = sim.time_stages()
        other.step_frame()
    assert set(times) == {"clock", "environment", "plan", "emit", "advance, remove"} and min(times.values()) > 0.0
    assert sim.state_hash() == other.state_hash()


def test_work_that_is_not_worth_a_thought_is_one_cores(monkeypatch):
    monkeypatch.setattr(launch, "PARALLEL_FROM", 10.0)
    sim = Simulation(scene(), device="cpu", threads=2)
    sim.run(0.3)
    assert sim.cores == 1


def test_a_frame_whose_crew_is_at_another_frame_is_one_cores(parallel):
    """As when two threads of a program have a simulation each; the bits do not tell."""
    one, other = (Simulation(scene(), device="cpu", threads=2) for _ in range(2))
    assert crew().taken_by(one._graph)
    other.step_frame()
    assert other.cores == 1
    crew().finish()
    other.step_frame()
    assert other.cores == 2
    assert other.state_hash() == hash_after(2, 1)


@pytest.mark.skipif(not hasattr(os, "sched_getaffinity"), reason="this system does not say where threads may run")
def test_cores_that_wait_for_each_other_are_different_ones(monkeypatch):
    """Only while a frame has all of them; a thread that works alone goes where the system likes."""
    cores = os.sched_getaffinity(0)
    sim = Simulation(scene(), device="cpu", threads=len(cores))
    monkeypatch.setattr(launch, "PARALLEL_FROM", 0)
    for _ in range(3):
        sim.step_frame()
    hired = [os.sched_getaffinity(thread.native_id) for thread in threading.enumerate() if thread.name.startswith("warpsim-core-")]
    assert any(len(place) == 1 for place in hired) or len(cores) == 1
    assert os.sched_getaffinity(0) == cores, "the caller's own thread is where it was"


def meetings_of(substeps: int, solver: str) -> int:
    """How often each of two cores waits for the other in a frame."""
    keys = tangle(100, 200) | {"solver": solver, "pins": [1, 2], "substeps": substeps}
    return sum(Simulation(network(**keys), device="cpu", threads=2)._graph._meetings.values())


@pytest.mark.parametrize("solver", ["semi_implicit_euler", "verlet", "drift_kick"])
def test_cores_meet_twice_a_substep(solver):
    """After the springs and after the pins: kicks, advance and pins keep to the points of their core."""
    assert meetings_of(9, solver) - meetings_of(4, solver) == 2 * 5


def several(count: int) -> Scene:
    """So many small systems that know nothing of each other, two that do, and a larger one."""
    born = {"burst": {"count": 60}, "rate": 300.0, "shape": {"type": "sphere", "radius": 1.0}, "lifetime": 0.2}
    systems = {f"small{k}": {"type": "particles", "capacity": 300, "emitters": [born]} for k in range(count)}
    children = {"on": {"event": "death", "of": "small0"}, "burst": {"count": 2}, "lifetime": 0.1}
    systems["children"] = {"type": "particles", "capacity": 600, "emitters": [children]}
    systems["large"] = {"type": "particles", "capacity": 9000, "emitters": [{**born, "burst": {"count": 8000}, "lifetime": 9.0}]}
    return Scene.model_validate({"name": "several", "systems": systems, "flow": [{"type": "vortex", "circulation": 1.0}]})


def test_systems_that_hear_of_each_other_are_one_company():
    company = companies(several(3).systems)
    assert company["children"] == company["small0"]
    assert len(set(company.values())) == 4


@pytest.mark.parametrize("threads", [2, 3])
def test_systems_divided_among_cores_have_the_bits_of_one(threads, monkeypatch):
    """Every way to divide them up that a plan may choose, and changes between them."""
    simulated = several(4)
    one, other = (Simulation(simulated, device="cpu", threads=count) for count in (1, threads))
    graph, names = other._graph, other._graph._companies
    own = [tuple(names[core::threads]) for core in range(threads)]
    plans = [
        Plan((), tuple(own)),
        Plan(("large",), tuple(tuple(n for n in mine if n != "large") for mine in own)),
        graph._joint,
        graph._alone,
    ]
    for k in range(24):
        with monkeypatch.context() as patch:
            patch.setattr(graph, "_plan_for", lambda loads, k=k: plans[k % 4])
            patch.setattr(graph.crowding, "told", lambda *told: None)
            other.step_frame()
        assert other.cores == plans[k % 4].core_count
        one.step_frame()
        assert one.state_hash() == other.state_hash(), k


def test_a_thread_that_is_hired_twice_works_once(parallel):
    """As when Ctrl-C comes while it starts: the second finds the first at work and goes home."""
    sim = Simulation(scene(), device="cpu", threads=2)
    sim.step_frame()
    first = crew()._threads[1]
    rounds = crew()._captured(native.follow_rounds, 1, 64, crew()._board, crew()._orders, calls())
    second = threading.Thread(target=wp.capture_launch, args=(rounds,))
    second.start()
    second.join(20.0)
    assert not second.is_alive() and first.is_alive()
    sim.run(0.1)
    assert sim.state_hash() == hash_after(sim.index, 1)
