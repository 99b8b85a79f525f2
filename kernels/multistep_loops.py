"""Native loop texts of the multistep methods, line by line as in multistep.py; loops.py puts them between prologue and epilogue.

R1, R2, R3 are the past values, N the drive at the substep's beginning, NA the one ahead, XS and VS what the one-step method makes of a
block in which some are not ready.
"""

DECLARATIONS = """
    float N[3][B], NA[3][B], XS[3][B], VS[3][B], R1[3][B], R2[3][B], R3[3][B];
    int whole[B], ready[B];
"""
LOAD = """
        for (int i = 0; i < B; ++i) {
            const int newborn = pace.first == 0 && birth_frame[b + i] == frame;
            kept[i] = newborn ? 0 : particles.history_count.data[b + i];
            for (int c = 0; c < 3; ++c) {
                R1[c][i] = newborn ? 0.0f : particles.history.data[b + i + c * S];
                if (PAST > 1) R2[c][i] = newborn ? 0.0f : particles.history.data[b + i + (3 + c) * S];
                if (PAST > 2) R3[c][i] = newborn ? 0.0f : particles.history.data[b + i + (6 + c) * S];
            }
        }
"""
STORE = """
        for (int i = 0; i < n; ++i) {
            for (int c = 0; c < 3; ++c) {
                particles.history.data[b + i + c * S] = R1[c][i];
                if (PAST > 1) particles.history.data[b + i + (3 + c) * S] = R2[c][i];
                if (PAST > 2) particles.history.data[b + i + (6 + c) * S] = R3[c][i];
            }
            particles.history_count.data[b + i] = kept[i];
        }
"""
READY = """
            int lacking = 0;
            for (int i = 0; i < B; ++i) {
                whole[i] = $whole_step(H[i], pace.dt);
                ready[i] = whole[i] & (kept[i] >= PAST);
                lacking += (i < n) & (1 - ready[i]);
            }
"""
START = {  # by form: one step by Runge–Kutta, as in start_inertial and start_tracer
    "inertial": """
            if (lacking) {
                EACH(const auto w = $exponential_weights(k * (0.5f * h));
                     const vec g = $pull(GET(N), GET(V0), k);
                     PUT(X, $glide_position(GET(X0), GET(V0), g, still, still, still, w, 0.5f * h)))
                flow(2 * s + 1); force(2 * s + 1);
                EACH(PUT(NA, $driven(GET(A), GET(U), k))
                     const auto w = $exponential_weights(k * h);
                     const vec g = $pull(GET(NA), GET(V0), k);
                     PUT(X, $glide_position(GET(X0), GET(V0), g, still, still, still, w, h)))
                flow(2 * s + 2); force(2 * s + 2);
                EACH(const vec now = GET(N), half = GET(NA), end = $driven(GET(A), GET(U), k), g = $pull(now, GET(V0), k);
                     const vec n1 = $middle_slope(now, half, end), n2 = $middle_bend(now, half, end), n3 = still;
                     const auto w = $exponential_weights(k * h);
                     PUT(XS, $glide_position(GET(X0), GET(V0), g, n1, n2, n3, w, h))
                     PUT(VS, $glide_velocity(GET(V0), g, n1, n2, n3, w, h)))
            }
""",
    "tracer": """
            if (lacking) {
                EACH(PUT(DX, GET(N)) PUT(X, $drift(GET(X0), GET(N), 0.5f * h)))
                for (int stage = 0; stage < 2; ++stage) {
                    flow(2 * s + 1);
                    EACH(PUT(DX, $drift(GET(DX), GET(U), 2.0f)) PUT(X, $drift(GET(X0), GET(U), stage == 0 ? 0.5f * h : h)))
                }
                flow(2 * s + 2);
                EACH(PUT(XS, $drift(GET(X0), $drift(GET(DX), GET(U), 1.0f), h / 6.0f)) PUT(VS, GET(V)))
            }
""",
}
SETTLE = """
            if (lacking) for (int i = 0; i < n; ++i) if (!ready[i]) { PUT(X, GET(XS)) PUT(V, GET(VS)) }
"""
REMEMBER = """
            for (int c = 0; c < 3; ++c) for (int i = 0; i < B; ++i) {
                if (PAST > 2) R3[c][i] = R2[c][i];
                if (PAST > 1) R2[c][i] = R1[c][i];
                R1[c][i] = N[c][i];
            }
            for (int i = 0; i < B; ++i) kept[i] = whole[i] ? (kept[i] < 3 ? kept[i] + 1 : 3) : 0;
"""
PAST_DIFFERENCES = {  # by order of the polynomial through the past
    1: "d1 = still, d2 = still, d3 = still",
    2: "d1 = $first_difference(now, GET(R1)), d2 = still, d3 = still",
    3: "d1 = $first_difference(now, GET(R1)), d2 = $second_difference(now, GET(R1), GET(R2)), d3 = still",
    4: """d1 = $first_difference(now, GET(R1)), d2 = $second_difference(now, GET(R1), GET(R2)),
                           d3 = $third_difference(now, GET(R1), GET(R2), GET(R3))""",
}
DIFFERENCES_AHEAD = {
    1: "d1 = $first_difference(GET(NA), now), d2 = still, d3 = still",
    2: "d1 = $first_difference(GET(NA), now), d2 = still, d3 = still",
    4: """d1 = $first_difference(now, GET(R1)), d2 = $second_difference(now, GET(R1), GET(R2)),
                           d3 = $third_difference(GET(NA), now, GET(R1), GET(R2))""",
}
SLOPES = "const vec n1 = $first_slope(d1, d2, d3), n2 = $second_slope(d2, d3), n3 = d3;"


def inertial_text(order: int, corrects: bool) -> str:
    """Write a substep of the second-order form."""
    position, velocity = (f"$glide_{what}, g, n1, n2, n3, w, h)" for what in ("position(GET(X0), GET(V0)", "velocity(GET(V0)"))
    glide = f"const auto w = $exponential_weights(k * h); PUT(X, {position}) PUT(V, {velocity})"
    moves = [PAST_DIFFERENCES[order]] + ([DIFFERENCES_AHEAD[order]] if corrects else [])
    moves = [f"EACH(const vec now = GET(N), g = $pull(now, GET(V0), k), {text}; {SLOPES} {glide})" for text in moves]
    ahead = " flow(2 * s + 2); force(2 * s + 2); EACH(PUT(NA, $driven(GET(A), GET(U), k))) "
    keep = "EACH(PUT(N, $driven(GET(A), GET(U), k)) PUT(X0, GET(X)) PUT(V0, GET(V))) "
    text = keep + begun(order, "inertial") + ahead.join(moves) + ended(order)
    return text + "flow(2 * s + 2); force(2 * s + 2);"


def tracer_text(order: int, corrects: bool) -> str:
    """Write a substep of the first-order form."""
    moves = [PAST_DIFFERENCES[order]] + ([DIFFERENCES_AHEAD[order]] if corrects else [])
    follow = "PUT(X, $follow(GET(X0), now, n1, n2, n3, h))"
    moves = [f"EACH(const vec now = GET(N), {text}; {SLOPES} {follow})" for text in moves]
    ahead = " flow(2 * s + 2); EACH(PUT(NA, GET(U))) "
    keep = "EACH(PUT(N, GET(U)) PUT(X0, GET(X))) "
    return keep + begun(order, "tracer") + ahead.join(moves) + ended(order) + "flow(2 * s + 2); EACH(PUT(V, GET(U)))"


def begun(order: int, form: str) -> str:
    """Write what comes first, after the beginning is kept: a step by the one-step method, for those that are not ready."""
    return "" if order == 1 else READY.replace("PAST", str(order - 1)) + START[form]


def ended(order: int) -> str:
    """Write what comes after it: those particles' places, and what all remember."""
    return "" if order == 1 else SETTLE + REMEMBER.replace("PAST", str(order - 1))


def multistep_texts() -> tuple[dict, dict]:
    """Return by method what it feels and a substep of it; and how many past values it loads and stores, where it has any."""
    texts, past = {}, {}
    forms = ("", "flow(m); force(m);", inertial_text), ("tracer_", "flow(m);", tracer_text)
    methods = [("heun", 1, True), *((f"adams_bashforth_{order}", order, False) for order in (2, 3, 4))]
    methods += [(f"abm_pece_{order}", order, True) for order in (2, 4)]
    for prefix, feel, write in forms:
        for name, order, corrects in methods:
            texts[prefix + name], past[prefix + name] = (feel, write(order, corrects)), order - 1
    return texts, past
