"""Events of one system: logs on the device, filled in each frame for the emitters of other systems that listen."""

from collections.abc import Iterator

import warp as wp

from warpsim.kernels import emission, events
from warpsim.launch import MOST_CORES, Stage
from warpsim.population import Field, Population
from warpsim.scene.events import On, kind_of

LINEAGE = {"lineage": Field(2, wp.uint32, "1", "random name from its emitter and ordinal, that its children's ordinals grow from")}
TINT = {"tint": Field(1, wp.uint32, "1", "color of its own, rgba bytes, multiplied with the look's")}
IMPACT = {
    "impact": Field(10, wp.float32, "m, m/s, 1, s", "of the frame's first impact: place, velocity before, normal, time since; no state"),
    "impact_count": Field(1, wp.int32, "1", "impacts so far"),
    "impact_number": Field(1, wp.int32, "1", "how many there had been before the frame's first"),
}


def fields_of(heard: list[On]) -> dict[str, Field]:
    """Return the rows that a system needs for what is listened to of it."""
    return (LINEAGE if heard else {}) | (IMPACT if any(on.event == "collision" for on in heard) else {})


class Events:
    """The logs of what is listened to of one system."""

    def __init__(self, heard: list[On], population: Population, clock: wp.array, environment: wp.array, fps: float):
        self._population, self._clock, self._environment, self._fps = population, clock, environment, fps
        self._heard = {kind_of(on): (on, self._log(on.event == "collision")) for on in heard}

    def _log(self, on_surfaces: bool) -> emission.EventLog:
        population, log = self._population, emission.EventLog()
        n, device = population.capacity, population.device
        log.count = wp.zeros(1, dtype=int, device=device)
        log.position, log.velocity = (wp.zeros((3, n), dtype=float, device=device) for _ in range(2))
        log.since = wp.zeros(n, dtype=float, device=device)
        log.lineage = wp.zeros((2, n), dtype=wp.uint32, device=device)
        log.number = wp.zeros(n, dtype=int, device=device)
        log.normal = wp.zeros((3, n if on_surfaces else 0), dtype=float, device=device)
        log.tint = wp.zeros(n if "tint" in population.fields else 0, dtype=wp.uint32, device=device)
        return log

    def log(self, on: On) -> emission.EventLog:
        """Return the log of an event as kernels see it."""
        return self._heard[kind_of(on)][1]

    @property
    def follow_motion(self) -> bool:
        """Whether deaths or collisions are listened to, which are known after the particles have moved."""
        return any(on.event != "birth" for on, _ in self._heard.values())

    def stages(self, native: bool, particles: emission.Particles, *kinds: str) -> Iterator[Stage]:
        """Yield the stages that note the frame's events of these kinds."""
        n, device = self._population.capacity, self._population.device
        for on, log in self._heard.values():
            if on.event not in kinds:
                continue
            watch = events.Watch()
            watch.kind, watch.fps, watch.clock = events.EVENTS[on.event], self._fps, self._clock
            watch.min_speed = on.min_speed or 0.0
            watch.environment, watch.counters, watch.particles = self._environment, self._population.counters, particles
            if native:
                found = wp.zeros(MOST_CORES, dtype=int, device=device)
                yield Stage("events", events.mark_parts, n, (watch, found), events.mark_parts)
                yield Stage("events", events.scatter_parts, n, (watch, found, log), events.scatter_parts)
            else:
                marks, order = (wp.zeros(n, dtype=int, device=device) for _ in range(2))
                yield Stage("events", events.mark_events, n, (watch, marks, log))
                yield Stage("events", launch=lambda marks=marks, order=order: wp.utils.array_scan(marks, order))
                yield Stage("events", events.scatter_events, n, (watch, marks, order, log))
