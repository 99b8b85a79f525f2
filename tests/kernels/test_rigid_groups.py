"""Rigid groups: who is in which, and the coarse matrix and its solution against dense products in float64."""

import numpy as np
import pytest

from tests.kernels.test_cloth import GRAVITY, sheet
from tests.kernels.test_implicit import springs_of
from tests.simulation.networks import simulate, tangle
from warpsim.weaves import grouped, woven

CHAIN = {"generator": {"type": "chain", "count": 130, "start": [0, 0, 0], "end": [2, 0, 0]}, "stiffness": 1e4, "mass": 0.01}


@pytest.mark.parametrize("case", ["random", "sheet", "chain"])
@pytest.mark.parametrize("count", [2, 64, 65, 200])
def test_every_point_is_in_one_group_and_every_spring_between_two_in_one_pair(case, count):
    n, springs = springs_of(case, count)
    weave, points = woven(n, springs), np.random.default_rng(count).normal(size=(n, 3))
    held = np.random.default_rng(1).random(n) < 0.1
    groups = grouped(points, weave, held, 8, 32)
    sizes = np.bincount(groups.group)
    assert len(sizes) == len(groups.center) == max(1, min(8, 2 ** int(np.log2(max(n / 32, 1))))) and np.ptp(sizes) <= 1
    assert (groups.group[groups.center] == np.arange(len(sizes))).all()
    for g in range(len(sizes)):
        mine = groups.order[groups.chunk_begin[g] : groups.chunk_begin[g + 1]]
        assert (mine[mine >= 0] == np.flatnonzero(groups.group == g)).all()
    assert groups.chunk_begin[-1] == len(groups.order)
    found = []
    for (g, h), begin, end in zip(groups.pair, groups.pair_begin, groups.pair_begin[1:], strict=False):
        for i, j, entry in groups.crossing[begin:end]:
            assert (groups.group[i], groups.group[j]) == (g, h) and (g < h or held[i] != held[j])
            assert weave.neighbor.reshape(-1)[entry] == j and 64 * np.searchsorted(weave.begin, entry // 64, "right") - 64 + entry % 64 == i
            found.append(weave.spring.reshape(-1)[entry])
    between = np.diff(groups.group[springs], axis=1)[:, 0] != 0
    assert sorted(found) == np.flatnonzero(between | (held[springs].sum(axis=1) == 1)).tolist()


def test_two_halves_lie_apart():
    """Groups are halves across the longest extent, so that neighbors are together."""
    _, springs = springs_of("chain", 128)
    points = np.stack([np.linspace(0, 1, 128), np.zeros(128), np.zeros(128)], axis=1)
    assert (np.diff(grouped(points, woven(128, springs), np.zeros(128, bool), 4, 32).group[np.argsort(points[:, 0])]) != 0).sum() == 3


def dense(system) -> tuple[np.ndarray, np.ndarray]:
    """Return the matrix of a system, but for β within groups, and Z, both in float64, from what the device has."""
    solver, n = system.solver, len(system.net.points)
    weave, groups = solver._weave, solver._groups
    begin, neighbor, spring = (getattr(weave, name).numpy() for name in ("begin", "neighbor", "spring"))
    weight, free, group = weave.weight.numpy().astype(float), weave.free.numpy()[:n] > 0, groups.group.numpy()
    matrix = np.kron(np.diag(system.particles.mass.numpy()[:n].astype(float)), np.eye(3))
    for entry in np.flatnonzero(spring >= 0):
        row, lane = divmod(entry, 64)
        i, j = 64 * (np.searchsorted(begin, row, side="right") - 1) + lane, neighbor[entry]
        w, beta = weight[row, lane:192:64], weight[row, 192 + lane]
        block = np.outer(w, w) + beta * np.eye(3) * (group[i] != group[j] or not (free[i] and free[j]))
        matrix[3 * i : 3 * i + 3, 3 * i : 3 * i + 3] += block
        matrix[3 * i : 3 * i + 3, 3 * j : 3 * j + 3] -= block
    offset, lift = groups.offset.numpy().astype(float), np.zeros((3 * n, 6 * groups.center.shape[0]))
    for i in np.flatnonzero(free):
        x, y, z = offset[:, i]
        lift[3 * i : 3 * i + 3, 6 * group[i] : 6 * group[i] + 6] = np.hstack([np.eye(3), [[0, z, -y], [-z, 0, x], [y, -x, 0]]])
    return matrix, lift


@pytest.mark.parametrize(
    "keys",
    [tangle(200, 600), tangle(200, 600) | {"pins": [0, 7, 100]}, sheet(20, 15, pins=["left"]), CHAIN | {"pins": ["start"]}, tangle(9, 15)],
    ids=["tangle", "pinned tangle", "sheet", "straight chain", "few"],
)
def test_the_coarse_matrix_and_its_solution_are_those_of_dense_products(keys, device):
    """float64 throughout, but for the solution's last rounding. What adds nothing, as the turn of a line about itself, is left out."""
    system = simulate(**keys, solver="implicit_euler", gravity=GRAVITY, device=device)
    for _ in range(20 if "generator" not in keys else 0):
        system.step_frame()
    system.step_frame()
    system = system.systems["s"]
    groups = system.solver._groups
    matrix, lift = dense(system)
    factor = np.tril(groups.matrix.numpy())
    kept = np.diag(factor) > 0
    expected = lift.T @ matrix @ lift
    # Within a group a spring does not resist turning but for rounding of w in float32, which the device leaves out and the product has.
    grain = 1e-6 * np.sqrt(np.outer(np.diag(expected), np.diag(expected))) + 1e-12 * np.abs(expected).max()
    assert (np.abs(factor @ factor.T - expected)[np.ix_(kept, kept)] < grain[np.ix_(kept, kept)]).all()
    assert kept.sum() >= len(kept) - 2 * groups.center.shape[0] - 6 * (groups.center.shape[0] == 1)
    residual = system.solver._linear.residual.numpy()[:, : len(system.net.points)].T.reshape(-1).astype(float)
    load = lift.T @ residual
    solution = np.zeros(len(kept))
    solution[kept] = np.linalg.solve((factor @ factor.T)[np.ix_(kept, kept)], load[kept])
    found = groups.lift.numpy().T.reshape(-1)
    assert found == pytest.approx(solution, abs=1e-6 * np.abs(solution).max() + 1e-30)
    lengths = [
        np.linalg.norm(system.solver._linear.scaled.numpy().astype(float)) ** 2 + load @ solution,
        system.solver._search.square.numpy()[0],
    ]
    assert lengths[0] == pytest.approx(lengths[1], rel=1e-6, abs=1e-30)


def test_what_falls_together_falls_in_time_however_early_iterations_end():
    """A stiff sheet swings down from the horizontal: with 40 iterations it is where it is with as many as it takes, to 2 % of the way."""
    keys = {"edges": [[1, 0, 0], [0, 0, 1]], "pins": ["left"], "gravity": (0, -9.81, 0), "solver": "implicit_euler"}
    kinds = {kind: {"stiffness": 1e5} for kind in ("structural", "shear")} | {"bend": {"stiffness": 10.0}}
    ends = []
    for iterations in (40, 2000):
        sim = simulate(**(sheet(24, 24) | keys | kinds), iterations=iterations)
        sim.run(0.3)
        ends.append(sim.frame()["s"].position[:, 1].astype(float))
    assert ends[1].min() < -0.3 and np.abs(ends[0] - ends[1]).max() < 0.02 * np.abs(ends[1]).max()
