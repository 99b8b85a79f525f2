"""Flow primitives as texts in x, y, z for a strength of 1, from which the device's interpreter works them out in float64.

Symbols: d from the axis or center to (x, y, z), r² = d·d, a axis, e direction. Each formula is that of kernels/flow.py.
"""

import math

import numpy as np


def linear(row, center) -> str:
    """Write row · ((x, y, z) − center)."""
    terms = [f"{m!r}*({name} - ({c!r}))" for m, name, c in zip(map(float, row), "xyz", map(float, center), strict=True) if m]
    return f"({' + '.join(terms) or '0'})"


def lines(spec) -> tuple[list[str], list[str], str]:
    """Write d and a × d, three components each, and r² of a primitive round an axis."""
    a = np.array(spec.axis, float) / math.hypot(*spec.axis)
    d = [linear(row, spec.center) for row in np.eye(3) - np.outer(a, a)]
    turned = [linear(row, spec.center) for row in np.cross(np.eye(3), a)]
    return d, turned, square(d)


def square(d: list[str]) -> str:
    """Write r², kept off zero as in kernels/primitive.py."""
    return "(" + " + ".join(f"{part}^2" for part in d) + " + 1e-12)"


def source(spec) -> list[str]:
    """Write d/(2π r²)."""
    d, _, r2 = lines(spec)
    return [f"{part}/(2*pi*{r2})" for part in d]


def point_source(spec) -> list[str]:
    """Write d/(4π r³)."""
    d = [linear(row, spec.center) for row in np.eye(3)]
    r2 = square(d)
    return [f"{part}/(4*pi*{r2}*sqrt({r2}))" for part in d]


def vortex(spec) -> list[str]:
    """Write a × d g/(2π r²), g by core."""
    _, turned, r2 = lines(spec)
    core2 = repr((spec.core.radius or 1.0) ** 2)
    share = {
        "ideal": f"1/{r2}",
        "rankine": f"min(1/{core2}, 1/{r2})",
        "lamb_oseen": f"(1 - exp(-{r2}/{core2}))/{r2}",
        "scully": f"1/({r2} + {core2})",
    }[spec.core.model]
    return [f"{part}/(2*pi)*({share})" for part in turned]


def doublet(spec) -> list[str]:
    """Write (e − 2 (d·e) d/r²)/r²."""
    d, _, r2 = lines(spec)
    a, e = np.array(spec.axis, float) / math.hypot(*spec.axis), np.array(spec.direction, float)
    e = e - a * (a @ e)
    e = e / np.linalg.norm(e)
    along = linear(e, spec.center)
    return [f"({component!r} - 2*{along}*{part}/{r2})/{r2}" for component, part in zip(map(float, e), d, strict=True)]


def rotation(spec) -> list[str]:
    """Write a × d."""
    return lines(spec)[1]


FORMULAS = {
    "source": source,
    "point_source": point_source,
    "vortex": vortex,
    "doublet": doublet,
    "rotation": rotation,
}
