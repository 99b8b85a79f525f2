"""Native loop over the rows of a sheet that is bent, for the CPU, beside the plain kernel whose bits it shares; see loops.py."""

import warp as wp

from warpsim.kernels.bending import Bending, cell_share, hinge_force, hinge_sum, line_share, sum_hinges, with_force
from warpsim.kernels.emission import Particles
from warpsim.kernels.loops import share, snippet
from warpsim.kernels.planar import read3, write3

HINGES = """
    constexpr int B = @BLOCK@;
    const int S = particles.position.shape[1], nx = bending.nx, ny = bending.ny, downs = (nx - 1) * ny;
    const float *PX = particles.position.data, *PY = PX + S, *PZ = PY + S;
    const float *VX = particles.velocity.data, *VY = VX + S, *VZ = VY + S;
    const float *K = bending.stiffness.data, *C = bending.damping.data;
    const int *torn = bending.torn.shape[0] > 0 ? bending.torn.data : nullptr;
    float *A = internal.data;
    #define AT(p) vec(PX[p], PY[p], PZ[p])
    #define GOES(p) vec(VX[p], VY[p], VZ[p])
    #define OF(F, t) vec(F[0][t], F[1][t], F[2][t])
    #define HINGE(F, t, a, b, c, d, k, damping) { \\
        const vec f = $hinge_force($hinge_sum(AT(a), AT(b), AT(c), AT(d)), $hinge_sum(GOES(a), GOES(b), GOES(c), GOES(d)), k, damping); \\
        F[0][t] = f[0]; F[1][t] = f[1]; F[2][t] = f[2]; }
    #define NONE(F, t) { F[0][t] = 0.0f; F[1][t] = 0.0f; F[2][t] = 0.0f; }
    for (int j = begin / nx; j * nx < end; ++j) {
        const int row = j * nx, from = begin > row ? begin - row : 0, to = end < row + nx ? end - row : nx;
        for (int i0 = from; i0 < to; i0 += B) {
            const int n = to - i0 < B ? to - i0 : B, p = row + i0;
            float along[3][B + 2] = {}, down[3][3][B] = {}, cell[2][3][B + 1] = {};  // those of the columns and rows beside it, too
            {
                const int a = 1 - i0 > -1 ? 1 - i0 : -1, b = nx - 1 - i0 < n + 1 ? nx - 1 - i0 : n + 1;
                const float part = j == 0 || j == ny - 1 ? 0.5f : 1.0f;
                for (int t = a; t < b; ++t) HINGE(along, t + 1, p + t - 1, p + t, p + t + 1, p + t, part * K[0], part * C[0])
                if (torn) for (int t = a, e = j * (nx - 1) + i0; t < b; ++t) if (torn[e + t - 1] | torn[e + t]) NONE(along, t + 1)
            }
            for (int r = 0; r < 3; ++r) {
                if (j + r - 1 < 1 || j + r - 1 > ny - 2) continue;
                const int q = p + (r - 1) * nx;
                for (int t = 0; t < n; ++t) {
                    const float part = i0 + t == 0 || i0 + t == nx - 1 ? 0.5f : 1.0f;
                    HINGE(down[r], t, q + t - nx, q + t, q + t + nx, q + t, part * K[1], part * C[1])
                }
                if (torn) for (int t = 0, e = downs + q; t < n; ++t) if (torn[e + t - nx] | torn[e + t]) NONE(down[r], t)
            }
            for (int r = 0; r < 2; ++r) {
                if (j + r - 1 < 0 || j + r - 1 > ny - 2) continue;
                const int q = p + (r - 1) * nx, a = i0 > 0 ? -1 : 0, b = nx - 1 - i0 < n ? nx - 1 - i0 : n;
                for (int t = a; t < b; ++t) HINGE(cell[r], t + 1, q + t, q + t + 1, q + t + nx + 1, q + t + nx, K[2], C[2])
                if (torn) for (int t = a; t < b; ++t) {
                    const int e = (j + r - 1) * (nx - 1) + i0 + t, f = downs + q + t;
                    if (torn[e] | torn[e + nx - 1] | torn[f] | torn[f + 1]) NONE(cell[r], t + 1)
                }
            }
            for (int t = 0; t < n; ++t) {
                const vec lines = $line_share(vec(0.0f, 0.0f, 0.0f), OF(along, t), OF(along, t + 1), OF(along, t + 2));
                const vec both = $line_share(lines, OF(down[0], t), OF(down[1], t), OF(down[2], t));
                const vec f = $cell_share(both, OF(cell[0], t), OF(cell[0], t + 1), OF(cell[1], t), OF(cell[1], t + 1));
                const int m = p + t;
                const vec a = $with_force(vec(A[m], A[m + S], A[m + 2 * S]), f, bending.inverse_mass.data[m]);
                A[m] = a[0]; A[m + S] = a[1]; A[m + 2 * S] = a[2];
            }
        }
    }
"""


UNDEFINED = "".join(f"#undef {name}\n" for name in ("AT", "GOES", "OF", "HINGE", "NONE"))


@wp.func_native(snippet(HINGES, hinge_force, hinge_sum, line_share, cell_share, with_force) + UNDEFINED)
def bending_range(begin: int, end: int, bending: Bending, particles: Particles, internal: wp.array2d[float]):
    """Add what the hinges of a range of points do."""
    for p in range(begin, end):
        force = sum_hinges(p % bending.nx, p // bending.nx, bending, particles.position, particles.velocity)
        write3(internal, p, with_force(read3(internal, p), force, bending.inverse_mass[p]))


@wp.kernel(enable_backward=False)
def accumulate_bending(part: int, part_count: int, bending: Bending, particles: Particles, internal_inout: wp.array2d[float]):
    """Add what the hinges do to one part of the points, a = F/m [m/s²]."""
    cut = share(part + wp.tid(), part_count, bending.nx * bending.ny)
    bending_range(cut[0], cut[1], bending, particles, internal_inout)
