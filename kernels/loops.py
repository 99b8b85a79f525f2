"""Native loop shapes for the CPU, beside the plain kernels whose bits they share.

A snippet is only the loop; it calls the wp.func formulas, and the compiler vectorizes it (Warp's own loops of `goto`s never
do). The Python body of a native function is the plain loop it stands for: Warp builds that too, so the formulas are emitted
before the snippet and counted in the module's hash. No fast-math: IEEE arithmetic gives the same bits for every split, tail,
vector width and for the plain kernels. Empty for CUDA. Measured in docs/adr/0003-native-loops.md.
"""

import warp as wp

from warpsim.kernels.advance import AMONG_COLLIDERS, LOOPS, advance_flight, living_step, store_body
from warpsim.kernels.clearance import CLEARANCES
from warpsim.kernels.collider import into_frame
from warpsim.kernels.contact import path_reach
from warpsim.kernels.elementary import decay_series
from warpsim.kernels.emission import ACTIVE, Particles
from warpsim.kernels.encounter import meet_colliders
from warpsim.kernels.environment import Environment, drag_rate
from warpsim.kernels.expression_loops import BLOCK_FORMULAS, EXPRESSION_BLOCK
from warpsim.kernels.flow import FLOWS, LONG_FLOWS
from warpsim.kernels.forces import FORCES
from warpsim.kernels.integration import KIT, Pace, ballistic_position, drift, felt_time, inside, push
from warpsim.kernels.lifetime import age_at
from warpsim.kernels.multistep_loops import DECLARATIONS, LOAD, STORE, multistep_texts
from warpsim.kernels.removal_loops import chunk_size, close_ranks
from warpsim.kernels.snippets import share, snippet

WHOLE_BLOCKS = {"sample_expression": EXPRESSION_BLOCK}  # formulas that have loops of their own


def cases(formulas, macro, row="q", without=()):
    """Write a switch over kinds, so that the kind is decided once per block and not per particle; some formulas may be left out."""
    loops = (WHOLE_BLOCKS.get(f.func.__name__) or f"{macro}(${f.func.__name__}({row}, x))" for f in formulas)
    return " ".join(f"case {kind}: {loop} break;" for kind, (f, loop) in enumerate(zip(formulas, loops, strict=True)) if f not in without)


PROLOGUE = """
    constexpr int B = @BLOCK@;
    const int S = particles.position.shape[1];
    float *P = particles.position.data, *Q = particles.velocity.data;
    float *birth_age = particles.birth_age.data, *L = particles.lifetime.data;
    int *birth_frame = particles.birth_frame.data, *alive = particles.alive.data;
    alignas(64) float X[3][B], V[3][B], U[3][B], A[3][B], I[3][B], XB[3][B], VB[3][B], X0[3][B], V0[3][B], DX[3][B], DV[3][B];
    alignas(64) float H[B], K[B], W[B], age[B], life[B];
    alignas(64) int dead[B], kept[B], near[B];
MEMORY    const int coupled = particles.internal.shape[0] > 0, sticks = particles.contact.shape[0] > 0;
    #define GET(F) vec(F[0][i], F[1][i], F[2][i])
    #define PUT(F, value) { const vec r = value; F[0][i] = r[0]; F[1][i] = r[1]; F[2][i] = r[2]; }
    // Chains of a hundred operations: several vectors beside each other, for a core sees only some 400 instructions ahead.
    #define EACH(...) _Pragma("clang loop interleave_count(2)") for (int i = 0; i < B; ++i) { const float h = H[i], k = K[i]; __VA_ARGS__ }
    #define KICK(v, u, a, k, h) $push(v, u, a, k, strong ? $felt_time(k, h) : h * $decay_series(k * h))
    #define ADD(F, value) { const vec r = value; F[0][i] += r[0]; F[1][i] += r[1]; F[2][i] += r[2]; }
    // What a formula reads through a pointer, a grid's velocities, is none of the block's arrays: the compiler may gather it.
    #define EACH_OF_BLOCK _Pragma("clang loop vectorize(assume_safety) interleave_count(4)") for (int i = 0; i < B; ++i)
    #define FLOW(formula) EACH_OF_BLOCK { const vec x = GET(X); ADD(U, formula) }
    #define FORCE(formula) for (int i = 0; i < B; ++i) { const vec x = GET(X), w(W[i], W[i], W[i]); ADD(A, wp::cw_mul(formula, w)) }
    #define NEAR(formula) for (int i = 0; i < B; ++i) { \\
        const float reach = $path_reach(c, half, whole, GET(XB), GET(VB), GET(X), GET(V), H[i], pace.dt); \\
        const vec x = $into_frame(c.center, c.rotation, GET(XB)); near[i] |= !(formula > reach); }
    auto flow = [&](int moment) {
        const int count = environment.flow.shape[1];
        const auto *rows = environment.flow.data + moment * count;
        int j = 0;
        vec wind(0.0f, 0.0f, 0.0f);  // what comes first and is the same everywhere is summed once for the block
        for (; j < count && rows[j].kind == @UNIFORM@; ++j) wind = wp::add(wind, $sample_uniform(rows[j], wind));
        for (int c = 0; c < 3; ++c) for (int i = 0; i < B; ++i) U[c][i] = wind[c];
        for (; j < count; ++j) {
            const auto q = rows[j];
            switch (q.kind) { FLOW_CASES }
        }
    };
    FORCE_LAMBDA
    const vec still(0.0f, 0.0f, 0.0f);
    for (int b = begin; b < end; b += B) {
        const int n = end - b < B ? end - b : B;  // dead slots are computed, never stored
        for (int i = 0; i < B; ++i) {
            for (int c = 0; c < 3; ++c) { X[c][i] = P[b + i + c * S]; V[c][i] = Q[b + i + c * S]; }
            age[i] = $age_at(frame, birth_frame[b + i], birth_age[b + i], pace.fps);
            life[i] = L[b + i];
            W[i] = 1.0f / particles.mass.data[b + i];
            K[i] = $drag_rate(environment.alpha, environment.viscosity, particles.radius.data[b + i], W[i]);
            dead[i] = pace.first > 0 ? 1 - alive[b + i] : 0;
        }
        int strong = 0;  // 0: no drag in the block leaves the series of mean_decay(), and its other branch is not worked out
        for (int i = 0; i < B; ++i) strong |= !(K[i] * pace.dt < 0.5f);
        if (coupled) for (int c = 0; c < 3; ++c) for (int i = 0; i < B; ++i) I[c][i] = particles.internal.data[b + i + c * S];
RECALL"""
FORCE_LAMBDA = """const int weighs_alone = environment.forces.shape[1] == 0 && !coupled;
    for (int c = 0; c < 3; ++c) for (int i = 0; i < B; ++i) A[c][i] = environment.gravity[c];
    auto force = [&](int moment) {
        if (weighs_alone) return;  // what it was filled with above is all there is
        for (int c = 0; c < 3; ++c) for (int i = 0; i < B; ++i) A[c][i] = environment.gravity[c];
        for (int j = 0; j < environment.forces.shape[1]; ++j) {
            const auto q = environment.forces.data[moment * environment.forces.shape[1] + j];
            switch (q.kind) { FORCE_CASES }
        }
        if (coupled) for (int c = 0; c < 3; ++c) for (int i = 0; i < B; ++i) A[c][i] += I[c][i];
    };"""
SUBSTEPS = """
        for (int s = pace.first; s < pace.last; ++s) {
            for (int i = 0; i < B; ++i) H[i] = $living_step(age[i], life[i], dead[i], s, pace);
BEGIN_CONTACTS"""
BEGIN_CONTACTS = """
            for (int c = 0; c < 3; ++c) for (int i = 0; i < B; ++i) { XB[c][i] = X[c][i]; VB[c][i] = V[c][i]; }
"""
CONTACTS = """
            {
                for (int i = 0; i < B; ++i) near[i] = 0;
                for (int j = 0; j < environment.colliders.shape[1]; ++j) {
                    const auto *q = environment.colliders.data + 2 * s * environment.colliders.shape[1] + j;
                    const auto c = q[0], half = q[environment.colliders.shape[1]], whole = q[2 * environment.colliders.shape[1]];
                    switch (c.kind) { NEAR_CASES }
                }
                int hits = 0;
                if (s == 0 && particles.impact.shape[0] > 0) for (int i = 0; i < n; ++i) particles.impact.data[b + i + 9 * S] = -1.0f;
                for (int i = 0; i < n; ++i) {
                    if (!(H[i] > 0.0f) || !(near[i] || (sticks && particles.contact.data[b + i]))) continue;
                    const vec x0 = GET(XB), v0 = GET(VB), x1 = GET(X), v1 = GET(V);
                    const auto p = $meet_colliders(b + i, s, H[i], age[i], x0, v0, x1, v1, pace, environment, particles, counters);
                    PUT(X, p.x) PUT(V, p.v)
                    dead[i] = p.dead;
                    if (p.hits) kept[i] = 0;
                    hits += p.hits;
                }
                if (hits) { FEEL_AGAIN }
            }
"""
EPILOGUE = """
        }
STORE_PAST        const int whole = pace.last == pace.substep_count;
        int outside = 0;
        for (int i = 0; i < n; ++i) {
            for (int c = 0; c < 3; ++c) { P[b + i + c * S] = X[c][i]; Q[b + i + c * S] = V[c][i]; }
            const int lives = (1 - dead[i]) & (whole ? age[i] < life[i] : 1);
            const int in = whole ? $inside(GET(X), GET(V), environment.extent) : 1;
            outside += lives & (1 - in);
            alive[b + i] = environment.policy == @KILL@ ? lives & in : lives;
        }
        if (outside && environment.policy == @KILL@) __atomic_fetch_add(counters.data + @KILLED@, (wp::int64)outside, __ATOMIC_RELAXED);
        else if (outside) __atomic_store_n(counters.data + @FAULT@, (wp::int64)1, __ATOMIC_RELAXED);
    }
"""
TEXTS = {  # by method: what it feels before the first substep and after a collision (at moment m), and a substep
    "euler": (
        "",
        "flow(2 * s); force(2 * s); EACH(vec x = $drift(GET(X), GET(V), h); PUT(V, KICK(GET(V), GET(U), GET(A), k, h)) PUT(X, x))",
    ),
    "drift_kick": (
        "",
        "EACH(PUT(X, $drift(GET(X), GET(V), h))) flow(2 * s + 2); force(2 * s + 2); EACH(PUT(V, KICK(GET(V), GET(U), GET(A), k, h)))",
    ),
    "semi_implicit_euler": (
        "",
        "flow(2 * s); force(2 * s); EACH(PUT(V, KICK(GET(V), GET(U), GET(A), k, h)) PUT(X, $drift(GET(X), GET(V), h)))",
    ),
    "verlet": (
        "flow(m); force(m);",
        """EACH(PUT(V, KICK(GET(V), GET(U), GET(A), k, 0.5f * h)) PUT(X, $drift(GET(X), GET(V), h)))
            flow(2 * s + 2); force(2 * s + 2); EACH(PUT(V, KICK(GET(V), GET(U), GET(A), k, 0.5f * h)))""",
    ),
    "rk4": (
        "flow(m); force(m);",
        """EACH(PUT(V, KICK(GET(V), GET(U), still, k, 0.5f * h)) PUT(X0, GET(X)) PUT(V0, GET(V)) PUT(DX, GET(V)) PUT(DV, GET(A))
                 PUT(X, $drift(GET(X0), GET(V), 0.5f * h)) PUT(V, $drift(GET(V0), GET(A), 0.5f * h)))
            for (int stage = 0; stage < 2; ++stage) {
                force(2 * s + 1);
                EACH(const float g = stage == 0 ? 0.5f * h : h;
                     PUT(DX, $drift(GET(DX), GET(V), 2.0f)) PUT(DV, $drift(GET(DV), GET(A), 2.0f))
                     PUT(X, $drift(GET(X0), GET(V), g)) PUT(V, $drift(GET(V0), GET(A), g)))
            }
            force(2 * s + 2);
            EACH(PUT(X, $drift(GET(X0), $drift(GET(DX), GET(V), 1.0f), h / 6.0f))
                 PUT(V, $drift(GET(V0), $drift(GET(DV), GET(A), 1.0f), h / 6.0f)))
            flow(2 * s + 2); force(2 * s + 2); EACH(PUT(V, KICK(GET(V), GET(U), still, k, 0.5f * h)))""",
    ),
    "tracer_euler": ("flow(m);", "EACH(PUT(X, $drift(GET(X), GET(U), h))) flow(2 * s + 2); EACH(PUT(V, GET(U)))"),
    "tracer_rk4": (
        "flow(m);",
        """EACH(PUT(X0, GET(X)) PUT(DX, GET(U)) PUT(X, $drift(GET(X0), GET(U), 0.5f * h)))
            for (int stage = 0; stage < 2; ++stage) {
                flow(2 * s + 1);
                EACH(PUT(DX, $drift(GET(DX), GET(U), 2.0f)) PUT(X, $drift(GET(X0), GET(U), stage == 0 ? 0.5f * h : h)))
            }
            flow(2 * s + 2); EACH(PUT(X, $drift(GET(X0), $drift(GET(DX), GET(U), 1.0f), h / 6.0f)))
            flow(2 * s + 2); EACH(PUT(V, GET(U)))""",
    ),
}
MULTISTEP_TEXTS, PAST = multistep_texts()
TEXTS |= MULTISTEP_TEXTS
MACROS = ("GET", "PUT", "ADD", "EACH", "KICK", "EACH_OF_BLOCK", "FLOW", "FORCE", "NEAR")
FORMULAS = (*FLOWS.values(), *FORCES.values(), age_at, drag_rate, living_step, inside, push, felt_time, decay_series, drift)
FORMULAS += (*BLOCK_FORMULAS, *vars(KIT.glides).values(), KIT.whole_step)
CONTACT_FORMULAS = (*CLEARANCES.values(), into_frame, path_reach, meet_colliders)  # among colliders besides


def advance_text(loop: str, long_flows: tuple[str, ...]) -> str:
    """Assemble the loop of one method, free or among colliders, with those of the long flows that are felt."""
    name, among = loop.removesuffix(AMONG_COLLIDERS), loop.endswith(AMONG_COLLIDERS)
    feel, step = TEXTS[name]
    text = PROLOGUE + feel.replace("(m)", "(2 * pace.first)") + SUBSTEPS + step + (CONTACTS if among else "") + EPILOGUE
    text = text.replace("BEGIN_CONTACTS", BEGIN_CONTACTS if among else "")
    past = PAST.get(name, 0)
    for place, part in {"MEMORY": DECLARATIONS, "RECALL": LOAD, "STORE_PAST": STORE}.items():
        text = text.replace(place, part.replace("PAST", str(past)) if past else DECLARATIONS if place == "MEMORY" else "")
    text = text.replace("FEEL_AGAIN", feel.replace("(m)", "(2 * s + 2)"))
    text = text.replace("FORCE_LAMBDA", FORCE_LAMBDA if "force(" in step else "")  # a tracer's plain loop calls no force
    left_out = [FLOWS[name] for name in LONG_FLOWS if name not in long_flows]
    text = text.replace("FLOW_CASES", cases(FLOWS.values(), "FLOW", without=left_out))
    text = text.replace("FORCE_CASES", cases(FORCES.values(), "FORCE"))
    text = text.replace("NEAR_CASES", cases(CLEARANCES.values(), "NEAR", "c"))
    formulas = (*FORMULAS, *(CONTACT_FORMULAS if among else ()))
    return snippet(text.replace("\n    #define", "\n#define"), *formulas) + "".join(f"#undef {macro}\n" for macro in MACROS)


def advance_loop(name, loop, module, text):
    """Make the native loop kernels of one method, in a module of their own."""

    @wp.func_native(text)
    def advance_range(
        begin: int,
        end: int,
        frame: int,
        pace: Pace,
        environment: Environment,
        particles: Particles,
        counters: wp.array[wp.int64],
    ):
        """Advance a range of particles through the frame."""
        for i in range(begin, end):
            body = loop(i, frame, pace, environment, particles, counters)
            store_body(i, frame, body, pace, environment, particles, counters)

    @wp.kernel(name=f"advance_{name}_loop", module=module, enable_backward=False)
    def advance_particles(
        part: int,
        part_count: int,
        pace: Pace,
        clock: wp.array[wp.int64],
        environment: wp.array[Environment],
        particles_inout: Particles,
        counters_inout: wp.array[wp.int64],
    ):
        """Advance one part of the active particles through the frame."""
        cut = share(part + wp.tid(), part_count, int(counters_inout[ACTIVE]))
        advance_range(cut[0], cut[1], int(clock[0]), pace, environment[0], particles_inout, counters_inout)

    @wp.kernel(name=f"advance_{name}_and_remove", module=module, enable_backward=False)
    def advance_and_remove(
        part: int,
        part_count: int,
        pace: Pace,
        clock: wp.array[wp.int64],
        environment: wp.array[Environment],
        particles_inout: Particles,
        counters_inout: wp.array[wp.int64],
        slab_inout: wp.array2d[wp.uint32],
        relay_inout: wp.array[int],
        calls: wp.uint64,
        barrier: wp.array[int],
    ):
        """Advance one part of the active particles through the whole frame, chunk by chunk, and remove the expired."""
        active = int(counters_inout[ACTIVE])
        size = chunk_size(active, part_count)
        chunk = int(part + wp.tid())
        while chunk * size < active:
            begin = chunk * size
            end = wp.min(begin + size, active)
            advance_range(begin, end, int(clock[0]), pace, environment[0], particles_inout, counters_inout)
            alive = particles_inout.alive
            close_ranks(chunk, begin, end, active, part_count, alive, counters_inout, slab_inout, relay_inout, calls, barrier)
            chunk = chunk + part_count

    return advance_particles, advance_and_remove


def advance_loops(name: str, long_flows: tuple[str, ...]) -> tuple[wp.Kernel, wp.Kernel]:
    """Make the native loop kernels of a method in LOOPS: what moves, and what moves and removes; they are a module of their own.

    long_flows: those of LONG_FLOWS that are felt, in that order; what is not felt is not compiled.
    """
    return advance_loop(name, LOOPS[name], ".".join(("warpsim.kernels.loops", *long_flows, name)), advance_text(name, long_flows))


FLIGHT = """
    const int S = particles.position.shape[1];
    const float *P = births.position.data, *Q = births.velocity.data, *L = births.lifetime.data, *birth_age = births.birth_age.data;
    const int *birth_frame = births.birth_frame.data;
    float *X = particles.position.data, *V = particles.velocity.data;
    const vec g = environment.gravity;
    int outside = 0;
    #pragma clang loop vectorize(assume_safety)
    for (int i = begin; i < end; ++i) {
        const float age = $age_at(frame, birth_frame[i], birth_age[i], pace.fps), t = age < L[i] ? age : L[i];
        const vec v0(Q[i], Q[i + S], Q[i + 2 * S]), x = $ballistic_position(vec(P[i], P[i + S], P[i + 2 * S]), v0, g, t);
        const vec v = $drift(v0, g, t);
        for (int c = 0; c < 3; ++c) { X[i + c * S] = x[c]; V[i + c * S] = v[c]; }
        const int lives = age < L[i], in = $inside(x, v, environment.extent);
        outside += lives & (1 - in);
        particles.alive.data[i] = environment.policy == @KILL@ ? lives & in : lives;
    }
    if (outside && environment.policy == @KILL@) __atomic_fetch_add(counters.data + @KILLED@, (wp::int64)outside, __ATOMIC_RELAXED);
    else if (outside) __atomic_store_n(counters.data + @FAULT@, (wp::int64)1, __ATOMIC_RELAXED);
"""


@wp.func_native(snippet(FLIGHT, age_at, ballistic_position, drift, inside))
def fly_range(
    begin: int,
    end: int,
    frame: int,
    pace: Pace,
    environment: Environment,
    births: Particles,
    particles: Particles,
    counters: wp.array[wp.int64],
):
    """Place a range of particles on their arcs."""
    for i in range(begin, end):
        advance_flight(i, frame, pace, environment, births, particles, counters)


@wp.kernel(enable_backward=False)
def advance_ballistic(
    part: int,
    part_count: int,
    pace: Pace,
    clock: wp.array[wp.int64],
    environment: wp.array[Environment],
    births: Particles,
    particles_out: Particles,
    counters_inout: wp.array[wp.int64],
):
    """Place one part of the active particles on their arcs; position and velocity in `births` are those at birth."""
    cut = share(part + wp.tid(), part_count, int(counters_inout[ACTIVE]))
    fly_range(cut[0], cut[1], int(clock[0]), pace, environment[0], births, particles_out, counters_inout)
