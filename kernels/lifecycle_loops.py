"""Native loop shapes of the life cycle on the CPU: births and compaction in place.

As in loops.py: the Python body of each native function is the plain loop it stands for.
"""

import warp as wp

from warpsim.kernels.birth import (
    SHAPES,
    born_age,
    born_lifetime,
    born_mass,
    born_radius,
    born_tint,
    born_velocity,
    emit_particle,
    event_segment,
    first_id,
    inherit,
    travelled,
)
from warpsim.kernels.emission import ACTIVE, BORN, LIVE, Births, Particles, Plan, Segment
from warpsim.kernels.loops import share, snippet
from warpsim.kernels.random import LINEAGE, random_words

EMIT = """
    const int S = particles.position.shape[1];
    float *P = particles.position.data, *V = particles.velocity.data;
    const auto emitter = births.emitters.data[segment.emitter];
    const int frame = (int)births.clock.data[0];
    const float frame_time = (float)(1.0 / births.fps);
#define EACH(...) _Pragma("clang loop vectorize(assume_safety)") for (int n = begin; n < end; ++n) { \\
        const int i = slot + n, j = n - segment.begin; const wp::int64 ordinal = segment.ordinal + (wp::int64)j; __VA_ARGS__ }
#define PLACE(formula) EACH(const vec x = formula; for (int c = 0; c < 3; ++c) P[i + c * S] = x[c];)
#define SEARCH(formula) for (int n = begin; n < end; ++n) { const wp::int64 ordinal = segment.ordinal + (wp::int64)(n - segment.begin); \\
        const vec x = formula; for (int c = 0; c < 3; ++c) P[slot + n + c * S] = x[c]; }
    switch (emitter.shape) { SHAPE_CASES }
    EACH(const vec v = $born_velocity(emitter, ordinal); for (int c = 0; c < 3; ++c) V[i + c * S] = v[c];)
    EACH(particles.birth_age.data[i] = $born_age(emitter, ordinal, segment, j, frame_time); particles.birth_frame.data[i] = frame;)
    if (emitter.travel[0] >= 0) for (int i = slot + begin; i < slot + end; ++i) {
        const vec x = $travelled(births, emitter, particles.birth_age.data[i], vec(P[i], P[i + S], P[i + 2 * S]));
        for (int c = 0; c < 3; ++c) P[i + c * S] = x[c];
    }
    EACH(particles.lifetime.data[i] = $born_lifetime(emitter, ordinal); particles.mass.data[i] = $born_mass(emitter, ordinal);)
    EACH(particles.radius.data[i] = $born_radius(emitter, ordinal);)
    for (int n = begin; n < end; ++n) {
        const wp::int64 number = id + (wp::int64)n;
        particles.id.data[slot + n] = (wp::uint32)number;
        particles.id.data[slot + n + S] = (wp::uint32)(number >> 32);
    }
    if (particles.tint.shape[0]) EACH(particles.tint.data[i] = $born_tint(births, emitter, ordinal);)
    if (particles.contact.shape[0]) for (int n = begin; n < end; ++n) particles.contact.data[slot + n] = 0;
    if (particles.impact.shape[0]) for (int i = slot + begin; i < slot + end; ++i) {
        for (int row = 0; row < 10; ++row) particles.impact.data[i + row * S] = row == 9 ? -1.0f : 0.0f;
        particles.impact_count.data[i] = particles.impact_number.data[i] = 0;
    }
    if (particles.lineage.shape[0]) EACH(const auto words = $random_words(emitter.key, ordinal, LINEAGE_CHANNEL);
        particles.lineage.data[i] = words[0]; particles.lineage.data[i + S] = words[1];)
#undef PLACE
#undef SEARCH
#undef EACH
"""
SHAPE_CASES = " ".join(f"case {k}: PLACE(${formula.func.__name__}(emitter, ordinal)) break;" for k, formula in enumerate(SHAPES.values()))
SHAPE_CASES = SHAPE_CASES.replace("PLACE($born_mesh(", "SEARCH($born_mesh(")  # it searches: no loop to vectorize
EMIT = EMIT.replace("SHAPE_CASES", SHAPE_CASES)
EMIT = EMIT.replace("LINEAGE_CHANNEL", str(LINEAGE))
VALUES = (born_velocity, born_age, born_lifetime, born_mass, born_radius, born_tint, random_words, travelled)


@wp.func_native(snippet(EMIT, *SHAPES.values(), *VALUES))
def emit_range(begin: int, end: int, segment: Segment, slot: int, id: wp.int64, births: Births, particles: Particles):
    """Fill the slots of the frame's births begin … end − 1, all of one segment."""
    for n in range(begin, end):
        emit_particle(slot + n, n - segment.begin, id + wp.int64(n), births, segment, particles)


@wp.func(inline=False)
def emit_run(begin: int, end: int, segment: Segment, slot: int, id: wp.int64, births: Births, particles_out: Particles):
    """Fill slots as emit_range does: one copy of so much code for all who call it."""
    emit_range(begin, end, segment, slot, id, births, particles_out)


@wp.func
def emit_children(begin: int, end: int, segment: Segment, slot: int, id: wp.int64, births: Births, particles_out: Particles):
    """Fill the slots of the frame's births begin … end − 1, all of events: event by event, each the births of one moment."""
    emitter = births.emitters[segment.emitter]
    k = int(begin)
    while k < end:
        one = event_segment(births, segment, k)
        stop = wp.min(end, one.end)
        emit_run(k, stop, one, slot, id, births, particles_out)
        for n in range(k, stop):
            inherit(slot + n, (k - segment.begin) // emitter.per_event, emitter, births.logs[emitter.log], particles_out)
        k = stop


@wp.kernel(enable_backward=False)
def emit_particles(part: int, part_count: int, births: Births, plan: Plan, counters: wp.array[wp.int64], particles_out: Particles):
    """Fill the slots of one part of this frame's births."""
    cut = share(part + wp.tid(), part_count, int(counters[BORN]))
    for s in range(plan.segment_count[0]):
        segment = plan.segments[s]
        begin = wp.max(cut[0], segment.begin)
        end = wp.min(cut[1], segment.end)
        if begin < end:
            if births.emitters[segment.emitter].log < 0:
                emit_run(begin, end, segment, int(counters[LIVE]), first_id(plan, counters), births, particles_out)
            else:
                emit_children(begin, end, segment, int(counters[LIVE]), first_id(plan, counters), births, particles_out)


COMPACT = """
    const int* keep = alive.data;
    int start = 0, w = 0;
    while (start < active && keep[start]) ++start;  // nothing before the first dead one moves
    w = start;
    for (int row = begin; row < end; row += 4) {
        wp::uint32* r[4];
        for (int k = 0; k < 4; ++k) r[k] = slab.data + (size_t)slab.shape[1] * (row + k < end ? row + k : end - 1);
        wp::uint32 *a = r[0], *b = r[1], *c = r[2], *d = r[3];
        w = start;
        for (int i = start; i < active; ++i) { a[w] = a[i]; b[w] = b[i]; c[w] = c[i]; d[w] = d[i]; w += keep[i]; }
    }
    if (begin == 0 && end > 0) counters.data[@LIVE@] = (wp::int64)w;
"""


@wp.func_native(snippet(COMPACT))
def compact_rows(begin: int, end: int, active: int, alive: wp.array[int], counters: wp.array[wp.int64], slab: wp.array2d[wp.uint32]):
    """Move the survivors of rows begin … end − 1 together, in order; the owner of row 0 counts them."""
    for row in range(begin, end):
        w = int(0)
        for i in range(active):
            slab[row, w] = slab[row, i]
            w = w + alive[i]
        if row == 0:
            counters[LIVE] = wp.int64(w)


@wp.kernel(enable_backward=False)
def scatter_in_place(
    part: int, part_count: int, alive: wp.array[int], counters_inout: wp.array[wp.int64], slab_inout: wp.array2d[wp.uint32]
):
    """Remove the expired: each core owns whole rows, so nothing races, and every row of the slab moves."""
    rows = slab_inout.shape[0]
    mine = part + wp.tid()
    compact_rows(rows * mine // part_count, rows * (mine + 1) // part_count, int(counters_inout[ACTIVE]), alive, counters_inout, slab_inout)
