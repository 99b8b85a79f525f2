"""Births on and in a mesh: uniform over its surface, or over what it encloses, from a key and an ordinal alone.

A place on the surface is a triangle chosen by area and a place in it. A place inside is drawn in one of the equal cells of a grid
that meet the inside, and drawn again until it is inside: an odd number of triangles lies ahead of it along x. Cells that share
their y and z are a column, which knows the triangles over it. In float64, so that slivers and borders are told apart; two
triangles see the edge between them alike, so nothing slips through.
"""

import warp as wp

from warpsim.kernels.random import BULK, POSITION, random_words, uniform, uniform64


@wp.struct
class MeshTable:
    corners: wp.array2d[wp.vec3]  # (triangles, 3) [m]
    areas: wp.array[wp.float64]  # (triangles) area up to and with each, as a share of the whole
    low: wp.vec3  # corner of the grid [m]
    step: wp.vec3  # size of a cell [m]
    cells: wp.array[wp.vec3i]  # those that meet the inside
    column_count: int  # along z
    begins: wp.array[int]  # (columns + 1) where the list of each column begins, z fastest
    columns: wp.array[int]  # triangles over each column
    attempts: int  # after which so many are outside that none is expected, the mesh's first vertex is taken


@wp.func
def chosen_triangle(mesh: MeshTable, u: wp.float64) -> int:
    """Return the first triangle whose share of the area, with all before it, exceeds u in [0, 1): by bisection."""
    low = int(0)
    high = int(mesh.areas.shape[0] - 1)
    while low < high:
        middle = (low + high) // 2
        if mesh.areas[middle] > u:
            high = middle
        else:
            low = middle + 1
    return low


@wp.func
def on_surface(mesh: MeshTable, key: wp.vec2ui, ordinal: wp.int64) -> wp.vec3:
    """Return a place uniform on the surface [m]: (1 − √u) A + √u (1 − w) B + √u w C.  Source: Turk 1990, Graphics Gems."""
    pick = random_words(key, ordinal, BULK)
    words = random_words(key, ordinal, POSITION)
    k = chosen_triangle(mesh, uniform64(pick[0], pick[1]))
    root = wp.sqrt(uniform(words[0]))
    w = uniform(words[1])
    return mesh.corners[k, 0] * (1.0 - root) + mesh.corners[k, 1] * (root * (1.0 - w)) + mesh.corners[k, 2] * (root * w)


@wp.func
def edge_ahead(p: wp.vec3, q: wp.vec3, y: wp.float64, z: wp.float64) -> int:
    """Return 1 if the edge p q, seen along x, crosses the ray from (y, z) toward +y; the same for q p, to the bit."""
    a = p
    b = q
    if q[2] < p[2] or (q[2] == p[2] and q[1] < p[1]):
        a = q
        b = p
    if (wp.float64(a[2]) > z) == (wp.float64(b[2]) > z):
        return 0
    rise = (z - wp.float64(a[2])) / (wp.float64(b[2]) - wp.float64(a[2]))
    return wp.where(wp.float64(a[1]) + rise * (wp.float64(b[1]) - wp.float64(a[1])) > y, 1, 0)


@wp.func
def triangle_ahead(a: wp.vec3, b: wp.vec3, c: wp.vec3, x: wp.vec3) -> int:
    """Return 1 if the ray from x toward +x meets the triangle.  Source: Shimrat 1962 for the projection; its plane for the distance."""
    y = wp.float64(x[1])
    z = wp.float64(x[2])
    crossings = edge_ahead(a, b, y, z) + edge_ahead(b, c, y, z) + edge_ahead(c, a, y, z)
    if crossings % 2 == 0:
        return 0
    aby = wp.float64(b[1]) - wp.float64(a[1])
    abz = wp.float64(b[2]) - wp.float64(a[2])
    acy = wp.float64(c[1]) - wp.float64(a[1])
    acz = wp.float64(c[2]) - wp.float64(a[2])
    apy = y - wp.float64(a[1])
    apz = z - wp.float64(a[2])
    area = aby * acz - abz * acy
    low = wp.float64(wp.min(a[0], wp.min(b[0], c[0])))
    meets = low
    if area != wp.float64(0.0):
        s = (apy * acz - apz * acy) / area
        t = (aby * apz - abz * apy) / area
        meets = wp.float64(a[0]) + s * (wp.float64(b[0]) - wp.float64(a[0])) + t * (wp.float64(c[0]) - wp.float64(a[0]))
    high = wp.float64(wp.max(a[0], wp.max(b[0], c[0])))
    return wp.where(wp.clamp(meets, low, high) > wp.float64(x[0]), 1, 0)


@wp.func
def encloses(mesh: MeshTable, column: int, x: wp.vec3) -> bool:
    """Return whether x, which lies in the column, is inside the mesh: whether an odd number of triangles lies ahead."""
    ahead = int(0)
    for k in range(mesh.begins[column], mesh.begins[column + 1]):
        i = mesh.columns[k]
        ahead = ahead + triangle_ahead(mesh.corners[i, 0], mesh.corners[i, 1], mesh.corners[i, 2], x)
    return ahead % 2 == 1


@wp.func
def in_volume(mesh: MeshTable, key: wp.vec2ui, ordinal: wp.int64) -> wp.vec3:
    """Return a place uniform in what the mesh encloses [m], by rejection; each attempt draws from a key of its own."""
    place = mesh.corners[0, 0]
    attempt = int(0)
    while attempt < mesh.attempts:
        drawn = wp.vec2ui(key[0], key[1] + wp.uint32(attempt))
        share = uniform64(random_words(drawn, ordinal, BULK)[0], random_words(drawn, ordinal, BULK)[1])
        words = random_words(drawn, ordinal, POSITION)
        cell = mesh.cells[wp.min(int(share * wp.float64(mesh.cells.shape[0])), mesh.cells.shape[0] - 1)]
        at = wp.vec3(float(cell[0]) + uniform(words[0]), float(cell[1]) + uniform(words[1]), float(cell[2]) + uniform(words[2]))
        x = mesh.low + wp.cw_mul(at, mesh.step)
        attempt = attempt + 1
        if encloses(mesh, cell[1] * mesh.column_count + cell[2], x):
            place = x
            attempt = mesh.attempts
    return place
