"""Two coaxial vortex rings that leapfrog: thin rings that move with the flow at their circles, in float64.

`python -m tests.reference.leapfrog` prints the keyframes of scenes/leapfrog.yaml.
Source: Dyson 1893, Hicks 1922 (thin rings); Rosenhead 1930 (the core).
"""

import math

import numpy as np

CIRCULATION, CORE, RADIUS, GAP = 1.6, 0.1, 0.72, 0.62  # m²/s, m, m, m
DURATION, SPACING, STEP = 14.0, 0.1, 0.01  # s
ANGLE = 2.0 * math.pi * np.arange(800) / 800  # the trapezoid rule converges exponentially: e^(-800 CORE/RADIUS)


def flow_at(rho: float, z: float, radius: float) -> np.ndarray:
    """Return (radial, axial) velocity [m/s] of a ring of that radius at distance rho from the axis, z before the ring: Biot and Savart."""
    cosine = np.cos(ANGLE)
    square = (rho - radius) ** 2 + z**2 + CORE**2 + 2.0 * rho * radius * (1.0 - cosine)
    weights = CIRCULATION * radius / (4.0 * math.pi) * (2.0 * math.pi / len(ANGLE)) / square**1.5
    return np.array([weights @ (z * cosine), weights @ (radius - rho * cosine)])


def motion(state: np.ndarray) -> np.ndarray:
    """Return the rate of change of [(R, z) of the one, of the other] [m/s]."""
    return np.array([sum(flow_at(rho, z - at, radius) for radius, at in state) for rho, z in state])


def paths() -> tuple[np.ndarray, np.ndarray]:
    """Return times (n,) and radius and place (n, 2, 2) of both rings, in the frame of their mean speed; Runge–Kutta of fourth order."""
    state = np.array([[RADIUS, 0.5 * GAP], [RADIUS, -0.5 * GAP]])
    every, states = round(SPACING / STEP), []
    for step in range(round(DURATION / STEP) + 1):
        if step % every == 0:
            states.append(state)
        a = motion(state)
        b = motion(state + 0.5 * STEP * a)
        c = motion(state + 0.5 * STEP * b)
        state = state + STEP / 6.0 * (a + 2.0 * b + 2.0 * c + motion(state + STEP * c))
    times, found = SPACING * np.arange(len(states)), np.array(states)
    return times, found


def mean_speed(times: np.ndarray, states: np.ndarray) -> float:
    """Return the speed of the pair, from its first to its last passing [m/s]."""
    ahead = states[:, 0, 1] - states[:, 1, 1]
    passes = np.flatnonzero(np.diff(np.sign(ahead)) != 0)
    middle = states[:, :, 1].mean(axis=1)
    return float((middle[passes[-1]] - middle[passes[0]]) / (times[passes[-1]] - times[passes[0]]))


if __name__ == "__main__":
    times, states = paths()
    wind = mean_speed(times, states)
    print(f"mean speed {wind:.4f}")
    for ring in (0, 1):
        for name, curve in (("radius", states[:, ring, 0]), ("place", states[:, ring, 1] - wind * times)):
            print(name, "[" + ", ".join(f"[{t:.1f}, {value:.4f}]" for t, value in zip(times, curve, strict=True)) + "]")
