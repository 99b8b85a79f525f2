"""Sheets that meet themselves, for tests: in any state, through the stages of one substep."""

import numpy as np

from tests.simulation.networks import network
from tests.simulation.stages import carry_out
from warpsim import Simulation
from warpsim.systems.parts import SelfCollision

FLOOR = {"type": "plane", "center": [0, -0.62, 0], "friction": 0.5, "restitution": 0}
# Laid down in folds by a rail, or crumpled by one that drives it to and fro.
RAIL = [[0, [0, 0, 0]], [0.4, [0.2, -0.2, 0.2]], [0.8, [0, -0.5, 0.0]]]
WILD_RAIL = [[0, [0, 0, 0]], [0.3, [0.3, -0.1, 0.1]], [0.6, [-0.2, -0.35, -0.1]], [0.9, [0, -0.55, 0.2]]]
KINDS = {"structural": {"stiffness": 20, "damping": 0.01}, "shear": {"stiffness": 10, "damping": 0.005}, "bend": {"stiffness": 1}}


def sheet(nx: int, ny: int, side: float = 0.1, **keys) -> dict:
    """Keys of a sheet with square cells that meets itself, hanging from `top` unless pins say otherwise."""
    size = {"resolution": [nx, ny], "edges": [[side * (nx - 1), 0, 0], [0, -side * (ny - 1), 0]]}
    return {"type": "cloth", "density": 0.3, "self_collision": True, **size, **KINDS, **keys}


def folding(rail=RAIL, points: int = 25, **keys) -> dict:
    """Keys of a sheet of 0.6 m that is laid onto itself by its upper edge."""
    moved = {"pins": ["top"], "pin_motion": [{"keyframes": rail}], "thickness": 0.01}
    return sheet(points, points, side=0.6 / (points - 1), gravity=(0, -9.81, 0), more={"colliders": [FLOOR]}, **{**moved, **keys})


class Crumpled:
    """One substep of a sheet's self-collision from any state: x0 at its beginning, x and v when the solver has moved it."""

    def __init__(self, threads: int = 1, native: bool = True, **keys):
        self.sim = Simulation(network(**keys), device="cpu", threads=threads, native=native)
        self.sim.step_frame()  # in the first nothing moves
        self.system = self.sim.systems["s"]
        self.part = next(part for part in self.system.parts if isinstance(part, SelfCollision))
        self.count, self.h = self.system.point_count, self.system.pace.dt
        spec = self.system.spec
        self.cell = [np.array(edge, float) / (n - 1) for edge, n in zip(spec.edges, spec.resolution, strict=True)]
        self.places = np.stack(np.divmod(np.arange(self.count), spec.resolution[0])[::-1], axis=1)
        self.w = self.system.inverse_mass.numpy()[: self.count].astype(float)
        self.distance = spec.layers.distance
        self._threads, self._native = threads, native

    def put(self, x0: np.ndarray, x: np.ndarray, v: np.ndarray) -> None:
        """Put the sheet into a state."""
        for array, rows in (
            (self.system.start, (x0, np.zeros_like(x0))),
            (self.system.particles.position, (x,)),
            (self.system.particles.velocity, (v,)),
        ):
            values = array.numpy()
            values[:, : self.count] = np.concatenate([row.T for row in rows])
            array.assign(values)

    def play(self, *hooks) -> tuple[np.ndarray, np.ndarray]:
        """Run stages of the part's hooks, by name, and return places and velocities."""
        stages = [stage for hook in hooks for stage in getattr(self.part, hook)(0)]
        self.system.native = self._native
        carry_out(stages, cores=self._threads, native=self._native)
        return tuple(self.system.population.host(key).T.astype(float) for key in ("position", "velocity"))

    @property
    def touches(self) -> np.ndarray:
        """How many touch each point."""
        return self.part.layers.touches.numpy()[: self.count]


def crumple(points: np.ndarray, size: float, seed: int = 0) -> np.ndarray:
    """Places of points in a ball of a size: the sheet's own, folded together by smooth random waves."""
    rng = np.random.default_rng(seed)
    phase = points @ rng.normal(0, 14.0, (3, 3)) + rng.uniform(0, 6.28, 3)
    return (size * np.sin(phase)).astype(np.float32).astype(float)
