"""Clearance of meshes: never more than the distance to the nearest triangle, and close to it; nothing on the side that is solid."""

import numpy as np
import pytest
import warp as wp

from warpsim import load_scene
from warpsim.colliders import Colliders
from warpsim.environment import SignalTable
from warpsim.kernels.clearance import mesh_clearance
from warpsim.kernels.collider import Collider


@wp.kernel
def measure_both(c: Collider, q: wp.array[wp.vec3], bound_out: wp.array[float], distance_out: wp.array[float]):
    i = wp.tid()
    near = wp.mesh_query_point_sign_parity(c.mesh, q[i], 1.0e30)
    bound_out[i] = mesh_clearance(c, q[i])
    distance_out[i] = near.sign * wp.length(q[i] - wp.mesh_eval_position(c.mesh, near.face, near.u, near.v))


@pytest.mark.parametrize("side", ["inside", "outside"])
def test_it_is_a_lower_bound_and_not_far_below(side, device, rng):
    scene = load_scene("hourglass", overrides=[f"colliders.0.side={side}"])
    solids = Colliders(scene, device)  # keeps the triangles
    (row,) = solids.rows(scene, SignalTable())
    points = np.array(row.middle) + rng.uniform(-1.2, 1.2, (20_000, 3)) * np.array(row.half)
    bound, distance = wp.zeros(len(points), dtype=float, device=device), wp.zeros(len(points), dtype=float, device=device)
    wp.launch(measure_both, len(points), [row, wp.array(points, dtype=wp.vec3, device=device), bound, distance], device=device)
    bound, distance = bound.numpy(), distance.numpy() * (-1.0 if side == "inside" else 1.0)
    boxed = (np.abs(points - np.array(row.middle)) <= np.array(row.half)).all(axis=1)
    assert (bound[boxed] <= np.maximum(distance[boxed], -0.0)).all(), "positive only where particles may be, and never too far"
    assert (bound[~boxed] <= np.abs(distance[~boxed])).all(), "beyond the box it is the box's distance, on either side"
    diagonal = np.linalg.norm(1.0 / np.array(row.cells_per_meter))
    clear = boxed & (distance > 2.0 * diagonal)
    assert clear.sum() > 100 and (bound[clear] > distance[clear] - 1.01 * diagonal).all()
