"""Birth: initial values of a particle from its emitter and ordinal alone, so that order, split and capacity cannot change them."""

import warp as wp

from warpsim.kernels.colors import WHITE, multiply_colors
from warpsim.kernels.elementary import cos_turns, sin_turns
from warpsim.kernels.emission import BORN, LIVE, NEXT_ID, NORMAL, Births, Distribution, Emitter, EventLog, Particles, Plan, Segment
from warpsim.kernels.mesh_births import in_volume, on_surface
from warpsim.kernels.planar import read3, write3
from warpsim.kernels.random import (
    BULK,
    LIFE,
    LINEAGE,
    POSITION,
    SIZE,
    VELOCITY,
    normal,
    random_words,
    uniform,
    uniform_positive,
    uniform_signed,
)
from warpsim.kernels.signals import sample_signal

SMALLEST_LIFETIME = wp.constant(1.0e-6)  # [s]: "lifetimes are clipped to > 0"
SMALLEST_BULK = wp.constant(1.0e-12)  # [kg], [m]


@wp.func(inline=True)
def draw(d: Distribution, first: wp.uint32, second: wp.uint32) -> float:
    """Return mean + spread·z, z uniform on [-1, 1) or standard normal."""
    if d.law == NORMAL:
        return d.mean + d.spread * normal(first, second)
    return d.mean + d.spread * uniform_signed(first)


@wp.func(inline=True)
def isotropic(first: wp.uint32, second: wp.uint32) -> wp.vec3:
    """Return a unit vector, uniform on the sphere.  Source: Archimedes' hat-box theorem."""
    z = uniform_signed(first)
    rho = wp.sqrt(wp.max(1.0 - z * z, 0.0))
    return wp.vec3(rho * cos_turns(uniform(second)), rho * sin_turns(uniform(second)), z)


@wp.func(inline=True)
def born_point(emitter: Emitter, ordinal: wp.int64) -> wp.vec3:
    """Return the center [m]."""
    return emitter.center


@wp.func(inline=True)
def born_segment(emitter: Emitter, ordinal: wp.int64) -> wp.vec3:
    """Return a point uniform on the segment from center − half to center + half [m]."""
    return emitter.center + emitter.half * uniform_signed(random_words(emitter.key, ordinal, POSITION)[0])


@wp.func(inline=True)
def born_disc(emitter: Emitter, ordinal: wp.int64) -> wp.vec3:
    """Return a point uniform on the disc, or on its rim [m]: r = R √u."""
    words = random_words(emitter.key, ordinal, POSITION)
    r = emitter.radius * wp.sqrt(wp.max(uniform(words[0]), float(emitter.surface)))
    turn = uniform(words[1])
    return emitter.center + emitter.tangent * (r * cos_turns(turn)) + emitter.bitangent * (r * sin_turns(turn))


@wp.func(inline=True)
def born_sphere(emitter: Emitter, ordinal: wp.int64) -> wp.vec3:
    """Return a point uniform in the ball, or on its sphere [m]: the largest of three uniform numbers is distributed as r³."""
    words = random_words(emitter.key, ordinal, POSITION)
    radial = random_words(emitter.key, ordinal, BULK)
    largest = wp.max(uniform(radial[0]), wp.max(uniform(radial[1]), uniform(radial[2])))
    return emitter.center + isotropic(words[0], words[1]) * (emitter.radius * wp.max(largest, float(emitter.surface)))


@wp.func(inline=True)
def to_face(chosen: bool, p: float) -> float:
    """Return p, or its sign if it is chosen."""
    return wp.where(chosen, wp.where(p < 0.0, -1.0, 1.0), p)


@wp.func(inline=True)
def born_box(emitter: Emitter, ordinal: wp.int64) -> wp.vec3:
    """Return a point uniform in the box, or on its six faces, chosen by area [m]; without branches, so that the loop vectorizes."""
    words = random_words(emitter.key, ordinal, POSITION)
    h = emitter.half
    pick = uniform(random_words(emitter.key, ordinal, BULK)[0]) * (h[1] * h[2] + h[2] * h[0] + h[0] * h[1])
    face = wp.where(pick < h[1] * h[2], 0, wp.where(pick < h[1] * h[2] + h[2] * h[0], 1, 2))
    face = wp.where(emitter.surface == 1, face, -1)
    x = to_face(face == 0, uniform_signed(words[0]))
    y = to_face(face == 1, uniform_signed(words[1]))
    z = to_face(face == 2, uniform_signed(words[2]))
    return emitter.center + wp.cw_mul(h, wp.vec3(x, y, z))


@wp.func
def born_mesh(emitter: Emitter, ordinal: wp.int64) -> wp.vec3:
    """Return a point uniform on the surface of a mesh, or in what it encloses [m]: c + s R p."""
    if emitter.surface == 1:
        return emitter.center + emitter.turn * on_surface(emitter.mesh, emitter.key, ordinal)
    return emitter.center + emitter.turn * in_volume(emitter.mesh, emitter.key, ordinal)


SHAPES = {"point": born_point, "segment": born_segment, "disc": born_disc, "sphere": born_sphere, "box": born_box, "mesh": born_mesh}


@wp.func
def born_position(emitter: Emitter, ordinal: wp.int64) -> wp.vec3:
    """Return the center: no such shape."""
    return emitter.center


def with_shape(kind, formula, otherwise):
    """Chain one more shape, as in flow.py."""

    @wp.func(name="born_position")
    def born_position(emitter: Emitter, ordinal: wp.int64) -> wp.vec3:
        """Return where a particle is born [m]."""
        if emitter.shape == kind:
            return formula(emitter, ordinal)
        return otherwise(emitter, ordinal)

    return born_position


for _kind, _formula in enumerate(SHAPES.values()):
    born_position = with_shape(_kind, _formula, born_position)


@wp.func(inline=True)
def born_velocity(emitter: Emitter, ordinal: wp.int64) -> wp.vec3:
    """Return a velocity in the emitter's cone, uniform per solid angle [m/s]: the cosine to its axis is uniform."""
    words = random_words(emitter.key, ordinal, VELOCITY)
    cosine = 1.0 - uniform(words[0]) * (1.0 - emitter.cone_cosine)
    rho = wp.sqrt(wp.max(1.0 - cosine * cosine, 0.0))
    turn = uniform(words[1])
    d = emitter.direction * cosine + emitter.across * (rho * cos_turns(turn)) + emitter.beyond * (rho * sin_turns(turn))
    return d * draw(emitter.speed, words[2], words[3])


@wp.func(inline=True)
def born_age(emitter: Emitter, ordinal: wp.int64, segment: Segment, j: int, frame_time: float) -> float:
    """Return the age at the frame's end of birth j of the segment [s], within [0, frame_time]."""
    jitter = uniform_positive(random_words(emitter.key, ordinal, POSITION)[3])
    return wp.clamp(segment.age - segment.width * (float(j) + jitter), 0.0, frame_time)


@wp.func
def travelled(births: Births, emitter: Emitter, age: float, x: wp.vec3) -> wp.vec3:
    """Return x displaced as the emitter was when a particle was born that has this age at the frame's end [m]."""
    t = wp.float64(births.clock[0]) / births.fps - wp.float64(age)
    dx = float(sample_signal(births.signals, emitter.travel[0], t))
    dy = float(sample_signal(births.signals, emitter.travel[1], t))
    dz = float(sample_signal(births.signals, emitter.travel[2], t))
    return x + wp.vec3(dx, dy, dz)


@wp.func(inline=True)
def born_lifetime(emitter: Emitter, ordinal: wp.int64) -> float:
    """Return a lifetime, clipped to > 0 [s]."""
    words = random_words(emitter.key, ordinal, LIFE)
    return wp.max(draw(emitter.lifetime, words[0], words[1]), SMALLEST_LIFETIME)


@wp.func(inline=True)
def born_mass(emitter: Emitter, ordinal: wp.int64) -> float:
    """Return a mass, clipped to > 0 [kg]."""
    words = random_words(emitter.key, ordinal, LIFE)
    return wp.max(draw(emitter.mass, words[2], words[3]), SMALLEST_BULK)


@wp.func(inline=True)
def born_radius(emitter: Emitter, ordinal: wp.int64) -> float:
    """Return a radius, clipped to > 0 [m]."""
    words = random_words(emitter.key, ordinal, SIZE)
    return wp.max(draw(emitter.extent, words[0], words[1]), SMALLEST_BULK)


@wp.func
def born_tint(births: Births, emitter: Emitter, ordinal: wp.int64) -> wp.uint32:
    """Return one of the emitter's colors, each as likely as the others; white if it has none."""
    if emitter.colors[1] == 0:
        return WHITE
    chosen = int(uniform(random_words(emitter.key, ordinal, SIZE)[2]) * float(emitter.colors[1]))
    return births.colors[emitter.colors[0] + wp.min(chosen, emitter.colors[1] - 1)]


@wp.func
def forget_contacts(i: int, particles_out: Particles):
    """Begin the rows of contacts anew: slot i still holds those of somebody dead."""
    if particles_out.contact.shape[0] > 0:
        particles_out.contact[i] = 0
    if particles_out.impact.shape[0] > 0:
        for row in range(9):
            particles_out.impact[row, i] = 0.0
        particles_out.impact[9, i] = -1.0
        particles_out.impact_count[i] = 0
        particles_out.impact_number[i] = 0


@wp.func
def emit_particle(i: int, j: int, id: wp.int64, births: Births, segment: Segment, particles_out: Particles):
    """Fill slot i with birth j of a segment."""
    emitter = births.emitters[segment.emitter]
    ordinal = segment.ordinal + wp.int64(j)
    age = born_age(emitter, ordinal, segment, j, float(wp.float64(1.0) / births.fps))
    x = born_position(emitter, ordinal)
    if emitter.travel[0] >= 0:
        x = travelled(births, emitter, age, x)
    write3(particles_out.position, i, x)
    write3(particles_out.velocity, i, born_velocity(emitter, ordinal))
    particles_out.birth_frame[i] = int(births.clock[0])
    particles_out.birth_age[i] = age
    particles_out.lifetime[i] = born_lifetime(emitter, ordinal)
    particles_out.mass[i] = born_mass(emitter, ordinal)
    particles_out.radius[i] = born_radius(emitter, ordinal)
    particles_out.id[0, i] = wp.uint32(id)
    particles_out.id[1, i] = wp.uint32(id >> wp.int64(32))
    if particles_out.tint.shape[0] > 0:
        particles_out.tint[i] = born_tint(births, emitter, ordinal)
    if particles_out.lineage.shape[0] > 0:
        words = random_words(emitter.key, ordinal, LINEAGE)
        particles_out.lineage[0, i] = words[0]
        particles_out.lineage[1, i] = words[1]
    forget_contacts(i, particles_out)


@wp.func
def event_segment(births: Births, segment: Segment, k: int) -> Segment:
    """Return the part of a segment of children that is the event's of the frame's birth k, with ordinals that grow from its lineage."""
    emitter = births.emitters[segment.emitter]
    log = births.logs[emitter.log]
    q = (k - segment.begin) // emitter.per_event
    one = segment
    one.begin = segment.begin + q * emitter.per_event
    one.end = one.begin + emitter.per_event
    one.ordinal = (wp.int64(log.lineage[1, q]) << wp.int64(32)) + wp.int64(log.lineage[0, q])
    one.ordinal = one.ordinal + wp.int64(log.number[q]) * wp.int64(emitter.per_event)
    one.age = log.since[q]
    one.width = 0.0
    return one


@wp.func
def turn_up_to(n: wp.vec3, x: wp.vec3) -> wp.vec3:
    """Return x turned the shortest way that turns +y to the unit vector n; half round x if they oppose.  Source: Rodrigues 1840."""
    k = wp.vec3(n[2], 0.0, -n[0])  # y × n
    k2 = wp.dot(k, k)
    if n[1] < 0.0 and k2 < 1.0e-12:
        return wp.vec3(x[0], -x[1], -x[2])
    share = 1.0 / (1.0 + wp.abs(n[1]))
    if n[1] < 0.0:
        share = (1.0 - n[1]) / k2  # the same, 1/(1 + n_y), where that sum would be all rounding
    return x * n[1] + wp.cross(k, x) + k * (wp.dot(k, x) * share)


@wp.func
def inherit(i: int, q: int, emitter: Emitter, log: EventLog, particles_inout: Particles):
    """Move the newborn in slot i to the place of event q, with its share of the velocity there: x + X, v + share V; and the color."""
    x = read3(particles_inout.position, i)
    v = read3(particles_inout.velocity, i)
    if emitter.on_surface == 1:
        x = turn_up_to(read3(log.normal, q), x)
        v = turn_up_to(read3(log.normal, q), v)
    write3(particles_inout.position, i, x + read3(log.position, q))
    write3(particles_inout.velocity, i, v + read3(log.velocity, q) * emitter.share)
    if emitter.color_share == 1:
        particles_inout.tint[i] = multiply_colors(particles_inout.tint[i], log.tint[q])


@wp.func
def first_id(plan: Plan, counters: wp.array[wp.int64]) -> wp.int64:
    """Return the running number of the frame's first birth."""
    s = plan.segment_count[0]
    total = int(0)
    if s > 0:
        total = plan.segments[s - 1].end
    return counters[NEXT_ID] - wp.int64(total)


@wp.kernel(enable_backward=False)
def emit_particles(first: int, births: Births, plan: Plan, counters: wp.array[wp.int64], particles_out: Particles):
    """Fill the slots of this frame's births; launched over the capacity, the most that can be born."""
    k = first + wp.tid()
    if wp.int64(k) < counters[BORN]:
        s = int(0)
        while k >= plan.segments[s].end:
            s = s + 1
        i = int(counters[LIVE]) + k
        id = first_id(plan, counters) + wp.int64(k)
        segment = plan.segments[s]
        emitter = births.emitters[segment.emitter]
        if emitter.log < 0:
            emit_particle(i, k - segment.begin, id, births, segment, particles_out)
        else:
            one = event_segment(births, segment, k)
            emit_particle(i, k - one.begin, id, births, one, particles_out)
            inherit(i, (k - segment.begin) // emitter.per_event, emitter, births.logs[emitter.log], particles_out)
