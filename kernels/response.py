"""What becomes of a point that touches a collider: it bounces, or it rests and slides.

Symbols: w the velocity relative to the surface [m/s], a the acceleration relative to it [m/s²], n the unit normal, toward the free side,
e the restitution, μ the friction. Everything is in the collider's own frame, where its surface stands still, but a Flight, which is in
the scene's. An impact turns w_n into −e w_n and takes at most μ(1 + e)|w_n| from the tangential part. A bounce that would be over within
the substep is none: the point stays on the surface, and friction decelerates it by μ times what presses it on.
Source: Newton 1687 (restitution), Coulomb 1785 (friction).
"""

import warp as wp

from warpsim.kernels.clearance import measure_gap, skin_of
from warpsim.kernels.collider import CAPSULE, MESH, SPHERE, Collider, Pose, out_of_frame, surface_velocity
from warpsim.kernels.contact import Touch


@wp.struct
class Flight:
    x: wp.vec3  # path x + w t + ½ a t² [m]
    w: wp.vec3
    a: wp.vec3
    v: wp.vec3  # velocity v + b t [m/s]; on a surface not the path's, which also lifts it to the skin
    b: wp.vec3
    left: float  # [s]
    held: int  # number of the collider on which it slides, plus 1; 0: it flies
    held_too: int  # of a second one, in the crease between them
    normal: wp.vec3  # of the first
    rests: int  # 1: friction holds it


@wp.struct
class Slide:
    d: wp.vec3  # displacement [m]
    w: wp.vec3  # velocity after it [m/s]


@wp.func
def slide(w: wp.vec3, a: wp.vec3, brake: float, t: float) -> Slide:
    """Return the way and the last velocity of a point with tangential w and a against Coulomb friction of `brake` [m/s²]."""
    s = Slide()
    free = w + a * t
    speed = wp.length(free)
    if speed <= brake * t:
        first = wp.length(w)
        lack = brake * t - speed
        if first > 0.0:
            s.d = w * (0.5 * t * first / (first + lack))
        return s
    s.w = free * (1.0 - brake * t / speed)
    s.d = (w + s.w) * (0.5 * t)
    return s


@wp.func
def rub(w: wp.vec3, impulse: float) -> wp.vec3:
    """Return a tangential velocity after friction took up to `impulse` [m/s] of it."""
    speed = wp.length(w)
    if speed <= wp.max(impulse, 0.0):  # a speed so small that its square is none, too
        return wp.vec3()
    return w * (1.0 - impulse / speed)


@wp.func
def grip_factor(heading: wp.vec3, grip: wp.vec3, n: wp.vec3, w: wp.vec3) -> float:
    """Return the factor of friction of a body with bristles that would slide as w: (forward or backward) cos² θ + sideways sin² θ."""
    e = heading - n * wp.dot(n, heading)
    along = wp.dot(e, w)
    t = w - n * wp.dot(n, w)
    squares = wp.dot(e, e) * wp.dot(t, t)
    share = wp.min(along * along / wp.max(squares, 1.0e-30), 1.0)  # cos², θ being the angle to the heading in the surface
    return wp.where(along > 0.0, grip[0], grip[1]) * share + grip[2] * (1.0 - share)


@wp.func
def bounce(c: Collider, w: wp.vec3, n: wp.vec3) -> wp.vec3:
    """Return the velocity after an impact, relative to the surface."""
    wn = wp.min(wp.dot(n, w), 0.0)
    return rub(w - n * wn, -c.friction * (1.0 + c.restitution) * wn) - n * (c.restitution * wn)


@wp.func
def curvature(c: Collider, q: wp.vec3, w: wp.vec3) -> float:
    """Return ±w²/r of a point that follows a round surface [m/s²]: presses from inside, lifts from outside.  Source: Huygens 1673."""
    if c.kind != SPHERE and c.kind != CAPSULE:
        return 0.0
    square = wp.dot(c.axis, c.axis)
    across = w
    if square > 0.0 and wp.abs(wp.dot(q, c.axis)) < square:
        across = w - c.axis * (wp.dot(w, c.axis) / square)
    return wp.dot(across, across) / wp.where(c.inside == 1, c.radius, -c.radius)


@wp.func
def follows(c: Collider) -> int:
    """Return 1 if a point that slides along the surface cannot meet the same collider again on its way."""
    return wp.where(c.kind == MESH or (c.inside == 1 and c.kind != SPHERE and c.kind != CAPSULE), 0, 1)


@wp.func
def turn_along(first: wp.vec3, last: wp.vec3, n: wp.vec3, a: wp.vec3, d: wp.vec3, brake: float) -> wp.vec3:
    """Return the last velocity of a slide of d [m], turned into the surface there; its square is w² + 2 a·d − 2 brake |d|."""
    tangent = last - n * wp.dot(n, last)
    square = wp.max(wp.dot(first, first) + 2.0 * wp.dot(a, d) - 2.0 * brake * wp.length(d), 0.0)
    return tangent * (wp.sqrt(square) / wp.max(wp.length(tangent), 1.0e-20))


@wp.func
def begin_slide(c: Collider, pose: Pose, end: Pose, touch: Touch, w: wp.vec3, a: wp.vec3, f: Flight) -> Flight:
    """Return the flight of a point that stays on the surface, with tangential w: straight to where its slide in the frame ends."""
    n = touch.n
    skin = skin_of(c, f.x)
    press = -wp.dot(n, a)
    pull = a + n * press
    held_too = int(0)
    m = wp.quat_rotate_inv(pose.rotation, f.normal)
    crease = wp.cross(n, m)
    if f.held > 0 and wp.length(crease) > 1.0e-3 and wp.dot(m, w + pull * (0.5 * f.left)) < 0.0:
        crease = wp.where(f.held_too > 0, wp.vec3(), wp.normalize(crease))  # a third surface makes a corner
        press = press + wp.max(-wp.dot(m, a), 0.0)
        w = crease * wp.dot(crease, w)
        pull = crease * wp.dot(crease, pull)
        held_too = f.held
    brake = c.friction * wp.max(press + curvature(c, touch.q, w), 0.0)
    s = slide(w, pull, brake, f.left)
    lifted = n * wp.max(0.5 * skin - touch.g, 0.0)
    if c.kind == SPHERE or c.kind == CAPSULE:
        gap = measure_gap(c, touch.q + s.d)  # round: the tangent leads away
        lifted = gap.n * (0.5 * skin - gap.g)
        work = s.d + wp.where(touch.g < -skin, wp.vec3(), lifted)  # what two solids squeeze out of each other gains nothing by it
        s.w = turn_along(w, s.w, gap.n, a, work, brake)
    x = f.x + wp.quat_rotate(pose.rotation, s.d + lifted)
    if c.moves == 1:
        x = out_of_frame(end, touch.q + s.d + lifted)
    rate = wp.where(f.left > 0.0, 1.0 / f.left, 0.0)
    f.v = wp.quat_rotate(pose.rotation, w) + surface_velocity(pose, f.x)
    f.b = (wp.quat_rotate(end.rotation, s.w) + surface_velocity(end, x) - f.v) * rate
    f.w = (x - f.x) * rate
    f.a = wp.vec3()
    f.rests = wp.where(wp.length(s.w) == 0.0, 1, 0)
    f.held = touch.collider + 1
    f.held_too = held_too
    f.normal = wp.quat_rotate(pose.rotation, n)
    return f


@wp.func
def begin_flight(f: Flight, v: wp.vec3, a: wp.vec3) -> Flight:
    """Return the flight of a point that leaves the surface with velocity v under acceleration a."""
    f.v = v
    f.b = a
    f.w = v
    f.a = a
    f.rests = 0
    f.held = 0
    f.held_too = 0
    return f
