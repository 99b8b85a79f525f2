"""Pair forces against their twin by brute force, law by law; and their bits, by every way of running."""

import numpy as np
import pytest
import warp as wp

from tests.kernels.gathering import clouds, gather
from tests.kernels.test_bits import emitters, hash_of
from tests.physics.scenes import scene
from tests.reference import pairwise as twin
from tests.reference.pairwise import Pair, pair_forces
from warpsim.environment import law_row
from warpsim.kernels import pairwise, pairwise_loops
from warpsim.launch import Stage
from warpsim.scene.forces import PAIR_SOLVERS, Pairwise
from warpsim.signals import SignalTable

REACH = 0.37
CLOUDS = ["none", "one", "two", "three", "uniform", "clustered", "sheet", "line", "sparse", "borders", "one cell", "a block"]


def rows_of(pairs: list[Pair], device: str) -> wp.array:
    """The laws as a table of one moment."""
    rows = []
    for pair in pairs:
        row = law_row(Pairwise(law=pair.law, radius=pair.radius, softening=pair.softening, strength=pair.strength), SignalTable())
        row.strength = wp.vec3(pair.strength, 0.0, 0.0)
        rows.append(row)
    return wp.array(rows, dtype=pairwise.PairLaw, device=device).reshape((1, len(rows)))


def accelerations(pairs: list[Pair], points: np.ndarray, device="cpu", **way) -> np.ndarray:
    """What the stages make of the points, (n, 3) float32; all have 1 kg."""
    internal = wp.full((3, -(-max(len(points), 1) // 64) * 64), float("nan"), dtype=float, device=device)

    def accumulate(neighbors):
        inputs = (0, neighbors.population.counters, rows_of(pairs, device), neighbors.grid, neighbors.sorted)
        inputs += (neighbors.population.field("mass"), internal)
        return [Stage("pairs", pairwise.accumulate_pairs, internal.shape[1], inputs, pairwise_loops.accumulate_pairs)]

    gather(points, max(pair.radius for pair in pairs), device, more=accumulate, **way)
    return internal.numpy()[:, : len(points)].T


def sizes(pairs: list[Pair], x: np.ndarray) -> np.ndarray:
    """Sum of the sizes of what acts on each, to which rounding is in proportion."""
    total = np.zeros(len(x))
    for pair in pairs:
        d, s = twin.distances(pair, np.asarray(x, float))
        np.fill_diagonal(s, np.inf)
        f = np.where(s < pair.radius, np.abs(twin.FORCES[pair.law](pair.strength, np.minimum(s, pair.radius), pair.radius)), 0.0)
        total += (f * np.linalg.norm(d, axis=2) / s).sum(axis=1)
    return total


def test_every_law_has_a_twin_and_a_word():
    assert set(twin.FORCES) == set(twin.POTENTIALS) == set(pairwise.PAIR_LAWS)
    assert set(pairwise.PAIR_LAWS) == set(Pairwise.model_fields["law"].annotation.__args__)


@pytest.mark.parametrize("law", twin.FORCES)
def test_a_force_is_the_slope_of_its_potential_and_its_window_ends_smoothly(law):
    """Central differences err by h²/6 f″; the roundings of U over 2h are smaller still."""
    k, r, h = -1.3, 0.7, 1e-5
    s = np.linspace(0.05, 0.69, 50)
    slope = (twin.POTENTIALS[law](k, s + h, r) - twin.POTENTIALS[law](k, s - h, r)) / (2 * h)
    np.testing.assert_allclose(slope, twin.FORCES[law](k, s, r), rtol=1e-6, atol=1e-9)
    if law in ("linear", "cosine"):
        assert abs(twin.FORCES[law](k, r, r)) < 1e-12


@pytest.mark.parametrize("name", CLOUDS)
@pytest.mark.parametrize("law", pairwise.PAIR_LAWS)
def test_forces_equal_brute_force(law, name, rng, device):
    """To 2^-24 of the terms for each of them: the sum's roundings; a dozen more in each term, x_j − x_i being exact or rounded once."""
    points = clouds(rng, REACH)[name]
    pairs = [Pair(-1.7, REACH, law, 0.02)]
    exact, size = pair_forces(pairs, points), sizes(pairs, points)
    d, s = twin.distances(pairs[0], points.astype(float))
    edge = (
        (np.abs(s - REACH) < 1e-6 * REACH).any(axis=1) if law in ("constant", "inverse_square", "spring") else np.zeros(len(points), bool)
    )
    got = accelerations(pairs, points, device)
    assert np.isfinite(got).all()
    error = np.linalg.norm(got - exact, axis=1)[~edge]
    # near R two terms cancel, and cos_turns errs by 2.5e-7: of k, whatever is left; 1e-45 away from zero it rounds like an integer
    absolute = 3e-7 * 1.7 if law in ("linear", "cosine") else 1e-44
    count = (s < REACH).sum(axis=1)[~edge]
    assert (error <= (12 + count) * 2.0**-24 * size[~edge] + absolute * count).all()
    if len(points) > 1000 and name != "sparse":
        assert size.min() >= 0.0 and (size > 0).mean() > 0.9, "there was something to compare"


def test_laws_of_several_radii_add_up(rng, device):
    points = clouds(rng, REACH)["uniform"]
    pairs = [Pair(2.0, REACH, "constant", 0.02), Pair(-5.0, 0.5 * REACH, "cosine", 0.0), Pair(-0.3, 0.8 * REACH, "inverse_square", 0.05)]
    got, exact = accelerations(pairs, points, device), pair_forces(pairs, points)
    count = sum((twin.distances(pair, points.astype(float))[1] < pair.radius).sum(axis=1) for pair in pairs)
    tolerance = (12 + count) * 2.0**-24 * sizes(pairs, points) + 3e-7 * 5.0 * count
    assert (np.linalg.norm(got - exact, axis=1) <= tolerance).all()


@pytest.mark.parametrize("law", pairwise.PAIR_LAWS)
@pytest.mark.parametrize("softening", [0.0, 1e-3])
def test_coincident_particles_feel_nothing_and_near_ones_something_finite(law, softening, device):
    points = np.array([[1.0, 2.0, 3.0], [1.0, 2.0, 3.0], [0.0, 0.0, 0.0], [1e-20, 0.0, 0.0], [0.0, 1e-11, 0.0]])
    got = accelerations([Pair(1e12, REACH, law, softening)], points, device)
    assert np.isfinite(got).all() and (got[:2] == 0.0).all()
    only = accelerations([Pair(1e12, REACH, law, softening)], points[:1], device)
    assert (only == 0.0).all()


@pytest.mark.parametrize("law", pairwise.PAIR_LAWS)
def test_action_is_reaction_to_the_last_bit(law, rng, device):
    """Of two particles the forces are the same number with the other sign."""
    for _ in range(20):
        points = rng.normal(size=(2, 3)) * 0.1 + 100 * rng.normal(size=3)
        got = accelerations([Pair(-1.7, 1.0, law)], points, device)
        assert (got[0] == -got[1]).all() and (got[0] != 0.0).any()


@pytest.mark.parametrize("name", [*CLOUDS, "far", "beyond", "one point"])
def test_loops_and_plain_kernels_share_their_bits(name, rng):
    """Whatever the lanes, the cores and the size of the table, which decides which far cells share a bucket."""
    points = clouds(rng, REACH)[name]
    pairs = [Pair(2.0, REACH, "inverse_square", 0.02), Pair(-5.0, 0.5 * REACH, "cosine")]
    expected = accelerations(pairs, points).tobytes()
    for way in ({"native": False}, {"cores": 2}, {"cores": 3}, {"cores": 16}):
        assert accelerations(pairs, points, **way).tobytes() == expected, way


def test_strangers_far_away_change_no_bit(rng):
    points = clouds(rng, REACH)["clustered"]
    pairs = [Pair(2.0, REACH, "inverse_square", 0.02)]
    alone = accelerations(pairs, points)
    crowd = np.concatenate([points, 1e4 + rng.uniform(0, 500, (9000, 3))])
    assert accelerations(pairs, crowd)[: len(points)].tobytes() == alone.tobytes()


FORCES = [
    {"type": "pairwise", "strength": {"sine": {"mean": -1e-4, "amplitude": 5e-5, "period": 0.1}}, "radius": 0.15, "law": "linear"},
    {"type": "pairwise", "strength": 1e-7, "radius": 0.3},
    {"type": "attractor", "strength": 1e-3, "law": "spring"},
]


@pytest.mark.parametrize("solver", PAIR_SOLVERS)
@pytest.mark.parametrize("live", [1, 64, 65, 1501])
def test_runs_with_births_and_deaths_share_their_bits(solver, live, monkeypatch):
    monkeypatch.setattr("warpsim.launch.PARALLEL_FROM", 0)
    keys = {"forces": FORCES, "solver": solver, "coupling": {"alpha": 1e-3}, "substeps": 3}
    document = scene(*emitters(live), capacity=live + live // 8 + 30, **keys)
    expected = hash_of(document)
    assert hash_of(document) == expected, "again"
    assert hash_of(document, native=False) == expected, "plain kernels"
    for threads in (2, 3, 5):
        assert hash_of(document, threads) == expected, threads
    roomy = scene(*emitters(live), capacity=20 * live + 1000, **keys)
    roomier = scene(*emitters(live), capacity=40 * live + 2000, **keys)
    assert hash_of(roomy) == hash_of(roomier), "the room does not matter where nobody is refused"


@pytest.mark.parametrize("solver", PAIR_SOLVERS)
def test_colliders_and_a_small_world_do_not_part_the_ways(solver, monkeypatch):
    """Who was killed in a substep, by a collider or beyond the extent, is near nobody in the next; all ways agree on it."""
    monkeypatch.setattr("warpsim.launch.PARALLEL_FROM", 0)
    floor = {"type": "plane", "center": [0, -0.6, 0], "normal": [0, 1, 0], "restitution": 0.5}
    drain = {"type": "sphere", "center": [0.3, 0, 0], "radius": 0.2, "action": "kill"}
    keys = {"forces": FORCES, "solver": solver, "substeps": 3, "gravity": (0.0, -9.81, 0.0), "limits": {"extent": 0.8, "unstable": "kill"}}
    plain = scene(*emitters(301), capacity=500, **keys)
    document = type(plain).model_validate(plain.model_dump(by_alias=True) | {"colliders": [floor, drain]})
    expected = hash_of(document)
    assert (
        hash_of(document, native=False) == expected and hash_of(document, 3) == expected and hash_of(document, 3, native=False) == expected
    )
