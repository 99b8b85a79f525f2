"""Images: the rows of the flow table by which an obstacle answers a primitive, so that nothing flows through its surface.

Milne-Thomson's circle theorem for a cylinder of radius R, axis a: what stands at b (from the axis) has its image at c = (R²/|b|²) b.

    uniform U            a doublet of moment R² (I − a aᵀ) U on the axis
    source V′ at b       a source V′ at c, a sink −V′ on the axis
    vortex Γ at b        a vortex −Γ at c, a vortex Γ on the axis, so that the circulation round the cylinder is its own
    doublet m at b       a doublet (R²/|b|²) (I − 2 b̂ b̂ᵀ) m at c

A wall with unit normal n mirrors, S = I − 2 n nᵀ: places, axes, moments and travels are multiplied by S; a circulation about an axis
changes its sign (it is a pseudovector; that of a ring is about its jet and stays); a uniform flow loses its part along n.
Walls that are perpendicular to each other answer each other's images.

Cores. A mirrored vortex has the same core, an image at a cylinder one smaller by R/|b|. On the cylinder the distances from b and from c
have that same ratio, so both cores weaken their vortices by one factor there, and as the pair of ideal ones sends nothing through the
surface, neither does this pair: exact for every core. The vortices on the axis turn like a solid body inside and are ideal outside.

Source: Milne-Thomson 1968, §6.21 (the circle theorem), of which the table is what it says for each kind; the note on cores is ours.
"""

from collections.abc import Sequence

import numpy as np
import warp as wp

from warpsim.kernels import flow
from warpsim.kernels.primitive import RANKINE, FlowPrimitive

KINDS = list(flow.FLOWS)


def vector(components) -> wp.vec3:
    """Return three numbers as the device's vector."""
    return wp.vec3(*(float(component) for component in components))


def matrix(entries) -> wp.mat33:
    """Return nine numbers as the device's matrix."""
    return wp.mat33(*(float(entry) for entry in np.asarray(entries).ravel()))


def array(value) -> np.ndarray:
    """Return a row's vector (3,) in float64."""
    return np.array(value, dtype=float)


def changed(row: FlowPrimitive, gain=1.0, **fields) -> FlowPrimitive:
    """Return a copy of a row with other fields and its strength multiplied, from the left, by a number or a matrix."""
    copy = FlowPrimitive()
    for name in FlowPrimitive.vars:
        setattr(copy, name, fields.get(name, getattr(row, name)))
    factor = gain * np.eye(3) if np.ndim(gain) == 0 else gain
    copy.gain = matrix(factor @ array(row.gain).reshape(3, 3))  # Warp hands a matrix out flat
    return copy


class CylinderImages:
    """The circle theorem, per kind of primitive."""

    def __init__(self, spec):
        self.center, self.radius = np.array(spec.center, float), spec.radius
        self.axis = np.array(spec.axis, float) / np.linalg.norm(spec.axis)
        self.across = np.eye(3) - np.outer(self.axis, self.axis)

    def of(self, row: FlowPrimitive) -> list[FlowPrimitive]:
        """Return the images of a row."""
        return self.formulas[KINDS[row.kind]](self, row)

    def own(self, row: FlowPrimitive) -> FlowPrimitive:
        """Return a vortex's row on the axis: ideal outside, like a solid body inside."""
        return changed(row, center=vector(self.center), axis=vector(self.axis), core=RANKINE, core_radius=self.radius)

    def _inverse(self, row: FlowPrimitive) -> tuple[wp.vec3, float, np.ndarray]:
        """Return the image's place, the ratio R/|b|, and the unit vector towards the primitive."""
        b = self.across @ (array(row.center) - self.center)
        distance = np.linalg.norm(b)
        return vector(self.center + (self.radius / distance) ** 2 * b), self.radius / distance, b / distance

    def _uniform(self, row):
        doublet = KINDS.index("doublet")
        return [changed(row, self.radius**2 * self.across, kind=doublet, center=vector(self.center), axis=vector(self.axis))]

    def _source(self, row):
        place, _, _ = self._inverse(row)
        return [changed(row, center=place), changed(row, -1.0, center=vector(self.center))]

    def _vortex(self, row):
        place, ratio, _ = self._inverse(row)
        return [changed(row, -1.0, center=place, core_radius=ratio * row.core_radius), self.own(changed(row, self._side(row)))]

    def _side(self, row) -> float:
        """Return 1 for an axis like the cylinder's, -1 for the opposite one."""
        return float(np.sign(array(row.axis) @ self.axis))

    def _doublet(self, row):
        place, ratio, towards = self._inverse(row)
        return [changed(row, ratio**2 * (np.eye(3) - 2.0 * np.outer(towards, towards)), center=place)]

    formulas = {"uniform": _uniform, "source": _source, "vortex": _vortex, "doublet": _doublet}


class WallImages:
    """The mirror, per kind of primitive."""

    def __init__(self, spec):
        self.center = np.array(spec.center, float)
        self.normal = np.array(spec.normal, float) / np.linalg.norm(spec.normal)
        self.mirror = np.eye(3) - 2.0 * np.outer(self.normal, self.normal)
        self.gains = {"source": 1.0, "point_source": 1.0, "doublet": self.mirror, "vortex_ring": 1.0}
        self.gains |= {"vortex": -1.0, "vortex_segment": -1.0}

    def of(self, row: FlowPrimitive) -> list[FlowPrimitive]:
        """Return the image of a row; a line that stands on the wall sends nothing through it, and its image has no strength."""
        kind = KINDS[row.kind]
        if kind == "uniform":
            return [changed(row, -np.outer(self.normal, self.normal))]
        place = vector(self.center + self.mirror @ (array(row.center) - self.center))
        endless = kind in ("source", "vortex", "doublet")
        stands = endless and abs(array(row.axis) @ self.normal) > 0.5  # else it is parallel to the wall
        turn = matrix(self.mirror @ array(row.turn).reshape(3, 3))
        return [changed(row, 0.0 if stands else self.gains[kind], center=place, axis=vector(self.mirror @ array(row.axis)), turn=turn)]


IMAGES = {"cylinder": CylinderImages, "wall": WallImages}


def answered(row: FlowPrimitive, obstacles: Sequence) -> list[FlowPrimitive]:
    """Return a row and all its images at the obstacles that answer it, each of which answers the images at those before it."""
    rows = [row]
    for obstacle in obstacles:
        images = IMAGES[obstacle.type](obstacle)
        rows += [image for one in rows for image in images.of(one)]
    return rows
