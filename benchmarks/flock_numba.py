"""The boids of benchmarks/flocks.py for Numba: prange over boids, plain loops; imported only where that is installed."""

import numpy as np
from numba import float32, njit, prange, set_num_threads

from benchmarks.flock_peers import CLOSEST, Law

ZERO, ONE = np.float32(0.0), np.float32(1.0)


@njit(parallel=True)
def mark(x, rate, n, cell):
    for i in prange(len(x)):
        a = min(int(x[i, 0] * rate), n - 1)
        b = min(int(x[i, 1] * rate), n - 1)
        c = min(int(x[i, 2] * rate), n - 1)
        cell[i] = (c * n + b) * n + a


@njit
def sort(cell, start, place, order):
    start[:] = 0
    for i in range(len(cell)):
        start[cell[i] + 1] += 1
    for c in range(len(start) - 1):
        start[c + 1] += start[c]
        place[c] = start[c]
    for i in range(len(cell)):
        order[place[cell[i]]] = i
        place[cell[i]] += 1


@njit(parallel=True)
def gather(order, x, v, y, w):
    for k in prange(len(order)):
        for c in range(3):
            y[k, c] = x[order[k], c]
            w[k, c] = v[order[k], c]


@njit
def steer(k, at, n, start, y, w, reach2, cosine, closest2):
    """Return what the boid at place k does [N]."""
    cx, cy, cz = at % n, at // n % n, at // (n * n)
    xi, yi, zi, ui, vi, wi = y[k, 0], y[k, 1], y[k, 2], w[k, 0], w[k, 1], w[k, 2]
    limit = cosine * np.sqrt(ui * ui + vi * vi + wi * wi)
    ax = ay = az = sx = sy = sz = mu = mv = mw = count = ZERO
    for rz in range(max(cz - 1, 0), min(cz + 2, n)):
        for ry in range(max(cy - 1, 0), min(cy + 2, n)):
            row = (rz * n + ry) * n
            for j in range(start[row + max(cx - 1, 0)], start[row + min(cx + 2, n)]):
                dx, dy, dz = y[j, 0] - xi, y[j, 1] - yi, y[j, 2] - zi
                d2 = dx * dx + dy * dy + dz * dz
                if d2 < reach2 and j != k and dx * ui + dy * vi + dz * wi >= limit * np.sqrt(d2):
                    g = ONE / max(d2, closest2)
                    ax, ay, az = ax - dx * g, ay - dy * g, az - dz * g
                    sx, sy, sz = sx + dx, sy + dy, sz + dz
                    mu, mv, mw = mu + w[j, 0], mv + w[j, 1], mw + w[j, 2]
                    count += ONE
    if count > ZERO:
        q = ONE / count
        ax, ay, az = ax + sx * q + mu * q - ui, ay + sy * q + mv * q - vi, az + sz * q + mw * q - wi
    return ax, ay, az


@njit(parallel=True)
def move(order, cell, start, n, numbers, y, w, x, v):
    reach2, cosine, closest2, strongest, slowest, fastest, edge, h = numbers
    for k in prange(len(order)):
        i = order[k]
        ax, ay, az = steer(k, cell[i], n, start, y, w, reach2, cosine, closest2)
        force = np.sqrt(ax * ax + ay * ay + az * az)
        f = h * (strongest / force if force > strongest else ONE)
        ui, vi, wi = w[k, 0] + ax * f, w[k, 1] + ay * f, w[k, 2] + az * f
        speed = np.sqrt(ui * ui + vi * vi + wi * wi)
        f = min(max(speed, slowest), fastest) / max(speed, float32(1e-9))
        v[i, 0], v[i, 1], v[i, 2] = ui * f, vi * f, wi * f
        for c in range(3):
            p = y[k, c] + h * v[i, c]
            if p < ZERO:
                p, v[i, c] = -p, abs(v[i, c])
            elif p > edge:
                p, v[i, c] = edge - (p - edge), -abs(v[i, c])
            x[i, c] = p


class Flock:
    """Sorted by cell on one core, the rest on so many threads."""

    def __init__(self, x: np.ndarray, v: np.ndarray, law: Law, threads: int):
        self._threads = threads
        self.position, self.velocity, self._cells = x.copy(), v.copy(), law.cells
        self._sorted = np.empty_like(x), np.empty_like(v)
        self._cell, self._order = np.empty(len(x), np.int32), np.empty(len(x), np.int32)
        self._start, self._place = np.zeros(law.cells**3 + 1, np.int32), np.zeros(law.cells**3, np.int32)
        self._rate = np.float32(law.cells / law.edge)
        limits = (law.strongest, law.slowest, law.fastest, law.edge, law.h)
        self._numbers = tuple(np.float32(q) for q in (law.radius**2, law.cosine, (CLOSEST * law.radius) ** 2, *limits))

    def step_frame(self) -> None:
        """Advance one frame."""
        set_num_threads(self._threads)
        mark(self.position, self._rate, self._cells, self._cell)
        sort(self._cell, self._start, self._place, self._order)
        gather(self._order, self.position, self.velocity, *self._sorted)
        move(self._order, self._cell, self._start, self._cells, self._numbers, *self._sorted, self.position, self.velocity)
