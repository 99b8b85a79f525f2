"""Water: what a fluid does to the surface of a network of springs, facet by facet."""

from collections.abc import Iterator

import numpy as np
import warp as wp

from warpsim.environment import Environment, Surroundings
from warpsim.kernels import facets
from warpsim.launch import Stage
from warpsim.networks import SLICE, looseness, packed_facets
from warpsim.scene.particles import Drag


class Water:
    """The fluid round one `springs` network with a surface; it feels the whole flow, whatever drags at its points."""

    def __init__(self, system, environment: Environment):
        self._system, device, count, net = system, environment.device, system.pace.substep_count, system.net
        self._flow = Surroundings(environment, self._felt(environment), 2 * count + 1, 0.5 * system.pace.dt)
        self._surface = facets.Surface()
        self._surface.corner = wp.array(net.facets, dtype=wp.vec4i, device=device)
        begin, facet = packed_facets(len(net.points), net.facets)
        self._surface.begin, self._surface.facet = (wp.array(array.reshape(-1), dtype=int, device=device) for array in (begin, facet))
        self._surface.flow = self._flow.flow
        self._surface.looseness = wp.array(self._looseness(), dtype=float, device=device)
        self._surface.resistance = wp.array([system.spec.water], dtype=float, device=device)
        self._share = wp.zeros((3, len(net.facets)), dtype=float, device=device)

    @classmethod
    def wanted(cls, spec) -> bool:
        """Return whether a network lies in a fluid; this may not change while it runs."""
        return spec.water is not None

    def stages(self) -> Iterator[Stage]:
        """Yield the stages that fill the table of the flow for the frame under way."""
        yield from self._flow.stages()

    def forces(self, moment: int) -> Iterator[Stage]:
        """Yield the stages that add what the fluid does [m/s²] to the system's `internal`."""
        system, surface = self._system, self._surface
        h = system.pace.dt if system.solver.takes_air else 0.0  # without a scale it is the force itself
        inputs = (moment, h, surface, system.particles, self._share)
        yield Stage("water", facets.sample_facets, len(surface.corner), inputs)
        inputs = (len(system.net.points), surface, self._share, system.inverse_mass, system.internal)
        yield Stage("water", facets.accumulate_facets, len(surface.begin) * SLICE - SLICE, inputs)

    def change(self, environment: Environment) -> None:
        """Take the numbers of the system's spec and the environment's, in place."""
        self._flow.change(*self._felt(environment))
        self._surface.looseness.assign(self._looseness())
        self._surface.resistance.assign([self._system.spec.water])

    def _felt(self, environment: Environment) -> tuple:
        row, flow, _, _ = environment.felt(self._system.spec.feels, Drag(alpha=0.0))
        return row, flow, [], []

    def _looseness(self) -> np.ndarray:
        """Return Σ d/(m N²) over the corners of each facet, float32 (q,) [1/kg]."""
        return looseness(self._system.net, self._system.inverse_mass.numpy()[: len(self._system.net.points)]).astype(np.float32)
