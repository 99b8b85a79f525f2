"""Native loops of the staged methods for the CPU, beside the plain kernels whose bits they share; see loops.py."""

import warp as wp

from warpsim.kernels import staged
from warpsim.kernels.emission import Particles
from warpsim.kernels.environment import drag_rate, sample_felt_acceleration
from warpsim.kernels.flow import FLOWS, sample_flow
from warpsim.kernels.forces import FORCES
from warpsim.kernels.integration import drift
from warpsim.kernels.loops import FORMULAS, cases, share, snippet
from warpsim.kernels.planar import read3, write3
from warpsim.kernels.points import started
from warpsim.kernels.staged import Staging, driven

OUTER = """
    constexpr int B = @BLOCK@;
    const int S = particles.position.shape[1];
    const auto environment = staging.environment.data[0];
    float X[3][B], U[3][B], A[3][B], W[B], K[B];
    #define GET(F) vec(F[0][i], F[1][i], F[2][i])
    #define ADD(F, value) { const vec r = value; F[0][i] += r[0]; F[1][i] += r[1]; F[2][i] += r[2]; }
    #define EACH_OF_BLOCK _Pragma("clang loop vectorize(assume_safety)") for (int i = 0; i < B; ++i)
    #define FLOW(formula) EACH_OF_BLOCK { const vec x = GET(X); ADD(U, formula) }
    #define FORCE(formula) for (int i = 0; i < B; ++i) { const vec x = GET(X), w(W[i], W[i], W[i]); ADD(A, wp::cw_mul(formula, w)) }
    for (int b = begin; b < end; b += B) {
        const int n = end - b < B ? end - b : B;
        for (int i = 0; i < B; ++i) {
            for (int c = 0; c < 3; ++c) {
                X[c][i] = particles.position.data[b + i + c * S];
                U[c][i] = 0.0f;
                A[c][i] = environment.gravity[c];
            }
            W[i] = 1.0f / particles.mass.data[b + i];
            K[i] = $drag_rate(environment.alpha, environment.viscosity, particles.radius.data[b + i], W[i]);
        }
        for (int j = 0; j < environment.flow.shape[1]; ++j) {
            const auto q = environment.flow.data[moment * environment.flow.shape[1] + j];
            switch (q.kind) { FLOW_CASES }
        }
        for (int j = 0; j < environment.forces.shape[1]; ++j) {
            const auto q = environment.forces.data[moment * environment.forces.shape[1] + j];
            switch (q.kind) { FORCE_CASES }
        }
        for (int c = 0; c < 3; ++c) for (int i = 0; i < B; ++i) A[c][i] += internal.data[b + i + c * S];
        for (int i = 0; i < n; ++i) {
            const vec r = $driven(GET(A), GET(U), K[i]);
            for (int c = 0; c < 3; ++c) internal.data[b + i + c * S] = r[c];
        }
    }
"""
OUTER = OUTER.replace("FLOW_CASES", cases(FLOWS.values(), "FLOW")).replace("FORCE_CASES", cases(FORCES.values(), "FORCE"))
OUTER = OUTER.replace("\n    #define", "\n#define")
OUTER_MACROS = "".join(f"#undef {macro}\n" for macro in ("GET", "ADD", "EACH_OF_BLOCK", "FLOW", "FORCE"))

POINTS = """
    constexpr int B = @BLOCK@;
    const int S = particles.position.shape[1];
    const auto environment = staging.environment.data[0];
    const float h = staging.h;
    const vec still(0.0f, 0.0f, 0.0f);
    float X[3][B], V[3][B], X0[3][B], V0[3][B], N[3][B], NOW[3][B], MIDDLE[3][B], SLIDE[3][B], R1[3][B], R2[3][B], R3[3][B], K[B];
    int kept[B];
    // Copies as such: as loops, which the compiler cuts and unrolls at length, they took it half of its time.
    #define LOAD(F, array, row) for (int c = 0; c < 3; ++c) __builtin_memcpy(F[c], array.data + b + (row + c) * S, sizeof F[c]);
    #define SAVE(F, array, row) for (int c = 0; c < 3; ++c) __builtin_memcpy(array.data + b + (row + c) * S, F[c], n * sizeof(float));
    #define GET(F) vec(F[0][i], F[1][i], F[2][i])
    #define PUT(F, value) { const vec r = value; F[0][i] = r[0]; F[1][i] = r[1]; F[2][i] = r[2]; }
    #define PUT_IF(F, flag, value) { const vec r = value; for (int c = 0; c < 3; ++c) F[c][i] = flag ? r[c] : F[c][i]; }
    #define EACH(...) _Pragma("clang loop unroll(disable)") for (int i = 0; i < B; ++i) { const float k = K[i]; __VA_ARGS__ }
    for (int b = begin; b < end; b += B) {
        const int n = end - b < B ? end - b : B;  // slots beyond are computed, never stored
        LOAD(X, particles.position, 0) LOAD(V, particles.velocity, 0) LOAD(X0, staging.start, 0) LOAD(V0, staging.start, 3)
        LOAD(N, staging.drive, 0) LOAD(NOW, staging.now, 0) SUMS
        _Pragma("clang loop unroll(disable)")
        for (int i = 0; i < B; ++i) K[i] = $drag_rate(environment.alpha, environment.viscosity, particles.radius.data[b + i],
                                                      1.0f / particles.mass.data[b + i]);
        PAST
        STAGE
        _Pragma("clang loop unroll(disable)")
        for (int i = 0; i < n; ++i) if (staging.free.data[b + i] > 0.0f) for (int c = 0; c < 3; ++c) {
            particles.position.data[b + i + c * S] = X[c][i];
            particles.velocity.data[b + i + c * S] = V[c][i];
        }
        SAVE(NOW, staging.now, 0) KEEP
    }
"""
POINTS_MACROS = "".join(f"#undef {macro}\n" for macro in ("LOAD", "SAVE", "GET", "PUT", "PUT_IF", "EACH"))
END = """
                 const vec m = GET(MIDDLE) * 0.5f, n1 = $middle_slope(GET(NOW), m, GET(N)), n2 = $middle_bend(GET(NOW), m, GET(N));
                 const auto w = $exponential_weights(k * h);
                 const vec x = $drift(GET(X0), GET(SLIDE) + GET(V), h * (1.0f / 6.0f));
                 const vec v = $glide_velocity(GET(V0), $pull(GET(NOW), GET(V0), k), n1, n2, still, w, h);"""
RUNGE_KUTTA = (  # line by line as in staged.py
    """EACH(PUT(NOW, GET(N)) PUT(SLIDE, GET(V0)) PUT(X, $drift(GET(X0), GET(V0), 0.5f * h)) PUT(V, $half_kick(GET(V0), GET(N), k, h)))""",
    """EACH(PUT(MIDDLE, GET(N)) PUT(SLIDE, $drift(GET(SLIDE), GET(V), 2.0f)) PUT(X, $drift(GET(X0), GET(V), 0.5f * h))
             PUT(V, $half_kick(GET(V0), GET(N), k, h)))""",
    """EACH(PUT(MIDDLE, GET(MIDDLE) + GET(N)) PUT(SLIDE, $drift(GET(SLIDE), GET(V), 2.0f)) PUT(X, $drift(GET(X0), GET(V), h))
             PUT(V, $half_kick($half_kick(GET(V0), GET(NOW), k, h), GET(N) * 2.0f - GET(NOW), k, h)))""",
    f"EACH({END} PUT(X, x) PUT(V, v))",
)
START = f"""EACH({END}
                 const bool short_of = kept[i] < ORDER - 1;
                 PUT_IF(X, short_of, x) PUT_IF(V, short_of, v) PUT_IF(R1, short_of, GET(NOW))
                 PUT_IF(R2, short_of, GET(NOW) - n1 + n2 * 0.5f) PUT_IF(R3, short_of, GET(NOW) - n1 * 2.0f + n2 * 2.0f)
                 kept[i] = short_of ? @JUST_BEGUN@ : kept[i];)"""
PREDICT = """EACH(const vec now = GET(N), g = $pull(now, GET(V0), k);
                 DIFFERENCES
                 const vec n1 = $first_slope(d1, d2, d3), n2 = $second_slope(d2, d3);
                 const auto w = $exponential_weights(k * h);
                 const vec v = $glide_velocity(GET(V0), g, n1, n2, d3, w, h);
                 PLACE
                 const bool moves = ORDER < 3 || kept[i] < @JUST_BEGUN@;
                 PUT(NOW, now) PUT_IF(X, moves, x) PUT_IF(V, moves, v))"""
PLACES = (
    "const vec x = $glide_position(GET(X0), GET(V0), g, n1, n2, d3, w, h);",
    """const vec y = $glide_position(GET(X0), GET(V0), g, n1, n2, d3, w, h), z = $drift(GET(X0), v, h);
                 const bool knows = kept[i] > 0;
                 const vec x(knows ? y[0] : z[0], knows ? y[1] : z[1], knows ? y[2] : z[2]);""",
)
DIFFERENCES = (  # by order - 1
    "const vec d1 = still, d2 = still, d3 = still;",
    "const vec d1 = $first_difference(now, GET(R1)) * (kept[i] > 0 ? 1.0f : 0.0f), d2 = still, d3 = still;",
    """const vec d1 = $first_difference(now, GET(R1)) * (kept[i] > 0 ? 1.0f : 0.0f), d3 = still;
                 const vec d2 = $second_difference(now, GET(R1), GET(R2)) * (kept[i] > 1 ? 1.0f : 0.0f);""",
    """const vec d1 = $first_difference(now, GET(R1)) * (kept[i] > 0 ? 1.0f : 0.0f);
                 const vec d2 = $second_difference(now, GET(R1), GET(R2)) * (kept[i] > 1 ? 1.0f : 0.0f);
                 const vec d3 = $third_difference(now, GET(R1), GET(R2), GET(R3)) * (kept[i] > 2 ? 1.0f : 0.0f);""",
)
AHEAD = {
    1: "const vec d1 = $first_difference(GET(N), now), d2 = still, d3 = still;",
    4: """const vec near = $first_difference(GET(N), now), here = $first_difference(now, GET(R1));
                 const vec newest = $second_difference(GET(N), now, GET(R1)) * (kept[i] > 0 ? 1.0f : 0.0f);
                 const vec older = $second_difference(now, GET(R1), GET(R2));
                 const bool one = kept[i] > 0, two = kept[i] > 1;
                 const vec d1(one ? here[0] : near[0], one ? here[1] : near[1], one ? here[2] : near[2]);
                 const vec d2(two ? older[0] : newest[0], two ? older[1] : newest[1], two ? older[2] : newest[2]);
                 const vec d3 = $third_difference(GET(N), now, GET(R1), GET(R2)) * (two ? 1.0f : 0.0f);""",
}
CORRECT = """EACH(const vec now = GET(NOW), g = $pull(now, GET(V0), k);
                 AHEAD
                 const vec n1 = $first_slope(d1, d2, d3), n2 = $second_slope(d2, d3);
                 const auto w = $exponential_weights(k * h);
                 const bool moves = ORDER < 3 || kept[i] < @JUST_BEGUN@;
                 PUT_IF(X, moves, $glide_position(GET(X0), GET(V0), g, n1, n2, d3, w, h))
                 PUT_IF(V, moves, $glide_velocity(GET(V0), g, n1, n2, d3, w, h)))"""
REMEMBER = """
        EACH(const bool shifts = kept[i] < @JUST_BEGUN@;
             PUT_IF(R3, shifts, GET(R2)) PUT_IF(R2, shifts, GET(R1)) PUT_IF(R1, shifts, GET(NOW))
             kept[i] = kept[i] + 1 < 3 ? kept[i] + 1 : 3;)"""
GLIDES = (*vars(staged.GLIDES32).values(), drag_rate, drift, staged.half_kick)


def adams_text(name: str) -> str:
    """Return the text of one of Adams' stages by its name in staged.ADAMS."""
    what, order = name.split("_")
    text = {"start": START, "correct": CORRECT}.get(what, PREDICT)
    text = text.replace("DIFFERENCES", DIFFERENCES[int(order) - 1]).replace("AHEAD", AHEAD[4 if order == "4" else 1])
    return text.replace("PLACE", PLACES[what == "predict"]).replace("ORDER", order)


def points_text(stage: str, order: int, keeps: bool) -> str:
    """Assemble the loop of one stage; order 0: one by Runge and Kutta, which has no past but sums."""
    rows = [f"(R{j + 1}, particles.history, {3 * j})" for j in range(order - 1)]
    past = " ".join(f"LOAD{row}" for row in rows) + (
        " __builtin_memcpy(kept, particles.history_count.data + b, sizeof kept);" if rows else ""
    )
    kept = " ".join(f"SAVE{row}" for row in rows) + (
        " __builtin_memcpy(particles.history_count.data + b, kept, n * sizeof(int));" if rows else ""
    )
    sums = "LOAD(MIDDLE, staging.middle, 0) LOAD(SLIDE, staging.slide, 0)"
    text = POINTS.replace("SUMS", sums if "MIDDLE" in stage or "SLIDE" in stage else "").replace("PAST", past)
    text = text.replace("KEEP", kept if order else sums.replace("LOAD", "SAVE")).replace("STAGE", stage + (REMEMBER if keeps else ""))
    text = text.replace("@JUST_BEGUN@", str(int(staged.JUST_BEGUN))).replace("\n    #define", "\n#define")
    return snippet(text, *GLIDES) + POINTS_MACROS


@wp.func_native(snippet(OUTER, *FORMULAS, driven) + OUTER_MACROS)
def outer_range(begin: int, end: int, moment: int, staging: Staging, particles: Particles, internal: wp.array2d[float]):
    """Add what acts from without to a range of points."""
    for i in range(begin, end):
        environment = staging.environment[0]
        x = read3(particles.position, i)
        a = sample_felt_acceleration(environment, moment, 1.0 / particles.mass[i], x) + read3(internal, i)
        k = drag_rate(environment.alpha, environment.viscosity, particles.radius[i], 1.0 / particles.mass[i])
        write3(internal, i, driven(a, sample_flow(environment.flow, moment, x), k))


@wp.kernel(enable_backward=False)
def accumulate_outer(part: int, part_count: int, moment: int, staging: Staging, particles: Particles, internal_inout: wp.array2d[float]):
    """Add what acts from without to one part of the points."""
    cut = share(part + wp.tid(), part_count, staging.count)
    outer_range(cut[0], cut[1], moment, staging, particles, internal_inout)


def stage_loop(name: str, text: str, formula, order: int, keeps: bool):
    """Make the native loop kernel of one stage."""

    @wp.func_native(points_text(text, order, keeps))
    def stage_range(begin: int, end: int, staging: Staging, particles: Particles):
        """Move a range of points."""
        for i in range(begin, end):
            c = formula(staged.gather_stages(i, staging, staged.gather_course(i, staging, particles)))
            staged.store_course(i, staged.remember(c), staging, particles)

    @wp.kernel(name=f"advance_{name}_loop", module=f"warpsim.kernels.staged_loops.{name}", enable_backward=False)
    def advance_stage(part: int, part_count: int, staging_inout: Staging, particles_inout: Particles):
        """Move one part of the points."""
        if started(staging_inout.clock, staging_inout.opening):
            cut = share(part + wp.tid(), part_count, staging_inout.count)
            stage_range(cut[0], cut[1], staging_inout, particles_inout)

    return advance_stage


STAGES = {
    f"stage_{place}": stage_loop(f"stage_{place}", text, formula, 0, False)
    for place, (text, formula) in enumerate(zip(RUNGE_KUTTA, staged.RUNGE_KUTTA, strict=True))
}
STAGES |= {name: stage_loop(name, adams_text(name), *what) for name, what in staged.ADAMS.items()}
