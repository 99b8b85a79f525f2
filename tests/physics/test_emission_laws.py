"""Laws of emission: who is born when, how many, with which values — through whole simulations, as a user sees them.

Statistical bounds are 4 standard errors of the estimate: one wrong alarm in 16 000, and the seeds are fixed.
"""

import numpy as np
import pytest

from tests.physics.scenes import emitter, scene, simulate, start, state
from warpsim import Simulation


def births_per_frame(rate, frames=4000, fps=60, **keys) -> np.ndarray:
    """Births in each frame of an emitter whose particles die at once."""
    sim = simulate(emitter(rate=rate, **{"lifetime": 1e-3, **keys}), fps=fps, substeps=1)
    born = [0]
    for _ in range(frames):
        sim.step_frame()
        born.append(sim.systems["p"].population.counter("next_id"))
    return np.diff(born)


@pytest.mark.parametrize(
    ("law", "variance"),
    [("uniform", 1 / 3), ("scaled_uniform", 1.0), ("normal", 1.0), ("poisson", None)],
)
def test_the_count_law_has_its_mean_and_variance(law, variance):
    """N_E = 40 and N_V = 12 per frame; the carried fraction adds less than 1/6 to the variance (a difference of two roundings)."""
    n = births_per_frame({"mean": 2400.0, "spread": 720.0, "law": law})
    expected = 144.0 * variance if variance else 40.0
    assert n.mean() == pytest.approx(40.0, abs=4 * np.sqrt(expected / len(n)))
    kurtosis = {"uniform": 1.8, "scaled_uniform": 1.8, "normal": 3.0, "poisson": 3.1}[law]
    assert n.var() == pytest.approx(expected, abs=1 / 6 + 4 * expected * np.sqrt((kurtosis - 1) / len(n)))


def test_a_large_poisson_rate_stays_poisson():
    """Both ways of drawing: inversion in chunks (5e4) and, above a million, the normal limit."""
    for mean, frames in ((5.0e4, 400), (1.5e6, 200)):
        n = births_per_frame({"mean": mean * 60, "law": "poisson"}, frames=frames)
        assert n.mean() == pytest.approx(mean, abs=4 * np.sqrt(mean / frames))
        assert n.var() == pytest.approx(mean, rel=4 * np.sqrt(2 / frames))


@pytest.mark.parametrize("rate", [1.0, 7.3, 59.9, 60.0, 1234.56])
def test_without_spread_the_count_is_exact(rate):
    total = np.cumsum(births_per_frame(rate, frames=600))
    exact = rate * np.arange(1, 601) / 60
    assert np.all((total >= np.floor(exact - 1e-6)) & (total <= np.ceil(exact + 1e-6)))


def test_the_steady_population_is_rate_times_mean_life():
    sim = simulate(emitter(rate=5000.0, lifetime={"mean": 0.8, "spread": 0.5}))
    sim.run(1.5)
    counts = [frame["p"].count for frame in sim.frames(120)]
    # births are spread evenly, so that the number alive strays by the lives only: a variance below rate · spread of life
    assert np.mean(counts) == pytest.approx(4000.0, abs=4 * np.sqrt(5000 * 0.5))


def test_births_lie_evenly_within_the_frame_and_leave_no_rings():
    """A fast emitter: the moments of birth, as fractions of a frame, pass χ² against the uniform law, coarse and fine."""
    sim = simulate(emitter(rate=60_000.0), substeps=1)
    phases = []
    for frame in sim.frames(9):
        p = frame["p"]
        phases.append(1.0 - 60.0 * p.age[p.age < 1 / 60 - 1e-7])
    phases = np.concatenate(phases)
    assert 8_900 < len(phases) <= 9_000 and phases.min() >= 0.0 and phases.max() <= 1.0
    fine = np.sort(phases * 1000 % 1.0)  # the place within one of the 1000 strata of a frame
    for bins, sample in ((50, phases), (50, fine)):
        observed, _ = np.histogram(sample, bins=bins, range=(0.0, 1.0))
        chi2 = ((observed - len(sample) / bins) ** 2 / (len(sample) / bins)).sum()
        assert chi2 < 49 + 4 * np.sqrt(2 * 49)  # strata make the coarse one smaller than chance, never larger


def test_a_stream_has_no_gaps_in_space():
    """A jet of constant speed: distances from the nozzle are uniform, so that no ring shows at a frame's boundary."""
    jet = emitter(rate=30_000.0, velocity={"direction": [1, 0, 0], "speed": 60.0}, lifetime=0.2)
    sim = simulate(jet, substeps=1, capacity=20_000)
    sim.run(0.3)
    x = state(sim)[0][:, 0]
    observed, _ = np.histogram(x, bins=120, range=(0.0, 12.0))  # 12 m of jet, 50 particles in each decimeter, 10 bins per frame
    assert observed.min() > 45 and observed.max() < 55  # strata of 1/500 frame: at most one more or less at each end of a bin, doubled


def test_a_rate_without_bound_is_refused_not_forgotten():
    """Infinite before t = 0.5, then finite: counted as refused meanwhile, and births go on afterwards."""
    pole = {"mean": {"expression": "100/floor(2*t)"}}
    sim = simulate(emitter(rate=pole, lifetime=0.2), capacity=100)
    sim.run(0.3)
    assert sim.statistics()["p"]["live"] == 100 and sim.statistics()["p"]["refused"] > 1e9
    sim.run(1.1)
    assert 9 <= sim.statistics()["p"]["live"] <= 11


# ---- exact moments


@pytest.mark.parametrize("fps", [24, 30, 50, 60, 29.97])
def test_a_life_of_one_second_is_in_exactly_the_frames_of_one_second(fps):
    sim = simulate(emitter(1, lifetime=1.0), fps=fps)
    assert sim.frame()["p"].count == 1, "born at 0 is in frame 0"
    last = int(np.ceil(fps - 1e-9)) - 1  # the last k with k/fps < 1
    sim.seek(last)
    assert sim.frame()["p"].count == 1
    sim.step_frame()
    assert sim.frame()["p"].count == 0


def test_a_burst_at_zero_moves_in_the_first_step():
    sim = simulate(start(velocity=(6.0, 0, 0)))
    assert state(sim)[0][0, 0] == 0.0
    sim.step_frame()
    assert state(sim)[0][0, 0] == pytest.approx(0.1, rel=1e-6)


def test_ages_tell_the_moment_of_birth():
    """Births on a list of moments: at frame k each is k/fps − moment old, and has moved for so long."""
    moments = [0.0, 0.003, 1 / 60, 0.05001, 0.0721, 0.1]
    bursts = [{"count": 1, "at": at} for at in moments]
    sim = simulate(emitter(burst=bursts, velocity={"direction": [1, 0, 0], "speed": 2.0}), substeps=3)
    for frame in sim.frames(12):
        born = [at for at in moments if at <= frame.time + 1e-12]
        p = frame["p"]
        assert np.sort(p.age)[::-1] == pytest.approx([frame.time - at for at in born], abs=1e-7)
        assert np.sort(p.position[:, 0])[::-1] == pytest.approx([2.0 * (frame.time - at) for at in born], abs=1e-6)


def test_death_is_at_its_exact_moment_too():
    """One that lives 0.4 of a frame is in no frame, whatever is born beside it."""
    sim = simulate(emitter(rate=600.0, lifetime=0.4 / 60), substeps=4)
    sim.run(1.0)
    counts = [frame["p"].count for frame in sim.frames(60)]
    assert np.mean(counts) == pytest.approx(4.0, abs=0.3) and max(counts) <= 5  # of the frame's 10 births the last 0.4


@pytest.mark.parametrize("prewarm", [0.5, 0.505])
def test_prewarm_starts_the_clock_earlier(prewarm):
    sim = simulate(emitter(rate=1000.0), emitter(1, at=-0.4), emitter(1, at=-2.0), prewarm=prewarm)
    frame = sim.frame()
    assert frame.index == 0 and frame.time == 0.0
    ages = np.sort(frame["p"].age)
    assert abs(len(ages) - (1000 * prewarm + 1)) <= 1, "the burst before the beginning never happens"
    assert ages[-1] <= prewarm + 1e-6 and np.abs(ages - 0.4).min() < 1e-6


def test_start_and_stop_bound_the_rate():
    sim = simulate(emitter(rate=3000.0, start=0.1, stop=0.255))
    sim.run(0.5)
    born = 0.5 - np.sort(sim.frame()["p"].age)[::-1].astype(float)
    assert len(born) == 465 and born[0] >= 0.1 - 1e-6 and born[-1] <= 0.255 + 1e-6


@pytest.mark.parametrize("interval", [1 / 240, 0.13])
def test_intervals_shorter_and_longer_than_a_frame(interval):
    """One z per interval: the births of each interval are its own number, spread evenly over it."""
    sim = simulate(emitter(rate={"mean": 3000.0, "spread": 3000.0, "interval": interval}))
    sim.run(2.6)
    born = 2.6 - np.sort(sim.frame()["p"].age)[::-1].astype(float)
    number = np.floor(born / interval - 1e-6).astype(int)
    counts = np.bincount(number)[:-1] if interval > 0.1 else np.bincount(number)
    assert len(counts) >= 19 and counts.max() <= 6000 * interval + 1.001
    assert counts.std() > 0.3 * 3000 * interval, "the intervals differ"
    for k in np.flatnonzero(counts > 50):
        phase = np.sort(born[number == k] / interval - k)
        even = (np.arange(len(phase)) + 0.5) / len(phase)
        assert np.abs(phase - even).max() < 0.6 / len(phase) + 1e-4


def test_a_rate_follows_its_curve():
    ramp = {"mean": {"keyframes": [[0.0, 0.0], [1.0, 4000.0]]}}
    total = np.cumsum(births_per_frame(ramp, frames=60))
    t = np.arange(1, 61) / 60
    assert np.abs(total - 2000 * t**2).max() <= 1.0


# ---- identity


def births_of(sim) -> dict[int, tuple]:
    """Initial values by id: with no gravity and no flow, velocity, mass, radius and life stay as they were."""
    p = sim.frame()["p"]
    values = np.column_stack([p.velocity, p.mass, p.radius, p.lifetime])
    origin = p.position.astype(float) - p.velocity * p.age[:, None].astype(float)
    return {int(i): (v, o) for i, v, o in zip(p.id, values, origin, strict=True)}


CLOUD = emitter(
    rate={"mean": 30_000.0, "spread": 10_000.0, "interval": 0.1},
    shape={"type": "sphere", "radius": 1.0},
    velocity={"cone": 120, "speed": {"mean": 1.0, "spread": 0.5}},
    lifetime={"mean": 50.0, "spread": 10.0},
    mass={"mean": 1.0, "spread": 0.1},
    radius={"mean": 0.1, "spread": 0.05},
)


def test_initial_values_do_not_depend_on_capacity_or_frame_rate():
    runs = [
        Simulation(scene(CLOUD, capacity=capacity, fps=fps, substeps=1), device="cpu", threads=1)
        for capacity, fps in ((1_000_000, 60), (10_000, 60), (1_000_000, 30))
    ]
    for sim in runs:
        sim.run(0.7)
    full, small, slow = (births_of(sim) for sim in runs)
    statistics = [sim.statistics()["p"] for sim in runs]
    assert statistics[1]["live"] == 10_000 and statistics[1]["refused"] == len(full) - 10_000 and len(full) == len(slow) > 15_000
    for other in (small, slow):
        for identity, (values, origin) in other.items():
            assert np.array_equal(values, full[identity][0])
            assert np.abs(origin - full[identity][1]).max() < 5e-6  # the same point, moved there and back by rounded steps


def test_systems_and_emitters_do_not_disturb_each_other():
    alone = scene(CLOUD)
    more = scene(CLOUD, emitter(rate=100.0, velocity={"speed": 1.0}))
    other = more.model_dump(by_alias=True)
    other["systems"] = {"before": other["systems"]["p"], **other["systems"]}
    first, second, third = (Simulation(s, device="cpu", threads=1) for s in (alone, more, type(more).model_validate(other)))
    for sim in (first, second, third):
        sim.run(0.2)
    assert second.state_hash() != first.state_hash()
    kept = first.frame()["p"].velocity
    assert {v.tobytes() for v in kept} <= {v.tobytes() for v in second.frame()["p"].velocity}
    assert np.array_equal(second.frame()["p"].velocity, third.frame()["p"].velocity)
    assert not np.array_equal(third.frame()["before"].velocity, third.frame()["p"].velocity)


# ---- shapes and directions


def sample(shape=None, count=100_000, **keys) -> tuple[np.ndarray, np.ndarray]:
    still = emitter(count, shape=shape or {"type": "point"}, **keys)
    return state(Simulation(scene(still, capacity=count), device="cpu", threads=1))


def chi2_of(values: np.ndarray, bins=64) -> None:
    """Assert that values in [0, 1] are uniform."""
    observed, _ = np.histogram(values, bins=bins, range=(0.0, 1.0))
    assert observed.sum() == len(values), "all lie in [0, 1]"
    expected = len(values) / bins
    chi2 = ((observed - expected) ** 2 / expected).sum()
    assert abs(chi2 - (bins - 1)) < 4 * np.sqrt(2 * (bins - 1))


@pytest.mark.parametrize("fill", ["volume", "surface"])
def test_spheres_and_discs_are_filled_evenly(fill):
    x, _ = sample({"type": "sphere", "center": [1, 2, 3], "radius": 2.0, "fill": fill})
    d = (x - [1, 2, 3]) / 2.0
    r = np.linalg.norm(d, axis=1)
    chi2_of(np.minimum(r**3, 1.0)) if fill == "volume" else np.testing.assert_allclose(r, 1.0, atol=1e-6)
    for axis in range(3):
        chi2_of(np.clip(0.5 + 0.5 * d[:, axis] / r, 0, 1))  # Archimedes: each coordinate of the direction is uniform
    x, _ = sample({"type": "disc", "center": [1, 2, 3], "normal": [1, 1, 1], "radius": 2.0, "fill": fill})
    d = (x - [1, 2, 3]) / 2.0
    assert np.abs(d @ np.ones(3)).max() < 2e-6
    r = np.linalg.norm(d, axis=1)
    chi2_of(np.minimum(r**2, 1.0)) if fill == "volume" else np.testing.assert_allclose(r, 1.0, atol=1e-6)
    first, second = np.array([1, -1, 0]) / np.sqrt(2), np.array([1, 1, -2]) / np.sqrt(6)
    chi2_of((np.arctan2(d @ second, d @ first) / (2 * np.pi)) % 1.0)


def test_segments_and_boxes_are_filled_evenly():
    x, _ = sample({"type": "segment", "start": [1, 0, 0], "end": [1, 4, 2]})
    chi2_of(x[:, 1] / 4)
    assert np.abs(x[:, 2] - x[:, 1] / 2).max() < 1e-6 and (x[:, 0] == 1).all()
    x, _ = sample({"type": "box", "center": [0, 1, 0], "size": [1, 2, 4]})
    for axis, (low, size) in enumerate(((-0.5, 1), (0.0, 2), (-2.0, 4))):
        chi2_of((x[:, axis] - low) / size)


def test_the_faces_of_a_box_get_their_share_by_area():
    x, _ = sample({"type": "box", "center": [0, 0, 0], "size": [1, 2, 4], "fill": "surface"})
    on = np.abs(np.abs(x) - [0.5, 1, 2]) < 1e-6
    assert (on.sum(axis=1) >= 1).all()
    areas = np.array([8.0, 4.0, 2.0]) / 14.0
    assert on.mean(axis=0) == pytest.approx(areas, abs=4 * np.sqrt(0.25 / len(x)))
    assert (x[on[:, 0]][:, 0] > 0).mean() == pytest.approx(0.5, abs=0.01)


@pytest.mark.parametrize("cone", [0, 25, 90, 180])
def test_directions_fill_the_cone_per_solid_angle(cone):
    axis = np.array([1.0, 2.0, -2.0]) / 3.0
    _, v = sample(velocity={"direction": [1, 2, -2], "cone": cone, "speed": {"mean": 3.0, "spread": 1.0}})
    speed = np.linalg.norm(v, axis=1)
    chi2_of(np.clip((speed - 2.0) / 2.0, 0, 1))
    cosine = (v / speed[:, None]) @ axis
    if cone == 0:
        assert cosine.min() > 1 - 1e-6
        return
    least = np.cos(np.radians(cone))
    chi2_of(np.clip((cosine - least) / (1 - least), 0, 1))
    across = v / speed[:, None] - np.outer(cosine, axis)
    first = np.cross(axis, [0, 0, 1]) / np.linalg.norm(np.cross(axis, [0, 0, 1]))
    chi2_of((np.arctan2(across @ np.cross(axis, first), across @ first) / (2 * np.pi)) % 1.0)


def test_neighbors_and_quantities_are_not_correlated():
    """Correlation of n independent pairs strays by 1/√n; six quantities of one particle, and each with the next particle's."""
    still = emitter(100_000, shape={"type": "box", "size": [1, 1, 1]}, velocity={"cone": 180, "speed": {"mean": 2, "spread": 1}})
    still |= {"mass": {"mean": 1, "spread": 0.5}, "radius": {"mean": 1, "spread": 0.5}, "lifetime": {"mean": 9, "spread": 3}}
    p = Simulation(scene(still, capacity=100_000), device="cpu", threads=1).frame()["p"]
    speed = np.linalg.norm(p.velocity, axis=1)
    columns = np.column_stack([p.position, p.velocity[:, 0] / speed, speed, p.mass, p.radius, p.lifetime]).astype(float)
    for other in (columns, np.roll(columns, 1, axis=0), np.roll(columns, 256, axis=0)):
        correlation = np.corrcoef(columns.T, other.T)[:8, 8:]
        if other is columns:
            correlation = correlation - np.eye(8)
        assert np.abs(correlation).max() < 4.5 / np.sqrt(len(columns))
