"""The boids of benchmarks/flocks.py for Taichi; imported only where that is installed."""

import numpy as np
import taichi as ti

from benchmarks.flock_peers import CLOSEST, Law


def taichi_flock(x: np.ndarray, v: np.ndarray, law: Law, cores: int):
    """Make a flock for Taichi on the CPU."""
    ti.init(arch=ti.cpu, default_fp=ti.f32, cpu_max_num_threads=cores, log_level=ti.ERROR)
    return Flock(x, v, law)


@ti.data_oriented
class Flock:
    """Counted by cell with atomics, filled, and each boid scans nine rows of three cells."""

    def __init__(self, x: np.ndarray, v: np.ndarray, law: Law):
        self.law, self.n, self.count = law, law.cells, len(x)
        self.x, self.v, self.y, self.w = (ti.Vector.field(3, ti.f32, len(x)) for _ in range(4))
        self.cell, self.order = ti.field(ti.i32, len(x)), ti.field(ti.i32, len(x))
        self.start, self.place = ti.field(ti.i32, self.n**3 + 1), ti.field(ti.i32, self.n**3)
        self.x.from_numpy(x)
        self.v.from_numpy(v)

    def step_frame(self) -> None:
        """Advance one frame."""
        self.mark()
        self.scan()
        self.fill()
        self.move()
        ti.sync()

    @property
    def position(self) -> np.ndarray:
        """Where its boids are, (n, 3) [m]."""
        return self.x.to_numpy()

    @ti.kernel
    def mark(self):
        for c in self.place:
            self.place[c] = 0
        for i in self.x:
            at = ti.min(ti.cast(self.x[i] * (self.n / self.law.edge), ti.i32), self.n - 1)
            self.cell[i] = (at[2] * self.n + at[1]) * self.n + at[0]
            ti.atomic_add(self.place[self.cell[i]], 1)

    @ti.kernel
    def scan(self):
        total = 0
        ti.loop_config(serialize=True)
        for c in range(self.n**3):
            self.start[c] = total
            total += self.place[c]
            self.place[c] = self.start[c]
        self.start[self.n**3] = total

    @ti.kernel
    def fill(self):
        for i in self.x:
            k = ti.atomic_add(self.place[self.cell[i]], 1)
            self.order[k] = i
            self.y[k] = self.x[i]
            self.w[k] = self.v[i]

    @ti.kernel
    def move(self):
        n, radius = ti.static(self.n, self.law.radius)
        for k in range(self.count):
            i = self.order[k]
            at = self.cell[i]
            cx, cy, cz = at % n, at // n % n, at // (n * n)
            xi, vi = self.y[k], self.w[k]
            limit = self.law.cosine * vi.norm()
            apart, way, course = ti.Vector([0.0, 0.0, 0.0]), ti.Vector([0.0, 0.0, 0.0]), ti.Vector([0.0, 0.0, 0.0])
            count = 0.0
            for rz in range(ti.max(cz - 1, 0), ti.min(cz + 2, n)):
                for ry in range(ti.max(cy - 1, 0), ti.min(cy + 2, n)):
                    row = (rz * n + ry) * n
                    for j in range(self.start[row + ti.max(cx - 1, 0)], self.start[row + ti.min(cx + 2, n)]):
                        d = self.y[j] - xi
                        d2 = d.dot(d)
                        if d2 < radius * radius and j != k and d.dot(vi) >= limit * ti.sqrt(d2):
                            apart -= d / ti.max(d2, (CLOSEST * radius) ** 2)
                            way += d
                            course += self.w[j]
                            count += 1.0
            f = apart
            if count > 0.0:
                f += way / count + course / count - vi
            if f.norm() > self.law.strongest:
                f *= self.law.strongest / f.norm()
            w = vi + f * self.law.h
            w *= ti.min(ti.max(w.norm(), self.law.slowest), self.law.fastest) / ti.max(w.norm(), 1e-9)
            p = xi + w * self.law.h
            for c in ti.static(range(3)):
                if p[c] < 0.0:
                    p[c], w[c] = -p[c], ti.abs(w[c])
                elif p[c] > self.law.edge:
                    p[c], w[c] = self.law.edge - (p[c] - self.law.edge), -ti.abs(w[c])
            self.x[i] = p
            self.v[i] = w
