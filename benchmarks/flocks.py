"""Flocks: the whole step with one core and all, in turns with Numba, Taichi and Warp's own hash grid doing the same to the same boids."""

import math
from functools import partial

import numpy as np

from benchmarks.contest import Claim, Contest, Entrant
from benchmarks.flock_peers import HashGridFlock, Law
from benchmarks.measure import Stepped
from warpsim import Scene, Simulation
from warpsim.frame import Frame
from warpsim.launch import available_cores

FPS = 60
SPEED = (0.5, 2.0)  # [m/s]
STRONGEST = 20.0  # [N]
MOST_APART = 1e-6  # [m], in the mean
ROUNDING = 2.0**-23  # of the box's edge: what places are rounded to in a frame
WHY = "a neighbor at the very edge of view is seen by one and not by the other, and moves a boid 1e-5 m; places are rounded in every frame"


def rows(quick: bool) -> list[Contest]:
    """The rows of flocks."""
    counts = {"flocks-10k": 4_000, "flocks-100k": 2_000, "flocks-1m": 3_000} if quick else {"flocks-10k": 10_000, "flocks-100k": 100_000}
    counts |= {} if quick else {"flocks-1m": 1_000_000}
    bars = {"flocks-10k": {}, "flocks-100k": {"peers": 3.5, "steps_per_second": 60.0}, "flocks-1m": {"peers": 3.5}}
    return [boids(name, count, **bars[name]) for name, count in counts.items()]


def boids(name: str, count: int, peers: float | None = None, steps_per_second: float | None = None) -> Contest:
    """A flock of so many boids; `peers`: how many times as long as we the fastest of them is to take; None: there are none."""
    scene, cores = flock(count, 24.0, 1.0, 240.0), available_cores()
    numba = [Entrant("Numba prange", threads, partial(numba_flock, threads=threads), "numba") for threads in sorted({1, cores})]
    others = [Entrant("Taichi", cores, partial(taichi_flock, threads=cores), "taichi")]
    others.append(Entrant("wp.HashGrid, plain kernel", 1, partial(begin, HashGridFlock)))
    return Contest(
        name=name,
        work=f"{count:,} boids, 24 others within 1 m, field of view 240 degrees: the whole step, sort and motion included",
        scene=scene,
        items=count,
        item="boid",
        entrants=[*numba, *others] if peers else [],
        compare=apart,
        most=MOST_APART + ROUNDING * law_of(scene).edge,
        why=WHY,
        claims=[Claim(("Numba prange", "Taichi"), peers), Claim(("wp.HashGrid, plain kernel",), None)] if peers else [],
        steps_per_second=steps_per_second,
    )


def flock(count: int, neighbors: float, radius: float, view: float) -> Scene:
    """A box of boids, each with so many others within its radius [m], of which it sees those in its field of view [degrees]."""
    edge = radius * (count * 4.0 / 3.0 * math.pi / neighbors) ** (1.0 / 3.0)
    domain = {"min": [0, 0, 0], "max": [edge] * 3, "boundary": "contain"}
    system = {"type": "flock", "count": count, "domain": domain, "perception": {"radius": radius, "field_of_view": view}}
    system |= {"speed": list(SPEED), "max_force": STRONGEST}
    return Scene.model_validate({"name": "flock", "time": {"fps": FPS, "substeps": 1}, "systems": {"flock": system}})


def law_of(scene: Scene) -> Law:
    """Return what the peers are to do."""
    spec = scene.systems["flock"]
    cosine = math.cos(math.radians(0.5 * spec.perception.field_of_view))
    return Law(spec.perception.radius, cosine, STRONGEST, *SPEED, spec.domain.max[0], 1.0 / FPS)


def begin(make, run: Simulation, **more) -> Stepped:
    """Make a peer with the boids of a run as they are."""
    frame = run.frame()["flock"]
    return make(np.array(frame.position), np.array(frame.velocity), law_of(run.scene), **more)


def numba_flock(run: Simulation, threads: int) -> Stepped:
    """The peer in Numba."""
    from benchmarks.flock_numba import Flock

    return begin(Flock, run, threads=threads)


def taichi_flock(run: Simulation, threads: int) -> Stepped:
    """The peer in Taichi."""
    from benchmarks.flock_taichi import taichi_flock as make

    return begin(make, run, cores=threads)


def apart(frame: Frame, peer: Stepped) -> float:
    """Return how far a peer's boids are from ours, in the mean [m]."""
    return float(np.linalg.norm(peer.position - frame["flock"].position, axis=1).mean())
