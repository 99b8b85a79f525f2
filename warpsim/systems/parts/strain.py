"""Strain limit: no spring is longer than a share beyond its rest length once a substep has moved the points."""

from collections.abc import Iterator
from typing import final

import numpy as np
import warp as wp

from warpsim.coloring import greedy, runs
from warpsim.kernels import strain, strain_loops
from warpsim.launch import Stage
from warpsim.networks import spring_numbers
from warpsim.scene import SceneError
from warpsim.scene.problems import Problem
from warpsim.systems.parts.base import Part

MOST_SWEEPS = 200  # in a substep; what is too long then stays so until the next, and is counted
WORTH_A_LAUNCH = {True: 4096, False: 16}  # springs of a color, natively or not; a run of smaller colors is left to one core or thread


@final
class StrainLimit(Part):
    """Shortens springs that are stretched too far, after every substep and before contacts."""

    constrains = True

    @classmethod
    def wanted(cls, spec) -> bool:
        """Return whether the spec limits the strain of its springs."""
        return spec.strain_limit is not None

    def __init__(self, system):
        super().__init__(system)
        device, limited = system.device, self._limited()
        self._check(limited)
        coloring = greedy(system.net.springs[limited])
        self._sizes = np.diff(coloring.begin).tolist()
        self._limit = strain.StrainLimit()
        self._limit.h, self._limit.opening, self._limit.most = system.pace.dt, system.opening, MOST_SWEEPS
        self._limit.begin = wp.array(coloring.begin, dtype=int, device=device)
        self._limit.order = wp.array(limited[coloring.order].astype(np.int32), dtype=int, device=device)
        self._limit.inverse_mass = system.inverse_mass
        self._limit.strain = wp.array([system.spec.strain_limit], dtype=float, device=device)
        self._limit.aim, self._limit.kept = wp.zeros(1, dtype=float, device=device), wp.zeros(1, dtype=float, device=device)
        self._limit.multiplier = wp.zeros(len(coloring.order), dtype=float, device=device)
        for name in ("over", "going", "turn"):
            setattr(self._limit, name, wp.zeros(1, dtype=int, device=device))

    def _limited(self) -> np.ndarray:
        """Return the springs that it holds, int64 (q,): not those between two pins, nor of cloth those to the next but one.

        These are short enough where the two springs beside them are.
        """
        system, spec = self.system, self.system.spec
        held = np.zeros(system.point_count, bool)
        held[spec.pinned(spec.pins)] = True
        count = spec.generator.spring_count if spec.type == "cloth" else len(system.net.springs)
        return np.flatnonzero(~held[system.net.springs[:count]].all(axis=1))

    def _check(self, limited: np.ndarray) -> None:
        """Raise SceneError where a spring is too long from the beginning: to shorten it at once would be a blow."""
        system, rest = self.system, spring_numbers(self.system.spec, self.system.net)[2][limited]
        ends = system.net.points[system.net.springs[limited]]
        strain = np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1) / np.where(rest > 0.0, rest, np.inf) - 1.0
        worst = int(strain.argmax()) if len(limited) else -1
        if worst >= 0 and strain[worst] > system.spec.strain_limit * (1.0 + 1e-6):
            words = f"spring {limited[worst]} begins with a strain of {strain[worst]:.3g}: give it a longer rest_length, or a higher limit"
            raise SceneError([Problem(words, path=f"systems.{system.name}.strain_limit")])

    def constrain(self, s: int) -> Iterator[Stage]:
        """Yield the stages that put the pins where they belong, and shorten what hangs between."""
        system, limit = self.system, self._limit
        if not self._sizes:
            return
        yield from system.hold(s)
        yield Stage("strain", strain.open_sweeps, 1, (system.clock, limit))
        yield from self._sweep(1)
        inputs, count = (limit, system.table, system.particles), max(2, sum(self._sizes))
        look = Stage("strain", strain.mark_overlong, count, inputs, strain_loops.mark_overlong)
        body = (*self._sweep(0), look, Stage("strain", strain.choose_sweep, 1, (limit,)))
        yield Stage("strain", body=body, condition=limit.going, most=MOST_SWEEPS)

    def _sweep(self, begins: int) -> Iterator[Stage]:
        """Yield the stages of one sweep, or with 1 of what begins a substep."""
        system, worth = self.system, WORTH_A_LAUNCH[self.system.native]
        shared = (begins, self._limit, system.table, system.particles)
        for color, end in runs(self._sizes, worth):
            if end - color > 1 or self._sizes[color] < worth:
                loops = strain_loops if system.native else strain
                yield Stage("strain", loops.project_colors, 1, (color, end, *shared))
            else:
                yield Stage("strain", strain.project_springs, self._sizes[color], (color, *shared), strain_loops.project_springs)

    def change(self) -> None:
        """Take the numbers of the spec."""
        self._limit.strain.assign([self.system.spec.strain_limit])

    @property
    def state(self) -> dict[str, wp.array]:
        """What pulled at each spring in the last substep, and after how many sweeps."""
        return {"limit_pull": self._limit.multiplier, "limit_turn": self._limit.turn}

    def statistics(self) -> dict[str, float]:
        """Return how many springs are longer than they may be at the present frame: sweeps ran out, or contacts came after."""
        system = self.system
        ends = system.population.host("position").T.astype(float)[system.net.springs[self._limit.order.numpy()]]
        rest = system.table.rest.numpy()[self._limit.order.numpy()].astype(float)
        length = np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1)
        return {"overlong": int(((rest > 0.0) & (length > (1.0 + system.spec.strain_limit) * rest * (1.0 + 1e-6))).sum())}
