"""Measurers of motion: a test particle under a system's laws, or all of a system's particles, against the laws of laws.py."""

import math
from abc import abstractmethod
from dataclasses import replace

import numpy as np

from warpsim.scene.emitters import Burst, Distribution, Emitter, Point, Velocity
from warpsim.scene.look import Look
from warpsim.scene.oracles import entry_of
from warpsim.verify import laws
from warpsim.verify.amounts import expected_at
from warpsim.verify.findings import Reading
from warpsim.verify.measurers import Frames, StoryMeasurer, gone

LIFETIME = 1e6  # [s]: a test particle does not die
LONGEST = 1e5  # [s]: of an orbit that is waited for


class ParticleMeasurer(StoryMeasurer):
    """Measures a test particle in a system of its own, beside those of the other oracles, in the scene's surroundings."""

    story = "test particles"
    system = ""
    """Name of that system, given when the story is put together; no scene has one like it."""

    def __init__(self, oracle, scene):
        super().__init__(oracle, scene)
        self.body = laws.body_of(oracle, scene)

    def particle_spec(self):
        """Return the system of the test particle: the oracle's, with one birth."""
        body = self.body
        speed = float(np.linalg.norm(body.v))
        pace = Distribution.model_construct(mean=speed, spread=0.0, law="uniform")  # a vector may be longer than its components may
        velocity = Velocity(direction=tuple(body.v), speed=pace) if speed > 1e-9 else None
        mass, radius = Distribution(mean=body.m), Distribution(mean=body.radius)
        bursts = (Burst(count=1, at=self.oracle.release),)
        shape, life = Point(center=tuple(body.x)), Distribution(mean=LIFETIME)
        emitter = Emitter(shape=shape, burst=bursts, velocity=velocity, lifetime=life, mass=mass, radius=radius)
        feels = self.oracle.feels_in(self.scene)
        spec = self.oracle.spec_in(self.scene)
        return spec.model_copy(update={"capacity": 1, "emitters": (emitter,), "feels": feels, "look": Look()})

    @property
    def frames(self) -> Frames:
        return Frames(self.frame_at(self.oracle.at))

    def look(self, simulation) -> None:
        frame = simulation.frame()[self.system]
        if frame.count:
            self.see(simulation, frame.position[0].astype(float), frame.velocity[0].astype(float))

    def see(self, simulation, x: np.ndarray, v: np.ndarray) -> None:
        """Take the particle's place and velocity in the present frame."""
        self.x, self.v, self.time = x, v, simulation.time


class StateMeasurer(ParticleMeasurer):
    """Measures what the test particle has at one moment."""

    def reading(self) -> Reading:
        if not hasattr(self, "time"):
            return gone("the test particle")
        expected = expected_at(self.oracle.expect, self.time)
        return Reading(self.measured(), self.theory(self.time - self.oracle.release) if expected is None else expected)

    @abstractmethod
    def measured(self) -> float | np.ndarray:
        """Return the quantity at the moment of measuring."""

    def theory(self, t: float) -> float | np.ndarray:
        """Return what the law says so long after the release [s]; nan where there is none and the oracle must say it."""
        return math.nan


class TerminalSpeedMeasurer(StateMeasurer):
    """|v − w|, w the constant wind."""

    def measured(self) -> float:
        return float(np.linalg.norm(self.v - self.body.wind))

    def theory(self, t: float) -> float:
        return laws.terminal_speed(self.body)


class RelaxationMeasurer(StateMeasurer):
    """v."""

    def measured(self) -> np.ndarray:
        return self.v

    def theory(self, t: float) -> np.ndarray:
        return laws.velocity_after(self.body, t)


class ArcMeasurer(StateMeasurer):
    """x."""

    def measured(self) -> np.ndarray:
        return self.x

    def theory(self, t: float) -> np.ndarray:
        return laws.place_after(self.body, t)


class OrbitMeasurer(ParticleMeasurer):
    """The moment at which the angle about the center reaches its last turn, by the cubic through angle and rate of the frames beside it."""

    MOST_TIMES = 1.25  # of the expected time it may take

    def __init__(self, oracle, scene):
        super().__init__(oracle, scene)
        self.center = oracle.center_in(scene)
        expected = expected_at(oracle.expect, oracle.release)
        self.expected = laws.orbit_period(self.body, self.center, oracle.release) if expected is None else expected
        self._before: tuple[float, float, float] | None = None  # angle, rate and time at the last frame
        self._place: np.ndarray | None = None
        self.period = math.nan
        self.remark = "" if 0.0 < self.expected < LONGEST else "this orbit has no closed law, or no end: say what to expect"

    @property
    def frames(self) -> Frames:
        seconds = self.MOST_TIMES * self.oracle.turns * self.expected if not self.remark else 0.0
        first = math.ceil(self.oracle.release * self.scene.time.fps)
        return Frames(throughout=(first, first + math.ceil(seconds * self.scene.time.fps) + 1))

    @property
    def satisfied(self) -> bool:
        return math.isfinite(self.period)

    def _axis(self, r: np.ndarray, v: np.ndarray) -> np.ndarray:
        axis = np.cross(r, v) if self.center.type == "attractor" else np.array(self.center.axis, float)
        return axis / np.linalg.norm(axis)

    def see(self, simulation, x, v) -> None:
        r = x - np.array(self.center.center)
        if self._place is None:
            self._normal = self._axis(r, v)
        r = r - self._normal * (r @ self._normal)
        rate, time = float(np.cross(r, v) @ self._normal / (r @ r)), simulation.time
        if self._place is None:
            # The release lies within this frame, a little before: the angle is counted from there.
            start = self.body.x - np.array(self.center.center)
            self._place, self._before = start - self._normal * (start @ self._normal), (0.0, rate, self.oracle.release)
        turned = math.atan2(np.cross(self._place, r) @ self._normal, self._place @ r)
        angle = self._before[0] + turned
        target = math.copysign(2.0 * math.pi * self.oracle.turns, angle)
        if not self.satisfied and abs(angle) >= abs(target) and time > self._before[2]:
            self.period = (crossing(*self._before, angle, rate, time, target) - self.oracle.release) / self.oracle.turns
        self._before, self._place = (angle, rate, time), r

    def reading(self) -> Reading:
        return Reading(self.period, self.expected, remark=self.remark or ("" if self.satisfied else "it did not come round in time"))


def crossing(y0: float, s0: float, t0: float, y1: float, s1: float, t1: float, target: float) -> float:
    """Return when the cubic through (t0, y0) with slope s0 and (t1, y1) with slope s1 reaches the target, by bisection."""
    h = t1 - t0

    def cubic(share: float) -> float:
        q = 1.0 - share
        return (
            q * q * (1.0 + 2.0 * share) * y0
            + share * q * q * h * s0
            + share * share * (3.0 - 2.0 * share) * y1
            - share * share * q * h * s1
        )

    low, high = 0.0, 1.0
    for _ in range(60):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if (cubic(middle) - target) * (y1 - target) < 0.0 else (low, middle)
    return t0 + h * 0.5 * (low + high)


class BounceHeightMeasurer(StateMeasurer):
    """d + v²/(2g) along the plane's normal: the height to which it is on its way up, or from which it comes down."""

    def __init__(self, oracle, scene):
        super().__init__(oracle, scene)
        plane = entry_of(oracle.collider, scene.colliders)
        self.plane, self.normal = plane, np.array(plane.normal, float) / np.linalg.norm(plane.normal)

    def _height(self, x: np.ndarray, v: np.ndarray) -> float:
        return laws.height_above(x - np.array(self.plane.center), v, self.normal, float(np.linalg.norm(self.body.g)))

    def measured(self) -> float:
        return self._height(self.x, self.v)

    def theory(self, t: float) -> float:
        return laws.height_after(self._start(), self.plane.restitution, t)[0]

    def _start(self) -> tuple[float, float, float]:
        """Return height and speed along the normal at the release, and g."""
        return float((self.body.x - self.plane.center) @ self.normal), float(self.body.v @ self.normal), float(np.linalg.norm(self.body.g))

    def reading(self) -> Reading:
        reading = super().reading()
        bounces = laws.height_after(self._start(), self.plane.restitution, getattr(self, "time", 0.0) - self.oracle.release)[1]
        return reading if reading.remark else replace(reading, remark=f"bounces so far: {bounces}")


class PositionMeasurer(StateMeasurer):
    """x; what to expect is always said."""

    def measured(self) -> np.ndarray:
        return self.x


class EnergyMeasurer(StateMeasurer):
    """½ m v² − m g·x and what attractors hold."""

    def measured(self) -> float:
        return self._energy(self.x, self.v, self.time)

    def theory(self, t: float) -> float:
        return self._energy(self.body.x, self.body.v, self.oracle.release)

    def _energy(self, x: np.ndarray, v: np.ndarray, time: float) -> float:
        return laws.energy(self.oracle, self.scene, x[None], v[None], np.array([self.body.m]), time)


class MomentumMeasurer(StateMeasurer):
    """m v."""

    def measured(self) -> np.ndarray:
        return self.body.m * self.v

    def theory(self, t: float) -> np.ndarray:
        return self.body.m * (self.body.v + self.body.g * t)
