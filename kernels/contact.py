"""Contact of a moving point with one collider, in the collider's own frame: when, where and how it first touches.

Symbols: q the point [m], w its velocity [m/s], a its acceleration [m/s²], so that q(t) = q + w t + ½ a t² within the substep; g the gap,
the distance to the surface, negative inside what is solid [m]; n the unit normal, toward the free side; e the skin [m].

A point touches where its gap has come down to the skin and is about to close. It stops at ¾ e, rests at ½ e, and what would not
bring it below ¼ e is left alone: rounding moves it by less. Convex solids are approached by their supporting planes, whose crossing by
the parabola is exact: what is behind such a plane is farther away, so that no step can pass the surface.
Source: conservative advancement, Mirtich 1996; the planes: Zhang, Lee & Kim 2006.
"""

import warp as wp

from warpsim.kernels.clearance import NEVER, axis_point, measure_gap, skin_of
from warpsim.kernels.collider import BOX, CAPSULE, MESH, SPHERE, Collider, into_frame

MOST_STEPS = 32  # of an approach; who is not there by then stops where it is


@wp.struct
class Touch:
    t: float  # when [s]; NEVER
    q: wp.vec3  # where the point is then
    n: wp.vec3
    g: float
    way: wp.vec3  # from where it was to q [m]
    collider: int  # place in the table


@wp.func(inline=True)
def along(q: wp.vec3, w: wp.vec3, a: wp.vec3, t: float) -> wp.vec3:
    """Return q + w t + ½ a t²."""
    return q + (w + a * (0.5 * t)) * t


@wp.func(inline=True)
def path_reach(
    c: Collider, half: Collider, whole: Collider, x0: wp.vec3, v0: wp.vec3, x1: wp.vec3, v1: wp.vec3, h: float, dt: float
) -> float:
    """Return how far from its beginning a substep's path gets in the collider's frame [m]; endless for part of a substep beside a mover."""
    middle = (x0 + x1) * 0.5 - (v1 - v0) * (0.125 * h)
    q0 = into_frame(c.center, c.rotation, x0)
    q1 = into_frame(whole.center, whole.rotation, x1)
    bend = q0 + q1 - into_frame(half.center, half.rotation, middle) * 2.0
    way = q1 - q0
    reach = wp.sqrt(wp.dot(way, way)) + 0.5 * wp.sqrt(wp.dot(bend, bend)) + 2.0 * skin_of(c, x0)
    return wp.where(c.moves == 1 and h < 0.999 * dt, NEVER, reach)


@wp.func
def fall_time(g0: float, g1: float, g2: float, level: float) -> float:
    """Return the first t >= 0 at which g0 + g1 t + ½ g2 t² comes down to a level <= g0 [s], NEVER if it does not."""
    d = g0 - level
    square = g1 * g1 - 2.0 * g2 * d
    if square < 0.0:
        return NEVER
    root = wp.sqrt(square)
    if g1 < 0.0:
        return 2.0 * d / (root - g1)
    if g2 < 0.0:
        return (g1 + root) / -g2
    return NEVER


@wp.func
def plane_time(g0: float, g1: float, g2: float, skin: float, left: float) -> float:
    """Return when a gap g0 + g1 t + ½ g2 t² from a plane becomes a touch, NEVER if it does not within the time left [s]."""
    if g0 > skin:
        return fall_time(g0, g1, g2, 0.75 * skin)
    if g0 > 0.25 * skin and fall_time(g0, g1, g2, 0.25 * skin) > left:
        return NEVER
    if g1 < 0.0:
        return 0.0
    return fall_time(g0, g1, g2, g0)


@wp.func
def touch_convex(c: Collider, q: wp.vec3, w: wp.vec3, a: wp.vec3, left: float, skin: float) -> Touch:
    """Return when the point first touches a plane, or a sphere, box or capsule from outside."""
    touch = Touch()
    touch.t = NEVER
    t = float(0.0)
    for k in range(MOST_STEPS):
        here = along(q, w, a, t)
        gap = measure_gap(c, here)
        dt = plane_time(gap.g, wp.dot(gap.n, w + a * t), wp.dot(gap.n, a), skin, left - t)
        if not dt <= left - t:
            return touch
        if dt == 0.0 or k == MOST_STEPS - 1:
            touch.t = t
            touch.q = here
            touch.n = gap.n
            touch.g = gap.g
            return touch
        t = t + dt
    return touch


@wp.func
def ball_time(d: wp.vec3, w: wp.vec3, a: wp.vec3, radius: float, left: float) -> float:
    """Return a time before which |d + w t + ½ a t²| stays below a radius >= |d| [s]; higher powers of t are bounded by left·t²."""
    curve = wp.dot(w, w) + wp.dot(d, a) + (wp.abs(wp.dot(w, a)) + 0.25 * wp.dot(a, a) * left) * left
    curve = wp.max(curve, 1.0e-20)
    slope = wp.dot(d, w)
    lack = wp.min(wp.dot(d, d) - radius * radius, 0.0)
    root = wp.sqrt(slope * slope - curve * lack)
    if slope > 0.0:
        return -lack / (slope + root)
    return (root - slope) / curve


@wp.func
def hollow_time(c: Collider, q: wp.vec3, w: wp.vec3, a: wp.vec3, level: float, left: float) -> float:
    """Return a time before which a point stays inside a hollow sphere or capsule, by `level` [m] at least [s]."""
    square = wp.dot(c.axis, c.axis)
    along_axis = wp.dot(q, c.axis)
    if square == 0.0 or wp.abs(along_axis) >= square:
        return ball_time(q - axis_point(c, q), w, a, c.radius - level, left)
    length = wp.sqrt(square)
    e = c.axis / length
    z = wp.dot(q, e)
    d = q - e * z
    beside = ball_time(d, w - e * wp.dot(w, e), a - e * wp.dot(a, e), c.radius - level, left)  # in the cylinder between the ends
    beside = wp.min(beside, fall_time(length - z, -wp.dot(w, e), -wp.dot(a, e), 0.0))
    beside = wp.min(beside, fall_time(length + z, wp.dot(w, e), wp.dot(a, e), 0.0))
    return wp.max(beside, ball_time(d, w, a, c.radius - level, left))  # and in the ball round its nearest point


@wp.func(inline=False)
def touch_hollow(c: Collider, q: wp.vec3, w: wp.vec3, a: wp.vec3, left: float, skin: float) -> Touch:
    """Return when the point first touches a sphere or capsule from inside."""
    touch = Touch()
    touch.t = NEVER
    t = float(0.0)
    for k in range(MOST_STEPS):
        here = along(q, w, a, t)
        now = w + a * t
        gap = measure_gap(c, here)
        slope = wp.dot(gap.n, now)
        if (gap.g <= skin and slope < 0.0) or k == MOST_STEPS - 1:
            touch.t = t
            touch.q = here
            touch.n = gap.n
            touch.g = gap.g
            return touch
        dt = hollow_time(c, here, now, a, wp.min(0.75 * skin, gap.g), left - t)
        if not t + dt < left:
            return touch
        t = t + dt
    return touch


@wp.func(inline=False)
def touch_room(c: Collider, q: wp.vec3, w: wp.vec3, a: wp.vec3, left: float, skin: float) -> Touch:
    """Return when the point first touches one of the six walls of a box from inside."""
    touch = Touch()
    touch.t = NEVER
    for i in range(3):
        for side in range(2):
            sign = float(1 - 2 * side)
            g = c.half[i] + sign * q[i]
            t = plane_time(g, sign * w[i], sign * a[i], skin, left)
            if t <= left and t < touch.t:
                touch.t = t
                touch.q = along(q, w, a, t)
                touch.n = wp.vec3()
                touch.n[i] = sign
                touch.g = c.half[i] + sign * touch.q[i]
    return touch


@wp.func(inline=False)
def touch_mesh(c: Collider, q: wp.vec3, w: wp.vec3, a: wp.vec3, left: float, skin: float) -> Touch:
    """Return when the point first touches a triangle, from either side: the chord of its path is cast as a ray, and never left."""
    touch = Touch()
    touch.t = NEVER
    end = along(q, w, a, left)
    length = wp.length(end - q)
    if not length > 0.0:
        return touch
    d = (end - q) / length
    stand_off = c.radius + skin
    hit = wp.mesh_query_ray(c.mesh, q, d, length + 4.0 * stand_off)
    if not hit.result:
        return touch
    n = hit.normal
    slope = wp.dot(n, d)
    if slope > 0.0:
        n = -n
        slope = -slope
    g = -hit.t * slope - c.radius  # of the whole face's plane, at the beginning
    if g + length * slope > 0.25 * skin:
        return touch
    touch.n = n
    touch.q = q
    touch.g = g
    touch.t = 0.0
    if g > skin:
        back = wp.max(hit.t + (c.radius + 0.75 * skin) / slope, 0.0)
        touch.q = q + d * back
        touch.g = 0.75 * skin
        touch.t = fall_time(g, wp.dot(n, w), wp.dot(n, a), 0.75 * skin)
        if not touch.t <= left:
            touch.t = left * wp.min(back / length, 1.0)
    return touch


@wp.func
def touch_collider(c: Collider, q: wp.vec3, w: wp.vec3, a: wp.vec3, left: float, skin: float) -> Touch:
    """Return when, where and how the point first touches a collider within the time left [s]."""
    if c.kind == MESH:
        return touch_mesh(c, q, w, a, left, skin)
    if c.inside == 1 and c.kind == BOX:
        return touch_room(c, q, w, a, left, skin)
    if c.inside == 1 and (c.kind == SPHERE or c.kind == CAPSULE):
        return touch_hollow(c, q, w, a, left, skin)
    return touch_convex(c, q, w, a, left, skin)
