"""Measurers of contact: the least distance from colliders, and crossings of a surface with itself."""

import math

from warpsim.crossings import crossings
from warpsim.verify.amounts import expected_at
from warpsim.verify.findings import Reading
from warpsim.verify.networks import SpanMeasurer, places
from warpsim.verify.solids import clearance


class ClearanceMeasurer(SpanMeasurer):
    """The least distance of all points from all colliders in all frames."""

    def __init__(self, oracle, scene):
        super().__init__(oracle, scene)
        self._least, self._where = math.inf, ""

    def look(self, simulation) -> None:
        points, self._times = places(simulation, self.oracle.system), [simulation.time]
        for one in self.oracle.of(self.scene):
            distance = clearance(one, points, simulation.time)
            if not distance.min() >= self._least:
                self._least, point = float(distance.min()), int(distance.argmin())
                self._where = f"point {point}, {one.name or one.type}, at {simulation.time:.6g} s"

    def reading(self) -> Reading:
        expected = expected_at(self.oracle.expect, self._times[-1])
        thickness = self.scene.systems[self.oracle.system].thickness
        return Reading(self._least, thickness if expected is None else expected, remark=self._where)


class CrossingsMeasurer(SpanMeasurer):
    """Edges through triangles, counted every so many frames and in the last."""

    def look(self, simulation) -> None:
        last = self.frame_at(self.oracle.to)
        if (last - simulation.index) % self.oracle.every == 0:
            frame = simulation.frame()[self.oracle.system]
            self._times.append(simulation.time)
            self._values.append(len(crossings(frame.position, frame.triangles)))

    def reading(self) -> Reading:
        worst = max(range(len(self._values)), key=self._values.__getitem__)
        remark = f"in {len(self._values)} frames"
        if self._values[worst]:
            remark += f"; {self._values[worst]} at {self._times[worst]:.6g} s"
        return Reading(float(sum(self._values)), expected_at(self.oracle.expect, self._times[-1]), remark=remark)
