"""Flocks for tests: one system `f`, whose start is written to a file as a user would write it."""

import numpy as np
import warp as wp

import warpsim
from warpsim.kernels.domain import cell_in, fold, layout_in, run_in
from warpsim.kernels.flock import Crowd, Rules, attends, counts, everybody, find_horizon, view_limit
from warpsim.kernels.grid import FINE

FLAT = {"min": [-1e3, -1e3, -1e3], "max": [1e3, 1e3, 1e3]}


def flock(folder, x, v=None, more=None, fps=60, substeps=1, gravity=(0, 0, 0), **system) -> warpsim.Scene:
    """A scene of one flock that starts at x with velocities v."""
    v = np.zeros_like(x) if v is None else v
    path = folder / f"start{len(list(folder.iterdir()))}.npz"
    np.savez(path, position=np.asarray(x, np.float32).reshape(-1, 3), velocity=np.asarray(v, np.float32).reshape(-1, 3))
    keys = {"type": "flock", "count": len(x), "domain": FLAT, "perception": {"radius": 1.0}, "start": {"file": str(path)}, **system}
    document = {"name": "flock", "time": {"fps": fps, "substeps": substeps}, "gravity": list(gravity), **(more or {})}
    return warpsim.Scene.model_validate(document | {"systems": {"f": keys}})


@wp.kernel(module="unique")
def note_neighbors(first: int, rules: wp.array[Rules], crowd: Crowd, found_out: wp.array2d[int], met_out: wp.array[int]):
    """Note whom the boid at each place has for neighbors, in the order in which they are met."""
    k = first + wp.tid()
    domain = crowd.domain[0]
    layout = layout_in(crowd.grid, crowd.count, domain)
    if k >= crowd.grid.begin[int(layout.mask) + 1]:
        return
    x = wp.vec3(crowd.sorted[0, k], crowd.sorted[1, k], crowd.sorted[2, k])
    v = wp.vec3(crowd.sorted[3, k], crowd.sorted[4, k], crowd.sorted[5, k])
    i = crowd.grid.order[k]
    rule = rules[0]
    last = everybody()
    if rule.nearest > 0:
        last = find_horizon(k, 1, rule, crowd, crowd, cell_in(x, domain, layout), layout)
    met_out[i] = 0
    for part in range(18):
        ends = run_in(crowd.grid, cell_in(x, domain, layout), part // 2, 2 * FINE + 1, part % 2, domain, layout)
        for j in range(ends[0], ends[1]):
            d = fold(wp.vec3(crowd.sorted[0, j], crowd.sorted[1, j], crowd.sorted[2, j]) - x, domain)
            m = attends(wp.dot(d, d), wp.dot(d, v), view_limit(rule.cosine, wp.dot(v, v)), rule.reach2)
            if m * counts(wp.dot(d, d), crowd.grid.order[j], last.d2, last.number) > 0.0 and j != k:
                found_out[i, met_out[i]] = crowd.grid.order[j]
                met_out[i] = met_out[i] + 1


def found_neighbors(sim) -> list[list[int]]:
    """Return whom each boid of `f` has for neighbors by the grid, in the order in which they are met."""
    system = sim.systems["f"]
    count, device, rules = system.point_count, system.device, system._attention["f"]._rules
    found = wp.full((max(count, 1), max(4 * count, 1)), -1, dtype=int, device=device)
    met = wp.zeros(max(count, 1), dtype=int, device=device)
    if count:
        wp.launch(note_neighbors, count, [0, rules, system.crowd.row, found, met], device=device)
    return [list(map(int, row[:n])) for row, n in zip(found.numpy(), met.numpy(), strict=True)][:count]
