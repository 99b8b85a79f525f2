"""Native loops over the rows of a sheet for the CPU, beside the plain kernels whose bits they share; see loops.py."""

import warp as wp

from warpsim.kernels.cloth import STEPS, Sheet, area_at, sum_sheet, twice_area, wind_pull
from warpsim.kernels.emission import Particles
from warpsim.kernels.flow import FLOWS, sample_flow
from warpsim.kernels.loops import FORMULAS, cases, share, snippet
from warpsim.kernels.planar import read3, write3
from warpsim.kernels.springs import spring_force

ROWS = """
    constexpr int B = @BLOCK@;
    const int S = particles.position.shape[1], nx = sheet.nx, ny = sheet.ny;
    const float *PX = particles.position.data, *PY = PX + S, *PZ = PY + S;
    const float *VX = particles.velocity.data, *VY = VX + S, *VZ = VY + S;
    float *A = internal.data;
    for (int j = begin / nx; j * nx < end; ++j) {
        const int row = j * nx, from = begin > row ? begin - row : 0, to = end < row + nx ? end - row : nx;
        for (int i0 = from; i0 < to; i0 += B) {
            const int n = to - i0 < B ? to - i0 : B, p = row + i0;
BODY
        }
    }
"""
SPRINGS = """
            static const int DI[] = {@ALONG@}, DJ[] = {@DOWN@};
            float FX[B] = {}, FY[B] = {}, FZ[B] = {};
            for (int s = 0; s < @COUNT@; ++s) {
                const float K = sheet.stiffness.data[s], C = sheet.damping.data[s], R = sheet.rest.data[s];
                if (j + DJ[s] < 0 || j + DJ[s] >= ny || (K == 0.0f && C == 0.0f)) continue;  // a spring without force adds nothing
                const int a = -DI[s] - i0 > 0 ? -DI[s] - i0 : 0, b = nx - DI[s] - i0 < n ? nx - DI[s] - i0 : n;
                const int o = p + DJ[s] * nx + DI[s];
                for (int t = a; t < b; ++t) {
                    const vec f = $spring_force(vec(PX[p + t], PY[p + t], PZ[p + t]), vec(VX[p + t], VY[p + t], VZ[p + t]),
                                                vec(PX[o + t], PY[o + t], PZ[o + t]), vec(VX[o + t], VY[o + t], VZ[o + t]), R, K, C);
                    FX[t] += f[0]; FY[t] += f[1]; FZ[t] += f[2];
                }
            }
            for (int t = 0; t < n; ++t) {
                const float w = sheet.inverse_mass.data[p + t];
                A[p + t] = FX[t] * w; A[p + t + S] = FY[t] * w; A[p + t + 2 * S] = FZ[t] * w;
            }
"""
AIR = """
            float X[3][B] = {}, U[3][B] = {}, N[3][B] = {};
            const int up = j > 0 ? -nx : 0, down = j < ny - 1 ? nx : 0;
            #define AT(k) vec(PX[k], PY[k], PZ[k])
            auto normal = [&](int t, int west, int east) {
                const int m = p + t, n = m + up, s = m + down;
                const vec a = $twice_area(AT(m), AT(m + east), AT(n + east), AT(n), AT(n - west), AT(m - west),
                                          AT(s - west), AT(s), AT(s + east));
                N[0][t] = a[0]; N[1][t] = a[1]; N[2][t] = a[2];
            };
            const int inner = i0 > 0 ? 0 : 1, outer = i0 + n < nx ? n : n - 1;
            for (int t = inner; t < outer; ++t) normal(t, 1, 1);
            if (inner) normal(0, 0, nx > 1 ? 1 : 0);
            if (outer < n) normal(n - 1, nx > 1 ? 1 : 0, 0);
            for (int t = 0; t < n; ++t) { X[0][t] = PX[p + t]; X[1][t] = PY[p + t]; X[2][t] = PZ[p + t]; }
            #define FLOW(formula) for (int i = 0; i < B; ++i) { \\
                const vec x(X[0][i], X[1][i], X[2][i]), r = formula; U[0][i] += r[0]; U[1][i] += r[1]; U[2][i] += r[2]; }
            for (int k = 0; k < sheet.flow.shape[1]; ++k) {
                const auto q = sheet.flow.data[moment * sheet.flow.shape[1] + k];
                switch (q.kind) { FLOW_CASES }
            }
            for (int t = 0; t < n; ++t) {
                const int m = p + t;
                const vec f = $wind_pull(vec(N[0][t], N[1][t], N[2][t]), vec(VX[m], VY[m], VZ[m]), vec(U[0][t], U[1][t], U[2][t]), g);
                const bool free = sheet.inverse_mass.data[m] > 0.0f;
                A[m] = free ? A[m] + f[0] : A[m]; A[m + S] = free ? A[m + S] + f[1] : A[m + S];
                A[m + 2 * S] = free ? A[m + 2 * S] + f[2] : A[m + 2 * S];
            }
"""
for mark, numbers in {"ALONG": [step[0] for step in STEPS], "DOWN": [step[1] for step in STEPS], "COUNT": [len(STEPS)]}.items():
    SPRINGS = SPRINGS.replace(f"@{mark}@", ", ".join(map(str, numbers)))
AIR = ROWS.replace("BODY", AIR.replace("FLOW_CASES", cases(FLOWS.values(), "FLOW"))).replace("\n            #define", "\n#define")
AIR = "\n    const float g = sheet.air.data[0];\n    if (!(g > 0.0f)) return;" + AIR


@wp.func_native(snippet(ROWS.replace("BODY", SPRINGS), spring_force))
def sheet_range(begin: int, end: int, sheet: Sheet, particles: Particles, internal: wp.array2d[float]):
    """Sum the springs of a range of points."""
    for p in range(begin, end):
        force = sum_sheet(p % sheet.nx, p // sheet.nx, sheet, particles.position, particles.velocity)
        write3(internal, p, force * sheet.inverse_mass[p])


@wp.func_native(snippet(AIR, *FORMULAS, twice_area, wind_pull) + "#undef AT\n#undef FLOW\n")
def air_range(begin: int, end: int, moment: int, sheet: Sheet, particles: Particles, internal: wp.array2d[float]):
    """Add what the wind does to a range of points."""
    for p in range(begin, end):
        u = sample_flow(sheet.flow, moment, read3(particles.position, p))
        area = area_at(p % sheet.nx, p // sheet.nx, sheet, particles.position)
        write3(internal, p, wind_pull(area, read3(particles.velocity, p), u, sheet.air[0]))


@wp.kernel(enable_backward=False)
def accumulate_cloth(part: int, part_count: int, sheet: Sheet, particles: Particles, internal_out: wp.array2d[float]):
    """Store what the springs do to one part of the points."""
    cut = share(part + wp.tid(), part_count, sheet.nx * sheet.ny)
    sheet_range(cut[0], cut[1], sheet, particles, internal_out)


@wp.kernel(enable_backward=False)
def accumulate_air(part: int, part_count: int, moment: int, sheet: Sheet, particles: Particles, internal_inout: wp.array2d[float]):
    """Add what the wind does to one part of the points."""
    cut = share(part + wp.tid(), part_count, sheet.nx * sheet.ny)
    air_range(cut[0], cut[1], moment, sheet, particles, internal_inout)
