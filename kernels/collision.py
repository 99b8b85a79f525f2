"""Collisions of particles, which are points, with colliders: what becomes of a substep's path when something is in its way.

Symbols: x [m], v [m/s], a [m/s²] in the scene; q, w those in a collider's own frame, where it stands still; n its unit
normal; h the part of the substep in which the particle lives [s].

The path is the parabola through x0 and x1 with acceleration a = (v1 − v0)/h, whatever the method: constant forces then lose no energy at
a wall. Its velocity at the end differs from the method's v1 by half a kick or nothing; that difference is put back at the end.
"""

import warp as wp

from warpsim.kernels.clearance import NEVER, measure_clearance, measure_gap, measure_mesh_gap, skin_of
from warpsim.kernels.collider import (
    BOUNCE,
    CAPSULE,
    MESH,
    SPHERE,
    STICK,
    Collider,
    Pose,
    into_frame,
    out_of_frame,
    pose_at,
    surface_acceleration,
    surface_velocity,
)
from warpsim.kernels.contact import Touch, along, path_reach, touch_collider
from warpsim.kernels.response import Flight, begin_flight, begin_slide, bounce, curvature, follows, grip_factor, rub

MOST_CONTACTS = 12  # in a substep; who has had so many stays where it is until the next
# A bounce from w to −w under an acceleration a takes 2 w/a; half a kick from rest is none, whatever rounding says.
SHORT = wp.constant(0.51)
LEAST = wp.constant(1.0e-6)  # of a substep: too short for velocities from differences of places
ALIKE = wp.constant(1.0e-6)  # relative: two velocities that rounding cannot tell apart


@wp.struct
class Passage:
    x: wp.vec3  # at the substep's end [m]
    v: wp.vec3  # [m/s]
    hits: int  # contacts on the way: the path is another than the solver's
    dead: int  # 1: killed by one
    time: float  # from the beginning of its path to its death [s]
    stuck: int  # number of the collider it sticks to, plus 1
    pushed: int  # 1: it began inside a collider and was put on the surface
    impacts: int  # hits that were no mere rest
    impact_x: wp.vec3  # of the first of them: place [m]
    impact_v: wp.vec3  # velocity before [m/s]
    impact_normal: wp.vec3
    impact_time: float  # from the beginning of the path [s]


@wp.struct
class Span:
    moment: int  # row of the table at the substep's beginning
    begin: float  # share of the substep at which the particle's path begins
    rate: float  # shares per second [1/s]
    dt: float  # the whole substep [s]
    h: float  # the path's duration [s]
    heading: wp.vec3  # unit vector toward the head of the body that the particle belongs to [1]; zero: none
    grip: wp.vec3  # factors of friction where it slides forward, backward, sideways of that [1]


@wp.func
def path_velocity(x0: wp.vec3, v0: wp.vec3, x1: wp.vec3, a: wp.vec3, h: float) -> wp.vec3:
    """Return the parabola's velocity at x0: v0 + λ a h of the method (λ = ½, 0, −½) if rounding cannot tell it from the path's own."""
    w = (x1 - x0) / h - a * (0.5 * h)
    noise = ALIKE * (wp.max(wp.abs(x0)) + wp.max(wp.abs(x1))) / h + ALIKE * (wp.max(wp.abs(v0)) + wp.max(wp.abs(a)) * h)
    best = w
    for k in range(3):
        guess = v0 + a * (0.5 * float(k - 1) * h)
        if wp.max(wp.abs(guess - w)) <= noise:
            noise = wp.max(wp.abs(guess - w))
            best = guess
    return best


@wp.func
def pose_after(colliders: wp.array2d[Collider], span: Span, k: int, t: float) -> Pose:
    """Return where collider k is at t [s] from the beginning of the path."""
    return pose_at(colliders, span.moment, k, span.begin + t * span.rate)


@wp.func
def touch_one(colliders: wp.array2d[Collider], span: Span, k: int, f: Flight) -> Touch:
    """Return when a flight touches collider k; its path in the frame of one that moves is the parabola through three of its points."""
    c = colliders[span.moment, k]
    t = span.h - f.left
    pose = pose_after(colliders, span, k, t)
    q = into_frame(pose.center, pose.rotation, f.x)
    w = wp.quat_rotate_inv(pose.rotation, f.w)
    a = wp.quat_rotate_inv(pose.rotation, f.a)
    if c.moves == 1 and f.left > LEAST * span.dt:
        half = pose_after(colliders, span, k, t + 0.5 * f.left)
        whole = pose_after(colliders, span, k, span.h)
        middle = into_frame(half.center, half.rotation, along(f.x, f.w, f.a, 0.5 * f.left))
        end = into_frame(whole.center, whole.rotation, along(f.x, f.w, f.a, f.left))
        w = (middle * 4.0 - q * 3.0 - end) / f.left
        a = (q + end - middle * 2.0) * (4.0 / (f.left * f.left))
    touch = touch_collider(c, q, w, a, f.left, skin_of(c, f.x))
    touch.way = touch.q - q
    touch.collider = k
    return touch


@wp.func
def out_of_reach(c: Collider, x: wp.vec3, reach: float) -> int:
    """Return 1 for a solid at rest that no way of a length [m] from x gets to: touch_collider would find no touch of it."""
    round_room = wp.where(c.inside == 1 and (c.kind == SPHERE or c.kind == CAPSULE), 1, 0)  # its steps are too short by a bound
    if c.moves == 1 or c.kind == MESH or round_room == 1:  # a ray meets planes of triangles that lie elsewhere
        return 0
    far = measure_clearance(c, into_frame(c.center, c.rotation, x)) > 1.001 * reach + 2.0 * skin_of(c, x)
    return wp.where(far, 1, 0)


@wp.func
def next_touch(colliders: wp.array2d[Collider], span: Span, f: Flight) -> Touch:
    """Return a flight's first touch of all."""
    first = Touch()
    first.t = NEVER
    reach = (wp.length(f.w) + 0.5 * wp.length(f.a) * f.left) * f.left
    for k in range(colliders.shape[1]):
        if out_of_reach(colliders[span.moment, k], f.x, reach) == 1:
            continue
        if (f.held != k + 1 and f.held_too != k + 1) or follows(colliders[span.moment, k]) == 0:
            touch = touch_one(colliders, span, k, f)
            if touch.t <= f.left and touch.t < first.t:
                first = touch
    return first


@wp.func
def approaches(
    colliders: wp.array2d[Collider], moment: int, dt: float, x0: wp.vec3, v0: wp.vec3, x1: wp.vec3, v1: wp.vec3, h: float
) -> int:
    """Return 1 if a substep's path may touch any collider; what it says no to, cross_colliders leaves as it is."""
    near = int(0)
    for k in range(colliders.shape[1]):
        c = colliders[moment, k]
        q = into_frame(c.center, c.rotation, x0)
        reach = path_reach(c, colliders[moment + 1, k], colliders[moment + 2, k], x0, v0, x1, v1, h, dt)
        near = near | wp.where(measure_clearance(c, q) > reach, 0, 1)
    return near


@wp.func(inline=False)
def lift_off(c: Collider, pose: Pose, x: wp.vec3, newborn: int) -> wp.vec3:
    """Return a point put half a skin before the triangles that it is too near to: a ray from it could begin behind one of them."""
    skin = skin_of(c, x)
    for _corner in range(2):  # between two triangles it takes both
        gap = measure_mesh_gap(c, into_frame(pose.center, pose.rotation, x), skin, newborn)
        if gap.g < 0.25 * skin:
            x = x + wp.quat_rotate(pose.rotation, gap.n * (0.5 * skin - gap.g))
    return x


@wp.func
def fly(f: Flight, touch: Touch, c: Collider, pose: Pose) -> Flight:
    """Return the flight from its touch on; a touch at once leaves the place to the bit."""
    f.v = f.v + f.b * touch.t
    f.left = wp.max(f.left - touch.t, 0.0)
    if c.moves == 0:
        f.x = f.x + wp.quat_rotate(pose.rotation, touch.way)
    elif touch.t > 0.0:
        f.x = out_of_frame(pose, touch.q)
    if c.kind == MESH and touch.t > 0.0:
        f.x = lift_off(c, pose, f.x, 0)
    return f


@wp.func
def resolve_touch(
    colliders: wp.array2d[Collider], span: Span, c: Collider, touch: Touch, pose: Pose, a: wp.vec3, tracer: int, f: Flight
) -> Flight:
    """Return the flight after a touch: a bounce, or a slide if the bounce would be over within the substep."""
    w = wp.quat_rotate_inv(pose.rotation, f.v - surface_velocity(pose, f.x))
    pull = a
    if c.moves == 1:
        pull = a - surface_acceleration(colliders, span.moment, touch.collider, span.dt, pose, f.x)
        pull = pull - wp.cross(pose.spin, wp.quat_rotate(pose.rotation, w)) * 2.0  # Coriolis
    pull = wp.quat_rotate_inv(pose.rotation, pull)
    if wp.dot(span.heading, span.heading) > 0.0:
        m = wp.quat_rotate(pose.rotation, w + pull * f.left)
        c.friction = c.friction * grip_factor(span.heading, span.grip, wp.quat_rotate(pose.rotation, touch.n), m)
    if tracer == 1:
        pull = wp.vec3()
        c.restitution = 0.0
        c.friction = 0.0
    wn = wp.min(wp.dot(touch.n, w), 0.0)
    press = -wp.dot(touch.n, pull) + curvature(c, touch.q, w - touch.n * wp.dot(touch.n, w))
    if tracer == 1 or -c.restitution * wn < SHORT * press * span.h:
        end = pose_after(colliders, span, touch.collider, span.h)
        return begin_slide(c, pose, end, touch, rub(w - touch.n * wp.dot(touch.n, w), -c.friction * wn), pull, f)
    return begin_flight(f, f.v + wp.quat_rotate(pose.rotation, bounce(c, w, touch.n) - w), a)


@wp.func
def push_out(colliders: wp.array2d[Collider], span: Span, x: wp.vec3, newborn: int) -> wp.vec4:
    """Return where a point is that begins inside a collider: on the nearest surface; and 1 if that is more than what rounding does."""
    moved = float(0.0)
    for k in range(colliders.shape[1]):
        c = colliders[span.moment, k]
        pose = pose_after(colliders, span, k, 0.0)
        skin = skin_of(c, x)
        if c.kind == MESH:
            free = lift_off(c, pose, x, newborn)
        else:
            gap = measure_gap(c, into_frame(pose.center, pose.rotation, x))
            free = x
            if gap.g < wp.where(newborn == 1, 0.5 * skin, -skin):
                free = x + wp.quat_rotate(pose.rotation, gap.n * (0.5 * skin - gap.g))
        if wp.length(free - x) > 2.0 * skin:
            moved = 1.0
        x = free
    return wp.vec4(x[0], x[1], x[2], moved)


@wp.func
def end_passage(f: Flight, stagger: wp.vec3, a: wp.vec3, passage: Passage) -> Passage:
    """Return the passage at the end of a flight, its velocity put back to where the method has it within the step."""
    passage.x = along(f.x, f.w, f.a, f.left)
    passage.v = f.v + f.b * f.left
    if f.rests == 0 or wp.dot(stagger, a) > 0.0:  # one that rests shows no half kick, unless the method takes it back
        passage.v = passage.v + stagger
    return passage


@wp.func
def ride(colliders: wp.array2d[Collider], span: Span, k: int, since: float, x: wp.vec3) -> Passage:
    """Return where a point of collider k ends that is at x since a time [s] of the span."""
    passage = Passage()
    passage.hits = 1
    passage.x = x
    if colliders[span.moment, k].moves == 1:
        begin = pose_after(colliders, span, k, since)
        end = pose_after(colliders, span, k, span.h)
        passage.x = out_of_frame(end, into_frame(begin.center, begin.rotation, x))
        passage.v = surface_velocity(end, passage.x)
    return passage


@wp.func
def end_stay(colliders: wp.array2d[Collider], span: Span, c: Collider, touch: Touch, pose: Pose, f: Flight, passage: Passage) -> Passage:
    """Return the passage of a particle that a touch kills, or that stays on the collider from then on."""
    passage.x = f.x
    passage.v = f.v
    passage.time = span.h - f.left
    if c.action == STICK:
        riding = ride(colliders, span, touch.collider, passage.time, f.x)
        passage.x = riding.x
        passage.v = riding.v
        passage.stuck = touch.collider + 1
    else:
        passage.dead = 1
    return passage


@wp.func
def note_impact(f: Flight, n: wp.vec3, span: Span, passage: Passage) -> Passage:
    """Return the passage with one more impact."""
    if passage.impacts == 0:
        passage.impact_x = f.x
        passage.impact_v = f.v
        passage.impact_normal = n
        passage.impact_time = span.h - f.left
    passage.impacts = passage.impacts + 1
    return passage


@wp.func
def cross_colliders(
    colliders: wp.array2d[Collider],
    span: Span,
    x0: wp.vec3,
    v0: wp.vec3,
    x1: wp.vec3,
    v1: wp.vec3,
    tracer: int,
    newborn: int,
) -> Passage:
    """Return where a particle ends that would go from (x0, v0) to (x1, v1) within a span, were there no colliders."""
    passage = Passage()
    passage.x = x1
    passage.v = v1
    a = wp.where(tracer == 1, wp.vec3(), (v1 - v0) / span.h)
    w = path_velocity(x0, wp.where(tracer == 1, v1, v0), x1, a, span.h)
    stagger = v1 - (w + a * span.h)
    f = begin_flight(Flight(), w, a)
    f.left = span.h
    start = push_out(colliders, span, x0, newborn)
    f.x = wp.vec3(start[0], start[1], start[2])
    passage.pushed = int(start[3])
    if wp.max(wp.abs(f.x - x0)) > 0.0:
        passage.hits = 1
    for contact in range(MOST_CONTACTS):
        touch = next_touch(colliders, span, f)
        if not touch.t <= f.left:
            break
        c = colliders[span.moment, touch.collider]
        pose = pose_after(colliders, span, touch.collider, span.h - f.left + touch.t)
        f = fly(f, touch, c, pose)
        f.left = wp.where(f.left < LEAST * span.dt, 0.0, f.left)
        n = wp.quat_rotate(pose.rotation, touch.n)
        passage.hits = passage.hits + 1
        struck = -wp.dot(n, f.v - surface_velocity(pose, f.x))
        if c.action != BOUNCE or (tracer == 0 and struck > 2.0 * span.h * wp.abs(wp.dot(n, a))):
            passage = note_impact(f, n, span, passage)
        if c.action != BOUNCE:
            return end_stay(colliders, span, c, touch, pose, f, passage)
        f = resolve_touch(colliders, span, c, touch, pose, a, tracer, f)
        if contact == MOST_CONTACTS - 1 or f.left == 0.0:
            f.left = 0.0
            break
    if passage.hits > 0:
        passage = end_passage(f, stagger, a, passage)
    return passage
