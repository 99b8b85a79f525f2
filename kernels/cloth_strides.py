"""A whole substep of semi_implicit_euler of a sheet in one pass over its rows, on the CPU: springs, wind, drag, gravity, motion.

A row moves as soon as its sums are complete: those below have it in their buffers already. Where two cores' parts meet, two rows on either
side are read by both, and only get their new velocities noted at first; they move in a second pass, after all have met, which also
holds the pins. The bits are those of the stages that do this one by one (cloth_loops.py, loops.py, springs.py).
"""

import warp as wp

from warpsim.kernels.advance import living_step
from warpsim.kernels.cloth import Sheet, sheet_pull
from warpsim.kernels.cloth_loops import PULL_BUFFERS, SPRINGS_AND_AIR, WIND_BUFFERS, rows_text, share_rows
from warpsim.kernels.emission import FAULT, Particles
from warpsim.kernels.environment import Environment, drag_rate
from warpsim.kernels.integration import Pace, drift, felt_time, inside, push
from warpsim.kernels.lifetime import age_at
from warpsim.kernels.planar import read3, write3
from warpsim.kernels.springs import Pins, hold_pin, spring_force

MOVE = """
                const float *radius = particles.radius.data + p, *mass = particles.mass.data + p;
                float XN[3][B], VN[3][B];
                auto move = [&](auto rate, auto felt) {
                    for (int i = 0; i < B; ++i) {
                        const float k = rate(i);
                        PUT(VN, i, $push(AT(speed[j % 3], mine + i), vec(), environment.gravity + AT(pull, i), k, felt(k)))
                        PUT(XN, i, $drift(AT(place[j % 3], mine + i), AT(VN, i), h))
                    }
                };
                auto drag = [&](int i) {
                    const int m = i < n ? i : 0;
                    return $drag_rate(environment.alpha, environment.viscosity, radius[m], 1.0f / mass[m]);
                };
                const bool drags = environment.alpha > 0.0f || environment.viscosity > 0.0f;
                if (drags) move(drag, [&](float k) { return $felt_time(k, h); });
                else move([](int) { return 0.0f; }, [&](float) { return h; });  // two rows of the slab and an exponential less
                const bool shared = (begin > 0 && j < begin + 2) || (end < ny && j >= end - 2);
                float *XO = particles.position.data + p, *VO = (shared ? internal.data : particles.velocity.data) + p;
                for (int c = 0; c < 3; ++c) for (int i = 0; i < B; ++i) if (i < n) VO[c * S + i] = VN[c][i];
                if (!shared) for (int c = 0; c < 3; ++c) for (int i = 0; i < B; ++i) if (i < n) XO[c * S + i] = XN[c][i];
                int outside = 0;
                if (whole) for (int i = 0; i < n; ++i) outside += 1 - $inside(AT(XN, i), AT(VN, i), environment.extent);
                if (outside) __atomic_store_n(counters.data + @FAULT@, (wp::int64)1, __ATOMIC_RELAXED);
"""


@wp.func
def move_point(
    p: int,
    h: float,
    whole: int,
    environment: Environment,
    particles_inout: Particles,
    internal: wp.array2d[float],
    counters_inout: wp.array[wp.int64],
):
    """Let what acts on point p act for h [s], and move it; note one that leaves the world at the frame's end."""
    k = drag_rate(environment.alpha, environment.viscosity, particles_inout.radius[p], 1.0 / particles_inout.mass[p])
    v = push(read3(particles_inout.velocity, p), wp.vec3(), environment.gravity + read3(internal, p), k, felt_time(k, h))
    x = drift(read3(particles_inout.position, p), v, h)
    write3(particles_inout.velocity, p, v)
    write3(particles_inout.position, p, x)
    if whole == 1 and inside(x, v, environment.extent) == 0:
        counters_inout[FAULT] = wp.int64(1)


@wp.func_native(
    rows_text(SPRINGS_AND_AIR.replace("ENDED", MOVE), WIND_BUFFERS | PULL_BUFFERS, spring_force, drag_rate, push, felt_time, drift, inside)
)
def stride_rows(
    begin: int,
    end: int,
    moment: int,
    h: float,
    whole: int,
    environment: Environment,
    sheet: Sheet,
    particles: Particles,
    internal: wp.array2d[float],
    counters: wp.array[wp.int64],
):
    """Move a range of rows through a substep, but for those that other cores read: they only get new velocities, in `internal`."""
    for p in range(begin * sheet.nx, end * sheet.nx):
        write3(internal, p, sheet_pull(p % sheet.nx, p // sheet.nx, moment, sheet, particles))
    for p in range(begin * sheet.nx, end * sheet.nx):
        move_point(p, h, whole, environment, particles, internal, counters)


@wp.func
def span_of(pace: Pace, clock: wp.array[wp.int64], particles: Particles) -> float:
    """Return how long the points live in the substep [s], all alike: as the particles' kernels have it, nothing in the opening frame."""
    age = age_at(int(clock[0]), particles.birth_frame[0], particles.birth_age[0], pace.fps)
    return living_step(age, particles.lifetime[0], 0, pace.first, pace)


@wp.kernel(enable_backward=False)
def advance_cloth(
    part: int,
    part_count: int,
    pace: Pace,
    clock: wp.array[wp.int64],
    environment: wp.array[Environment],
    sheet: Sheet,
    particles_inout: Particles,
    internal_inout: wp.array2d[float],
    counters_inout: wp.array[wp.int64],
):
    """Move one part of the points through substep pace.first, but for the rows that other cores read."""
    cut = share_rows(part + wp.tid(), part_count, sheet.ny)
    h = span_of(pace, clock, particles_inout)
    whole = wp.where(pace.last == pace.substep_count, 1, 0)
    stride_rows(cut[0], cut[1], 2 * pace.first, h, whole, environment[0], sheet, particles_inout, internal_inout, counters_inout)


@wp.kernel(enable_backward=False)
def project_cloth(
    part: int,
    part_count: int,
    pace: Pace,
    clock: wp.array[wp.int64],
    pins: Pins,
    environment: wp.array[Environment],
    sheet: Sheet,
    internal: wp.array2d[float],
    particles_inout: Particles,
    counters_inout: wp.array[wp.int64],
):
    """Move the rows of one part that others have read, by their new velocities, and hold its pins."""
    cut = share_rows(part + wp.tid(), part_count, sheet.ny)
    h = span_of(pace, clock, particles_inout)
    for j in range(cut[0], cut[1]):
        if (cut[0] > 0 and j < cut[0] + 2) or (cut[1] < sheet.ny and j >= cut[1] - 2):
            for p in range(j * sheet.nx, (j + 1) * sheet.nx):
                v = read3(internal, p)
                write3(particles_inout.velocity, p, v)
                write3(particles_inout.position, p, drift(read3(particles_inout.position, p), v, h))
    for p in range(pins.point.shape[0]):
        if pins.point[p] >= cut[0] * sheet.nx and pins.point[p] < cut[1] * sheet.nx:
            hold_pin(p, pace.first, wp.float64(pace.dt), pins, environment[0], particles_inout, counters_inout)
