"""Laws of tearing: when a spring breaks, what it gives back, what stays the same, and what of a sheet is left to be seen."""

import numpy as np
import pytest

from tests.simulation.networks import network, simulate, state, tangle
from warpsim import Simulation
from warpsim.observers.recorder import Recorder
from warpsim.replay import NoRun, Recording
from warpsim.scene.resolved import resolved_yaml

PULLED = {"points": [[0, 0, 0], [1, 0, 0]], "springs": [[0, 1]], "stiffness": 50.0, "pins": [0, 1], "tear": 0.25, "substeps": 4}
MOTION = [{"pins": [1], "displacement": [{"expression": "0.5*t"}, 0, 0]}]
BANNER = {
    "type": "cloth",
    "resolution": [11, 9],
    "edges": [[1.0, 0, 0], [0, -0.8, 0]],
    "density": 0.2,
    "tear": 0.3,
    "pins": ["left", "right"],
}
BANNER |= {"structural": {"stiffness": 60.0, "damping": 0.01}, "shear": {"stiffness": 20.0}, "gravity": (0, -9.81, 0), "substeps": 24}
BANNER |= {"pin_motion": [{"pins": ["right"], "displacement": [{"expression": "0.8*t"}, 0, 0]}]}


def test_a_spring_breaks_when_its_strain_is_reached_and_stays_broken():
    """Pulled at 0.5 m/s it is a quarter longer after 0.5 s, to one substep; pushed together again it does not heal."""
    sim = simulate(**PULLED, pin_motion=[{"pins": [1], "keyframes": [[0, [0, 0, 0]], [1, [0.5, 0, 0]], [2, [0, 0, 0]]]}])
    torn = [bool(frame["s"].torn[0]) for frame in sim.frames(120)]
    assert torn.index(True) == 30 and all(torn[30:])  # entry 30 is frame 31, whose first substep ends at 0.504 s
    energy = [row["elastic_energy"] for row in energies(PULLED | {"pin_motion": MOTION}, 33)]
    assert energy[29] == pytest.approx(0.5 * 50 * 0.25**2, rel=1e-4) and energy[30] == energy[32] == 0.0


def energies(keys: dict, count: int) -> list[dict[str, float]]:
    """Statistics of so many frames."""
    sim = simulate(**keys)
    return [sim.statistics()["s"] for _ in sim.frames(count)]


def test_a_stone_falls_freely_once_its_thread_breaks():
    """The thread stands a strain of 0.05, its weight asks for mg/k = 0.1: from then on the stone falls as if there had never been one."""
    keys = {"points": [[0, 0, 0], [0, -1, 0]], "springs": [[0, 1]], "stiffness": 98.1, "pins": [0], "tear": 0.05, "solver": "verlet"}
    sim = simulate(**keys, gravity=(0, -9.81, 0), substeps=16)
    while not sim.frame()["s"].torn[0]:
        sim.step_frame()
    x, v = state(sim)
    assert 1.05 < -x[1, 1] < 1.06 and v[1, 1] < 0
    sim.run(0.5)
    assert state(sim)[0][1, 1] == pytest.approx(x[1, 1] + 0.5 * v[1, 1] - 0.5 * 9.81 * 0.25, abs=1e-5)


def test_compression_and_springs_without_length_never_tear():
    keys = {"points": [[0, 0, 0], [1, 0, 0], [1, 0, 0]], "springs": [[0, 1], [1, 2]], "stiffness": 5.0, "pins": [0, 1], "tear": 0.01}
    sim = simulate(**keys, pin_motion=[{"pins": [1], "keyframes": [[0, [0, 0, 0]], [1, [-0.9, 0, 0]]]}], rest_length=[1.0, 0.0])
    sim.run(1.0)
    assert not sim.frame()["s"].torn.any()


def test_momentum_stays_while_everything_breaks():
    """A spring that breaks does so for both its ends: 1e-6 of Σ m|v| over 600 substeps in which two thirds of the springs go."""
    sim = simulate(**tangle(), tear=0.6, substeps=10)
    mass = sim.frame()["s"].mass.astype(float)[:, None]
    velocity = sim.systems["s"].population.field("velocity")
    velocity.assign(np.random.default_rng(1).normal(size=velocity.shape).astype(np.float32))
    before = (mass * state(sim)[1]).sum(axis=0)
    torn = [int(frame["s"].torn.sum()) for frame in sim.frames(60)]
    assert (mass * state(sim)[1]).sum(axis=0) == pytest.approx(before, abs=2e-6 * np.abs(mass * state(sim)[1]).sum())
    assert (np.diff(torn) >= 0).all() and torn[-1] > 0.5 * len(tangle()["springs"])


def test_a_frame_shows_what_is_left():
    """Triangles with a torn edge are gone, and no others; the topology is that of the beginning."""
    sim = simulate(**BANNER)
    first = sim.frame()["s"]
    assert first.tears and not first.torn.any() and len(first.triangles) == 160
    sim.run(1.0)
    s = sim.frame()["s"]
    gone = {tuple(sorted(pair)) for pair in s.topology["springs"][s.torn].tolist()}
    assert len(gone) > 5 and len(s.springs) == len(s.topology["springs"]) - len(gone)
    kept = [t for t in s.topology["triangles"].tolist() if not any(tuple(sorted((t[k], t[k - 1]))) in gone for k in range(3))]
    assert s.triangles.tolist() == kept and 0 < len(kept) < 160
    assert (s.topology["triangles"] == first.topology["triangles"]).all() and len(first.triangles) == 160


def test_seeking_and_sliders_know_what_is_torn():
    """State holds it: back and forth gives the same hash; stiffer springs do not heal; a reset makes the network whole."""
    sim = simulate(**BANNER, more={"limits": {"unstable": "reset"}})
    sim.run(1.0)
    after, torn = sim.state_hash(), sim.frame()["s"].torn
    sim.seek(10)
    assert not sim.frame()["s"].torn.any()
    sim.seek(60)
    assert sim.state_hash() == after and (sim.frame()["s"].torn == torn).all()
    sim.change("systems.s.structural.stiffness", 61.0)
    sim.change("systems.s.tear", 1000.0)
    sim.step_frame()
    numbers = sim.systems["s"].network.stiffness.numpy()[sim.systems["s"].packed.places()]
    assert (sim.frame()["s"].torn == torn).all() and not numbers[torn].any() and numbers[~torn].any()
    sim.systems["s"].reset()
    assert not sim.systems["s"].torn().any() and sim.systems["s"].network.stiffness.numpy().max() == 61.0


def test_a_run_folder_and_its_replay_know_what_is_torn(tmp_path):
    scene = network(**BANNER, self_collision=True, solver="implicit_euler")
    sim = Simulation(scene, device="cpu")
    sim.run(0.5)
    recorder = Recorder(tmp_path / "run")
    recorder.begin(resolved_yaml(scene))
    for frame in sim.frames(12):
        recorder.record(frame, sim.statistics(), "0" * 32)
    recorder.close()
    s = frame["s"]
    with np.load(tmp_path / "run" / "topology.npz") as topology:
        assert (topology["s.springs"] == s.topology["springs"]).all() and (topology["s.triangles"] == s.topology["triangles"]).all()
    header, *_, last = (line.split(",") for line in (tmp_path / "run" / "stats.csv").read_text().splitlines())
    told = {f"s.{key}": number for key, number in sim.statistics()["s"].items()}
    assert dict(zip(header[2:], map(float, last[2:]), strict=True)) == told and {"s.torn", "s.self_contacts", "s.cg_residual"} < set(told)
    again = Recording(tmp_path / "run").frame(frame.index)["s"]
    assert s.torn.any() and (again.torn == s.torn).all() and (again.triangles == s.triangles).all() and (again.springs == s.springs).all()
    path = tmp_path / "run" / "frames" / f"{frame.index:06d}.npz"
    with np.load(path) as stored:
        arrays = {key: stored[key] for key in stored.files}
    np.savez(path, **(arrays | {"s.torn": np.zeros(3, bool)}))
    with pytest.raises(NoRun, match="damaged"):
        Recording(tmp_path / "run").frame(frame.index)


@pytest.mark.parametrize("solver", ["euler", "drift_kick", "verlet"])
def test_every_solver_tears(solver):
    sim = simulate(**BANNER, solver=solver)
    sim.run(0.8)
    assert sim.frame()["s"].torn.any() and np.isfinite(state(sim)[0]).all()
