"""Events: what happens to a system's particles in a frame, noted for the emitters that listen, in the order of the slots.

The log holds each event's place, velocity and moment, so that the children need nothing of the parent any more. It is filled by
a prefix sum over the parent's slots: deterministic, without waiting for the host. On CUDA by mark, scan and scatter; natively
each core counts its own part, then writes it behind those of the cores before it.
"""

import warp as wp

from warpsim.kernels.emission import ACTIVE, LIVE, EventLog, Particles
from warpsim.kernels.environment import Environment
from warpsim.kernels.integration import inside
from warpsim.kernels.lifetime import age_at
from warpsim.kernels.loops import share
from warpsim.kernels.planar import read3, write3

BIRTH, DEATH, COLLISION = range(3)
EVENTS = {"birth": BIRTH, "death": DEATH, "collision": COLLISION}


@wp.struct
class Watch:
    kind: int  # BIRTH …
    min_speed: float  # toward the surface, of a collision [m/s]
    fps: float  # frames per second
    clock: wp.array[wp.int64]  # one number: the frame under way
    environment: wp.array[Environment]  # one row
    counters: wp.array[wp.int64]  # of the population it happens to
    particles: Particles  # for births as they were born


@wp.func
def age_of(i: int, watch: Watch) -> float:
    """Return the age of the particle in slot i at the frame's end [s]."""
    return age_at(int(watch.clock[0]), watch.particles.birth_frame[i], watch.particles.birth_age[i], watch.fps)


@wp.func
def impact_vector(i: int, row: int, impact: wp.array2d[float]) -> wp.vec3:
    """Return three rows of the frame's first impact of slot i, from a row on: 0 place [m], 3 velocity before [m/s], 6 normal."""
    return wp.vec3(impact[row, i], impact[row + 1, i], impact[row + 2, i])


@wp.func
def collides(i: int, watch: Watch) -> int:
    """Return 1 if slot i had an impact in this frame, the first of them at min_speed or more toward the surface, −v·n."""
    if watch.particles.impact[9, i] < 0.0:
        return 0
    v = impact_vector(i, 3, watch.particles.impact)
    n = impact_vector(i, 6, watch.particles.impact)
    return wp.where(-wp.dot(v, n) >= watch.min_speed, 1, 0) * inside(
        impact_vector(i, 0, watch.particles.impact), v, watch.environment[0].extent
    )


@wp.func
def happens(i: int, watch: Watch) -> int:
    """Return 1 if the event happens to slot i in this frame; a particle beyond the world, or removed by its policy, has none."""
    if watch.kind == BIRTH:
        return wp.where(wp.int64(i) >= watch.counters[LIVE], 1, 0)
    if watch.kind == COLLISION:
        return collides(i, watch)
    if watch.particles.alive[i] == 1 or age_of(i, watch) < watch.particles.lifetime[i]:
        return 0
    return inside(read3(watch.particles.position, i), read3(watch.particles.velocity, i), watch.environment[0].extent)


@wp.func
def note_collision(i: int, q: int, watch: Watch, log_out: EventLog):
    """Write the impact of slot i as event q; of the velocity before it the part along the surface, v − (v·n) n."""
    v = impact_vector(i, 3, watch.particles.impact)
    n = impact_vector(i, 6, watch.particles.impact)
    write3(log_out.position, q, impact_vector(i, 0, watch.particles.impact))
    write3(log_out.velocity, q, v - n * wp.dot(v, n))
    write3(log_out.normal, q, n)
    log_out.since[q] = watch.particles.impact[9, i]
    log_out.number[q] = watch.particles.impact_number[i]


@wp.func
def note(i: int, q: int, watch: Watch, log_out: EventLog):
    """Write the event of slot i as number q of the frame; a death is as long ago as the age exceeds the lifetime."""
    if watch.kind == COLLISION:
        note_collision(i, q, watch, log_out)
    else:
        write3(log_out.position, q, read3(watch.particles.position, i))
        write3(log_out.velocity, q, read3(watch.particles.velocity, i))
        log_out.since[q] = wp.where(watch.kind == BIRTH, watch.particles.birth_age[i], age_of(i, watch) - watch.particles.lifetime[i])
        log_out.number[q] = 0
    log_out.lineage[0, q] = watch.particles.lineage[0, i]
    log_out.lineage[1, q] = watch.particles.lineage[1, i]
    if log_out.tint.shape[0] > 0:
        log_out.tint[q] = watch.particles.tint[i]


@wp.kernel(enable_backward=False)
def mark_events(first: int, watch: Watch, marks_out: wp.array[int], log_out: EventLog):
    """Mark the slots to which the event happens, and begin an empty log."""
    i = first + wp.tid()
    if i == 0:
        log_out.count[0] = 0
    if wp.int64(i) < watch.counters[ACTIVE]:
        marks_out[i] = happens(i, watch)


@wp.kernel(enable_backward=False)
def scatter_events(first: int, watch: Watch, marks: wp.array[int], order: wp.array[int], log_out: EventLog):
    """Write the marked events, order = inclusive scan of the marks; the last active slot knows how many there are."""
    i = first + wp.tid()
    if wp.int64(i) < watch.counters[ACTIVE]:
        if marks[i] == 1:
            note(i, order[i] - 1, watch, log_out)
        if wp.int64(i) == watch.counters[ACTIVE] - wp.int64(1):
            log_out.count[0] = order[i]


@wp.kernel(enable_backward=False)
def mark_parts(part: int, part_count: int, watch: Watch, found_out: wp.array[int]):
    """Count the events of one part of the active slots: found (64)."""
    mine = part + wp.tid()
    cut = share(mine, part_count, int(watch.counters[ACTIVE]))
    count = int(0)
    for i in range(cut[0], cut[1]):
        count = count + happens(i, watch)
    found_out[mine] = count


@wp.kernel(enable_backward=False)
def scatter_parts(part: int, part_count: int, watch: Watch, found: wp.array[int], log_out: EventLog):
    """Write the events of one part behind those of the parts before it."""
    mine = part + wp.tid()
    cut = share(mine, part_count, int(watch.counters[ACTIVE]))
    q = int(0)
    for k in range(mine):
        q = q + found[k]
    if found[mine] > 0:
        for i in range(cut[0], cut[1]):
            if happens(i, watch) == 1:
                note(i, q, watch, log_out)
                q = q + 1
    if mine == part_count - 1:
        log_out.count[0] = q
