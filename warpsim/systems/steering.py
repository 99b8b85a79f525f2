"""Steering of one flock: its behaviors as a table with a row for each substep, and the stages that add them up."""

from collections.abc import Iterator

import warp as wp

from warpsim.environment import Environment
from warpsim.kernels import steering
from warpsim.launch import Stage
from warpsim.scene.colliders import Course
from warpsim.signals import SignalTable, components, strength_signals
from warpsim.systems.emitters import random_key

EVERYWHERE = 1.0e18  # [m]: a radius without limit, whose square is a number


class Steering:
    """What the boids of a flock do besides its rules; `flock` is the system."""

    def __init__(self, flock, environment: Environment):
        self._flock, self._start_time, device = flock, environment.start_time, flock.device
        rows, table, points = self._rows(flock.spec)
        self._signals = table.tables(device)
        self._behaviors = wp.array(rows, dtype=steering.Behavior, device=device)
        self._points = wp.array(points, dtype=wp.vec3, device=device)
        self._table = wp.zeros((flock.pace.substep_count, len(rows)), dtype=steering.Behavior, device=device)

    def _rows(self, spec) -> tuple[list, SignalTable, list]:
        """Return the behaviors' rows, their signals and the points of their paths."""
        rows, table, points = [], SignalTable(), []
        for place, one in enumerate(spec.steering):
            row = steering.Behavior()
            row.kind, row.weight = list(steering.BEHAVIORS).index(one.type), one.weight
            row.speed = spec.pace if one.speed is None else one.speed
            row.key, row.leader, row.signal = random_key(self._flock.scene.seed, self._flock.name, place), -1, wp.vec3i(-1, -1, -1)
            row.radius = getattr(one, "radius", None) or EVERYWHERE
            for key in ("distance", "horizon", "period"):
                setattr(row, key, getattr(one, key, 0.0))
            if one.type == "path":
                row.first, row.count, row.closed = len(points), len(one.points), int(one.closed)
                points += one.points
            if one.type == "leader" and one.boid is not None:
                row.leader = one.boid
            target = getattr(one, "target", None)
            if target is not None:
                row.signal = strength_signals(components(target.keyframes) if isinstance(target, Course) else target, table)
            rows.append(row)
        return rows, table, points

    def sampling(self) -> Iterator[Stage]:
        """Yield the stage that finds the goals of all substeps of a frame."""
        if len(self._behaviors):
            inputs = (self._start_time, self._flock.pace.dt, self._signals, self._behaviors, self._table)
            yield Stage("steering", steering.sample_behaviors, self._table.shape[0], inputs)

    def stages(self, s: int) -> Iterator[Stage]:
        """Yield the stage that adds to the flock's steering in substep s."""
        if len(self._behaviors):
            flock = self._flock
            inputs = (s, flock.point_count, flock.pace.dt, self._start_time, self._table, self._points, flock.domain)
            inputs += (flock.surroundings.row, flock.particles, flock.steering)
            yield Stage("steering", steering.accumulate_steering, flock.population.capacity, inputs)

    def change(self) -> None:
        """Take the numbers of the flock's spec, in place."""
        rows, table, points = self._rows(self._flock.spec)
        table.write(self._signals)
        for array, values in ((self._behaviors, rows), (self._points, points)):
            if len(array):
                array.assign(wp.array(values, dtype=array.dtype, device=array.device))
