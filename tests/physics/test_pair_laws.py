"""Laws of pair forces: momentum, energy, two bodies that orbit and oscillate, a ball whose size theory knows, births and deaths."""

import math

import numpy as np
import pytest

from tests.physics.scenes import emitter, simulate, start, state
from tests.reference.pairwise import Pair, pair_energy
from warpsim.scene.forces import PAIR_SOLVERS

ULP = 2.0**-24
CLOUD = {"shape": {"type": "sphere", "radius": 0.5}}


def between(pair: Pair) -> tuple[dict, ...]:
    return ({"type": "pairwise", "law": pair.law, "strength": pair.strength, "radius": pair.radius, "softening": pair.softening},)


def energy(sim, pairs: list[Pair]) -> float:
    """Kinetic and potential energy of particles of 1 kg [J]."""
    x, v = state(sim)
    return 0.5 * float((v**2).sum()) + pair_energy(pairs, x)


@pytest.mark.parametrize("solver", PAIR_SOLVERS)
@pytest.mark.parametrize("law", ["constant", "inverse_square", "spring", "linear", "cosine"])
def test_momentum_stays(law, solver):
    """Each kick h·a is the sum of about 60 terms and added to a velocity; all of that rounds independently, hence the √."""
    pair = Pair(-0.02, 0.4, law, 0.01)
    burst = emitter(800, velocity={"cone": 180, "speed": 0.5}, **CLOUD)
    sim = simulate(burst, forces=between(pair), solver=solver)
    before = state(sim)[1].sum(axis=0)
    sim.run(0.5)
    x, v = state(sim)
    steps = 120
    rounding = ULP * np.sqrt(800 * steps) * (np.abs(v).max() + 60 * np.abs(v).max() / steps)
    assert np.abs(v.sum(axis=0) - before).max() < 4 * rounding, "4σ of 2400 sums"
    assert np.abs(v).max() > 0.5, "they did push each other"


def test_momentum_stays_through_births_and_deaths():
    """All at rest when born: what the dead take along is what they had, so count the living and the dead together."""
    pair = Pair(-0.05, 0.4, "linear", 0.01)
    born = emitter(600, **CLOUD) | {"lifetime": {"mean": 0.4, "spread": 0.3}}
    sim = simulate(born, forces=between(pair))
    gone, last = np.zeros(3), {}
    for frame in sim.frames(30):
        p = frame["p"]
        now = dict(zip(p.id.tolist(), p.velocity.astype(float), strict=True))
        gone += sum((last[key] for key in last.keys() - now.keys()), np.zeros(3))
        last = now
    total = gone + sum(last.values())
    # In its last frame one is gone before the last velocity was seen: up to a frame of pushes of 0.05 N times some 100 neighbors.
    assert len(last) < 600 and np.linalg.norm(total) < 600 * 0.01, total


@pytest.mark.parametrize("solver", ["semi_implicit_euler", "verlet"])
def test_two_bodies_orbit_in_keplers_time(solver):
    """At distance a = 1 with masses of 1 kg: ω² = 2k/(m a³). Both solvers keep the circle; their period is off by O((ωh)²)."""
    k, substeps = 1.0, 32
    omega = math.sqrt(2 * k)
    speed = 0.5 * omega
    pair = Pair(k, 10.0, "inverse_square", 0.0)
    two = (start((0.5, 0, 0), (0, speed, 0)), start((-0.5, 0, 0), (0, -speed, 0)))
    sim = simulate(*two, forces=between(pair), solver=solver, substeps=substeps)
    turns, before = 0.0, 0.0
    for _ in sim.frames(600):
        x, _ = state(sim)
        d = x[0] - x[1]
        assert np.linalg.norm(d) == pytest.approx(1.0, abs=3 * omega / 60 / substeps)
        angle = math.atan2(d[1], d[0])
        turns += (angle - before + math.pi) % (2 * math.pi) - math.pi
        before = angle
    h = 1 / 60 / substeps
    phase = 10 * omega * (omega * h if solver == "semi_implicit_euler" else (omega * h) ** 2)
    assert turns == pytest.approx(10 * omega, abs=phase + 600 * substeps * ULP * 4)


@pytest.mark.parametrize("solver", ["semi_implicit_euler", "verlet"])
def test_two_bodies_on_a_spring_swing_at_the_root_of_2k_over_m(solver):
    """Symplectic Euler and Verlet swing at (2/h) asin(ωh/2): the zero crossings of 20 s tell it to a part in 1e5."""
    k, m, h = 3.0, 0.5, 1 / 240
    pair = Pair(k, 10.0, "spring")
    sim = simulate(start((0.4, 0, 0), mass=m), start((-0.4, 0, 0), mass=m), forces=between(pair), solver=solver)
    omega = 2 / h * math.asin(0.5 * h * math.sqrt(2 * k / m))
    t, d = [0.0], [0.8]
    for frame in sim.frames(1200):
        x = state(sim)[0]
        t.append(frame.time)
        d.append(x[0, 0] - x[1, 0])
    t, d = np.array(t), np.array(d)
    cross = np.flatnonzero(d[:-1] * d[1:] < 0)
    moments = t[cross] + (t[cross + 1] - t[cross]) * d[cross] / (d[cross] - d[cross + 1])
    period = 2 * np.polyfit(np.arange(len(moments)), moments, 1)[0]
    # a chord instead of an arc between frames: (ω/60)²/8 of a frame at worst, both ways in turn
    assert period == pytest.approx(2 * math.pi / omega, rel=1e-5)


@pytest.mark.parametrize(("law", "softening"), [("inverse_square", 0.1), ("linear", 1e-3), ("cosine", 1e-3), ("spring", 1e-3)])
@pytest.mark.parametrize("solver", ["semi_implicit_euler", "verlet"])
def test_energy_of_a_cloud_does_not_drift(law, softening, solver):
    """Symplectic: over 10 s it oscillates by O(h) (Verlet O(h²)) of what is exchanged and goes nowhere. Pulls reach across the cloud."""
    pair = Pair(
        *{"inverse_square": (2e-3, 50.0), "spring": (2e-3, 50.0), "linear": (-0.2, 0.3), "cosine": (-0.2, 0.3)}[law], law, softening
    )
    bowl = ({"type": "attractor", "law": "spring", "strength": 1.0},) if law in ("linear", "cosine") else ()
    sim = simulate(emitter(200, **CLOUD), forces=between(pair) + bowl, solver=solver)
    track, exchanged = [], 0.0
    for _ in sim.frames(600):
        x, v = state(sim)
        exchanged = max(exchanged, 0.5 * float((v**2).sum()))
        track.append(energy(sim, [pair]) + (0.5 * float((x**2).sum()) if bowl else 0.0))
    track = np.array(track)
    early, late = track[:150].mean(), track[-150:].mean()
    assert abs(late - early) < (2e-2 if solver == "semi_implicit_euler" else 4e-3) * exchanged, (early, late, exchanged)


def test_charges_in_a_bowl_settle_into_a_ball_of_known_size():
    """Inside a uniform ball N(r) k/r² = K r, so R³ = N k/K; the outermost shell lies within it by less than R (4π/3N)^⅓."""
    n, k, bowl = 400, 1e-3, 2.0
    pair = Pair(-k, 50.0, "inverse_square", 1e-3)
    forces = (*between(pair), {"type": "attractor", "law": "spring", "strength": bowl})
    sim = simulate(emitter(n, **CLOUD), forces=forces, coupling={"alpha": 2.0})
    sim.run(20.0)
    x, v = state(sim)
    radius = (n * k / bowl) ** (1 / 3)
    r = np.linalg.norm(x, axis=1)
    assert np.abs(v).max() < 1e-2, "at rest, nearly"
    # mean of r² in a uniform ball is 3/5 R²; the energy's correction for the lattice is of relative order N^(-2/3)
    assert (r**2).mean() == pytest.approx(0.6 * radius**2, rel=2 * n ** (-2 / 3))
    assert radius * (1 - (4 * math.pi / 3 / n) ** (1 / 3)) < r.max() < radius


def test_one_system_does_not_feel_another_and_who_does_not_feel_is_free():
    import warpsim

    def system(**keys):
        return {"type": "particles", "capacity": 64, "emitters": [emitter(1, shape={"type": "point", "center": keys.pop("at")})], **keys}

    scene = {"name": "two", "gravity": [0, 0, 0], "forces": [{"type": "pairwise", "strength": 1.0, "radius": 5.0, "name": "pull"}]}
    systems = {"a": system(at=[0, 0, 0]), "b": system(at=[0.1, 0, 0])}
    alone = warpsim.Simulation(warpsim.Scene.model_validate(scene | {"systems": systems}), device="cpu", threads=1)
    alone.run(0.5)
    assert all((alone.frame()[name].velocity == 0.0).all() for name in "ab")
    for feels, moves in ((True, True), (["pull"], True), ([0], True), (False, False), ([], False)):
        both = system(at=[0, 0, 0], feels={"forces": feels})
        both["emitters"].append(emitter(1, shape={"type": "point", "center": [0.1, 0, 0]}))
        sim = warpsim.Simulation(warpsim.Scene.model_validate(scene | {"systems": {"p": both}}), device="cpu", threads=1)
        sim.run(0.1)
        assert (sim.frame()["p"].velocity != 0.0).any() == moves, feels


def test_a_pair_acts_from_the_first_whole_substep_that_both_live():
    """Born at 0.5 frame: the other has no force before; then both have the same to the bit."""
    pair = Pair(-1.0, 5.0, "constant", 0.0)
    sim = simulate(start((0, 0, 0)), start((1, 0, 0), burst={"count": 1, "at": 0.5 / 60}), forces=between(pair), substeps=4)
    sim.step_frame()
    v = state(sim)[1]
    assert v[0, 0] == -v[1, 0] and v[0, 0] == pytest.approx(-2 / 240, rel=1e-5)


def test_the_strength_and_the_radius_change_while_it_runs():
    """A kick of 1/60 m/s, exact to a few roundings of 6e-8."""
    pair = Pair(-1.0, 0.5, "constant", 0.0)
    sim = simulate(start((0, 0, 0)), start((1, 0, 0)), forces=between(pair), substeps=1)
    sim.step_frame()
    assert (state(sim)[1] == 0.0).all(), "out of reach"
    sim.change("forces.0.radius", 2.0)
    sim.step_frame()
    assert state(sim)[1][0, 0] == pytest.approx(-1 / 60, rel=1e-6)
    sim.change("forces.0.strength", 1.0)
    sim.step_frame()
    assert state(sim)[1][0, 0] == pytest.approx(0.0, abs=1e-8)


def test_a_strength_in_time_is_felt_at_the_substeps_beginning():
    """k(t) = t: the kicks of semi_implicit_euler add up to Σ s h², s = 0 … n − 1; Verlet's to the integral ½t²."""
    for solver, total in (("semi_implicit_euler", sum(range(240)) / 240**2), ("verlet", 0.5)):
        force = {"type": "pairwise", "law": "constant", "strength": {"expression": "t"}, "radius": 1e3, "softening": 0.0}
        sim = simulate(start((0, 0, 0)), start((10, 0, 0)), forces=(force,), solver=solver)
        sim.run(1.0)
        assert state(sim)[1][0, 0] == pytest.approx(total, rel=240 * ULP)
