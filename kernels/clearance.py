"""Clearance: how far a point is from one collider, in the collider's own frame, and within which distance it counts as touching.

Symbols: q the point [m]; g the gap, the distance to the surface, negative inside what is solid [m]; n the unit normal, toward the free
side. The registry CLEARANCES numbers the shapes. For a mesh a lower bound of the distance is that to the box round it or, within the
box, that of the cell in which the point is: from the cell's middle to the nearest triangle, less half the cell's diagonal.
"""

import warp as wp

from warpsim.kernels.collider import BOX, CAPSULE, PLANE, SPHERE, Collider

NEVER = wp.constant(1.0e30)  # [s], and as a distance beyond all [m]
SKIN = wp.constant(3.814697265625e-06)  # 2^-18: the skin relative to the coordinates, 64 roundings of them


@wp.struct
class Gap:
    g: float  # [m]
    n: wp.vec3


@wp.func
def axis_point(c: Collider, q: wp.vec3) -> wp.vec3:
    """Return the point of a capsule's axis nearest to q; the center of a sphere."""
    return c.axis * wp.clamp(wp.dot(q, c.axis) / wp.max(wp.dot(c.axis, c.axis), 1.0e-20), -1.0, 1.0)


@wp.func(inline=True)
def box_distance(q: wp.vec3, half: wp.vec3) -> float:
    """Return the signed distance to the box [-half, half].  Source: Quilez 2008."""
    x = wp.abs(q[0]) - half[0]
    y = wp.abs(q[1]) - half[1]
    z = wp.abs(q[2]) - half[2]
    px = wp.max(x, 0.0)
    py = wp.max(y, 0.0)
    pz = wp.max(z, 0.0)
    return wp.sqrt(px * px + py * py + pz * pz) + wp.min(wp.max(wp.max(x, y), z), 0.0)


@wp.func(inline=True)
def plane_clearance(c: Collider, q: wp.vec3) -> float:
    """Return g = n·q − r, r what is kept from it."""
    return wp.dot(c.axis, q) - c.radius


@wp.func(inline=True)
def sphere_clearance(c: Collider, q: wp.vec3) -> float:
    """Return g = ±(|q| − r), positive where particles may be."""
    g = wp.sqrt(wp.dot(q, q)) - c.radius
    return wp.where(c.inside == 1, -g, g)


@wp.func(inline=True)
def box_clearance(c: Collider, q: wp.vec3) -> float:
    """Return the signed distance to the box, positive where particles may be."""
    g = box_distance(q, c.half)
    return wp.where(c.inside == 1, -g, g)


@wp.func(inline=True)
def capsule_clearance(c: Collider, q: wp.vec3) -> float:
    """Return g = ±(|q − s| − r), s the nearest point of the axis."""
    share = wp.clamp(wp.dot(q, c.axis) / wp.max(wp.dot(c.axis, c.axis), 1.0e-20), -1.0, 1.0)
    d = q - c.axis * share
    g = wp.sqrt(wp.dot(d, d)) - c.radius
    return wp.where(c.inside == 1, -g, g)


@wp.func(inline=True)
def cell_of(p: float, counts: int, per_cell: float) -> int:
    """Return the number of the cell, 0 … counts − 1, in which a place p from the box's corner lies [m]; per_cell [1/m]."""
    return wp.clamp(int(p * per_cell), 0, counts - 1)


@wp.func(inline=True)
def mesh_clearance(c: Collider, q: wp.vec3) -> float:
    """Return what the box round the mesh, or the cell of the box, says of the distance to the triangles, less half a sheet's thickness."""
    d = q - c.middle
    i = cell_of(d[0] + c.half[0], c.cells[0], c.cells_per_meter[0])
    j = cell_of(d[1] + c.half[1], c.cells[1], c.cells_per_meter[1])
    k = cell_of(d[2] + c.half[2], c.cells[2], c.cells_per_meter[2])
    g = box_distance(d, c.half)
    return wp.where(g > 0.0, g, c.clearance[(i * c.cells[1] + j) * c.cells[2] + k]) - c.radius


@wp.func(inline=True)
def skin_of(c: Collider, x: wp.vec3) -> float:
    """Return the distance within which a point at x counts as touching [m]: 64 roundings of the coordinates."""
    return SKIN * (wp.max(wp.abs(x)) + wp.max(wp.abs(c.center)) + c.reach)


CLEARANCES = {  # kind -> lower bound of the distance to its surface, negative where it says nothing or inside
    "plane": plane_clearance,
    "sphere": sphere_clearance,
    "box": box_clearance,
    "capsule": capsule_clearance,
    "mesh": mesh_clearance,
}


@wp.func
def measure_clearance(c: Collider, q: wp.vec3) -> float:
    """Return the clearance of a collider of any kind."""
    if c.kind == PLANE:
        return plane_clearance(c, q)
    if c.kind == SPHERE:
        return sphere_clearance(c, q)
    if c.kind == BOX:
        return box_clearance(c, q)
    if c.kind == CAPSULE:
        return capsule_clearance(c, q)
    return mesh_clearance(c, q)


@wp.func
def box_gap(c: Collider, q: wp.vec3) -> Gap:
    """Return the gap to the box and the direction from its nearest point."""
    gap = Gap()
    gap.g = box_distance(q, c.half)
    d = wp.vec3()
    largest = float(-NEVER)
    nearest = int(0)
    for i in range(3):
        beyond = wp.abs(q[i]) - c.half[i]
        d[i] = wp.sign(q[i]) * wp.max(beyond, 0.0)
        if beyond > largest:
            largest = beyond
            nearest = i
    if largest > 0.0:
        gap.n = d / gap.g
    else:
        gap.n[nearest] = wp.where(q[nearest] < 0.0, -1.0, 1.0)
    return gap


@wp.func
def measure_gap(c: Collider, q: wp.vec3) -> Gap:
    """Return the gap and the normal at the nearest point of any collider but a mesh."""
    gap = Gap()
    if c.kind == PLANE:
        gap.g = wp.dot(c.axis, q) - c.radius
        gap.n = c.axis
        return gap
    if c.kind == BOX:
        gap = box_gap(c, q)
    else:
        d = q - axis_point(c, q)
        length = wp.length(d)
        gap.g = length - c.radius
        gap.n = wp.vec3(0.0, 1.0, 0.0)
        if length > 0.0:
            gap.n = d / length
    if c.inside == 1:
        gap.g = -gap.g
        gap.n = -gap.n
    return gap


@wp.func(inline=False)
def measure_mesh_gap(c: Collider, q: wp.vec3, skin: float, newborn: int) -> Gap:
    """Return the gap and the normal at the nearest triangle within the skin; of a newborn's also from deep inside a solid."""
    gap = Gap()
    gap.g = NEVER
    near = wp.mesh_query_point_no_sign(c.mesh, q, c.radius + skin)
    if near.result:
        d = q - wp.mesh_eval_position(c.mesh, near.face, near.u, near.v)
        gap.n = wp.mesh_eval_face_normal(c.mesh, near.face)
        if c.inside == 1 or (c.radius > 0.0 and wp.dot(gap.n, d) < 0.0):  # a sheet's free side is the one where the point is
            gap.n = -gap.n
        gap.g = wp.dot(gap.n, d) - c.radius
    elif newborn == 1 and c.radius == 0.0:
        deep = wp.mesh_query_point_sign_parity(c.mesh, q, NEVER)
        if deep.result and (deep.sign < 0.0) != (c.inside == 1):
            d = q - wp.mesh_eval_position(c.mesh, deep.face, deep.u, deep.v)
            gap.g = -wp.length(d)
            gap.n = d / gap.g
    return gap


@wp.kernel(enable_backward=False)
def measure_cells(first: int, c: Collider, cell: wp.vec3, clearance_out: wp.array[float]):
    """Fill the clearance of one cell of a mesh's box, cell [m] large; of a solid's only where the whole cell is on the free side."""
    n = first + wp.tid()
    i = n // (c.cells[1] * c.cells[2])
    j = n // c.cells[2] % c.cells[1]
    k = n % c.cells[2]
    x = (float(i) + 0.5) * cell[0]
    y = (float(j) + 0.5) * cell[1]
    z = (float(k) + 0.5) * cell[2]
    q = c.middle - c.half + wp.vec3(x, y, z)
    clearance_out[n] = -1.0
    near = wp.mesh_query_point_sign_parity(c.mesh, q, 1.0e30)
    if near.result and (c.radius > 0.0 or (near.sign < 0.0) == (c.inside == 1)):
        distance = wp.length(q - wp.mesh_eval_position(c.mesh, near.face, near.u, near.v))
        clearance_out[n] = distance * 0.9999 - 0.5001 * wp.length(cell)  # the query rounds, and so does a point's place in its cell
