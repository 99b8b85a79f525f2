"""Every method, plain and native, against its twin: one frame of a crowd with births and deaths in the middle of it."""

import numpy as np
import pytest
import warp as wp

from tests.physics.scenes import emitter, simulate, state
from tests.reference import flow, forces, integration, signals
from tests.reference.flow import Primitive
from tests.reference.forces import Field
from tests.reference.lifetime import active_step
from warpsim.kernels.integration import METHODS, kick

WIND = {"sine": {"mean": 1.0, "amplitude": 0.5, "period": 0.31}}
PULL = {"keyframes": [[0.0, 0.5], [0.4, 1.5]]}
FLOW = [
    {"type": "uniform", "velocity": [WIND, 0.3, -0.2]},
    {"type": "vortex", "center": [0, 0, 0.2], "axis": [0.2, 1, 0], "circulation": 2.0, "core": {"model": "lamb_oseen", "radius": 0.4}},
    {"type": "source", "center": [3, 0, 0], "rate": -1.0},
]
FORCES = [{"type": "attractor", "center": [0.5, 1.0, 0.0], "strength": PULL, "softening": 0.1}]
GRAVITY, MASS, ALPHA, FPS, SUBSTEPS, COUNT = (0.0, -9.81, 0.5), 0.5, 0.8, 60, 3, 257
CASES = [*METHODS, "ballistic"]


def system(name: str) -> dict:
    """Return the keys of a system that uses a method."""
    if name == "ballistic":
        return {"motion": "ballistic", "feels": {"forces": False}}
    if name.startswith("tracer_"):
        return {"coupling": "tracer", "solver": name.removeprefix("tracer_")}
    return {"coupling": {"alpha": ALPHA}, "solver": name}


def flow_at(t: float):
    """Return the flow of the scene at time t as the twin's function."""
    wind = (signals.sample(WIND, t), 0.3, -0.2)
    members = [Primitive("uniform", wind), Primitive("source", -1.0, center=(3, 0, 0))]
    members.append(Primitive("vortex", 2.0, center=(0, 0, 0.2), axis=(0.2, 1, 0), core="lamb_oseen", core_radius=0.4))
    return lambda x: flow.sample(members, x)


def acceleration_at(t: float):
    """Return gravity and forces of the scene at time t as the twin's function."""
    field = Field("attractor", signals.sample(PULL, t), center=(0.5, 1.0, 0.0), softening=0.1)
    return lambda x: forces.acceleration([field], GRAVITY, MASS, x)


def advance(name, x, v, age, lifetime, begin, past=()):
    """Return a particle's state one frame after time `begin`, at which it had the given age and past drives."""
    dt, method = 1.0 / (FPS * SUBSTEPS), integration.METHODS[name]
    for s in range(SUBSTEPS):
        fields = {m: (flow_at(begin + (s + m) * dt), acceleration_at(begin + (s + m) * dt)) for m in (0, 0.5, 1)}
        h = active_step(age + (s + 1) * dt, dt, lifetime)
        felt = (lambda y, m, f=fields: f[m][0](y)), (lambda y, m, f=fields: f[m][1](y))
        if isinstance(method, integration.Adams):
            x, v, past = method(x, v, *felt, ALPHA / MASS, h, past, h > 0.9999 * dt)
        else:
            x, v = method(x, v, *felt, ALPHA / MASS, h)
    return x, v


def pasts(sim) -> list[list]:
    """Return the past drives that each particle keeps, latest first."""
    population = sim.systems["p"].population
    if "history" not in population.fields:
        return [[]] * sim.frame()["p"].count
    rows, counts = population.host("history").astype(float), population.host("history_count")
    return [[rows[3 * j : 3 * j + 3, i] for j in range(min(counts[i], len(rows) // 3))] for i in range(len(counts))]


def crowd(name, native, device):
    """257 particles in a box with their own velocities and lives."""
    keys = {
        "shape": {"type": "box", "center": [0, 1, 0], "size": [1, 1, 1]},
        "velocity": {"cone": 180, "speed": {"mean": 1.0, "spread": 1.0}},
    }
    keys |= {"mass": MASS, "lifetime": {"mean": 0.2, "spread": 0.19}}
    fields = {"flow": FLOW, "forces": FORCES, "gravity": GRAVITY, "fps": FPS, "substeps": SUBSTEPS}
    return simulate(emitter(COUNT, **keys), device=device, native=native, **fields, **system(name))


def test_every_method_has_a_twin():
    assert set(integration.METHODS) == set(METHODS)


@pytest.mark.parametrize("native", [True, False])
@pytest.mark.parametrize("name", CASES)
def test_a_frame_equals_the_twin(name, native, device):
    """Each frame starts the twin from the device's state. 3 substeps in float32, |x| < 4 m, |v| < 8 m/s: 3 × 2 ulp of 2 m, 4 m/s."""
    sim = crowd(name, native, device)
    at_birth = state(sim)
    numbers, lived = np.arange(COUNT), 0
    for index in range(1, 20):
        before, ids, lives = state(sim), sim.frame()["p"].id.astype(int), sim.frame()["p"].lifetime.astype(float)
        past = pasts(sim)
        sim.step_frame()
        after, kept = state(sim), sim.frame()["p"].id.astype(int)
        lived += len(kept)
        for place in range(0, len(kept), 7):  # every seventh: the twin is slow
            row = int(np.flatnonzero(ids == kept[place])[0])
            if name == "ballistic":
                x, v = integration.ballistic(*(part[numbers == kept[place]][0] for part in at_birth), GRAVITY, index / FPS)
            else:
                begin = (index - 1) / FPS
                x, v = advance(name, before[0][row], before[1][row], begin, lives[row], begin, past[row])
            assert np.abs(after[0][place] - x).max() < 1e-6 and np.abs(after[1][place] - v).max() < 2e-6, (index, place)
    assert lived > 500


@pytest.mark.parametrize("native", [True, False])
@pytest.mark.parametrize("name", CASES)
def test_the_first_step_begins_at_birth(name, native, device):
    """Particles born within the frame move for the rest of it, by the twin from a negative age on."""
    keys = {"rate": 3000.0, "velocity": {"cone": 180, "speed": 2.0}, "mass": MASS, "shape": {"type": "point", "center": [1, 1, 0]}}
    fields = {"flow": FLOW, "forces": FORCES, "gravity": GRAVITY, "fps": FPS, "substeps": SUBSTEPS}
    sim = simulate(emitter(**keys), device=device, native=native, **fields, **system(name))
    twin = simulate(emitter(**keys), device=device, motion="ballistic", feels={"gravity": False, "forces": False}, fps=FPS)
    sim.step_frame()
    twin.step_frame()
    (x, v), age, (_, v0) = state(sim), sim.frame()["p"].age.astype(float), state(twin)
    assert len(x) == 50 and np.ptp(age) > 0.014
    for row in range(0, 50, 3):
        if name == "ballistic":
            x1, v1 = integration.ballistic(np.array([1.0, 1.0, 0.0]), v0[row], GRAVITY, age[row])
        else:
            x1, v1 = advance(name, np.array([1.0, 1.0, 0.0]), v0[row], age[row] - 1 / FPS, 1e6, 0.0)
        assert np.abs(x[row] - x1).max() < 1e-6 and np.abs(v[row] - v1).max() < 2e-6, row


@wp.kernel
def sample_kicks(rate: wp.array[float], h: float, v: wp.vec3, u: wp.vec3, a: wp.vec3, v_out: wp.array[wp.vec3]):
    i = wp.tid()
    v_out[i] = kick(v, u, a, rate[i], h)


def test_the_kick_is_exact_for_constant_drive(device):
    """Against the closed form, from kh = 0 over the seam of the series at ½ to very stiff: 1e-6 (φ to 5e-7) of |v − u| + |a| h."""
    v, u, a, h = np.array([3.0, -1.0, 0.5]), np.array([-2.0, 0.1, 4.0]), np.array([0.0, -9.81, 1.0]), 1 / 60
    rates = np.concatenate([[0.0, 29.9, 30.0, 30.1], np.geomspace(1e-6, 1e12, 253)]).astype(np.float32)
    out = wp.zeros(len(rates), dtype=wp.vec3, device=device)
    wp.launch(sample_kicks, len(rates), [wp.array(rates, device=device), h, *(wp.vec3(*w) for w in (v, u, a)), out], device=device)
    exact = np.array([integration.kick(v, u, a, float(k), h) for k in rates])
    assert np.abs(out.numpy() - exact).max() < 1e-6 * (np.linalg.norm(v - u) + np.linalg.norm(a) * h)
