"""Laws of the flow primitives, measured by the probes, which go through the functions that the particles feel.

float32 samples carry a relative rounding of about 1e-6 (some ten operations of 6e-8); integrals over thousands of points do better.
"""

import numpy as np
import pytest

from tests.physics.scenes import simulate

AXES = [(0, 0, 1), (0, 1, 0), (1, 2, -2)]
CENTER = np.array([0.3, -0.2, 0.5])


def probe(*flow):
    return simulate(flow=flow).flow


def perpendicular(axis) -> np.ndarray:
    across = np.cross(axis, [0.3, 0.5, 0.9])
    return across / np.linalg.norm(across)


def vortex(axis=(0, 0, 1), strength=1.7, model="ideal", radius=0.1):
    core = {"model": model} if model == "ideal" else {"model": model, "radius": radius}
    return {"type": "vortex", "center": CENTER.tolist(), "axis": list(axis), "circulation": strength, "core": core}


def source(axis=(0, 0, 1), strength=-0.9):
    return {"type": "source", "center": CENTER.tolist(), "axis": list(axis), "rate": strength}


@pytest.mark.parametrize("axis", AXES, ids=str)
@pytest.mark.parametrize("model", ["ideal", "rankine", "lamb_oseen", "scully"])
def test_circulation_round_a_vortex_is_its_strength(axis, model):
    flow, radius = probe(vortex(axis, 1.7, model)), 0.8
    share = radius**2 / (radius**2 + 0.1**2) if model == "scully" else 1.0  # Scully's core reaches the strength at infinity only
    along = 3.0 * np.asarray(axis) / np.linalg.norm(axis)
    assert flow.circulation(CENTER + along, axis, radius) == pytest.approx(1.7 * share, rel=1e-5)
    assert flow.circulation(CENTER, -np.asarray(axis), radius) == pytest.approx(-1.7 * share, rel=1e-5)
    if model != "scully":
        assert flow.circulation(CENTER + 0.3 * perpendicular(axis), axis, radius) == pytest.approx(1.7, rel=1e-4)  # off center
    assert abs(flow.circulation(CENTER + 2.0 * perpendicular(axis), axis, radius)) < 1.7e-4 * (20 if model == "scully" else 1)
    assert abs(flow.flux(CENTER, axis, radius)) < 1e-6


@pytest.mark.parametrize("axis", AXES, ids=str)
def test_flux_from_a_line_source_is_its_rate(axis):
    flow = probe(source(axis))
    assert flow.flux(CENTER, axis, 0.8) == pytest.approx(-0.9, rel=1e-5)
    assert flow.flux(CENTER + 0.3 * perpendicular(axis), axis, 0.8) == pytest.approx(-0.9, rel=1e-4)
    assert abs(flow.flux(CENTER + 2.0 * perpendicular(axis), axis, 0.8)) < 1e-5
    assert abs(flow.circulation(CENTER, axis, 0.8)) < 1e-6


def test_flux_from_a_point_source_is_its_rate():
    flow = probe({"type": "point_source", "center": CENTER.tolist(), "rate": 2.5})
    assert flow.flux(CENTER, radius=0.8) == pytest.approx(2.5, rel=1e-5)
    assert flow.flux(CENTER + [0.2, 0.1, -0.2], radius=0.8) == pytest.approx(2.5, rel=1e-4)
    assert abs(flow.flux(CENTER + [2.0, 0.0, 0.0], radius=0.8)) < 1e-5
    # through a disc: the share of the sphere that the disc covers, seen from the source
    height, radius = 0.5, 0.8
    share = 0.5 * (1.0 - height / np.hypot(height, radius))
    assert flow.discharge(CENTER + [0, height, 0], [0, 1, 0], radius) == pytest.approx(2.5 * share, rel=1e-5)


def test_what_has_neither_source_nor_circulation_shows_none():
    doublet = {"type": "doublet", "center": CENTER.tolist(), "axis": [0, 0, 1], "direction": [1, 0, 0], "strength": 0.7}
    wind = {"type": "uniform", "velocity": [1.0, -2.0, 0.5]}
    for primitive in (doublet, wind):
        flow = probe(primitive)
        for measured in (flow.circulation(CENTER, (0, 0, 1), 0.8), flow.flux(CENTER, (0, 0, 1), 0.8), flow.flux(CENTER, radius=0.8)):
            assert abs(measured) < 1e-5
    assert probe(wind).discharge(CENTER, [0, 1, 0], 0.8) == pytest.approx(-2.0 * np.pi * 0.64, rel=1e-6)


def test_solid_rotation_has_twice_its_angular_velocity_as_curl():
    axis = np.array([1, 2, -2]) / 3
    flow = probe({"type": "rotation", "center": CENTER.tolist(), "axis": [1, 2, -2], "angular_velocity": 1.5})
    points = np.random.default_rng(1).uniform(-2, 2, (50, 3))
    assert np.abs(flow.curl(points) - 3.0 * axis).max() < 1e-4  # rounding 3e-7 of a speed of 5 m/s over 1/64 m
    assert flow.circulation(CENTER, axis, 0.8) == pytest.approx(3.0 * np.pi * 0.64, rel=1e-5)
    assert np.abs(flow.divergence(points)).max() < 1e-4


@pytest.mark.parametrize(
    "primitive",
    [
        *(vortex((1, 2, -2), 1.7, model) for model in ("ideal", "rankine", "lamb_oseen")),  # Scully's has vorticity everywhere
        source((1, 2, -2)),
        {"type": "point_source", "center": CENTER.tolist(), "rate": 2.5},
        {"type": "doublet", "center": CENTER.tolist(), "axis": [1, 2, -2], "direction": [0, 1, 1], "strength": 0.7},
    ],
    ids=lambda p: p["type"] + p.get("core", {}).get("model", ""),
)
def test_divergence_and_curl_vanish_away_from_cores(primitive):
    rng = np.random.default_rng(2)
    points = CENTER + rng.normal(size=(400, 3)) * 1.5
    d = points - CENTER
    axis = np.array(primitive.get("axis", (0, 0, 0)), float)
    axis /= np.linalg.norm(axis) or 1.0
    points = points[np.linalg.norm(d - np.outer(d @ axis, axis), axis=1) > 0.7]
    flow = probe(primitive)
    scale = np.linalg.norm(flow.sample(points), axis=1) / (1 / 64)  # what differences of rounding errors are measured against
    # 1e-6 of rounding in each of 4 samples, weights 8/12; truncation h^4 v^(5)/30 = 6e-8/30 · 120 v/r^5 is below that at r = 0.7
    assert (np.abs(flow.divergence(points)) < 3e-6 * scale + 1e-5).all()
    assert (np.abs(flow.curl(points)) < 3e-6 * scale[:, None] + 1e-5).all()


def test_superposition_is_exact_to_rounding():
    parts = [vortex(), source((1, 2, -2)), {"type": "uniform", "velocity": [0.3, 0.1, -0.2]}, vortex((0, 1, 0), -0.4, "lamb_oseen")]
    points = np.random.default_rng(3).uniform(-3, 3, (500, 3)).astype(np.float32)
    alone = [probe(part).sample(points).astype(float) for part in parts]
    together = probe(*parts).sample(points).astype(float)
    # three additions, each rounded to half an ulp of a partial sum
    assert (np.abs(together - sum(alone)) <= 3 * 6.0e-8 * sum(np.abs(v) for v in alone)).all()


def profile(model: str, radii: np.ndarray, core=0.25, strength=2.0) -> np.ndarray:
    """Speed round the axis at distances from it."""
    points = CENTER + np.outer(radii, [1.0, 0.0, 0.0])
    return probe(vortex((0, 0, 1), strength, model, core)).sample(points)[:, 1].astype(float)


def test_lamb_oseen_peaks_where_theory_says():
    radii = np.linspace(0.9, 1.35, 4501) * 0.25
    speed = profile("lamb_oseen", radii)
    fit = np.polyfit(radii / 0.25, speed, 4)  # the top is flat to rounding: take the maximum of a smooth fit
    grid = np.linspace(1.0, 1.25, 100_001)
    top = np.polyval(fit, grid)
    assert grid[top.argmax()] == pytest.approx(1.1209064, abs=2e-3)
    assert top.max() == pytest.approx(0.6381727 * 2.0 / (2 * np.pi * 0.25), rel=1e-5)


def test_scully_peaks_at_its_core_radius_and_rankine_turns_rigidly_inside():
    radii = np.linspace(0.02, 1.0, 981)
    scully = profile("scully", radii)
    assert radii[scully.argmax()] == pytest.approx(0.25, abs=0.005) and scully.max() == pytest.approx(2.0 / (4 * np.pi * 0.25), rel=1e-5)
    rankine = profile("rankine", radii)
    inside, outside = radii < 0.249, radii > 0.251
    assert rankine[inside] == pytest.approx(2.0 * radii[inside] / (2 * np.pi * 0.25**2), rel=2e-6)
    assert rankine[outside] == pytest.approx(2.0 / (2 * np.pi * radii[outside]), rel=2e-6)


@pytest.mark.parametrize("model", ["rankine", "lamb_oseen", "scully"])
def test_a_core_is_at_rest_in_its_middle_and_smooth_near_it(model):
    radii = np.geomspace(1e-5, 1e-2, 31)
    slope = 2.0 / (2 * np.pi * 0.25**2)  # of all three models
    # from r = 1e-4 on: nearer, the rounding of the coordinates (3e-8 of 0.3 m) is what remains of r
    far = radii > 1e-4
    assert profile(model, radii)[far] / radii[far] == pytest.approx(slope, rel=3e-3)


def test_no_flow_crosses_the_doublets_cylinder():
    speed, radius, axis, along = 1.3, 0.6, np.array([1, 2, -2]) / 3, np.array([2, 1, 2]) / 3  # along is across the axis
    flow = probe(
        {"type": "uniform", "velocity": (speed * along).tolist()},
        {"type": "doublet", "center": CENTER.tolist(), "axis": axis.tolist(), "direction": along.tolist(), "strength": speed * radius**2},
    )
    side = np.cross(axis, along)
    theta = np.linspace(0, 2 * np.pi, 721)
    outward = np.outer(np.cos(theta), along) + np.outer(np.sin(theta), side)
    velocity = flow.sample(CENTER + radius * outward + 0.7 * axis).astype(float)
    assert np.abs((velocity * outward).sum(axis=1)).max() < 1e-5 * speed
    assert np.abs(np.linalg.norm(velocity, axis=1) - 2 * speed * np.abs(np.sin(theta))).max() < 1e-5 * speed
    assert np.abs(velocity[[0, 360]]).max() < 1e-5 * speed  # the stagnation points


def test_a_source_in_a_wind_has_its_stagnation_point_upstream():
    flow = probe({"type": "uniform", "velocity": [2.0, 0, 0]}, {"type": "source", "center": [0, 0, 0], "axis": [0, 0, 1], "rate": 3.0})
    distance = 3.0 / (2 * np.pi * 2.0)
    assert np.abs(flow.sample([[-distance, 0, 0]])).max() < 1e-6
    assert flow.sample([[-1.01 * distance, 0, 0]])[0, 0] > 0 > flow.sample([[-0.99 * distance, 0, 0]])[0, 0]


def test_strengths_follow_time_at_the_probe():
    flow = probe(
        {"type": "vortex", "axis": [0, 0, 1], "circulation": {"keyframes": [[1.0, 2.0], [3.0, -2.0]]}},
        {"type": "source", "axis": [0, 0, 1], "rate": {"sine": {"mean": 1.0, "amplitude": 0.5, "period": 4.0, "phase": 0.3}}},
        {"type": "point_source", "center": [50.0, 0, 0], "rate": {"expression": "exp(-t) * 2"}},
    )
    for t in (0.0, 1.0, 1.7, 2.0, 2.9, 3.0, 9.0):
        assert flow.circulation([0, 0, 0], [0, 0, 1], 1.0, time=t) == pytest.approx(np.interp(t, [1, 3], [2, -2]), abs=2e-5)
        assert flow.flux([0, 0, 0], [0, 0, 1], 1.0, time=t) == pytest.approx(1.0 + 0.5 * np.sin(2 * np.pi * t / 4 + 0.3), abs=2e-5)
        assert flow.flux([50.0, 0, 0], radius=1.0, time=t) == pytest.approx(2.0 * np.exp(-t), abs=2e-4)
