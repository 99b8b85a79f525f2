"""Adaptive substeps: each particle takes 2^level equal substeps of a frame, as many as its tolerance asks for.

A frame in which a substep's estimated error exceeds the tolerance is gone through again from its beginning with twice as many; where even
the finest do not suffice, the particle is counted. Far below the tolerance the next frame has half as many. The past, known at
equal distances, goes along: its polynomial is read at the new ones. No collisions, no neighbors (warpsim/scene/pacing.py refuses them).
"""

import warp as wp

from warpsim.kernels.advance import gather_body, living_step, store_body
from warpsim.kernels.emission import ACTIVE, COARSE, Particles, count_one
from warpsim.kernels.environment import Environment
from warpsim.kernels.integration import FORMS, METHODS, Body, Pace
from warpsim.kernels.loops import share

MARGIN = 2.0  # how much further below the tolerance than doubled substeps would reach
ORDERS = {"abm_pece_2": 2, "abm_pece_4": 4}


@wp.struct
class Care:
    tolerance: float  # how far one substep's error may carry a particle by the frame's end [m]
    finest: int  # level of the shortest substeps; the environment's moments are half of these apart


@wp.func
def pace_at(level: int, pace: Pace) -> Pace:
    """Return the pace of a frame in 2^level substeps."""
    paced = pace
    paced.substep_count = 1 << level
    paced.dt = 1.0 / (pace.fps * float(paced.substep_count))
    paced.first = 0
    paced.last = paced.substep_count
    return paced


@wp.func(inline=True)
def past_at(n: wp.vec3, d1: wp.vec3, d2: wp.vec3, d3: wp.vec3, s: float) -> wp.vec3:
    """Return n + s ∇ + s(s+1)/2 ∇² + s(s+1)(s+2)/6 ∇³, the polynomial through past values at s < 0.  Source: Newton 1687."""
    return n + (d1 + (d2 + d3 * ((s + 2.0) / 3.0)) * (0.5 * (s + 1.0))) * s


def respacing(order: int, drive):
    """Make the change of a body's past to other substeps, for one order and form."""

    @wp.func
    def respace(body: Body, ratio: float) -> Body:
        """Return the body with its past at `ratio` times the distance; with too little of it, without."""
        n = drive(body)
        d1 = n - body.past1
        d2 = wp.vec3()
        d3 = wp.vec3()
        if order > 2:
            d2 = d1 - (body.past1 - body.past2)
            d3 = d2 - ((body.past1 - body.past2) - (body.past2 - body.past3))
        body.kept = wp.where(body.kept >= order - 1, body.kept, 0)
        body.past1 = past_at(n, d1, d2, d3, -ratio)
        body.past2 = past_at(n, d1, d2, d3, -2.0 * ratio)
        body.past3 = past_at(n, d1, d2, d3, -3.0 * ratio)
        return body

    return respace


def trial(step):
    """Make the passage through a frame at a given level, by one method."""

    @wp.func
    def try_frame(body: Body, level: int, care: Care, pace: Pace, environment: Environment) -> Body:
        """Return the body after a frame in 2^level substeps, its position_error the worst of them; cut short where finer ones are left."""
        paced = pace_at(level, pace)
        body.dt = paced.dt
        body.stride = 1 << (care.finest - level)
        worst = float(0.0)
        for s in range(paced.substep_count):
            body = step(body, s, living_step(body.age, body.lifetime, 0, s, paced), environment)
            error = body.position_error + body.velocity_error / pace.fps
            if not error <= worst:  # a NaN is the worst
                worst = error
            if not worst <= care.tolerance and level < care.finest:
                break
        body.position_error = worst
        return body

    return try_frame


def careful_loop(order: int, feel, step, respace):
    """Make the frame of one particle by one method."""
    try_frame = trial(step)

    @wp.func
    def advance_carefully(
        i: int,
        frame: int,
        care: Care,
        pace: Pace,
        environment: Environment,
        particles_inout: Particles,
        counters_inout: wp.array[wp.int64],
    ) -> Body:
        """Return the body in slot i after the frame, at the coarsest level that keeps the tolerance; note the level for the next one."""
        begin = feel(gather_body(i, frame, pace, environment, particles_inout), 0, environment)
        known = int(particles_inout.level[i])  # at its distances is the past known
        if frame == particles_inout.birth_frame[i]:
            known = 0
        level = int(known)
        body = try_frame(begin, level, care, pace, environment)
        while level < care.finest and not body.position_error <= care.tolerance:
            level = level + 1
            body = try_frame(respace(begin, 1.0 / float(1 << (level - known))), level, care, pace, environment)
        if not body.position_error <= care.tolerance:
            count_one(COARSE, counters_inout)
        elif level > 0 and body.position_error * (MARGIN * float(1 << (order + 1))) < care.tolerance:
            level = level - 1
            body = respace(body, 2.0)
        particles_inout.level[i] = level
        return body

    return advance_carefully


def careful_kernels(name: str, advance):
    """Make the plain kernel of one method, and the loop over a part of the particles for the CPU."""

    @wp.kernel(name=f"advance_{name}_carefully", module=f"warpsim.kernels.adaptive.{name}", enable_backward=False)
    def advance_particles(
        first: int,
        care: wp.array[Care],
        pace: Pace,
        clock: wp.array[wp.int64],
        environment: wp.array[Environment],
        particles_inout: Particles,
        counters_inout: wp.array[wp.int64],
    ):
        """Advance every active particle through the frame; what is asked of it is one row, so that it can change."""
        i = first + wp.tid()
        if wp.int64(i) < counters_inout[ACTIVE]:
            frame = int(clock[0])
            body = advance(i, frame, care[0], pace, environment[0], particles_inout, counters_inout)
            store_body(i, frame, body, pace, environment[0], particles_inout, counters_inout)

    @wp.kernel(name=f"advance_{name}_carefully_loop", module=f"warpsim.kernels.adaptive.{name}_loop", enable_backward=False)
    def advance_part(
        part: int,
        part_count: int,
        care: wp.array[Care],
        pace: Pace,
        clock: wp.array[wp.int64],
        environment: wp.array[Environment],
        particles_inout: Particles,
        counters_inout: wp.array[wp.int64],
    ):
        """Advance one part of the active particles through the frame, one by one: each has substeps of its own."""
        cut = share(part + wp.tid(), part_count, int(counters_inout[ACTIVE]))
        frame = int(clock[0])
        for i in range(cut[0], cut[1]):
            body = advance(i, frame, care[0], pace, environment[0], particles_inout, counters_inout)
            store_body(i, frame, body, pace, environment[0], particles_inout, counters_inout)

    return advance_particles, advance_part


ADVANCE = {}  # by method: plain kernel and loop
for _prefix, _form in FORMS.items():
    for _name, _order in ORDERS.items():
        _method = _prefix + _name
        _loop = careful_loop(_order, *METHODS[_method], respacing(_order, _form.drive))
        ADVANCE[_method] = careful_kernels(_method, _loop)
