"""Force fields as rows of a table [N]; gravity is an acceleration and needs no row.

Symbols: x point [m], d = C − x [m] toward the center C, ε softening [m], k strength. Each formula takes (field, x).
"""

import warp as wp

CONSTANT, INVERSE_SQUARE, SPRING = range(3)
ATTRACTOR_LAWS = {"constant": CONSTANT, "inverse_square": INVERSE_SQUARE, "spring": SPRING}


@wp.struct
class ForceField:
    kind: int  # place in FORCES
    law: int  # CONSTANT … SPRING
    center: wp.vec3  # [m]
    softening: float  # [m]
    signal: wp.vec3i  # rows of the signals that give the strength; -1: zero
    strength: wp.vec3  # (k [N | N·m² | N/m] by law, …) at the time of the table


@wp.func(inline=True)
def sample_attractor(field: ForceField, x: wp.vec3) -> wp.vec3:
    """Return F = k d/s | k d/s³ | k d by law, s = √(d² + ε²) [N].  Source: lecture; softening after Plummer 1911."""
    d = field.center - x
    s2 = wp.dot(d, d) + field.softening * field.softening
    g = float(1.0)
    if field.law == CONSTANT:
        g = 1.0 / wp.sqrt(s2)
    elif field.law == INVERSE_SQUARE:
        g = 1.0 / (s2 * wp.sqrt(s2))
    return d * (field.strength[0] * g)


FORCES = {"attractor": sample_attractor}


@wp.func
def sample_force(field: ForceField, x: wp.vec3) -> wp.vec3:
    """Return zero: there is no such kind."""
    return wp.vec3()


def with_case(kind, formula, otherwise):
    """Chain one more kind, as in flow.py."""

    @wp.func(name="sample_force")
    def sample_force(field: ForceField, x: wp.vec3) -> wp.vec3:
        """Return the force of one field at x."""
        if field.kind == kind:
            return formula(field, x)
        return otherwise(field, x)

    return sample_force


for _kind, _formula in enumerate(FORCES.values()):
    sample_force = with_case(_kind, _formula, sample_force)


@wp.func
def sample_acceleration(forces: wp.array2d[ForceField], node: int, gravity: wp.vec3, inverse_mass: float, x: wp.vec3) -> wp.vec3:
    """Return gravity plus the forces per mass at x [m/s²], by the table's row for one moment."""
    a = gravity
    for k in range(forces.shape[1]):
        a = a + sample_force(forces[node, k], x) * inverse_mass
    return a
