"""Native loops over the rows of a sheet for the CPU, beside the plain kernels whose bits they share; see loops.py.

A sheet is cut into tiles of columns, and a tile is worked through from top to bottom. Three rows of places and velocities lie in buffers,
with two columns of the next tile on either side, so that every loop runs over whole vectors of lanes. Each spring is worked out once, at
the upper or the left one of its ends, and what it pulls with is kept until both ends have had their turn: a point adds up its twelve in the
order of cloth.STEPS. Each cell between two rows is worked out once, too, for the four points round it (docs/adr/0029-speed-of-networks.md).
"""

import warp as wp

from warpsim.kernels.cloth import STEPS, Sheet, cell_area, sheet_air, sheet_pull, wind_pull
from warpsim.kernels.emission import Particles
from warpsim.kernels.flow import FLOWS
from warpsim.kernels.loops import FORMULAS, cases, snippet
from warpsim.kernels.planar import write3
from warpsim.kernels.springs import spring_force

FORWARD = [(along, down) for along, down in STEPS if (down, along) > (0, 0)]  # springs that are worked out here, by their steps

MOST_COLUMNS = 256  # of a tile
TILES = """
    constexpr int W = @WIDTH@, N = 16, O = N, L = W + 4 * N, B = @BLOCK@;  // lane O + l is column i0 + l; N of them are a vector
    const int S = particles.position.shape[1], nx = sheet.nx, ny = sheet.ny;
    const float *P = particles.position.data, *Q = particles.velocity.data;
    const float air = sheet.air.data[2 * moment], lead = sheet.air.data[2 * moment + 1];
    BUFFERS  // a buffer of n rows has row j in j % n; each row is x, y, z
    #define EACH_LANE(from) _Pragma("clang loop vectorize_width(16) interleave_count(1)") for (int l = from; l < from + lanes; ++l)
    #define AT(row, m) vec(row[0][m], row[1][m], row[2][m])
    #define PUT(row, m, value) { const vec r = value; row[0][m] = r[0]; row[1][m] = r[1]; row[2][m] = r[2]; }
    for (int c0 = 0; c0 < nx; c0 += W) {
        const int c1 = c0 + W < nx ? c0 + W : nx, width = c1 - c0, i0 = c0 > 0 ? c0 - 2 : 0, own = O + c0 - i0, rim = O + nx - i0;
        const int held = (c1 + 2 < nx ? c1 + 2 : nx) - i0, lanes = (held + N - 1) & -N;
        auto clear = [&](auto& buffer) {
            for (auto& row : buffer) for (auto& axis : row) for (int l = 0; l < ((width + B - 1) & -B) + 4 * N; ++l) axis[l] = 0.0f;
        };
        CLEARED
        int next = begin > 2 ? begin - 2 : 0;  // the row to be loaded
        for (int j = next; j < end; ++j) {
            for (; next < ny && next <= j + 2; ++next)
                for (int c = 0; c < 3; ++c) {
                    const float *X = P + c * S + next * nx + i0, *V = Q + c * S + next * nx + i0;
                    EACH_LANE(0) if (l < held) { place[next % 3][c][O + l] = X[l]; speed[next % 3][c][O + l] = V[l]; }
                }
ROW
        }
    }
"""
SPRINGS = """
            auto springs = [&](auto& pull, int s, int along, int down) {
                const float K = sheet.stiffness.data[s], D = sheet.damping.data[s], R = sheet.rest.data[s];
                if (j + down < begin || (K == 0.0f && D == 0.0f)) return;  // a spring without force adds nothing
                const auto &x = place[j % 3], &y = place[(j + down) % 3], &v = speed[j % 3], &u = speed[(j + down) % 3];
                const int first = i0 == 0 && along < 0 ? O - along : O, last = j + down < ny ? rim - (along > 0 ? along : 0) : O;
                EACH_LANE(O) {
                    const bool there = l >= first && l < last;  // beyond the rim are no springs
                    const vec f = $spring_force(AT(x, l), AT(v, l), AT(y, l + along), AT(u, l + along), R, K, D);
                    for (int c = 0; c < 3; ++c) pull[c][l] = there ? f[c] : 0.0f;
                }
            };
            CALLS
"""
AIR = """
            if (air > 0.0f) {
                const auto &x = place[j % 3], &y = place[(j + 1) % 3];
                const int last = j + 1 < ny ? rim - 1 : O;
                EACH_LANE(O) {
                    const vec a = $cell_area(AT(x, l), AT(x, l + 1), AT(y, l + 1), AT(y, l));
                    for (int c = 0; c < 3; ++c) cell[j % 2][c][l] = l < last ? a[c] : 0.0f;
                }
            }
"""
PULLS = """
            if (j < begin) continue;
            for (int t0 = 0; t0 < width; t0 += B) {
                const int p = j * nx + c0 + t0, mine = own + t0, n = width - t0 < B ? width - t0 : B;
                const float* w = sheet.inverse_mass.data + p;
                float X[3][B], U[3][B] = {}, pull[3][B] = {}, wind[3][B] = {};
                for (int c = 0; c < 3; ++c) for (int i = 0; i < B; ++i) if (i < n) { const int l = mine + i; pull[c][i] = SUM; }
                if (air > 0.0f) {
                    for (int c = 0; c < 3; ++c) for (int i = 0; i < B; ++i) X[c][i] = place[j % 3][c][mine + i];
                    #define FLOW(formula) for (int i = 0; i < B; ++i) { \\
                        const vec x = AT(X, i), r = formula; U[0][i] += r[0]; U[1][i] += r[1]; U[2][i] += r[2]; }
                    for (int m = 0; m < sheet.flow.shape[1]; ++m) {
                        const auto q = sheet.flow.data[moment * sheet.flow.shape[1] + m];
                        switch (q.kind) { FLOW_CASES }
                    }
                    const auto &above = cell[(j + 1) % 2], &below = cell[j % 2], &v = speed[j % 3];
                    for (int i = 0; i < B; ++i) {
                        const int l = mine + i;
                        const vec area = vec() + AT(above, l - 1) + AT(above, l) + AT(below, l - 1) + AT(below, l);
                        PUT(wind, i, $wind_pull(area, AT(v, l) + AT(pull, i) * lead, AT(U, i), air))
                    }
                }
                for (int c = 0; c < 3; ++c) for (int i = 0; i < B; ++i) if (i < n) pull[c][i] += w[i] > 0.0f ? wind[c][i] : 0.0f;
ENDED
            }
""".replace("FLOW_CASES", cases(FLOWS.values(), "FLOW"))
KEEP = """
                for (int c = 0; c < 3; ++c) for (int i = 0; i < B; ++i) if (i < n) internal.data[c * S + p + i] = pull[c][i];
"""
MACROS = "".join(f"#undef {macro}\n" for macro in ("EACH_LANE", "AT", "PUT", "FLOW"))


def pull_of(along: int, down: int) -> str:
    """Write what the spring to a neighbor does to component c at lane l: worked out here, or there and with the other sign."""
    if (along, down) in FORWARD:
        return f" + pull{FORWARD.index((along, down))}[j % {down + 1}][c][l]"
    return f" - pull{FORWARD.index((-along, -down))}[(j + 1) % {1 - down}][c][l + {along}]"


def rows_text(row: str, buffers: dict[str, int], *formulas) -> str:
    """Assemble a loop over rows from what is done in each; `buffers`: their names and numbers of rows."""
    text = TILES.replace("ROW", row).replace("@WIDTH@", str(MOST_COLUMNS))
    text = text.replace("BUFFERS", "float " + ", ".join(f"{name}[{rows}][3][L]" for name, rows in buffers.items()) + ";")
    text = text.replace("CLEARED", " ".join(f"clear({name});" for name in buffers))
    text = text.replace("\n                    #define", "\n#define").replace("\n    #define", "\n#define")
    return snippet(text, *FORMULAS, *formulas, cell_area, wind_pull) + MACROS


WIND_BUFFERS = {"place": 3, "speed": 3, "cell": 2}
PULL_BUFFERS = {f"pull{k}": down + 1 for k, (_, down) in enumerate(FORWARD)}
CALLS = " ".join(f"springs(pull{k}[j % {b + 1}], {STEPS.index((a, b))}, {a}, {b});" for k, (a, b) in enumerate(FORWARD))
SPRINGS_AND_AIR = SPRINGS.replace("CALLS", CALLS) + AIR
SPRINGS_AND_AIR += PULLS.replace("SUM", f"(0.0f{''.join(pull_of(*step) for step in STEPS)}) * w[i]")


@wp.func
def share_rows(part: int, part_count: int, row_count: int) -> wp.vec2i:
    """Return the rows [begin, end) of one core's part."""
    return wp.vec2i(row_count * part // part_count, row_count * (part + 1) // part_count)


@wp.func_native(rows_text(SPRINGS_AND_AIR.replace("ENDED", KEEP), WIND_BUFFERS | PULL_BUFFERS, spring_force))
def sheet_rows(begin: int, end: int, moment: int, sheet: Sheet, particles: Particles, internal: wp.array2d[float]):
    """Sum springs and wind of a range of rows."""
    for p in range(begin * sheet.nx, end * sheet.nx):
        write3(internal, p, sheet_pull(p % sheet.nx, p // sheet.nx, moment, sheet, particles))


@wp.func_native(rows_text(AIR + PULLS.replace("SUM", "0.0f").replace("ENDED", KEEP), WIND_BUFFERS))
def air_rows(begin: int, end: int, moment: int, sheet: Sheet, particles: Particles, internal: wp.array2d[float]):
    """Store what the wind does to a range of rows."""
    for p in range(begin * sheet.nx, end * sheet.nx):
        write3(internal, p, sheet_air(p % sheet.nx, p // sheet.nx, moment, sheet, particles, wp.vec3()))


@wp.kernel(enable_backward=False)
def accumulate_cloth(part: int, part_count: int, moment: int, sheet: Sheet, particles: Particles, internal_out: wp.array2d[float]):
    """Store what springs and wind do to one part of the points."""
    cut = share_rows(part + wp.tid(), part_count, sheet.ny)
    sheet_rows(cut[0], cut[1], moment, sheet, particles, internal_out)


@wp.kernel(enable_backward=False)
def accumulate_air(part: int, part_count: int, moment: int, sheet: Sheet, particles: Particles, internal_out: wp.array2d[float]):
    """Store what the wind alone does to one part of the points."""
    cut = share_rows(part + wp.tid(), part_count, sheet.ny)
    air_rows(cut[0], cut[1], moment, sheet, particles, internal_out)
