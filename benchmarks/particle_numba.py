"""The particles of benchmarks/particles.py for Numba as people write them: prange over particles; imported only where it is installed."""

import math

import numpy as np
from numba import float32, njit, prange, set_num_threads, uint32

from benchmarks.particle_peers import DOUBLET, SOURCE, UNIFORM, VORTEX, Start

ZERO, HALF, ONE, TWO = (np.float32(x) for x in (0.0, 0.5, 1.0, 2.0))
TINY, TURN = np.float32(1e-12), np.float32(2.0 * math.pi)
SHORTEST = np.float32(1e-6)  # [s]
POSITION, VELOCITY, LIFE = 0, 1, 2  # channels of the random numbers
UNIT, SIGNED = np.float32(2.0**-24), np.float32(2.0**-23)


@njit(inline="always")
def stir(a, b, c, d):
    a = uint32(a + b * d)
    b = uint32(b + c * a)
    c = uint32(c + a * b)
    return a, b, c, uint32(d + b * c)


@njit
def words(k0, k1, ordinal, channel):
    """Return four random words: pcg4d."""
    f, g = uint32(1664525), uint32(1013904223)
    a, b, c = uint32(k0 * f + g), uint32(k1 * f + g), uint32(uint32(ordinal) * f + g)
    a, b, c, d = stir(a, b, c, uint32(uint32(channel) * f + g))
    return stir(uint32(a ^ (a >> 16)), uint32(b ^ (b >> 16)), uint32(c ^ (c >> 16)), uint32(d ^ (d >> 16)))


@njit
def signed(word):
    return float32(word >> 8) * SIGNED - ONE


@njit
def unit(word):
    return float32(word >> 8) * UNIT


@njit(parallel=True)
def give_birth(first, count, ordinal, frame, key, box, numbers, x, v, birth_frame, birth_age, life, ids):
    speed, speed_spread, cone, mean, spread, frame_time = numbers
    for j in prange(count):
        i, n = first + j, ordinal + j
        a, b, c, d = words(key[0], key[1], n, POSITION)
        x[i, 0], x[i, 1], x[i, 2] = box[0, 0] + box[1, 0] * signed(a), box[0, 1] + box[1, 1] * signed(b), box[0, 2] + box[1, 2] * signed(c)
        age = frame_time - frame_time / count * (float32(j) + float32((d >> 8) + 1) * UNIT)
        birth_age[i] = min(max(age, ZERO), frame_time)
        a, b, c, d = words(key[0], key[1], n, VELOCITY)
        cosine = ONE - unit(a) * (ONE - cone)
        rho = math.sqrt(max(ONE - cosine * cosine, ZERO))
        fast = speed + speed_spread * signed(c)
        v[i, 0] = rho * math.sin(TURN * unit(b)) * fast
        v[i, 1] = cosine * fast
        v[i, 2] = rho * math.cos(TURN * unit(b)) * fast
        a, b, c, d = words(key[0], key[1], n, LIFE)
        life[i] = max(mean + spread * signed(a), SHORTEST)
        birth_frame[i], ids[i] = frame, n


@njit(error_model="numpy", fastmath=True)
def flow_at(kinds, p, x, y, z):
    """Return the sum of the primitives at a point [m/s]."""
    u = v = w = ZERO
    for k in range(len(kinds)):
        if kinds[k] == UNIFORM:
            u, v, w = u + p[k, 6], v + p[k, 7], w + p[k, 8]
            continue
        dx, dy, dz = x - p[k, 0], y - p[k, 1], z - p[k, 2]
        along = dx * p[k, 3] + dy * p[k, 4] + dz * p[k, 5]
        dx, dy, dz = dx - p[k, 3] * along, dy - p[k, 4] * along, dz - p[k, 5] * along
        q = ONE / (dx * dx + dy * dy + dz * dz + TINY)
        if kinds[k] == SOURCE:
            f = p[k, 6] * q
            u, v, w = u + dx * f, v + dy * f, w + dz * f
        elif kinds[k] == VORTEX:
            f = (ONE - math.exp(-p[k, 9] / q)) * p[k, 6] * q
            u += (p[k, 4] * dz - p[k, 5] * dy) * f
            v += (p[k, 5] * dx - p[k, 3] * dz) * f
            w += (p[k, 3] * dy - p[k, 4] * dx) * f
        elif kinds[k] == DOUBLET:
            f = TWO * (dx * p[k, 6] + dy * p[k, 7] + dz * p[k, 8]) * q
            u, v, w = u + (p[k, 6] - dx * f) * q, v + (p[k, 7] - dy * f) * q, w + (p[k, 8] - dz * f) * q
    return u, v, w


@njit
def step_of(age, life, dt):
    """Return the part of a substep in which a particle lives [s]; age is that at its end."""
    return min(max(min(min(age, life - age + dt), life), ZERO), dt)


@njit(parallel=True, error_model="numpy", fastmath=True)
def advance(count, frame, kinds, table, numbers, substeps, x, v, birth_frame, birth_age, life, alive):
    gx, gy, gz, k, dt, fps = numbers
    whole = -math.expm1(-k * dt) / k
    for i in prange(count):
        age, lifetime = float32(frame - birth_frame[i]) / fps + birth_age[i], life[i]
        px, py, pz, vx, vy, vz = x[i, 0], x[i, 1], x[i, 2], v[i, 0], v[i, 1], v[i, 2]
        for s in range(substeps):
            h = step_of(age - float32(substeps - 1 - s) * dt, lifetime, dt)
            u, w, q = flow_at(kinds, table, px, py, pz)
            felt = whole if h == dt else -math.expm1(-k * h) / k
            vx, vy, vz = vx + (gx + (u - vx) * k) * felt, vy + (gy + (w - vy) * k) * felt, vz + (gz + (q - vz) * k) * felt
            px, py, pz = px + vx * h, py + vy * h, pz + vz * h
        x[i, 0], x[i, 1], x[i, 2], v[i, 0], v[i, 1], v[i, 2] = px, py, pz, vx, vy, vz
        alive[i] = age < lifetime


@njit
def remove(count, alive, x, v, birth_frame, birth_age, life, ids):
    """Close the gaps in order and return how many are left."""
    n = 0
    for i in range(count):
        if alive[i]:
            if n < i:
                for c in range(3):
                    x[n, c], v[n, c] = x[i, c], v[i, c]
                birth_frame[n], birth_age[n], life[n], ids[n] = birth_frame[i], birth_age[i], life[i], ids[i]
            n += 1
    return n


class Dust:
    """A population in arrays of points, advanced by so many threads."""

    def __init__(self, start: Start, threads: int):
        self.start, self._threads = start, threads
        n, capacity = len(start.id), start.capacity
        self.count, self.frame, self.ordinal = n, start.frame, int(start.id[-1]) + 1
        self._x, self._v = np.zeros((capacity, 3), np.float32), np.zeros((capacity, 3), np.float32)
        self._birth_frame, self._ids = np.zeros(capacity, np.int32), np.zeros(capacity, np.int64)
        self._birth_age, self._life = np.zeros(capacity, np.float32), np.zeros(capacity, np.float32)
        self._alive = np.zeros(capacity, np.bool_)
        self._x[:n], self._v[:n], self._birth_frame[:n], self._ids[:n] = start.position, start.velocity, start.birth_frame, start.id
        self._birth_age[:n], self._life[:n] = start.birth_age, start.lifetime
        f = np.float32
        self._key = np.array(start.key, np.uint32)
        self._births = tuple(f(q) for q in (*start.speed, start.cone, *start.life, 1.0 / start.fps))
        self._numbers = tuple(f(q) for q in (*start.gravity, start.drag, 1.0 / (start.fps * start.substeps), start.fps))

    def step_frame(self) -> None:
        """Advance one frame: births, motion, deaths."""
        set_num_threads(self._threads)
        start, self.frame = self.start, self.frame + 1
        born = min(start.born, start.capacity - self.count)
        fields = (self._x, self._v, self._birth_frame, self._birth_age, self._life)
        give_birth(self.count, born, self.ordinal, self.frame, self._key, start.box, self._births, *fields, self._ids)
        self.count, self.ordinal = self.count + born, self.ordinal + born
        advance(self.count, self.frame, start.kinds, start.table, self._numbers, start.substeps, *fields, self._alive)
        self.count = remove(self.count, self._alive, *fields, self._ids)

    def state(self) -> tuple[np.ndarray, np.ndarray]:
        """Return the identities and places of who lives."""
        return self._ids[: self.count], self._x[: self.count]
