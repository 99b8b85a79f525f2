"""The particles of benchmarks/particles.py for Taichi on the CPU, as people write them; imported only where that is installed."""

import math

import numpy as np
import taichi as ti

from benchmarks.particle_peers import DOUBLET, SOURCE, UNIFORM, VORTEX, Start

POSITION, VELOCITY, LIFE = 0, 1, 2  # channels of the random numbers


def taichi_dust(start: Start, threads: int):
    """Make a population for Taichi."""
    ti.init(arch=ti.cpu, default_fp=ti.f32, default_ip=ti.i32, cpu_max_num_threads=threads, fast_math=True, log_level=ti.ERROR)
    return Dust(start)


@ti.func
def stir(q):
    q[0] += q[1] * q[3]
    q[1] += q[2] * q[0]
    q[2] += q[0] * q[1]
    q[3] += q[1] * q[2]
    return q


@ti.func
def words(k0, k1, ordinal, channel):
    """Return four random words: pcg4d."""
    f, g = ti.u32(1664525), ti.u32(1013904223)
    start = ti.Vector([ti.u32(k0), ti.u32(k1), ti.cast(ordinal, ti.u32), ti.u32(channel)], ti.u32) * f + g
    q = stir(start)
    return stir(q ^ (q >> ti.u32(16)))


@ti.func
def unit(word):
    return ti.cast(word >> ti.u32(8), ti.f32) * 2.0**-24


@ti.func
def signed(word):
    return ti.cast(word >> ti.u32(8), ti.f32) * 2.0**-23 - 1.0


@ti.func
def mean_decay(z):
    """Return (1 − e^{−z})/z; the series spares small z the cancellation."""
    return ti.select(z < 0.1, 1.0 - z * (0.5 - z * (1.0 / 6.0 - z * (1.0 / 24.0 - z / 120.0))), (1.0 - ti.exp(-z)) / ti.max(z, 0.1))


@ti.data_oriented
class Dust:
    """Two populations of fields; who lives on is counted with an atomic and copied from one to the other."""

    def __init__(self, start: Start):
        self.start, n, capacity = start, len(start.id), start.capacity
        self.count, self.frame, self.ordinal = n, start.frame, int(start.id[-1]) + 1
        self.now, self.then = (self._population(capacity) for _ in range(2))
        rest = np.zeros(capacity - n)
        self.now["x"].from_numpy(np.concatenate([start.position, np.zeros((capacity - n, 3))]).astype(np.float32))
        self.now["v"].from_numpy(np.concatenate([start.velocity, np.zeros((capacity - n, 3))]).astype(np.float32))
        for name, values in (("age", start.birth_age), ("life", start.lifetime), ("frame", start.birth_frame), ("id", start.id)):
            self.now[name].from_numpy(np.concatenate([values, rest]).astype(values.dtype))
        self.kinds, self.table, self.alive = ti.field(ti.i32, len(start.kinds)), ti.field(ti.f32, start.table.shape), ti.field(ti.i32, ())
        self.kinds.from_numpy(start.kinds)
        self.table.from_numpy(start.table)

    @staticmethod
    def _population(capacity: int) -> dict:
        fields = {name: ti.Vector.field(3, ti.f32, capacity) for name in ("x", "v")}
        return fields | {n: ti.field(t, capacity) for n, t in (("age", ti.f32), ("life", ti.f32), ("frame", ti.i32), ("id", ti.i64))}

    def step_frame(self) -> None:
        """Advance one frame: births, motion, deaths."""
        start, now, then = self.start, self.now, self.then
        self.frame += 1
        born = min(start.born, start.capacity - self.count)
        self.give_birth(self.count, born, self.ordinal, self.frame, now["x"], now["v"], now["age"], now["life"], now["frame"], now["id"])
        self.count, self.ordinal = self.count + born, self.ordinal + born
        self.advance(self.count, self.frame, now["x"], now["v"], now["age"], now["life"], now["frame"])
        self.alive[None] = 0
        self.remove(self.count, self.frame, *(fields[n] for n in ("x", "v", "age", "life", "frame", "id") for fields in (now, then)))
        self.count, self.now, self.then = self.alive[None], then, now
        ti.sync()

    def state(self) -> tuple[np.ndarray, np.ndarray]:
        """Return the identities and places of who lives."""
        return self.now["id"].to_numpy()[: self.count], self.now["x"].to_numpy()[: self.count]

    @ti.kernel
    def give_birth(
        self,
        first: int,
        count: int,
        ordinal: ti.i64,
        frame: int,
        x: ti.template(),
        v: ti.template(),
        age: ti.template(),
        life: ti.template(),
        birth: ti.template(),
        ids: ti.template(),
    ):
        k0, k1 = ti.static(self.start.key)
        for j in range(count):
            i, n = first + j, ordinal + j
            q = words(k0, k1, n, POSITION)
            for c in ti.static(range(3)):
                x[i][c] = float(self.start.box[0, c]) + float(self.start.box[1, c]) * signed(q[c])
            width = 1.0 / self.start.fps / count
            jitter = ti.cast((q[3] >> ti.u32(8)) + ti.u32(1), ti.f32) * 2.0**-24
            age[i] = ti.min(ti.max(1.0 / self.start.fps - width * (j + jitter), 0.0), 1.0 / self.start.fps)
            q = words(k0, k1, n, VELOCITY)
            cosine = 1.0 - unit(q[0]) * (1.0 - self.start.cone)
            rho, turn = ti.sqrt(ti.max(1.0 - cosine * cosine, 0.0)), 2.0 * math.pi * unit(q[1])
            speed = self.start.speed[0] + self.start.speed[1] * signed(q[2])
            v[i] = ti.Vector([rho * ti.sin(turn), cosine, rho * ti.cos(turn)]) * speed
            q = words(k0, k1, n, LIFE)
            life[i] = ti.max(self.start.life[0] + self.start.life[1] * signed(q[0]), 1e-6)
            birth[i], ids[i] = frame, n

    @ti.func
    def flow_at(self, x):
        u = ti.Vector([0.0, 0.0, 0.0])
        for k in range(self.kinds.shape[0]):
            strength = ti.Vector([self.table[k, 6], self.table[k, 7], self.table[k, 8]])
            if self.kinds[k] == UNIFORM:
                u += strength
            else:
                axis = ti.Vector([self.table[k, 3], self.table[k, 4], self.table[k, 5]])
                d = x - ti.Vector([self.table[k, 0], self.table[k, 1], self.table[k, 2]])
                d -= axis * d.dot(axis)
                r2 = d.dot(d) + 1e-12
                if self.kinds[k] == SOURCE:
                    u += d * (strength[0] / r2)
                elif self.kinds[k] == VORTEX:
                    u += axis.cross(d) * ((1.0 - ti.exp(-r2 * self.table[k, 9])) * strength[0] / r2)
                elif self.kinds[k] == DOUBLET:
                    u += (strength - d * (2.0 * d.dot(strength) / r2)) / r2
        return u

    @ti.kernel
    def advance(
        self, count: int, frame: int, x: ti.template(), v: ti.template(), age: ti.template(), life: ti.template(), birth: ti.template()
    ):
        dt, k = ti.static(1.0 / (self.start.fps * self.start.substeps), self.start.drag)
        gravity = ti.Vector([float(g) for g in self.start.gravity])
        for i in range(count):
            old, end = (frame - birth[i]) / self.start.fps + age[i], life[i]
            p, w = x[i], v[i]
            for s in range(self.start.substeps):
                now = old - (self.start.substeps - 1 - s) * dt
                h = ti.min(ti.max(ti.min(now, end - now + dt, end), 0.0), dt)
                w += (gravity + (self.flow_at(p) - w) * k) * (h * mean_decay(k * h))
                p += w * h
            x[i], v[i] = p, w

    @ti.kernel
    def remove(
        self,
        count: int,
        frame: int,
        x: ti.template(),
        x_out: ti.template(),
        v: ti.template(),
        v_out: ti.template(),
        age: ti.template(),
        age_out: ti.template(),
        life: ti.template(),
        life_out: ti.template(),
        birth: ti.template(),
        birth_out: ti.template(),
        ids: ti.template(),
        ids_out: ti.template(),
    ):
        for i in range(count):
            if (frame - birth[i]) / self.start.fps + age[i] < life[i]:
                n = ti.atomic_add(self.alive[None], 1)
                x_out[n], v_out[n], age_out[n], life_out[n], birth_out[n], ids_out[n] = x[i], v[i], age[i], life[i], birth[i], ids[i]
