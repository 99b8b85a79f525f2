"""What was measured, and what follows from it."""

from dataclasses import dataclass

import numpy as np

Quantity = float | np.ndarray | str


@dataclass(frozen=True)
class Reading:
    """What a measurer read: the measured quantity and the expected one, a number, a vector (3,), or text that must be equal."""

    measured: Quantity
    expected: Quantity
    standard_error: float | None = None
    """Of the measured number, where it counts random ones."""
    remark: str = ""
    """What a reader of the table should know besides."""
    samples: int | None = None
    """How many were sorted into bins, where the measured number is a χ²."""


@dataclass(frozen=True)
class Finding:
    """One line of the table: what an oracle found."""

    name: str
    kind: str
    verdict: str
    """pass, fail, skipped, or unmeasured (the scene blew up before)."""
    measured: Quantity | None = None
    expected: Quantity | None = None
    error: float | None = None
    """Distance of the measured from the expected."""
    allowed: float | None = None
    """The tolerance in the unit of the quantity."""
    detects: float | None = None
    """Statistical oracles: the smallest change of the expected number that 98 of 100 runs would notice. Of a χ²: the smallest root mean
    square by which the density of births may stray from even, as a part of it."""
    remark: str = ""
    reason: str = ""


def judged(name: str, oracle, reading: Reading) -> Finding:
    """Compare a reading with its oracle's tolerance."""
    facts = {"name": name, "kind": oracle.type, "measured": reading.measured, "expected": reading.expected}
    facts |= {"remark": reading.remark, "reason": oracle.reason}
    if isinstance(reading.measured, str):
        return Finding(verdict="pass" if reading.measured == reading.expected else "fail", **facts)
    error = float(np.linalg.norm(np.subtract(reading.measured, reading.expected)))
    allowed = allowance(oracle.tolerance, reading)
    # A test that lets errors of `allowed` pass notices a change by two standard errors more in 98 of 100 runs.
    detects = None if reading.standard_error is None else allowed + 2.0 * reading.standard_error
    if reading.samples:
        detects = float(np.sqrt(detects / reading.samples))  # n samples of a density that strays by ε add n ε² to χ²
    verdict = "pass" if error <= allowed else "fail"  # what is not a number fails
    return Finding(verdict=verdict, error=error, allowed=allowed, detects=detects, **facts)


def allowance(tolerance, reading: Reading) -> float:
    """Return a tolerance in the unit of the quantity."""
    if tolerance.absolute is not None:
        return tolerance.absolute
    if tolerance.relative is not None:
        return tolerance.relative * float(np.linalg.norm(reading.expected))
    return tolerance.sigma * (reading.standard_error or 0.0)
