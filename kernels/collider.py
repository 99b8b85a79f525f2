"""Colliders as rows of a table: what shape, how it answers, and where it is at each moment of the frame.

Symbols: x a point in the scene [m], q the same point in the collider's own frame, x = c + R q with center c and rotation R; R = Rz Ry Rx.
Between two moments of the table a collider moves straight and turns evenly.
"""

import warp as wp

from warpsim.kernels.elementary import cos64, sin64
from warpsim.kernels.signals import Signals, sample_signal

PLANE, SPHERE, BOX, CAPSULE, MESH = range(5)
BOUNCE, KILL, STICK = range(3)
ACTIONS = {"bounce": BOUNCE, "kill": KILL, "stick": STICK}
HALF_DEGREE = wp.constant(wp.float64(0.008726646259971648))  # half of a degree [rad]


@wp.struct
class Collider:
    kind: int  # PLANE … MESH
    action: int  # BOUNCE … STICK
    inside: int  # 1: particles are kept inside, the rest of the world is solid
    moves: int  # 1: center or rotation vary in time
    restitution: float
    friction: float
    radius: float  # sphere, capsule [m]; plane: how far particles are kept from it [m]; mesh: half the thickness of a sheet, 0 for a solid
    axis: wp.vec3  # plane: normal; capsule: from its middle to its end [m]
    half: wp.vec3  # box: half edges; mesh: those of the box round it [m]
    middle: wp.vec3  # mesh: center of that box in its own frame [m]
    mesh: wp.uint64
    cells: wp.vec3i  # of that box along x, y, z
    cells_per_meter: wp.vec3  # [1/m]
    clearance: wp.array[float]  # of the cells, z fastest [m]
    reach: float  # a length of the size of its coordinates [m], for what rounding can do
    center_signal: wp.vec3i
    rotation_signal: wp.vec3i  # angles about x, y, z, in that order [degrees]
    center: wp.vec3  # at the moment of the table [m]
    rotation: wp.quat
    velocity: wp.vec3  # of the center until the next moment [m/s]
    spin: wp.vec3  # likewise [rad/s]


@wp.struct
class Pose:
    center: wp.vec3  # [m]
    rotation: wp.quat
    velocity: wp.vec3  # [m/s]
    spin: wp.vec3  # [rad/s]


@wp.func
def sample_vector(signals: Signals, signal: wp.vec3i, t: wp.float64) -> wp.vec3d:
    """Return three signals at time t [s]."""
    return wp.vec3d(sample_signal(signals, signal[0], t), sample_signal(signals, signal[1], t), sample_signal(signals, signal[2], t))


@wp.func
def turn(degrees: wp.vec3d) -> wp.quatd:
    """Return the rotation by angles about x, then y, then z [degrees]: q = qz qy qx."""
    a = degrees[0] * HALF_DEGREE
    b = degrees[1] * HALF_DEGREE
    c = degrees[2] * HALF_DEGREE
    zero = wp.float64(0.0)
    return wp.quatd(zero, zero, sin64(c), cos64(c)) * wp.quatd(zero, sin64(b), zero, cos64(b)) * wp.quatd(sin64(a), zero, zero, cos64(a))


@wp.func
def spin_between(begin: wp.quatd, end: wp.quatd, duration: wp.float64) -> wp.vec3d:
    """Return the angular velocity [rad/s] that turns one rotation into another: 2 asin|s|/|s| s/T, s the vector part of end·begin⁻¹."""
    d = end * wp.quat_inverse(begin)
    s = wp.vec3d(d[0], d[1], d[2])
    if d[3] < wp.float64(0.0):
        s = -s
    z = wp.min(wp.dot(s, s), wp.float64(1.0))
    p = wp.float64(0.0)
    for k in range(12):  # the series of asin, to 1e-6 at a quarter turn per moment
        n = wp.float64(11 - k)
        p = wp.float64(1.0) / (wp.float64(2.0) * n + wp.float64(1.0)) + z * (n + wp.float64(0.5)) / (n + wp.float64(1.0)) * p
    return s * (wp.float64(2.0) * p / duration)


@wp.kernel(enable_backward=False)
def sample_colliders(
    first: int,
    start_time: wp.array[wp.float64],
    spacing: wp.float64,
    signals: Signals,
    colliders: wp.array[Collider],
    colliders_out: wp.array2d[Collider],
):
    """Fill the table's rows of one moment t = start + j·spacing [s]: each collider where it is at t."""
    j = first + wp.tid()
    t = start_time[0] + wp.float64(j) * spacing
    for k in range(colliders.shape[0]):
        row = colliders[k]
        center = sample_vector(signals, row.center_signal, t)
        rotation = turn(sample_vector(signals, row.rotation_signal, t))
        row.center = wp.vec3(center)
        row.rotation = wp.quat(rotation)
        if row.moves == 1 and spacing > wp.float64(0.0):
            later = t + spacing
            row.velocity = wp.vec3((sample_vector(signals, row.center_signal, later) - center) / spacing)
            row.spin = wp.vec3(spin_between(rotation, turn(sample_vector(signals, row.rotation_signal, later)), spacing))
        colliders_out[j, k] = row


@wp.func
def pose_at(colliders: wp.array2d[Collider], moment: int, k: int, share: float) -> Pose:
    """Return where collider k is at a share of the substep that begins at `moment`; rows are half a substep apart."""
    pose = Pose()
    if colliders[moment, k].moves == 0:
        pose.center = colliders[moment, k].center
        pose.rotation = colliders[moment, k].rotation
        return pose
    j = moment
    f = 2.0 * share
    if share >= 0.5:
        j = moment + 1
        f = 2.0 * share - 1.0
    pose.center = colliders[j, k].center * (1.0 - f) + colliders[j + 1, k].center * f
    pose.rotation = wp.normalize(colliders[j, k].rotation * (1.0 - f) + colliders[j + 1, k].rotation * f)
    pose.velocity = colliders[j, k].velocity
    pose.spin = colliders[j, k].spin
    return pose


@wp.func(inline=True)
def into_frame(center: wp.vec3, rotation: wp.quat, x: wp.vec3) -> wp.vec3:
    """Return q = R⁻¹ (x − c) [m]."""
    return wp.quat_rotate_inv(rotation, x - center)


@wp.func(inline=True)
def out_of_frame(pose: Pose, q: wp.vec3) -> wp.vec3:
    """Return x = c + R q [m]."""
    return pose.center + wp.quat_rotate(pose.rotation, q)


@wp.func
def surface_velocity(pose: Pose, x: wp.vec3) -> wp.vec3:
    """Return the velocity of the collider's matter at x [m/s], v = ċ + ω × (x − c).  Source: Euler 1750."""
    return pose.velocity + wp.cross(pose.spin, x - pose.center)


@wp.func
def surface_acceleration(colliders: wp.array2d[Collider], moment: int, k: int, dt: float, pose: Pose, x: wp.vec3) -> wp.vec3:
    """Return the acceleration of the collider's matter at x [m/s²], c̈ + ω̇ × r + ω × (ω × r), from the substep's two halves."""
    r = x - pose.center
    rate = 2.0 / dt
    linear = (colliders[moment + 1, k].velocity - colliders[moment, k].velocity) * rate
    angular = (colliders[moment + 1, k].spin - colliders[moment, k].spin) * rate
    return linear + wp.cross(angular, r) + wp.cross(pose.spin, wp.cross(pose.spin, r))
