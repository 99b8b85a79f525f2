"""Rendering: particles as words that a viewer draws without further work: quantized place, size and color."""

import warp as wp

from warpsim.kernels.colors import multiply_colors
from warpsim.kernels.emission import Particles
from warpsim.kernels.lifetime import age_at
from warpsim.kernels.planar import read3

LIFE, SPEED, AGE, HEIGHT, MASS, RADIUS, HEADING, NEIGHBORS = range(8)
QUANTITIES = {"life": LIFE, "speed": SPEED, "age": AGE, "height": HEIGHT, "mass": MASS, "radius": RADIUS}  # what a color may show
QUANTITIES |= {"heading": HEADING, "neighbors": NEIGHBORS}  # of a flock
DEGREES = wp.constant(57.29577951308232)  # per radian
WEIGHT = wp.constant(9.81)  # [m/s²]: a body banks so that its turn and this pull straight down on it


@wp.struct
class Box:
    low: wp.vec3  # corner [m]
    to_steps: wp.vec3  # 65535/extent [1/m]; 0 along an axis without extent


@wp.struct
class Look:
    size: wp.array[float]  # over life, as a share of the largest
    color: wp.array[wp.uint32]  # rgba bytes, over the range of the quantity
    quantity: int  # LIFE … RADIUS
    low: float  # the quantity's value at the first color, in its unit
    scale: float  # 1/(range of the quantity)


@wp.func
def quantize(value: float) -> wp.uint32:
    """Return the nearest of the 65536 steps."""
    return wp.uint32(wp.clamp(value + 0.5, 0.0, 65535.0))


@wp.func
def sample_table(share: float, count: int) -> int:
    """Return the place in a table of `count` entries over [0, 1]; a NaN is put first."""
    return int(wp.clamp(wp.max(share, 0.0) * float(count), 0.0, float(count - 1)))


@wp.func
def sample_quantity(look: Look, particles: Particles, i: int, age: float) -> float:
    """Return the quantity that the color shows, as a share of its range."""
    q = age / particles.lifetime[i]
    if look.quantity == SPEED:
        q = wp.length(read3(particles.velocity, i))
    elif look.quantity == AGE:
        q = age
    elif look.quantity == HEIGHT:
        q = particles.position[1, i]
    elif look.quantity == MASS:
        q = particles.mass[i]
    elif look.quantity == RADIUS:
        q = particles.radius[i]
    elif look.quantity == HEADING:
        v = read3(particles.velocity, i)
        q = DEGREES * wp.atan2(v[2], v[0])
    elif look.quantity == NEIGHBORS:
        q = float(particles.neighbors[i])
    return (q - look.low) * look.scale


@wp.kernel(enable_backward=False)
def splat_points(
    first: int,
    chosen: wp.array[int],
    frame: int,
    fps: float,
    particles: Particles,
    box: Box,
    look: Look,
    place_out: wp.array2d[wp.uint32],
    color_out: wp.array[wp.uint32],
):
    """Pack chosen particles (all if `chosen` is empty): x y z and size as four 16-bit words (count, 2), color as rgba bytes."""
    j = first + wp.tid()
    i = j
    if chosen.shape[0] > 0:
        i = chosen[j]
    steps = wp.cw_mul(read3(particles.position, i) - box.low, box.to_steps)
    age = age_at(frame, particles.birth_frame[i], particles.birth_age[i], fps)
    size = look.size[sample_table(age / particles.lifetime[i], look.size.shape[0])]
    place_out[j, 0] = quantize(steps[0]) | (quantize(steps[1]) << wp.uint32(16))
    place_out[j, 1] = quantize(steps[2]) | (quantize(size * 65535.0) << wp.uint32(16))
    color = look.color[sample_table(sample_quantity(look, particles, i, age), look.color.shape[0])]
    if particles.tint.shape[0] > 0:
        color = multiply_colors(color, particles.tint[i])
    color_out[j] = color


@wp.func
def signed_byte(share: float) -> wp.uint32:
    """Return a number from -1 to 1 as the low eight bits, two's complement, in steps of 1/127."""
    return wp.uint32(int(wp.floor(wp.clamp(share, -1.0, 1.0) * 127.0 + 0.5)) & 255)


@wp.func
def bank(force: wp.vec3, mass: float, heading: wp.vec3) -> float:
    """Return the sine of the roll to the right of a body that turns: a/√(a² + g²), a the acceleration to its right."""
    right = wp.cross(heading, wp.vec3(0.0, 1.0, 0.0))
    a = wp.dot(force, right) / mass
    return a / wp.sqrt(a * a + WEIGHT * WEIGHT)


@wp.kernel(enable_backward=False)
def splat_headings(
    first: int,
    chosen: wp.array[int],
    particles: Particles,
    course: wp.array2d[float],
    steering: wp.array2d[float],
    heading_out: wp.array[wp.uint32],
):
    """Pack four signed bytes for each body: the unit vector along its `course` [m/s], and the sine of its roll by `steering` [N]."""
    j = first + wp.tid()
    i = j
    if chosen.shape[0] > 0:
        i = chosen[j]
    v = read3(course, i)
    speed = wp.length(v)
    n = wp.vec3(1.0, 0.0, 0.0)
    if speed > 0.0:
        n = v / speed
    roll = float(0.0)
    if steering.shape[1] > 0:
        roll = bank(read3(steering, i), particles.mass[i], n)
    low = signed_byte(n[0]) | (signed_byte(n[1]) << wp.uint32(8))
    heading_out[j] = low | (signed_byte(n[2]) << wp.uint32(16)) | (signed_byte(roll) << wp.uint32(24))
