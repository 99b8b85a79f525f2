"""Native loop texts of the multistep methods, line by line as in multistep.py; loops.py puts them between prologue and epilogue.

R1, R2, R3 are the past values, N the drive at the substep's beginning, NA the one ahead, XS and VS what the one-step method makes of those
particles that are not ready; it is called for each of them, as few blocks have more than some.
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
START = """
            int lacking = 0;
            for (int i = 0; i < B; ++i) {
                whole[i] = $whole_step(H[i], pace.dt);
                ready[i] = whole[i] & (kept[i] >= PAST);
                lacking += 1 - ready[i];
            }
            if (lacking) for (int i = 0; i < n; ++i) {
                if (ready[i]) continue;
                const vec internal = coupled ? GET(I) : still;
                const auto p = $start_FORM(GET(X), GET(V), GET(U), DRAWN, K[i], W[i], internal, coupled, 2 * s, 1, H[i], environment);
                PUT(XS, p.x) PUT(VS, p.v)
            }
"""
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
    text = begun(order, "inertial") + keep + ahead.join(moves) + ended(order)
    return text + "flow(2 * s + 2); force(2 * s + 2);"


def tracer_text(order: int, corrects: bool) -> str:
    """Write a substep of the first-order form."""
    moves = [PAST_DIFFERENCES[order]] + ([DIFFERENCES_AHEAD[order]] if corrects else [])
    follow = "PUT(X, $follow(GET(X0), now, n1, n2, n3, h))"
    moves = [f"EACH(const vec now = GET(N), {text}; {SLOPES} {follow})" for text in moves]
    ahead = " flow(2 * s + 2); EACH(PUT(NA, GET(U))) "
    keep = "EACH(PUT(N, GET(U)) PUT(X0, GET(X))) "
    return begun(order, "tracer") + keep + ahead.join(moves) + ended(order) + "flow(2 * s + 2); EACH(PUT(V, GET(U)))"


def begun(order: int, form: str) -> str:
    """Write what comes before a substep: the particles that are not ready, by the one-step method."""
    if order == 1:
        return ""
    return START.replace("FORM", form).replace("DRAWN", "GET(A)" if form == "inertial" else "still").replace("PAST", str(order - 1))


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
