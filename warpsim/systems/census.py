"""Census: what is told of a flock as a whole, worked out when somebody asks; nothing of it is part of a frame."""

import numpy as np
import warp as wp

from warpsim.kernels import census
from warpsim.launch import FrameGraph, Stage
from warpsim.population import FIELDS, Population
from warpsim.systems.crowds import Crowd

ALONE = np.float32(census.ALONE)


class Census:
    """Order, turning, spacing and clusters of a flock (the system) as it is now.

    `copied`: of a copy on the CPU, as it is when this is made. One thread counts the clusters, which takes a GPU's a hundred times as long.
    """

    def __init__(self, flock, native: bool, copied: bool = False):
        crowd, device = flock.crowd, flock.device
        if copied:
            crowd, device, native = Crowd(on_cpu(flock.population), flock.spec, flock.spec.perception.radius), "cpu", True
        self._flock, capacity = flock, flock.population.capacity
        self._nearest = wp.zeros(capacity, dtype=float, device=device)
        self._count = wp.zeros(2, dtype=int, device=device)
        reach2 = flock.spec.perception.radius**2
        room = [wp.zeros(capacity, dtype=int, device=device) for _ in range(2)]
        stages = crowd.sorting(native)
        stages.append(Stage("census", census.sample_nearest, capacity, (crowd.row, reach2, self._nearest)))
        stages.append(Stage("census", census.mark_clusters, 1, (crowd.row, reach2, *room, self._count)))
        self._graph = FrameGraph(stages, device, 1, native)

    def numbers(self) -> dict[str, float]:
        """Return the numbers by their names in stats.csv; see docs/flocks.md."""
        flock = self._flock
        if not flock.point_count:
            return {"order": 0.0, "polarization": 0.0, "milling": 0.0, "nearest": 0.0, "clusters": 0}
        x, v = (flock.population.host(name).T.astype(float) for name in ("position", "velocity"))
        self._graph.run({})
        nearest = self._nearest.numpy()[: flock.point_count].astype(float)
        near = nearest[nearest < ALONE]
        domain = flock.spec.domain
        periodic = domain is not None and domain.boundary == "periodic"
        return course_numbers(x, v, periodic) | {
            "nearest": float(near.mean()) if len(near) else 0.0,
            "clusters": int(self._count.numpy()[0]),
        }


def on_cpu(population: Population) -> Population:
    """Return places and velocities of a population in one on the CPU, and its counters."""
    copy = Population(population.limit, {name: FIELDS[name] for name in ("position", "velocity")}, "cpu")
    for name in copy.fields:
        copy.field(name).numpy()[:, : population.counter("live")] = population.host(name)
    copy.counters.assign(population.counters.numpy())
    return copy


def course_numbers(x: np.ndarray, v: np.ndarray, periodic: bool) -> dict[str, float]:
    """Return order, polarization [degrees] and milling of boids at x (n, 3) with velocities v; who stands still has no heading.

    order: φ = |Σ v/|v||/n (Vicsek et al. 1995). polarization: mean angle between headings and the mean heading (Huth & Wissel 1992).
    milling: |Σ r × v/(|r| |v|)|/n with r from the center (Couzin et al. 2002); 0 in a periodic domain, which has no center.
    """
    speed = np.linalg.norm(v, axis=1)
    moving = speed > 0.0
    n = v[moving] / speed[moving, None]
    if not len(n):
        return {"order": 0.0, "polarization": 0.0, "milling": 0.0}
    mean = n.mean(axis=0)
    order = float(np.linalg.norm(mean))
    angle = np.degrees(np.arccos(np.clip(n @ (mean / order), -1.0, 1.0))) if order > 0.0 else np.full(len(n), 90.0)
    r = x[moving] - x[moving].mean(axis=0)
    length = np.linalg.norm(r, axis=1)
    turning = np.cross(r, n)[length > 0.0] / length[length > 0.0, None]
    milling = 0.0 if periodic or not len(turning) else float(np.linalg.norm(turning.sum(axis=0)) / len(n))
    return {"order": order, "polarization": float(angle.mean()), "milling": milling}
