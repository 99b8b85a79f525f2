"""The particles of benchmarks/particles.py as their peers begin with them: the same places, the same numbers, the same births to come.

Those for Numba and Taichi are beside, in modules that need them. All work out the same frame: births from pcg4d, so that the n-th of all is
born alike everywhere; four substeps of gravity, drag towards the flow and the flow of a table of primitives; deaths, the others in order.
"""

from dataclasses import dataclass

import numpy as np

from warpsim import Simulation
from warpsim.frame import Frame
from warpsim.kernels.flow import FLOWS
from warpsim.kernels.primitive import INVERSE_TWO_PI, LAMB_OSEEN

UNIFORM, SOURCE, VORTEX, DOUBLET = (list(FLOWS).index(kind) for kind in ("uniform", "source", "vortex", "doublet"))
SYSTEM = "dust"


@dataclass(frozen=True)
class Start:
    """Where ours are, and what all of them do: what a peer is made from."""

    position: np.ndarray  # float32 (n, 3) [m]
    velocity: np.ndarray  # float32 (n, 3) [m/s]
    birth_frame: np.ndarray  # int32 (n,)
    birth_age: np.ndarray  # float32 (n,) [s]
    lifetime: np.ndarray  # float32 (n,) [s]
    id: np.ndarray  # int64 (n,), rising
    kinds: np.ndarray  # int32 (primitives,), places in FLOWS
    table: np.ndarray  # float32 (primitives, 10): center, axis, strength as a vector, 1/R² of the core
    gravity: np.ndarray  # float32 (3,) [m/s²]
    drag: float  # k [1/s]
    fps: float
    substeps: int
    born: int  # in a frame
    key: tuple[int, int]  # of the random numbers of births
    box: np.ndarray  # float32 (2, 3): center and half edges [m]
    speed: tuple[float, float]  # mean and spread [m/s]
    cone: float  # cosine
    life: tuple[float, float]  # mean and spread [s]
    frame: int
    capacity: int


def start_of(run: Simulation) -> Start:
    """Return what a peer begins with, from a run of ours in its steady state."""
    system = run.systems[SYSTEM]
    population, emitter = system.population, system.emission.births.emitters.numpy()[0]
    environment = system.surroundings.row.numpy()[0]
    rows = system.surroundings.flow.numpy()[0]
    table = np.zeros((len(rows), 10), np.float32)
    for row, place in zip(rows, table, strict=True):
        place[:3], place[3:6], place[6:9] = row["center"], row["axis"], row["strength"]
        if row["kind"] in (SOURCE, VORTEX):
            place[6:9] = row["strength"][0] * float(INVERSE_TWO_PI)
        place[9] = 1.0 / row["core_radius"] ** 2
        assert row["kind"] != VORTEX or row["core"] == LAMB_OSEEN
    fields = {name: population.host(name) for name in ("birth_frame", "birth_age", "lifetime")}
    low, high = population.host("id").astype(np.int64)
    mass = float(emitter["mass"]["mean"])
    segment = system.emission.plan.segments.numpy()[0]
    assert emitter["direction"].tolist() == [0.0, 1.0, 0.0]
    return Start(
        position=np.ascontiguousarray(population.host("position").T),
        velocity=np.ascontiguousarray(population.host("velocity").T),
        **fields,
        id=low + (high << 32),
        kinds=rows["kind"].astype(np.int32),
        table=table,
        gravity=environment["gravity"].astype(np.float32),
        drag=float(environment["alpha"]) / mass,
        fps=system.pace.fps,
        substeps=system.pace.substep_count,
        born=int(segment["end"] - segment["begin"]),
        key=tuple(int(word) for word in emitter["key"]),
        box=np.array([emitter["center"], emitter["half"]], np.float32),
        speed=(float(emitter["speed"]["mean"]), float(emitter["speed"]["spread"])),
        cone=float(emitter["cone_cosine"]),
        life=(float(emitter["lifetime"]["mean"]), float(emitter["lifetime"]["spread"])),
        frame=run.index,
        capacity=population.limit,
    )


def distance(frame: Frame, peer) -> float:
    """Return how far the peer's particles are from ours, in the mean [m]; infinitely, if they are not the same ones."""
    ours = frame[SYSTEM]
    ids, position = peer.state()
    order = np.argsort(ids)
    if not np.array_equal(np.asarray(ours.id, np.int64), ids[order]):
        return float("inf")
    return float(np.linalg.norm(position[order].astype(float) - ours.position, axis=1).mean())
