"""Twin of kernels/facets.py: what a fluid does to a surface within a substep, facet by facet in float64."""

import numpy as np


def area_vector(corners: np.ndarray) -> np.ndarray:
    """Area vector of a polygon, ½ Σ x_k × x_{k+1} [m²]."""
    return 0.5 * np.cross(corners, np.roll(corners, -1, axis=0)).sum(axis=0)


def water_forces(x, v, flow, facets, c: float, inverse_mass: np.ndarray, h: float) -> np.ndarray:
    """Force on every point [N]: −c A max(0, w) n of each facet, evenly on its corners, scaled to what a substep h of it leaves to do.

    facets: lists of 3 or 4 points; flow(x) is the fluid's velocity. Of d facets at a point each may count on a d-th of its mass.
    """
    degree = np.zeros(len(x))
    for facet in facets:
        degree[list(facet)] += 1.0
    total = np.zeros_like(x)
    for facet in facets:
        points = list(facet)
        area = area_vector(x[points])
        size = np.linalg.norm(area)
        if size == 0.0:
            continue
        n = area / size
        w = max(n @ (v[points].mean(axis=0) - flow(x[points].mean(axis=0))), 0.0)
        kappa = c * size * (degree[points] * inverse_mass[points]).sum() / len(points) ** 2
        share = -np.expm1(-kappa * h) / (kappa * h) if kappa > 0.0 else 1.0
        total[points] -= c * size * w * share * n / len(points)
    return total
