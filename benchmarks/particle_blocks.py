"""The particles of benchmarks/particles.py for Numba, blocked by hand the way ours are; imported only where that is installed.

Planar rows, blocks of 64 in one scratch array that stays in the first-level cache, primitives outside and particles inside, a polynomial
for the exponential, no branch in a loop: Numba's compiler vectorizes that. Cores take ranges of blocks; rows are compacted side by side.
"""

import math

import numpy as np
from numba import float32, int32, njit, prange, set_num_threads

from benchmarks.particle_numba import (
    HALF,
    LIFE,
    ONE,
    POSITION,
    SHORTEST,
    TINY,
    TURN,
    TWO,
    UNIT,
    VELOCITY,
    ZERO,
    signed,
    step_of,
    unit,
    words,
)
from benchmarks.particle_peers import DOUBLET, SOURCE, UNIFORM, VORTEX, Start

B = 64
X, Y, Z, VX, VY, VZ, U, V, W, AGE, END, H = (B * k for k in range(12))  # places in the scratch array
ROWS = 11  # x y z, vx vy vz, age at birth, lifetime, frame of birth, identity: low word, high word
BIRTH_AGE, LIFETIME, BIRTH_FRAME, ID = 6, 7, 8, 9
FAST = {"fastmath": True, "error_model": "numpy", "boundscheck": False}
LOG2_E, LN_2 = np.float32(1.0 / math.log(2.0)), np.float32(math.log(2.0))
SERIES = tuple(np.float32(1.0 / math.factorial(n)) for n in range(7))
S0, S1, S2, S3, S4, S5, S6 = SERIES
MEANS = tuple(np.float32((-1.0) ** n / math.factorial(n + 1)) for n in range(7))
M0, M1, M2, M3, M4, M5, M6 = MEANS


@njit(inline="always")
def exponential_parts(z):
    """Return e^{z - n ln 2} by Taylor's series, and n, for z <= 0."""
    y = max(z, float32(-80.0)) * LOG2_E
    n = math.floor(y + HALF)
    g = (y - n) * LN_2
    p = S0 + g * (S1 + g * (S2 + g * (S3 + g * (S4 + g * (S5 + g * S6)))))
    return p, n


@njit(**FAST)
def add_flow(kind, p, t):
    """Add one primitive's velocity to U, V, W of a block."""
    cx, cy, cz, ax, ay, az, sx, sy, sz, inverse = p[0], p[1], p[2], p[3], p[4], p[5], p[6], p[7], p[8], p[9]
    if kind == UNIFORM:
        for i in range(B):
            t[U + i] += sx
            t[V + i] += sy
            t[W + i] += sz
    elif kind == SOURCE:
        for i in range(B):
            dx, dy, dz = t[X + i] - cx, t[Y + i] - cy, t[Z + i] - cz
            along = dx * ax + dy * ay + dz * az
            dx, dy, dz = dx - ax * along, dy - ay * along, dz - az * along
            f = sx / (dx * dx + dy * dy + dz * dz + TINY)
            t[U + i] += dx * f
            t[V + i] += dy * f
            t[W + i] += dz * f
    elif kind == VORTEX:
        for i in range(B):
            dx, dy, dz = t[X + i] - cx, t[Y + i] - cy, t[Z + i] - cz
            along = dx * ax + dy * ay + dz * az
            dx, dy, dz = dx - ax * along, dy - ay * along, dz - az * along
            r2 = dx * dx + dy * dy + dz * dz + TINY
            e, n = exponential_parts(-r2 * inverse)
            f = (ONE - e * np.int32((int32(n) + int32(127)) << int32(23)).view(np.float32)) * sx / r2
            t[U + i] += (ay * dz - az * dy) * f
            t[V + i] += (az * dx - ax * dz) * f
            t[W + i] += (ax * dy - ay * dx) * f
    elif kind == DOUBLET:
        for i in range(B):
            dx, dy, dz = t[X + i] - cx, t[Y + i] - cy, t[Z + i] - cz
            along = dx * ax + dy * ay + dz * az
            dx, dy, dz = dx - ax * along, dy - ay * along, dz - az * along
            q = ONE / (dx * dx + dy * dy + dz * dz + TINY)
            f = TWO * (dx * sx + dy * sy + dz * sz) * q
            t[U + i] += (sx - dx * f) * q
            t[V + i] += (sy - dy * f) * q
            t[W + i] += (sz - dz * f) * q


@njit(**FAST)
def advance_block(b, count, frame, kinds, table, numbers, substeps, slab, whole, alive, t):
    """Advance the block that begins at b through a frame."""
    gx, gy, gz, k, dt, fps = numbers
    for row in range(6):
        for i in range(B):
            t[B * row + i] = slab[row, b + i]
    for i in range(B):
        t[AGE + i] = float32(frame - whole[BIRTH_FRAME, b + i]) / fps + slab[BIRTH_AGE, b + i]
        t[END + i] = slab[LIFETIME, b + i]
    for s in range(substeps):
        back = float32(substeps - 1 - s) * dt
        for i in range(B):
            t[H + i] = step_of(t[AGE + i] - back, t[END + i], dt)
            t[U + i] = ZERO
            t[V + i] = ZERO
            t[W + i] = ZERO
        for j in range(len(kinds)):
            add_flow(kinds[j], table[j], t)
        for i in range(B):
            h = t[H + i]
            z = k * h  # < ½ here, so that the series does
            felt = h * (M0 + z * (M1 + z * (M2 + z * (M3 + z * (M4 + z * (M5 + z * M6))))))
            vx = t[VX + i] + (gx + (t[U + i] - t[VX + i]) * k) * felt
            vy = t[VY + i] + (gy + (t[V + i] - t[VY + i]) * k) * felt
            vz = t[VZ + i] + (gz + (t[W + i] - t[VZ + i]) * k) * felt
            t[VX + i] = vx
            t[VY + i] = vy
            t[VZ + i] = vz
            t[X + i] += vx * h
            t[Y + i] += vy * h
            t[Z + i] += vz * h
    n = min(B, count - b)
    for row in range(6):
        for i in range(n):
            slab[row, b + i] = t[B * row + i]
    for i in range(n):
        alive[b + i] = t[AGE + i] < t[END + i]


@njit(parallel=True, **FAST)
def advance(count, frame, kinds, table, numbers, substeps, slab, whole, alive, parts):
    blocks = (count + B - 1) // B
    for part in prange(parts):
        t = np.empty(12 * B, np.float32)
        for block in range(blocks * part // parts, blocks * (part + 1) // parts):
            advance_block(B * block, count, frame, kinds, table, numbers, substeps, slab, whole, alive, t)


@njit(parallel=True, **FAST)
def remove(count, alive, whole, parts):
    """Close the gaps in order, each core some rows, and return how many are left."""
    start = 0
    while start < count and alive[start]:
        start += 1
    left = np.zeros(parts, np.int64)
    for part in prange(parts):
        n = start
        for row in range(ROWS * part // parts, ROWS * (part + 1) // parts):
            n = start
            for i in range(start, count):
                whole[row, n] = whole[row, i]
                n += alive[i]
        left[part] = n
    return left[0]


@njit(parallel=True, **FAST)
def give_birth(first, count, ordinal, frame, key, box, numbers, slab, whole):
    speed, speed_spread, cone, mean, spread, frame_time = numbers
    for j in prange(count):
        i, n = first + j, ordinal + j
        a, b, c, d = words(key[0], key[1], n, POSITION)
        slab[0, i] = box[0, 0] + box[1, 0] * signed(a)
        slab[1, i] = box[0, 1] + box[1, 1] * signed(b)
        slab[2, i] = box[0, 2] + box[1, 2] * signed(c)
        age = frame_time - frame_time / count * (float32(j) + float32((d >> 8) + 1) * UNIT)
        slab[BIRTH_AGE, i] = min(max(age, ZERO), frame_time)
        a, b, c, d = words(key[0], key[1], n, VELOCITY)
        cosine = ONE - unit(a) * (ONE - cone)
        rho = math.sqrt(max(ONE - cosine * cosine, ZERO))
        fast = speed + speed_spread * signed(c)
        slab[3, i] = rho * math.sin(TURN * unit(b)) * fast
        slab[4, i] = cosine * fast
        slab[5, i] = rho * math.cos(TURN * unit(b)) * fast
        a, b, c, d = words(key[0], key[1], n, LIFE)
        slab[LIFETIME, i] = max(mean + spread * signed(a), SHORTEST)
        whole[BIRTH_FRAME, i], whole[ID, i], whole[ID + 1, i] = frame, n & 0xFFFFFFFF, n >> 32


class BlockedDust:
    """A population in planar rows, advanced block by block by so many threads."""

    def __init__(self, start: Start, threads: int):
        assert start.drag / (start.fps * start.substeps) < 0.5, "the series of the drag"
        self.start, self._threads = start, threads
        n, capacity = len(start.id), -(-start.capacity // B) * B
        self.count, self.frame, self.ordinal = n, start.frame, int(start.id[-1]) + 1
        self._slab = np.zeros((ROWS, capacity), np.float32)
        self._whole, self._alive = self._slab.view(np.int32), np.zeros(capacity, np.bool_)
        self._slab[:3, :n], self._slab[3:6, :n] = start.position.T, start.velocity.T
        self._slab[BIRTH_AGE, :n], self._slab[LIFETIME, :n] = start.birth_age, start.lifetime
        self._whole[BIRTH_FRAME, :n] = start.birth_frame
        self._whole[ID, :n], self._whole[ID + 1, :n] = (start.id & 0xFFFFFFFF).astype(np.uint32).view(np.int32), start.id >> 32
        f = np.float32
        self._key = np.array(start.key, np.uint32)
        self._births = tuple(f(q) for q in (*start.speed, start.cone, *start.life, 1.0 / start.fps))
        self._numbers = tuple(f(q) for q in (*start.gravity, start.drag, 1.0 / (start.fps * start.substeps), start.fps))

    def step_frame(self) -> None:
        """Advance one frame: births, motion, deaths."""
        set_num_threads(self._threads)
        start, self.frame = self.start, self.frame + 1
        born = min(start.born, start.capacity - self.count)
        give_birth(self.count, born, self.ordinal, self.frame, self._key, start.box, self._births, self._slab, self._whole)
        self.count, self.ordinal = self.count + born, self.ordinal + born
        rest = start.substeps, self._slab, self._whole, self._alive, self._threads
        advance(self.count, self.frame, start.kinds, start.table, self._numbers, *rest)
        self.count = remove(self.count, self._alive, self._whole, self._threads)

    def state(self) -> tuple[np.ndarray, np.ndarray]:
        """Return the identities and places of who lives."""
        low, high = self._whole[ID : ID + 2, : self.count].view(np.uint32).astype(np.int64)
        return low + (high << 32), self._slab[:3, : self.count].T
