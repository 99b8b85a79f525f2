"""Planar fields: float32 (3, capacity), all x, then all y, then all z, so that a loop over particles reads whole cache lines."""

import warp as wp


@wp.func
def read3(field: wp.array2d[float], i: int) -> wp.vec3:
    """Return column i of a planar field of shape (3, capacity)."""
    return wp.vec3(field[0, i], field[1, i], field[2, i])


@wp.func
def write3(field_out: wp.array2d[float], i: int, value: wp.vec3):
    """Store a vector as column i of a planar field of shape (3, capacity)."""
    for axis in range(3):
        field_out[axis, i] = value[axis]
