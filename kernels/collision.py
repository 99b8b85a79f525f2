"""Collisions of particles, which are points, with colliders."""

import warp as wp


@wp.struct
class Collider:
    kind: int


@wp.struct
class Passage:
    x: wp.vec3  # at the substep's end [m]
    v: wp.vec3  # [m/s]
    hits: int  # impacts on the way
    dead: int  # 1: killed by one


@wp.func
def cross_colliders(
    colliders: wp.array2d[Collider],
    moment: int,
    begin_share: float,
    end_share: float,
    h: float,
    x0: wp.vec3,
    v0: wp.vec3,
    x1: wp.vec3,
    v1: wp.vec3,
    tracer: int,
) -> Passage:
    """Return where a particle ends that would go from (x0, v0) to (x1, v1) within h, were there no colliders."""
    passage = Passage()
    passage.x = x1
    passage.v = v1
    return passage
