"""Elementary functions from + − × ÷ √ and shifts alone.

They vectorize, and they have the same bits on every processor, which the C library's do not. float32 for the particles; the
float64 ones (suffix 64) serve the few numbers that are worked out once per frame: strengths that vary in time, and births.
"""

import warp as wp

TWO_PI = wp.constant(6.2831853071795864)
LN_2 = wp.constant(0.69314718055994531)


@wp.func_native("return wp::cast<float>((n + 127) << 23);")
def power_of_two(n: int) -> float:
    """Return 2^n, -127 < n < 128."""
    return wp.pow(2.0, float(n))


@wp.func_native("return (wp::cast<int>(x) >> 23) - 126;")
def binary_exponent(x: float) -> int:
    """Return n with x = m 2^n, ½ <= m < 1, for a normal x > 0."""
    return int(wp.floor(wp.log2(x))) + 1


@wp.func_native("return wp::cast<wp::float64>((n + wp::int64(1023)) << 52);")
def power_of_two64(n: wp.int64) -> wp.float64:
    """Return 2^n, -1023 < n < 1024."""
    return wp.pow(wp.float64(2.0), wp.float64(n))


@wp.func_native("return (wp::cast<wp::int64>(x) >> 52) - wp::int64(1022);")
def binary_exponent64(x: wp.float64) -> wp.int64:
    """Return n with x = m 2^n, ½ <= m < 1, for a normal x > 0."""
    return wp.int64(wp.floor(wp.log2(x))) + wp.int64(1)


@wp.func(inline=True)
def exp_negative(z: float) -> float:
    """Return e^z for z <= 80, to 2e-7 relative; e^-80 below −80.  Source: e^z = 2^n 2^f, Taylor series of 2^f on |f| <= ½."""
    y = wp.max(z, -80.0) * 1.44269504
    n = wp.floor(y + 0.5)
    g = (y - n) * LN_2
    p = 1.0 + g * (1.0 + g * (0.5 + g * (0.16666667 + g * (0.041666667 + g * (0.0083333333 + g * 0.0013888889)))))
    return p * power_of_two(int(n))


@wp.func(inline=True)
def decay_series(z: float) -> float:
    """Return mean_decay(z) for 0 <= z < ½, by its Taylor series."""
    return 1.0 - z * (0.5 - z * (0.16666667 - z * (0.041666667 - z * (0.0083333333 - z * (0.0013888889 - z * 0.0001984127)))))


@wp.func(inline=True)
def mean_decay(z: float) -> float:
    """Return φ(z) = (1 − e^{−z})/z for z >= 0, the mean of e^{−s} on [0, z], to 5e-7; the series spares small z the cancellation."""
    return wp.where(z < 0.5, decay_series(z), (1.0 - exp_negative(-z)) / wp.max(z, 0.5))


@wp.func(inline=True)
def exponential_integral(q: float) -> float:
    """Return E₁(q) + ln min(q, 1) for q >= 0, to 2e-7: smooth at 0, where E₁ is not.  Source: Abramowitz & Stegun 1964, 5.1.11, 5.1.56."""
    x = wp.min(q, 1.0)
    near = 0.00023148148 - x * (2.8344671e-05 - x * (3.1001984e-06 - x * (3.0619244e-07 - x * 2.7557319e-08)))
    near = x * (1.0 - x * (0.25 - x * (0.055555556 - x * (0.010416667 - x * (0.0016666667 - x * near))))) - 0.57721566
    y = wp.min(wp.max(q, 1.0), 80.0)
    top = 0.26777373 + y * (8.6347609 + y * (18.059017 + y * (8.5733287 + y)))
    bottom = 3.9584969 + y * (21.099653 + y * (25.632956 + y * (9.5733223 + y)))
    return wp.where(q < 1.0, near, exp_negative(-y) * top / (y * bottom))


@wp.func(inline=True)
def log_positive(x: float) -> float:
    """Return ln x for a normal x > 0 below 2^126, to 2e-7.  Source: ln m = 2 artanh((m − 1)/(m + 1))."""
    n = binary_exponent(x)
    m = x * power_of_two(-n)
    low = wp.where(m < 0.70710678, 1, 0)
    m = m * (1.0 + float(low))
    s = (m - 1.0) / (m + 1.0)
    s2 = s * s
    return s * (2.0 + s2 * (0.66666667 + s2 * (0.4 + s2 * (0.28571429 + s2 * 0.22222222)))) + float(n - low) * LN_2


@wp.func(inline=True)
def sin_turns(u: float) -> float:
    """Return sin 2πu, to 2.5e-7.  Source: Taylor series on a quarter turn."""
    r = u - wp.floor(u + 0.5)
    r = wp.where(r > 0.25, 0.5 - r, r)
    r = wp.where(r < -0.25, -0.5 - r, r)
    q = r * TWO_PI
    q2 = q * q
    series = 1.0 - q2 * (0.16666667 - q2 * (0.0083333333 - q2 * (0.00019841270 - q2 * (2.7557319e-06 - q2 * 2.5052108e-08))))
    return q * series


@wp.func(inline=True)
def cos_turns(u: float) -> float:
    """Return cos 2πu, to 4.1e-7 on [0, 1): the sum u + ¼ is rounded."""
    return sin_turns(u + 0.25)


@wp.func(inline=True)
def exp64(x: wp.float64) -> wp.float64:
    """Return e^x, to 1e-15 relative; 0 below −708, e^709 above 709, NaN of NaN.  Source: Taylor series after reduction by ln 2."""
    if x != x:
        return x
    z = wp.min(x, wp.float64(709.0))
    if z < wp.float64(-708.0):
        return wp.float64(0.0)
    n = wp.floor(z * wp.float64(1.4426950408889634) + wp.float64(0.5))
    g = (z - n * wp.float64(0.693147180369123816490)) - n * wp.float64(1.90821492927058770002e-10)  # ln 2 in two parts
    p = wp.float64(1.0)
    for k in range(14):
        p = wp.float64(1.0) + p * g / wp.float64(14 - k)
    return p * power_of_two64(wp.int64(n))


@wp.func(inline=True)
def log64(x: wp.float64) -> wp.float64:
    """Return ln x, to 1e-15; NaN for x <= 0 and for subnormal x.  Source: ln m = 2 artanh((m − 1)/(m + 1))."""
    if not x > wp.float64(2.3e-308):
        return wp.float64(wp.nan)
    n = binary_exponent64(x)
    half = n >> wp.int64(1)
    m = x * power_of_two64(-half) * power_of_two64(half - n)  # in two steps: 2^-1024 is no normal number
    if m < wp.float64(0.70710678118654752):
        m = m * wp.float64(2.0)
        n = n - wp.int64(1)
    s = (m - wp.float64(1.0)) / (m + wp.float64(1.0))
    s2 = s * s
    p = wp.float64(0.0)
    for k in range(12):
        p = p * s2 + wp.float64(2.0) / wp.float64(23 - 2 * k)
    return s * p + wp.float64(n) * wp.float64(0.69314718055994531)


@wp.func(inline=True)
def sin_reduced64(x: wp.float64, n: wp.float64) -> wp.float64:
    """Return sin(x − nπ), |x − nπ| <= π/2, n a multiple of ½.  Source: Taylor series after reduction by π in three parts."""
    r = x - n * wp.float64(3.14159265346825122833)  # the leading 33 bits: exact times n < 2^19
    r = r - n * wp.float64(1.21542010126079319320e-10)
    r = r - n * wp.float64(4.04453249759190126308e-21)
    r2 = r * r
    p = wp.float64(1.0)
    for k in range(11):
        j = 22 - 2 * k
        p = wp.float64(1.0) - p * r2 / wp.float64(j * (j + 1))
    return r * p


@wp.func(inline=True)
def parity64(n: wp.float64) -> wp.float64:
    """Return 1 for an even whole number, −1 for an odd one."""
    half = n * wp.float64(0.5)
    return wp.where(half == wp.floor(half), wp.float64(1.0), wp.float64(-1.0))


@wp.func(inline=True)
def sin64(x: wp.float64) -> wp.float64:
    """Return sin x, x in radians, to 1e-15 for |x| < 1e6."""
    n = wp.floor(x * wp.float64(0.31830988618379067) + wp.float64(0.5))
    return parity64(n) * sin_reduced64(x, n)


@wp.func(inline=True)
def cos64(x: wp.float64) -> wp.float64:
    """Return cos x, x in radians, to 1e-15 for |x| < 1e6: −sin(x − (n + ½)π) for even n."""
    n = wp.floor(x * wp.float64(0.31830988618379067))
    return -parity64(n) * sin_reduced64(x, n + wp.float64(0.5))


@wp.func
def power64(x: wp.float64, y: wp.float64) -> wp.float64:
    """Return x^y: whole y up to 64 by multiplication (x may be negative), else e^{y ln x}; NaN where it is not real."""
    if y == wp.floor(y) and wp.abs(y) <= wp.float64(64.0):
        p = wp.float64(1.0)
        for _ in range(int(wp.abs(y))):
            p = p * x
        return wp.where(y < wp.float64(0.0), wp.float64(1.0) / p, p)
    if x == wp.float64(0.0) and y > wp.float64(0.0):
        return wp.float64(0.0)
    return exp64(y * log64(x))
